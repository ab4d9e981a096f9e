/* worker.js: a colony of the lab as a session of the live page. It answers the page's messages as
 * taichi_ants/live/server.py does, with the same frames; of the edits, it knows those of EDITS. */

import HEADERS from "./headers.json" with { type: "json" };
import { CAPACITY, Engine, LEARNERS } from "../page/engine.js";
import { decode, linkOf, partsOf } from "../page/link.js";
import { SCENE } from "../page/worlds.js";

const FRAMES_A_SECOND = 30, FASTEST = 1000; // as in server.py
const MOST_IN_FLIGHT = 12, STATE_MS = 500;
const BUSY_MS = 25, TICKS_AT_ONCE = 8;      // of a frame at the fastest speed
const MOST_TICKS = 200_000, MOST_LOOKED_BACK = 2_000_000; // of a visit; these times its ants
const LEARNER_LABELS = ["Q-learning", "SARSA"];

/** The changes of a visit that an edit is, see engine.js; `value` are its settings. */
const EDITS = {
  place: (engine, { what, cells }) => drawn({ rock: "rock", food: "food" }[what], cells),
  clear: (engine, { cells }) => drawn("erase", cells),
  trail: ({ scene }, { level, cells }) => drawn({ 0: "erase", [scene.level]: "trail" }[level], cells),
  ants: (engine, value) => [{ do: "ants", value }],
  epsilon: (engine, value) => [{ do: "epsilon", value }],
  learning_rate: ({ scene }, value) => [{ do: "rate", value }, ...(scene.learns ? [] : [{ do: "learns", value: 1 }])],
};

function drawn(what, path) {
  if (!what) throw new Error("only rock, food and trails like those of new deposits can be drawn here.");
  return [{ do: what, reach: 0, path }];
}

export class LiveColony {
  playing = false;
  speed = 12;       // ticks/s
  owed = 0;         // ticks that are due
  sessions = 0;
  inFlight = 0;     // frames that the page has not drawn yet
  behind = false;   // whether the next frame must be a whole one

  /**
   * @param {WebAssembly.Module} module colony.wasm
   * @param {string} link the visit to show, "" for the first screen
   * @param {(message: string | ArrayBuffer) => void} post
   */
  constructor(module, link, post) {
    this.module = module;
    this.post = post;
    let visit = { scene: SCENE, events: [], tick: 0 }, damage = "";
    try {
      const parts = partsOf(link);
      if (link) visit = { ...decode(parts.code), tick: parts.tick };
    } catch {
      damage = "this link is damaged; here is the first screen of the lab.";
    }
    const { scene, events, tick } = visit, end = Math.min(tick ?? 0, MOST_TICKS);
    this.scene = scene;
    this.start(events, Math.max(0, end - Math.floor(MOST_LOOKED_BACK / scene.ants)));
    this.sendBegin();
    while (this.engine.tick < end) { // the page can look back at each tick
      this.advance(1);
      this.inFlight = 1;
    }
    if (damage) this.say("error", { words: damage });
    this.sendState();
  }

  /** Begin a session with events, at a tick. */
  start(events, tick = 0) {
    this.strokes = []; // of the user; an undo goes back to where one began
    this.engine = new Engine(this.module, this.scene, events);
    this.capacity = Math.min(2 * this.engine.ants + 64, CAPACITY);
    this.note();
    this.pack(false, false);
    this.engine.pass(tick);
    if (tick) this.note();
    this.pack(false, false);
    [this.playing, this.owed] = [false, 0];
    this.sessions++;
  }

  apply(edit, stroke) {
    const { engine, strokes } = this, [[name, value]] = Object.entries(edit);
    if (!Object.hasOwn(EDITS, name)) throw new Error(`this page cannot do that (${name}); the live page of the Python package can.`);
    const changes = EDITS[name](engine, value);
    if (strokes[strokes.length - 1]?.stroke !== stroke) strokes.push({ stroke, tick: engine.tick, before: [...engine.events, ...engine.later] });
    for (const change of changes) engine.apply(change);
  }

  get rate() {
    const { learner, learns, rate } = this.engine.scene;
    return learner === LEARNERS.frozen ? 1 : learns * rate;
  }
  note() { this.engine.wasm.note_point(this.engine.scene.epsilon); }

  /** A frame: a whole one, or the changes since the last one; `acted` if that is one tick. */
  pack(whole, acted) {
    const { wasm, scene } = this.engine, length = wasm.pack_frame(whole, acted, scene.epsilon, this.rate);
    return wasm.memory.buffer.slice(wasm.array(13), wasm.array(13) + length);
  }

  /** Pass some ticks, and show them; only a single one shows what the ants did. */
  advance(ticks) {
    const { engine } = this, until = performance.now() + BUSY_MS;
    if (ticks === 1) engine.wasm.pass_acting();
    else if (ticks < Infinity) engine.pass(ticks);
    else do engine.pass(TICKS_AT_ONCE); while (performance.now() < until);
    this.show(this.pack(false, ticks === 1));
    this.note();
    if (!engine.later.length || engine.later[0].tick > engine.tick) return;
    engine.settle();
    this.show(this.pack(false, false));
  }

  show(frame) {
    this.behind ||= this.inFlight >= MOST_IN_FLIGHT;
    if (this.behind) return;
    this.inFlight++;
    this.post(frame);
  }

  /** Advance while playing. */
  turn() {
    if (!this.playing) return;
    const { speed } = this, now = performance.now();
    if (now >= this.due) {
      this.owed += Math.max(1, speed / FRAMES_A_SECOND);
      this.advance(speed >= FASTEST ? Infinity : Math.floor(this.owed));
      this.owed %= 1;
      this.due = Math.max(this.due + 1000 / Math.min(speed, FRAMES_A_SECOND), performance.now());
      if (now >= this.stateDue) this.sendState();
    }
    clearTimeout(this.turning);
    this.turning = setTimeout(() => this.turn(), this.due - performance.now());
  }

  say(kind, facts = {}) { this.post(JSON.stringify({ say: kind, ...facts })); }

  sendWhole() {
    [this.inFlight, this.behind] = [1, false];
    this.say("snapshot");
    this.post(this.pack(true, false));
  }

  sendBegin() {
    this.say("begin", { session: String(this.sessions), header: this.header(), choices: null, chosen: null });
    this.sendState();
    this.sendWhole();
  }

  sendState() {
    const { engine } = this, { epsilon, learner } = engine.scene, of = (more) => ({ least: 0, most: 1, edits: null, ...more });
    const values = {
      ants: of({ value: engine.ants, least: 1, most: Math.max(this.capacity, engine.ants), step: 1, path: "ants", help: "living ants" }),
      epsilon: of({ value: epsilon, step: 0.01, path: "epsilon", help: "share of random actions" }),
    };
    if (learner !== LEARNERS.frozen) values.learning_rate = of({ value: this.rate, step: 0.001, path: "learning_rate", help: "step size of updates" });
    this.stateDue = performance.now() + STATE_MS;
    this.say("state", { playing: this.playing, speed: this.speed, pages: 1, ticks: engine.tick, can_undo: this.strokes.length > 0, can_go_back: false, values, works: [], link: linkOf(engine) });
  }

  /** The header of `Recorder.header` in taichi_ants/viewer/recorder.py. */
  header() {
    const { scene, engine: { radius, size } } = this, { observation, ...header } = HEADERS.rules[scene.rules], learns = scene.learner !== LEARNERS.frozen;
    const count = 3 * radius * (radius - 1) + 1; // cells
    const cell = size < 2 ** 16 ? "u2" : "u4", types = Object.entries(header.types).map(([name, type]) => [name, type === "cell" ? cell : type]);
    const numbers = { "learning rate": scene.rate, discount: scene.discount }, about = {
      world: `${count} cells, ranges ${radius}, ${radius}, ${radius}`, "ants at the start": scene.ants, seed: scene.seed, observation,
      ...(learns ? { learner: LEARNER_LABELS[scene.learner], table: "shared", ...numbers } : { policy: "frozen", epsilon: scene.epsilon }),
    };
    return {
      ...header, title: `Ants in a world of ${count} cells`, ranges: [radius, radius, radius], types: Object.fromEntries(types), learns, names: HEADERS.names[header.n_states],
      pheromones: header.pheromones.map((one) => ({ ...one, strongest: scene.level })), groups: header.groups.map((group) => ({ ...group, learns })), about: Object.entries(about).map(([name, value]) => [name, String(value)]),
    };
  }

  /** Perform a request, or say why not. */
  receive(message) {
    const request = JSON.parse(message), { strokes } = this;
    const acts = {
      play: () => Object.assign(this, { playing: true, due: performance.now() }),
      pause: () => Object.assign(this, { playing: false }),
      speed: ({ value }) => Object.assign(this, { speed: value, due: performance.now() }),
      step: ({ ticks }) => {
        this.playing = false;
        for (let k = 0; k < ticks; k++) this.advance(1);
      },
      edit: ({ edit, stroke }) => {
        this.apply(edit, stroke);
        this.show(this.pack(false, false));
      },
      undo: () => {
        const last = strokes.pop();
        if (!last) throw new Error("there is nothing to undo: this session has no interventions.");
        this.start(last.before, last.tick);
        this.strokes = strokes;
        this.sendBegin();
      },
      restart: () => {
        this.start([]);
        this.sendBegin();
      },
      seen: ({ frames }) => {
        this.inFlight = Math.max(0, this.inFlight - frames);
        if (this.behind && !this.inFlight) this.sendWhole();
      },
    };
    try {
      if (!Object.hasOwn(acts, request.do)) throw new Error(`this page cannot do that (${request.do}); the live page of the Python package can.`);
      acts[request.do](request);
    } catch (error) {
      this.say("error", { words: error.message });
    }
    if (request.do !== "seen") this.sendState();
    this.turn();
  }
}

/** In a worker: the first message has what the constructor needs, the others are requests. */
export function serve() {
  let colony = null;
  addEventListener("message", ({ data }) => {
    if (colony) colony.receive(data);
    else colony = new LiveColony(new WebAssembly.Module(data.wasm), data.link, (message) => postMessage(message));
  });
}
