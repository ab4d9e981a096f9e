/* engine.js: ants in WebAssembly. It needs no DOM, so that workers and Node can use it as well.
 *
 * COLONIES (colony.wasm)
 *   const module = await WebAssembly.compile(bytes)       // once
 *   const engine = new Engine(module, scene, events?)     // starts; takes 3 ms
 *   scene: see SCENE in worlds.js; new Engine(module, { ...SCENE, rules: RULES.foraging, seed: 7 })
 *   engine.scene has the present settings, engine.first those of the start; engine.world, .radius, .size, .queen the world
 *   events: what to replay, as `decode` of link.js returns it; see `apply`
 *
 *   engine.pass(ticks)    events of a replay are applied on the way, each at its tick
 *   engine.apply(event)   a change between two ticks, which is recorded in `engine.events`:
 *     { do: "rock" | "food" | "scent" | "trail" | "erase", reach: 0..7, path: [cells] }
 *       a stroke: all cells within `reach` of a path of adjacent cells. While a visitor draws, apply
 *       the new cells of each frame as a separate event, without the last cell of the one before
 *       (a link then writes them as one stroke). Cells outside the world are dropped.
 *       A trail is as strong as new scent of ants, "scent" half as strong.
 *     { do: "ants" | "epsilon" | "rate" | "discount" | "level" | "shaping" | "learns", value }
 *       `level` is how long new scent lasts, in ticks; `learns` is 0 or 1. Values are rounded to
 *       what links can have (see LIMITS); `engine.scene` has the result.
 *   engine.forget()       drops the rest of a replay, when the visitor acts
 *   engine.tick, .ants, .deliveries, .returns
 *   engine.changed        true after ground has changed by `apply`; the page sets it to false
 *   engine.hash()         16 hexadecimal digits: two engines with the same hash have the same state
 *
 * A frame is in these arrays after each `pass` and `apply`. Read `ground` and `levels` anew for each:
 *   by cell: ground (EMPTY, ROCK, FOOD, QUEEN; ants stand on ROCK), levels (0..255 of the scent),
 *            traffic (carriers of the last ticks, fading by 1 %)
 *   by ant:  cells, before, before2 (cells now, one and two ticks ago), headings (0..5),
 *            looks (carries | event << 1 | action << 4; see EVENTS and ACTIONS), states (see `mind`)
 *   by state: values (8 floats each, the first 5 are those of ACTIONS)
 *
 *   engine.mind(ant)      what an ant sees and will do: { carries, state, values: [5], best: [actions],
 *                         next, why }; `why` is "best", "tie" (of several best actions), "explores",
 *                         or "was best" (SARSA draws an action before it learns)
 *   engine.policy(cell, heading, carries)   { state, values, best } of an ant that would stand there
 *   engine.codesOf(state), .valuesOf(state)   what it is, and what each action is worth in it
 *
 * CELLS are numbers: engine.at(q, r), engine.q(cell), engine.r(cell), engine.exists(q, r),
 *   engine.disc(cell, reach); STEPS[heading] is the step (q, r) to a neighbour.
 *
 * LONE ANTS (ant.wasm)
 *   const lone = new LoneAnts(module)
 *   lone.train({ ... })   gives { returns, steps, deliveries }, each Int32Array (seeds * episodes)
 *   lone.values   the tables of the last call, Float32Array (seeds * 640)
 *   lone.notes    of one seed, its first steps (at most `notes`), each an object with NOTES
 *   lone.follow(tables, { seeds, rollout, maxSteps, notes })   the same for ants that only follow their tables
 *   GRID is the paper's grid, 128 settings for `train`; 100 seeds of one take about 0.2 s
 */

import FOLLOWERS from "./followers.json" with { type: "json" };
import { EMPTY, FOOD, hexDistance, makeWorld, QUEEN, ROCK, STEPS } from "./worlds.js";

/** @typedef {import("./worlds.js").Scene} Scene */
/** @typedef {{ do: "rock" | "food" | "scent" | "trail" | "erase", reach: number, path: number[], tick?: number }} Stroke */
/** @typedef {{ do: "ants" | "epsilon" | "rate" | "discount" | "level" | "shaping" | "learns", value: number, tick?: number }} Setting */
/** @typedef {Stroke | Setting} Change */

export const ACTIONS = ["turn left", "go on", "turn right", "pick up", "give"];
export const EVENTS = { entered: 0, failed: 1, shaped: 2, pickedUp: 3, delivered: 4 };
/** The bits of rules: trails that rise towards food, right of way, ants that see ants, queues. */
export const PARTS = { directed: 1, rightOfWay: 2, seesAnts: 4, queues: 8 };
export const RULES = { paper: 0, foraging: 7, queueing: 15 };
export const LEARNERS = { q_learning: 0, sarsa: 1, frozen: 2 };
export const CAPACITY = 10000;
const START_LEVEL = 25;

/** The largest values of settings, as links have them: some in thousandths. */
export const LIMITS = {
  seed: Number.MAX_SAFE_INTEGER, ants: CAPACITY, epsilon: 1000, rate: 1000, discount: 1000,
  learns: 1, first: 1000, level: 100000, regrowth: 1000000, shaping: 100,
};
export const THOUSANDTHS = ["epsilon", "rate", "discount"], SIGNED = ["first", "shaping"];
export const leastOf = (name) => ({ ants: 1, level: 1, regrowth: -1 })[name] ?? (SIGNED.includes(name) ? -LIMITS[name] : 0);

/** The nearest value of a setting that a link can have. */
export function allowed(name, value) {
  const unit = THOUSANDTHS.includes(name) ? 1000 : 1;
  return Math.max(leastOf(name), Math.min(LIMITS[name], Math.round(value * unit))) / unit;
}

export class Engine {
  /**
   * @param {WebAssembly.Module} module colony.wasm
   * @param {Scene} scene
   * @param {Change[]} later changes of a replay, by tick
   */
  constructor(module, scene, later = []) {
    const wasm = /** @type {any} */ (new WebAssembly.Instance(module, {}).exports);
    this.wasm = wasm;
    this.scene = { ...scene };
    this.world = makeWorld(scene);
    this.later = later.slice();
    /** @type {Change[]} */
    this.events = [];
    this.changed = true;
    this.stale = true;
    const R = this.radius = this.world.radius;
    this.width = 2 * R + 1;
    this.size = this.width * this.width;
    this.queen = this.world.queen;
    if (!wasm.lay_out(R, R, R, CAPACITY, scene.rules, scene.learner)) throw new Error("There is too little memory.");
    this.look();
    for (const [cells, what] of [[this.world.rocks, ROCK], [this.world.foods, FOOD], [[this.queen], QUEEN]])
      for (const cell of /** @type {number[]} */ (cells)) this.laid[cell] = /** @type {number} */ (what);
    for (const name of Object.keys(LIMITS)) this.scene[name] = allowed(name, scene[name]);
    this.scene.ants = Math.min(this.scene.ants, wasm.room());
    this.first = { ...this.scene }; // for links
    this.setNumbers();
    wasm.begin(this.first.seed >>> 0, Math.floor(this.first.seed / 2 ** 32), this.first.ants, this.first.first);
    if (scene.learner === LEARNERS.frozen) this.follow();
    this.brush.set(this.world.scent);
    if (this.world.scent.length) wasm.lay_scent(this.world.scent.length, START_LEVEL);
    this.settle();
  }

  /** Make views of the memory, which does not grow after `lay_out`. */
  look() {
    const at = (k, Kind, n) => new Kind(this.wasm.memory.buffer, this.wasm.array(k), n);
    this.laid = at(0, Uint8Array, this.size); // with ants; `ground` is that of the frame
    this.shownGround = at(1, Uint8Array, this.size);
    this.shownLevels = at(2, Uint8Array, this.size);
    this.traffic = at(3, Float32Array, this.size);
    this.brush = at(4, Int32Array, this.size);
    this.cells = at(5, Int32Array, CAPACITY);
    this.before = at(6, Int32Array, CAPACITY);
    this.before2 = at(7, Int32Array, CAPACITY);
    this.headings = at(8, Uint8Array, CAPACITY);
    this.looks = at(9, Uint8Array, CAPACITY);
    this.states = at(10, Uint16Array, CAPACITY);
    this.values = at(11, Float32Array, 8 * this.wasm.states());
    this.read = at(12, Int32Array, 4);
  }

  // Cells are only packed when somebody looks at them.
  get ground() { return this.packed().shownGround; }
  get levels() { return this.packed().shownLevels; }
  packed() {
    if (this.stale) this.wasm.pack_cells();
    this.stale = false;
    return this;
  }

  get tick() { return this.wasm.ticks_passed(); }
  get ants() { return this.wasm.ants(); }
  get returns() { return this.wasm.count(0); }
  get deliveries() { return this.wasm.count(1); }

  setNumbers() {
    const s = this.scene, slope = s.rules & PARTS.directed ? Math.max(1, Math.floor((2 * s.level + 50) / 100)) : 0;
    this.wasm.set_rate(s.learns ? s.rate : 0);
    this.wasm.set_numbers(s.level, slope, s.discount, s.epsilon, s.shaping, s.regrowth);
  }

  /** Give the ants the hand-written policy `trail_follower`. */
  follow() {
    [...FOLLOWERS[this.wasm.states()]].forEach((letter, state) => {
      for (let a = 0; a < 5; a++) this.values[8 * state + a] = letter.charCodeAt(0) - 64 >> a & 1;
    });
    this.wasm.read_values();
  }

  /** Advance by some ticks. The events of a replay happen before the tick that follows them. */
  pass(ticks) {
    for (const end = this.tick + ticks; this.tick < end;) {
      this.settle();
      const next = this.later.length ? this.later[0].tick : end;
      this.wasm.pass(Math.min(end, next) - this.tick);
      this.stale = true;
    }
    this.settle();
  }

  /** Apply the events of a replay that are due. */
  settle() {
    while (this.later.length && this.later[0].tick <= this.tick) this.apply(/** @type {Change} */ (this.later.shift()));
  }

  forget() { this.later = []; }

  /**
   * Make a change now, and record it.
   * @param {Change} change
   */
  apply(change) {
    this.stale = true;
    if ("path" in change) {
      for (const path of this.rows(change.path)) {
        this.paint({ ...change, path });
        this.events.push({ ...change, path, tick: this.tick });
      }
      return;
    }
    const name = change.do, value = name === "ants" ? Math.min(change.value, this.wasm.room()) : change.value;
    this.scene[name] = allowed(name, value);
    if (name === "ants") this.wasm.set_ants(this.scene.ants);
    else this.setNumbers();
    this.events.push({ do: name, value: this.scene[name], tick: this.tick });
  }

  /** The parts of a path that are rows of adjacent cells of the world, as links need them. */
  rows(path) {
    const rows = /** @type {number[][]} */ ([]);
    let last = -1;
    for (const cell of path) {
      const inside = this.exists(this.q(cell), this.r(cell));
      const near = STEPS.some(([q, r]) => last + q + r * this.width === cell);
      if (inside && last >= 0 && near) rows[rows.length - 1].push(cell);
      else if (inside && cell !== last) rows.push([cell]);
      last = inside ? cell : -1;
    }
    return rows;
  }

  /** @param {Stroke} stroke */
  paint(stroke) {
    const cells = [...new Set(stroke.path.flatMap((cell) => this.disc(cell, stroke.reach)))];
    this.brush.set(cells);
    const ground = { rock: ROCK, food: FOOD, erase: EMPTY }[stroke.do], { level } = this.scene;
    if (ground !== undefined) this.wasm.put(cells.length, ground);
    const laid = { scent: Math.floor((level + 1) / 2), trail: level, erase: 0 }[stroke.do];
    if (laid !== undefined) this.wasm.lay_scent(cells.length, laid);
    this.changed = true;
  }

  hash() {
    const low = this.wasm.hash_state(0) >>> 0, high = this.wasm.hash_state(1) >>> 0;
    return high.toString(16).padStart(8, "0") + low.toString(16).padStart(8, "0");
  }

  /** What the ant sees and will do; see the top of this file. */
  mind(ant) {
    this.wasm.read_mind(ant);
    const carries = this.looks[ant] & 1, seen = this.seen();
    const next = this.read[2], only = seen.best.length > 1 ? "tie" : "best";
    return { ...seen, carries, next, why: this.read[3] ? "explores" : seen.best.includes(next) ? only : "was best" };
  }

  /** What an ant with this place and load would see, and its best actions. */
  policy(cell, heading, carries) {
    this.wasm.see_from(cell, heading, carries);
    return this.seen();
  }

  seen() {
    const [state, best] = this.read;
    return { state, best: ACTIONS.map((_, a) => a).filter((a) => best >> a & 1), values: this.valuesOf(state) };
  }

  valuesOf(state) { return [...this.values.subarray(8 * state, 8 * state + 5)]; }

  /** The load, and codes of the cells left, ahead and right, of a state. @returns {number[]} */
  codesOf(state) {
    const n = [4, 6, 7].find((codes) => 16 * codes ** 3 >= this.values.length); // that a cell can have
    return [Math.floor(state / n ** 3), Math.floor(state / n ** 2) % n, Math.floor(state / n) % n, state % n];
  }

  // Cells
  at(q, r) { return (r + this.radius) * this.width + q + this.radius; }
  q(cell) { return cell % this.width - this.radius; }
  r(cell) { return Math.floor(cell / this.width) - this.radius; }
  exists(q, r) { return hexDistance(q, r) < this.radius; }
  disc(cell, reach) {
    const q = this.q(cell), r = this.r(cell), found = [];
    for (let b = -reach; b <= reach; b++)
      for (let a = -reach; a <= reach; a++)
        if (hexDistance(a, b) <= reach && this.exists(q + a, r + b)) found.push(this.at(q + a, r + b));
    return found;
  }
}

// Lone ants --------------------------------------------------------------------------------------

/** The paper's grid: 64 settings of a learner, each with the two settings of delivery. */
export const GRID = [["q_learning", 0], ["sarsa", 0], ["dyna_q", 3], ["dyna_q", 5]].flatMap(([learner, planningSteps]) =>
  [true, false].flatMap((truncates) => [0.001, 0.01].flatMap((rate) => [0.9, 0.99].flatMap((discount) =>
    [0.3, 0.5].flatMap((epsilon) => [0.99, 0.995].map((decay) =>
      ({ learner, planningSteps, truncates, rate, discount, epsilon, decay })))))));

export class LoneAnts { // complete in itself, because workers get its text
  /** What is noted of a step. Cell and heading are those after it, and the value is that of the entry which the step has changed. */
  static NOTES = ["episode", "step", "state", "action", "reward", "next", "terminated", "cell", "heading", "value"];

  /** @param {WebAssembly.Module} module ant.wasm */
  constructor(module) { this.wasm = /** @type {any} */ (new WebAssembly.Instance(module, {}).exports); }

  /** Train one setting of GRID with several seeds; see the top of this file. */
  train({ learner, rate, discount, epsilon, decay, planningSteps = 0, truncates = false, first = 0, seeds, episodes = 500, maxSteps = 600,
          tables = null, purpose = 0, rollout = 0, notes = 0 }) {
    const n = seeds.length, all = n * episodes, at = this.wasm.prepare(n, episodes), noted = this.wasm.note_steps(notes);
    if (!at || !noted) throw new Error("There is too little memory.");
    new BigUint64Array(this.wasm.memory.buffer, at, n).set(seeds.map(BigInt));
    const start = new Float32Array(this.wasm.memory.buffer, this.wasm.tables(), n * 640);
    if (tables) start.set(tables);
    else start.fill(first);
    const number = ["q_learning", "sarsa", "dyna_q"].indexOf(learner);
    const done = this.wasm.train_all(number, rate, discount, epsilon, decay, planningSteps, truncates, maxSteps, purpose, rollout);
    if (!done) throw new Error("There is too little memory.");
    const memory = this.wasm.memory.buffer; // it may have grown
    this.values = new Float32Array(memory, done, n * 640).slice();
    const [returns, steps, deliveries] = [0, 1, 2].map((k) => new Int32Array(memory, done + 4 * (n * 640 + k * all), all).slice());
    const taken = Math.min(notes, steps.reduce((a, b) => a + b, 0)); // steps that are noted
    const whole = new Int32Array(memory, noted, LoneAnts.NOTES.length * taken), exact = new Float32Array(memory, noted, whole.length);
    this.notes = Array.from({ length: taken }, (_, k) => Object.fromEntries(LoneAnts.NOTES.map((name, j) =>
      [name, (name === "value" ? exact : whole)[k * LoneAnts.NOTES.length + j]])));
    return { returns, steps, deliveries };
  }

  /** Let ants follow their tables for an episode, without learning: the rollouts of the package, as long as trails stay. */
  follow(tables, { seeds, rollout = 0, maxSteps = 600, notes = 0 }) {
    return this.train({ learner: "q_learning", rate: 0, discount: 0.9, epsilon: 0, decay: 1, seeds, episodes: 1, maxSteps, tables, purpose: 1, rollout, notes });
  }
}
