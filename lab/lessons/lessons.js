/* lessons.js: six lessons as chapters of a page. A question waits for a prediction, then its experiment runs, and its answer can be
 * opened. With ?teachers in the address, all answers are open, and notes for teachers are shown. */

import { EXPERIMENTS, ACTS, nameOf, SETTINGS, viewOf, written } from "../../docs/lessons/page/experiments.js";
import { Stage } from "../article/world.js";
import { LoneAnts } from "../page/engine.js";
import { escaped, plotOf, tableOf } from "../page/figures.js";
import { centre } from "../page/geometry.js";
import { LOOKS } from "../page/looks.js";
import { glyph } from "../page/mind.js";
import { byId, bytesOf, openPage } from "../page/page.js";
import { STEPS } from "../page/worlds.js";

const RANGE = 10, FIRST_CELL = [-8, 0];       // of the paper's world: its size, and where ants start
/** The recorded steps of lone ants: a map, a slider, and what happened in a step. */
class Walk {
  constructor(place, walks, at = 0) {
    const hexagon = STEPS.map(([q, r]) => centre(q, r)).map(([x, y]) => `${(y / 1.82).toFixed(2)},${(x / 1.82).toFixed(2)}`).join(" ");
    const cells = [];
    for (let q = 1 - RANGE; q < RANGE; q++)
      for (let r = 1 - RANGE; r < RANGE; r++) {
        if (Math.abs(q - r) >= RANGE) continue;
        const kind = r || Math.abs(q) > 9 ? "" : q === -9 ? "nest" : q === 9 ? "food" : "scent";
        cells.push(`<polygon points="${hexagon}" transform="translate(${centre(q, r)})" class="${kind}" data-cell="${this.cell(q, r)}"/>`);
      }
    const names = walks.length > 1 ? `<select aria-label="Ant">${walks.map(([name]) => `<option>${escaped(name)}</option>`).join("")}</select>` : "";
    place.innerHTML = `<div class="walk"><svg viewBox="-15.5 -17.5 31 35" role="img" aria-label="The paper's world, with an ant">${cells.join("")}`
      + `<g class="ant"><path d="M0,-1.1L.7,.9L0,.5L-.7,.9Z"/></g></svg><div>${names}<p class="steps"><button aria-label="A step back">‹</button>`
      + `<input type="range" min="0" aria-label="Step"><button aria-label="A step forward">›</button></p><div class="tells" aria-live="polite"></div>`
      + '<p class="aside">At the top is food, at the bottom the queen, and outlined between them the trail. The stronger the colour of a cell, the more often the ant is there.</p></div></div>';
    this.place = place;
    this.walks = walks;
    this.bar = place.querySelector("input");
    const [back, on] = place.querySelectorAll("button"), pick = place.querySelector("select");
    this.bar.addEventListener("input", () => this.show());
    back.addEventListener("click", () => { this.bar.stepDown(); this.show(); });
    on.addEventListener("click", () => { this.bar.stepUp(); this.show(); });
    pick?.addEventListener("change", () => this.open(pick.selectedIndex, 0));
    this.open(0, at);
  }

  cell(q, r) { return (r + RANGE) * (2 * RANGE + 1) + q + RANGE; }

  /** Show one of the ants: the darker a cell, the more often it was there. */
  open(k, at) {
    const often = new Map();
    this.notes = this.walks[k][1];
    for (const { cell } of this.notes) often.set(cell, (often.get(cell) || 0) + 1);
    const most = Math.max(...often.values());
    for (const polygon of this.place.querySelectorAll("polygon")) polygon.style.setProperty("--often", String((often.get(Number(polygon.dataset.cell)) || 0) / most));
    [this.bar.max, this.bar.value] = [String(this.notes.length - 1), String(at)];
    this.show();
  }

  show() {
    const k = this.bar.valueAsNumber, { episode, step, state, action, reward, next, value } = this.notes[k];
    const { cell, heading } = step ? this.notes[k - 1] : { cell: this.cell(...FIRST_CELL), heading: 0 };
    const q = cell % (2 * RANGE + 1) - RANGE, r = Math.floor(cell / (2 * RANGE + 1)) - RANGE, entries = (wanted) => {
      const row = [0, 0, 0, 0, 0];
      for (const note of this.notes.slice(0, k)) if (note.state === wanted) row[note.action] = note.value;
      return row.map((entry) => entry.toFixed(4));
    };
    const seen = [5, 0, 1].map((turn) => STEPS[(heading + turn) % 6]).map(([a, b]) => this.cell(q + a, r + b));
    for (const polygon of this.place.querySelectorAll("polygon")) polygon.classList.toggle("seen", seen.includes(Number(polygon.dataset.cell)));
    const ant = this.place.querySelector(".ant");
    ant.setAttribute("transform", `translate(${centre(q, r)}) rotate(${60 * heading})`);
    ant.classList.toggle("carries", state >= 64);
    const learns = this.walks.length === 1 && this.notes.some((note) => note.value);
    this.place.querySelector(".tells").innerHTML = `<p>Episode ${episode}, step <b>${step}</b>: it observes <b>${nameOf(state)}</b>, chooses <b>${ACTS[action]}</b>, gets <b>${reward > 0 ? "+" : ""}${reward}</b>, and then observes ${nameOf(next)}.</p>`
      + (learns ? `<p>Its table before this step:</p>${tableOf(["observation", ...ACTS], [[nameOf(state), ...entries(state)], [nameOf(next), ...entries(next)]])}<p>After it, the entry for ${ACTS[action]} is ${value.toFixed(4)}.</p>` : "");
  }
}

/** The place of an experiment: an editor if there is something to write, a button, and the result. */
class Place {
  constructor(element, page) {
    this.element = element;
    this.page = page;
    this.experiment = EXPERIMENTS[element.dataset.run];
    this.group = null; // of a question, see Group
    const { ask, code, answer, now, label = code ? "Check" : "Run" } = this.experiment;
    element.innerHTML = (ask ? `<p>${ask}</p>` : "") + (code ? `<textarea class="code" spellcheck="false" autocapitalize="off" aria-label="Your function" rows="${code.split("\n").length + 2}">${escaped(code)}</textarea>` : "")
      + `<p class="acts"><button class="seeds">${label}</button></p><div class="result" aria-live="polite"></div>`
      + (code ? `<details><summary>Answer</summary><pre>${escaped(answer)}</pre></details>` : "");
    this.button = element.querySelector("button");
    this.result = element.querySelector(".result");
    this.label = label;
    this.button.addEventListener("click", () => this.run());
    this.button.parentElement.hidden = Boolean(now);
  }

  /** Run with what is written, or with the answer. */
  async run(answered = false) {
    const { button, result, experiment } = this, { code, answer, name } = experiment;
    [button.disabled, button.textContent] = [true, "Running …"];
    await new Promise((done) => { setTimeout(done, 30); }); // the button is seen to have been pressed
    result.classList.remove("wrong");
    try {
      const own = code ? written(answered ? answer : this.element.querySelector("textarea").value, name) : null;
      this.show(await experiment.go({ lone: this.page.lone, own, show: (outcome) => this.show(outcome) }));
    } catch (error) {
      result.classList.add("wrong");
      result.textContent = error.message;
    }
    [button.disabled, button.textContent] = [false, this.label];
    this.group?.open();
  }

  /** @param {import("../../docs/lessons/page/experiments.js").Outcome} outcome */
  show({ say, head, rows, lines, across, walks, at, views }) {
    this.result.innerHTML = (say ? `<p>${escaped(say)}</p>` : "") + (rows ? tableOf(head, rows) : "") + (lines ? plotOf(lines, across) : "")
      + (views ? `<div class="views">${views.map(({ state, values }) => `<div>${glyph([state >> 6, ...viewOf(state)], values, LOOKS[this.page.theme])}<b>${ACTS[values.indexOf(Math.max(...values))]}</b>${nameOf(state)}</div>`).join("")}</div>` : "");
    if (walks) new Walk(this.result, walks, at);
  }
}

/** A prediction, and what waits for it: one experiment, and everything after it up to the next section. */
class Group {
  constructor(label, teachers) {
    this.field = label.querySelector("textarea");
    this.hidden = [];
    this.teachers = teachers;
    label.insertAdjacentHTML("afterend", '<p class="acts"><button class="seeds">Show the recorded result</button></p>');
    this.button = this.reveal = label.nextElementSibling.firstElementChild; // for a question without an experiment
    this.reveal.addEventListener("click", () => this.open());
    this.field.addEventListener("input", () => this.wait());
  }

  /** Take the next element: the first experiment runs in view, the others wait. */
  take(child, place) {
    if (place && this.button === this.reveal && !this.hidden.length) [this.button, place.group] = [place.button, this];
    else this.hidden.push(child);
  }

  close() {
    this.reveal.parentElement.hidden = this.teachers || this.button !== this.reveal;
    for (const one of this.hidden) one.hidden = !this.teachers;
    this.wait();
  }

  wait() {
    this.button.disabled = !this.teachers && !this.field.value.trim();
    this.button.title = this.button.disabled ? "Write down your prediction first." : "";
  }

  open() {
    for (const one of this.hidden) one.hidden = false;
    this.reveal.parentElement.hidden = true;
  }
}

class Lessons extends Stage {
  constructor() {
    super();
    this.lone = new LoneAnts(new WebAssembly.Module(bytesOf("ant.wasm")));
    this.teachers = /\bteachers\b/.test(location.search);
    this.chapters = [...document.querySelectorAll("article")];
    this.places = [...document.querySelectorAll(".piece")].map((element) => new Place(element, this));
    for (const figure of document.querySelectorAll("figure")) figure.insertAdjacentHTML("afterbegin", `<figcaption>${SETTINGS[figure.dataset.piece]}</figcaption>`);
    for (const chapter of this.chapters) this.arrange(chapter);
    if (this.teachers) this.teach();
    addEventListener("hashchange", () => this.turn());
    this.turn();
    for (const place of this.places) if (place.experiment.now) place.run();
  }

  arrange(chapter) {
    const groups = [];
    let group = null;
    for (const child of [...chapter.children]) {
      if (child.tagName === "H2") group = null;
      else if (child.matches(".predict")) groups.push(group = new Group(child, this.teachers));
      else if (group) group.take(child, this.places.find(({ element }) => element === child));
    }
    for (const one of groups) one.close();
  }

  /** The teachers' edition: answers are open, and a button runs all that a chapter has. */
  teach() {
    document.body.classList.add("teachers-edition");
    for (const details of document.querySelectorAll("details")) details.open = true;
    for (const chapter of this.chapters) {
      chapter.firstElementChild.insertAdjacentHTML("afterend", '<p class="acts"><button class="seeds">Run all experiments of this lesson</button></p>');
      chapter.querySelector("button").addEventListener("click", async () => { for (const place of this.places) if (chapter.contains(place.element)) await place.run(true); });
    }
  }

  /** Show the chapter of the address, or the contents. */
  turn() {
    const number = location.hash.slice(1);
    for (const chapter of this.chapters) chapter.hidden = chapter.id !== number;
    byId("contents").hidden = this.chapters.some(({ hidden }) => !hidden);
    for (const link of document.querySelectorAll("nav a")) link.toggleAttribute("aria-current", link.getAttribute("href") === location.hash);
    const other = byId("edition");
    [other.href, other.textContent] = this.teachers ? [`?${location.hash}`, "Students’ edition"] : [`?teachers${location.hash}`, "Teachers’ edition"];
    scrollTo(0, 0);
  }
}

openPage("lessons", Lessons);
