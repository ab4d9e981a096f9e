/* embed.js: the lab in a frame of another page, which can steer it by messages; for these, see docs/how-to/lab.md.
 * `?bare` in the address hides all but the world, the play button and the brushes. */

import { visitOf } from "./address.js";
import { lineTo } from "./geometry.js";
import { SETTING_KINDS, STROKES } from "./link.js";

const MOST_TICKS = 100_000, FASTEST_MS = 50;

export class Embed {
  constructor(lab) {
    this.lab = lab;
    document.documentElement.classList.toggle("bare", /[?&]bare\b/.test(location.search));
    addEventListener("message", (event) => this.receive(event));
    if (parent !== window) parent.postMessage({ lab: "ready" }, "*");
  }

  receive({ data, source }) {
    if (!data || typeof data !== "object" || typeof data.lab !== "string" || !source) return;
    const answer = (message) => source.postMessage({ ...message, ...(data.id === undefined ? {} : { id: data.id }) }, "*");
    try {
      this.act(data, answer);
      answer(this.facts());
    } catch (error) {
      answer({ lab: "error", message: error.message });
    }
  }

  act(data, answer) {
    const { lab } = this, number = (value, least, most) => {
      if (!Number.isFinite(value) || value < least || value > most) throw new Error(`${data.lab}: ${value} is not between ${least} and ${most}.`);
      return value;
    };
    const acts = {
      start: () => (data.scene ? lab.address.start(String(data.scene)) : lab.begin()),
      say: () => {
        if (!lab.question || lab.question.said >= 0) throw new Error("say: no question is waiting for a prediction.");
        lab.say(number(data.option, 0, lab.question.options.length - 1));
      },
      play: () => lab.play(true),
      pause: () => lab.play(false),
      speed: () => { lab.ui.speed = number(data.value, 0.1, 64); },
      undo: () => lab.undo(),
      set: () => {
        if (!SETTING_KINDS.includes(data.name)) throw new Error(`set: ${data.name} is not one of ${SETTING_KINDS.join(", ")}.`);
        lab.set(data.name, number(data.value, 0, 10_000));
      },
      strokes: () => [data.strokes ?? ""].flat().forEach((stroke) => this.draw(stroke)),
      skip: () => { for (let k = number(data.ticks, 0, MOST_TICKS); k >= 1; k--) lab.advance(); },
      facts: () => {
        clearInterval(this.telling);
        if (data.every) this.telling = setInterval(() => answer(this.facts()), number(data.every, FASTEST_MS, 1e6));
      },
    };
    if (!Object.hasOwn(acts, data.lab)) throw new Error(`${data.lab} is not one of ${Object.keys(acts).join(", ")}.`);
    acts[data.lab]();
  }

  draw({ do: brush, reach, path }) {
    const { engine } = this.lab.runs[0];
    if (!Object.hasOwn(STROKES, brush) || !(reach >= 0 && reach <= 7)) throw new Error(`strokes: \`do\` is one of ${Object.keys(STROKES).join(", ")}, \`reach\` 0 to 7.`);
    if (!Array.isArray(path) || !path.length || !path.every(([q, r]) => engine.exists(q, r))) throw new Error("strokes: a path has cells [q, r] of the world.");
    const cells = path.flatMap((cell, k) => (k ? lineTo(path[k - 1], cell) : [cell]));
    this.lab.act({ do: brush, reach, path: cells.map(([q, r]) => engine.at(q, r)) });
  }

  facts() {
    this.lab.words(); // the story of now
    const { runs, ui, told } = this.lab;
    return {
      lab: "facts", playing: ui.playing, story: told, link: visitOf(runs),
      sides: runs.map((run) => ({
        tick: run.tick, ants: run.engine.ants, deliveries: run.engine.deliveries, perMinute: run.perMinute, returns: run.engine.returns,
        hash: run.engine.hash(), facts: { ...run.facts },
        wall: run.wall && { tick: run.wall.tick, crossed: run.wall.crossed, came: run.wall.came, detour: run.wall.detour, stopped: run.wall.stopped },
      })),
    };
  }
}
