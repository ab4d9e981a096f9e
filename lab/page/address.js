/* address.js: the address holds the scene, the seed and every stroke, so that a link replays a visit to the bit. */

import { decode, encode, linkOf, partsOf, pythonOf } from "./link.js";
import { beginDaily } from "./daily.js";
import { byId } from "./page.js";
import { QUESTIONS } from "./scenes.js";
import { many } from "./story.js";

const SAVE_MS = 250;
const MOST_REPLAY = 200_000; // ticks of a link that are replayed at once

/** The text after "#" that replays the runs up to now; two runs are joined by "~". */
export const visitOf = (runs) => runs.map((run) => linkOf(run.engine)).join("~");

/** Copy a text; return whether the browser allowed it. Pages in frames and files often need the old way. */
async function copied(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    const area = document.body.appendChild(document.createElement("textarea"));
    area.value = text;
    area.select();
    const done = document.execCommand("copy");
    area.remove();
    return done;
  }
}

export class Address {
  constructor(lab) {
    this.lab = lab;
    byId("copy").addEventListener("click", () => this.copy());
    byId("verify").addEventListener("click", () => this.verify());
    byId("back").addEventListener("click", ({ target }) => { target.href = `live.html#${linkOf(this.lab.runs[this.lab.runs.length - 1].engine)}`; });
    addEventListener("hashchange", () => this.open());
  }

  /** Write what has happened into the address, soon. */
  save() {
    clearTimeout(this.saving);
    this.saving = setTimeout(() => {
      const { runs } = this.lab, prepared = runs.some((run) => run.start > 0); // ticks that nobody wants to watch
      this.show(prepared ? visitOf(runs) : runs.map(({ engine }) => encode(engine.first, engine.events)).join("~"));
    }, SAVE_MS);
  }

  /** Write a text into the address: a link, or the name of a question or of the daily map. */
  show(text) {
    clearTimeout(this.saving);
    try { history.replaceState(null, "", `#${text}`); } catch { /* a frame that has no address */ }
  }

  async copy() {
    const { runs } = this.lab, text = visitOf(runs), ticks = runs.map(({ tick }) => many(tick)).join(" and "); // runs go on meanwhile
    this.show(text);
    const done = await copied(`${location.href.split("#")[0]}#${text}`);
    this.lab.toast(done ? `Link copied: ${many(text.length)} characters. It replays these ${ticks} ticks to the same state.`
      : `The address holds it now, ${many(text.length)} characters. Copy it from there.`, 5000);
  }

  /** Three lines of Python that replay the right run, and print the state that the page shows. */
  async verify() {
    const { runs } = this.lab, { engine, tick } = runs[runs.length - 1], lines = pythonOf(engine), hash = engine.hash();
    const done = await copied(lines);
    this.lab.toast(done ? `Three lines of Python copied. They print ${hash}, the state${runs.length > 1 ? " of the right world" : ""} at tick ${many(tick)}.`
      : "This browser does not let the page copy. The link in the address verifies as well.", 6000);
    return lines;
  }

  /** Open what the address asks for, or the first screen if it is damaged. */
  open(text = location.hash.slice(1)) {
    try {
      if (text) this.start(text);
    } catch (error) {
      this.lab.begin();
      this.lab.toast(`${error.name === "URIError" ? "This link is damaged." : error.message} The lab starts anew.`, 6000);
    }
  }

  /** Start a question, the daily map, or a link; an error if a text is none of them. */
  start(text) {
    const { lab } = this, question = QUESTIONS.find((one) => one.id === text);
    if (question) lab.ask(question);
    else if (text === "daily") beginDaily(lab);
    else this.replay(text.split("~").slice(0, 2).map(partsOf).map(({ code, ...moment }) => ({ ...decode(code), ...moment })));
  }

  /** Play links up to their moment, and compare the states if they have hashes. */
  replay(starts) {
    const { lab } = this, began = performance.now(), late = starts.some(({ tick }) => tick > MOST_REPLAY);
    lab.begin(starts);
    if (late || starts.some(({ tick }) => tick === null)) {
      return lab.toast(late ? `This link has more than ${many(MOST_REPLAY)} ticks: it plays from the start.` : starts[0].events.length
        ? "This link plays what was drawn." : "This link has settings alone: a new run starts with them.", 5000);
    }
    lab.runs.forEach((run, k) => run.skip(starts[k].tick));
    const ms = Math.round(performance.now() - began), wrong = lab.runs.filter((run, k) => starts[k].hash && run.engine.hash() !== starts[k].hash);
    this.replayed = { equal: !wrong.length, ms };
    lab.toast(wrong.length ? `Replayed ${many(starts[0].tick)} ticks, but the state differs: it is ${wrong[0].engine.hash()}.`
      : `Replayed ${many(starts[0].tick)} ticks in ${many(ms)} ms${starts.every(({ hash }) => hash) ? ": the same state, to the last bit" : ""}.`, 6000);
    return lab.controls.show();
  }
}
