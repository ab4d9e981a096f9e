/* controls.js: the settings, speeds and brushes beside the world. */

import { beginDaily } from "./daily.js";
import { LEARNERS, PARTS, RULES } from "./engine.js";
import { byId, icon } from "./page.js";
import { many, seconds } from "./story.js";
import { WORLDS } from "./worlds.js";

const SPEEDS = [0.5, 1, 4, 16];
const BRUSHES = [["rock", "Rock", "Draw rock (R)"], ["food", "Food", "Draw food (F)"], ["scent", "Trail", "Draw a trail (T)"],
                 ["erase", "Erase", "Erase rock, food and trails (E)"], ["look", "Look", "Look into an ant (L)"]];
const COUNTS = [1, 2, 4, 8, 12, 16, 24, 32, 40, 48, 64, 80, 100, 128, 160, 200, 250, 300, 350, 400, 450, 500, 600, 700, 800, 1000,
                1500, 2000, 3000, 5000, 10000];

/** Sliders: the values of their steps, the words, what they mean, and whether a change starts the run again. @type {any[]} */
const SLIDERS = [
  { name: "ants", label: "Ants", steps: COUNTS, words: many },
  { name: "epsilon", label: "Exploration", steps: Array.from({ length: 51 }, (_, k) => k / 100), words: (v) => `${Math.round(v * 100)} %`,
    help: "Exploration: how many of their actions are random" },
  { name: "level", label: "Scent lasts", steps: Array.from({ length: 24 }, (_, k) => 50 * k + 50), words: seconds,
    help: "Scent lasts: how long it takes new scent to fade" },
  { name: "shaping", label: "Reward for walking a trail", steps: Array.from({ length: 11 }, (_, k) => k), words: (v) => (v === 1 ? "1 point" : `${v} points`),
    help: "Reward for each step along scent, or with food nearer to the nest; food at home pays 10 points" },
  { name: "discount", label: "Discount", steps: Array.from({ length: 100 }, (_, k) => k / 100), words: (v) => v.toFixed(2),
    help: "Discount: what a point is worth one step later. At 0, only the next reward counts." },
  { name: "rate", label: "Learning rate", steps: Array.from({ length: 50 }, (_, k) => (k + 1) / 100), words: (v) => v.toFixed(2), more: true },
  { name: "first", label: "First values", steps: Array.from({ length: 21 }, (_, k) => k), words: String, more: true, restarts: true },
  { name: "regrowth", label: "Food grows back after", steps: [0, 20, 50, 100, 200, 500, 1000], words: (v) => (v ? seconds(v) : "at once"), more: true, restarts: true },
];
const RULE_NAMES = [["paper", "the paper’s"], ["foraging", "foraging"], ["queueing", "foraging and queues"]];
const PART_NAMES = [["directed", "A: scent rises towards food"], ["rightOfWay", "B: ants with food have right of way"],
                    ["seesAnts", "C: ants see each other"]];
const PLACES = { meadow: "the meadow", plain: "the plain", steppe: "the steppe", bridge: "two bridges", paper: "the paper’s", daily: "today’s map" };
const CROWDS = { plain: 1000, steppe: 10000, paper: 16 }; // ants to start with
const LEARNER_NAMES = [["q_learning", "Q-learning"], ["sarsa", "SARSA"], ["frozen", "none: written by hand"]];

/** The index of the step that is nearest to a value. */
const stepOf = (steps, value) => steps.reduce((best, step, k) => (Math.abs(step - value) < Math.abs(steps[best] - value) ? k : best), 0);

const switched = (id, label, help) => `<div class="control" title="${help}"><label><span>${label}</span><input type="checkbox" role="switch" class="switch" id="${id}"></label></div>`;
const selected = (id, label, options, help = "") => `<div class="control" title="${help}"><label><span>${label}</span><select id="${id}">`
  + `${options.map(([value, words]) => `<option value="${value}">${words}</option>`).join("")}</select></label>`;
const slider = ({ name, label, steps, help = "" }) => `<div class="control" title="${help}"><label for="c-${name}"><span>${label}</span><output id="o-${name}"></output></label>`
  + `<input type="range" id="c-${name}" min="0" max="${steps.length - 1}" step="1"></div>`;

export class Controls {
  constructor(lab) {
    this.lab = lab;
    this.build();
    this.markSpeed = this.radios(byId("speeds"), SPEEDS.map((speed) => [speed, speed === 0.5 ? "½×" : `${speed}×`, `Speed ${speed}`]),
                () => lab.ui.speed, (speed) => { lab.ui.speed = speed; });
    this.radios(byId("brushes"), BRUSHES.map(([id, word, label]) => [id, `${icon(id)}<span class="name">${word}</span>`, label]),
                () => lab.ui.brush, (brush) => lab.choose(brush));
    byId("undo").innerHTML = icon("undo");
    byId("undo").addEventListener("click", () => lab.undo());
    byId("play").addEventListener("click", () => lab.play(!lab.ui.playing));
    byId("restart").addEventListener("click", () => lab.restart());
    addEventListener("keydown", (event) => this.key(event));
  }

  build() {
    const rules = selected("rules", "Rules", RULE_NAMES, "Rules: what ants see, who gives way, and where scent points. A change starts the run again.") + '<div class="parts" id="parts" hidden>'
      + `${PART_NAMES.map(([part, words]) => `<label><input type="checkbox" data-part="${part}">${words}</label>`).join("")}</div></div>`;
    const [ants, exploration, ...others] = SLIDERS.filter(({ more }) => !more).map(slider);
    byId("controls").innerHTML = ants + exploration + switched("learns", "Learning", "Learning: while it is off they go on with what they know and learn nothing more") + others.join("") + rules;
    byId("more-controls").innerHTML = SLIDERS.filter(({ more }) => more).map(slider).join("")
      + `${selected("learner", "Learner", LEARNER_NAMES.map(([learner, words]) => [LEARNERS[learner], words]))}</div>`
      + `${selected("reach", "Brush size", ["small", "medium", "large", "huge"].map((size, k) => [k, size]))}</div>`
      + `${selected("place", "World", WORLDS.map(({ name }, k) => [k, PLACES[name]]))}</div>`
      + '<div class="control"><label><span>Seed</span><input type="number" id="seed" min="0" max="4294967295" step="1"></label></div>'
      + `${selected("theme", "Colours", [["dark", "dark"], ["light", "light"]])}</div>`;
    for (const each of SLIDERS) this.listen(each);
    byId("controls").addEventListener("focusin", ({ target }) => { // for fingers and keys, which cannot hover
      const { title } = target.closest(".control");
      if (title) this.lab.toast(title, 5000);
    });
    const on = (id, act) => byId(id).addEventListener("change", ({ target }) => act(target));
    on("learns", ({ checked }) => this.lab.set("learns", Number(checked)));
    on("rules", ({ value }) => this.lab.restart({ rules: RULES[value] }));
    on("parts", ({ dataset }) => this.lab.restart({ rules: this.scene.rules ^ PARTS[dataset.part] }));
    on("learner", ({ value }) => this.lab.restart({ learner: Number(value) }));
    on("reach", ({ value }) => { this.lab.ui.reach = Number(value); });
    on("place", ({ value }) => (WORLDS[value].daily ? beginDaily(this.lab) : this.lab.restart({ world: Number(value), ants: CROWDS[WORLDS[value].name] || 64 })));
    on("seed", ({ value }) => this.lab.restart({ seed: Math.max(0, Math.min(2 ** 32 - 1, Math.floor(value))) }));
    on("theme", ({ value }) => this.lab.setTheme(value));
  }

  /** The scene whose settings the controls change: the right one of two. */
  get scene() { return this.lab.runs[this.lab.runs.length - 1].engine.scene; }

  listen(slider) {
    const { name, steps, restarts } = slider, input = byId(`c-${name}`), value = () => steps[Number(input.value)];
    input.addEventListener("input", () => this.say(slider, value()));
    input.addEventListener("change", () => (restarts ? this.lab.restart({ [name]: value() }) : this.lab.set(name, value())));
  }

  say({ name, words }, value) {
    byId(`o-${name}`).textContent = words(value);
    byId(`c-${name}`).setAttribute("aria-valuetext", words(value));
  }

  /** Show the present settings. */
  show() {
    const { scene } = this, ui = this.lab.ui;
    for (const slider of SLIDERS) {
      byId(`c-${slider.name}`).value = String(stepOf(slider.steps, scene[slider.name]));
      this.say(slider, scene[slider.name]);
    }
    byId("learns").checked = Boolean(scene.learns);
    const foraging = scene.rules && !(scene.rules & PARTS.queues);
    const rules = scene.rules & PARTS.queues ? "queueing" : foraging ? "foraging" : "paper", { world, learner, seed } = scene;
    byId("parts").hidden = !foraging;
    for (const box of /** @type {NodeListOf<HTMLInputElement>} */ (document.querySelectorAll("[data-part]"))) {
      box.checked = Boolean(scene.rules & PARTS[box.dataset.part]);
    }
    const shown = { rules, reach: ui.reach, place: world, learner, seed, theme: ui.theme };
    for (const [id, value] of Object.entries(shown)) byId(id).value = String(value);
  }

  /** Inputs of which one is chosen; return what marks the present one. */
  radios(box, items, now, choose) {
    box.innerHTML = items.map(([id, html, label]) => `<label data-value="${id}" title="${label}"><input type="radio" name="${box.id}" aria-label="${label}">${html}</label>`).join("");
    const inputs = [...box.querySelectorAll("input")];
    const mark = () => inputs.forEach((input, k) => { input.checked = items[k][0] === now(); });
    inputs.forEach((input, k) => input.addEventListener("change", () => choose(items[k][0])));
    mark();
    return mark;
  }

  key(event) {
    if (this.lab.training.dialog.open || event.ctrlKey || event.metaKey || event.altKey || event.target.matches("input:not([type=radio]), select, textarea")) return;
    const brush = { r: "rock", f: "food", t: "scent", e: "erase", l: "look" }[event.key.toLowerCase()];
    if (brush) /** @type {HTMLElement} */ (document.querySelector(`#brushes [data-value="${brush}"] input`)).click();
    if (event.key.toLowerCase() === "z") this.lab.undo();
    if (event.key === " " && !event.target.matches("button, summary, input")) {
      event.preventDefault();
      byId("play").click();
    }
  }
}
