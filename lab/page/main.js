/* main.js: the lab: time, the runs in view, and what the page says about them. */

import { Brush } from "./brush.js";
import { byId, Controls, icon } from "./controls.js";
import { Painter } from "./draw.js";
import { mindOf } from "./mind.js";
import { Plot } from "./plot.js";
import { Run, TICKS_A_SECOND } from "./run.js";
import { many, storyOf } from "./story.js";
import { SCENE } from "./worlds.js";

/* global COLONY_WASM */
const bytesOf = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
const MOST_TICKS_MS = 22; // of a frame; ticks that do not fit are dropped
const WORDS_MS = 100;     // between two changes of words

class Lab {
  constructor() {
    const calm = matchMedia("(prefers-reduced-motion: reduce)");
    this.module = new WebAssembly.Module(bytesOf(COLONY_WASM));
    this.ui = { playing: true, speed: 1, brush: "rock", reach: 1, theme: "dark", pointer: null, down: false, focused: false,
                followed: -1, hero: -1, ghost: null, arrows: "", still: calm.matches, now: 0 };
    calm.addEventListener("change", () => { this.ui.still = calm.matches; });
    this.sides = [...document.querySelectorAll(".view")].map((view) => {
      const canvas = view.querySelector("canvas");
      return { view, canvas, caption: view.querySelector("figcaption"), painter: new Painter(canvas), run: null };
    });
    this.plot = new Plot(byId("plot"));
    this.frames = []; // [ms at which a frame began, ms of drawing]
    [this.owed, this.last, this.told, this.wordsAt, this.minds] = [0, 0, "", 0, 0];
    this.begin([{ scene: SCENE }]);
    this.controls = new Controls(this);
    this.brushes = this.sides.map((side) => new Brush(this, side));
    new ResizeObserver(() => { this.fits = false; }).observe(byId("views"));
    byId("learned").addEventListener("click", () => this.showMind(true));
    byId("mind").addEventListener("click", (event) => this.mindClick(event));
  }

  get runs() { return this.sides.filter((side) => side.run).map((side) => side.run); }

  /** Start one run, or two next to each other. @param {{scene: any, events?: any[], label?: string}[]} starts */
  begin(starts) {
    this.sides.forEach((side, k) => {
      const start = starts[k];
      side.view.hidden = !start;
      side.run = start ? new Run(this.module, start.scene, start.events) : null;
      side.caption.hidden = !start || !start.label;
      side.caption.innerHTML = start && start.label || "";
      const what = starts.length > 1 ? `The ${k ? "right" : "left"} world` : "The world";
      side.canvas.setAttribute("aria-label", `${what}. Arrow keys move the brush, Enter lowers and lifts it. `
        + "R, F, T, E and L choose rock, food, trail, eraser and eye.");
    });
    byId("views").classList.toggle("two", starts.length > 1);
    byId("other").hidden = starts.length < 2;
    Object.assign(this.ui, { followed: -1, hero: -1, ghost: null });
    this.plot.reset();
    [this.told, this.owed, this.fits] = ["", 0, false];
    if (this.controls) this.controls.show();
  }

  /** Start again, with the present settings and these changes; nothing that was drawn is kept. */
  restart(changes = {}) {
    const last = this.runs.length - 1;
    this.begin(this.runs.map((run, k) => ({
      scene: { ...run.engine.scene, ...(k === last ? changes : {}) }, label: this.sides[k].caption.innerHTML,
    })));
    this.play(true);
  }

  /** A change by the visitor; whatever a replay still holds is dropped. */
  act(event) {
    for (const run of this.runs) {
      run.engine.forget();
      run.apply({ ...event });
    }
    byId("undo").disabled = false;
  }

  /** Change a setting; of two runs, that of the right one. */
  set(name, value) {
    const run = this.runs[this.runs.length - 1];
    run.engine.forget();
    run.apply({ do: name, value });
    this.controls.show();
  }

  mayDraw() { return true; }

  undo() {}

  play(on) {
    this.ui.playing = on;
    byId("play").innerHTML = icon(on ? "pause" : "play");
    byId("play").setAttribute("aria-label", on ? "Pause" : "Play");
  }

  choose(brush) {
    this.ui.brush = brush;
    for (const { canvas } of this.sides) canvas.style.cursor = brush === "look" ? "pointer" : "crosshair";
  }

  setTheme(theme) {
    this.ui.theme = theme;
    document.documentElement.dataset.theme = theme;
    this.fits = false;
    this.controls.show();
  }

  fit() {
    for (const { painter, run } of this.sides) if (run) painter.fit(run, this.ui.theme);
    const style = getComputedStyle(document.documentElement);
    this.colours = Object.fromEntries(["text", "soft", "line", "accent"].map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
    this.fits = true;
  }

  advance() {
    for (const run of this.runs) {
      run.advance();
      this.note(run);
    }
  }

  /** Mark in the plot what happened in this tick. */
  note(run) {
    if (run !== this.runs[this.runs.length - 1]) return;
    const { facts, wall, tick } = run;
    if (facts.lanes === tick) this.plot.mark(tick, "lanes");
    if (wall && wall.tick === tick - 1) this.plot.mark(wall.tick, "wall");
    if (wall && wall.detour === tick) this.plot.mark(tick, "detour");
  }

  frame(now) {
    requestAnimationFrame((next) => this.frame(next));
    const { ui } = this, passed = Math.min(0.1, (now - this.last) / 1000 || 0);
    [this.last, ui.now] = [now, now];
    if (!this.fits) this.fit();
    for (const brush of this.brushes) brush.flush();
    if (ui.playing) {
      this.owed += passed * TICKS_A_SECOND * ui.speed;
      for (const until = performance.now() + MOST_TICKS_MS; this.owed >= 1; this.owed--) {
        this.advance();
        if (performance.now() > until) this.owed = 1;
      }
    }
    const began = performance.now();
    for (const { painter, run } of this.sides) if (run) painter.frame(ui.speed > 3 ? 1 : this.owed, passed, ui);
    this.firstFrame ||= performance.now(); // ms since the page was opened
    this.frames.push([now, performance.now() - began]);
    if (this.frames.length > 120) this.frames.shift();
    if (now - this.wordsAt > WORDS_MS) {
      this.wordsAt = now;
      this.words();
    }
  }

  words() {
    const { ui } = this, runs = this.runs, run = runs[runs.length - 1], told = storyOf(run);
    if (told.id !== this.told) {
      this.told = told.id;
      this.restartAnimation(told);
    }
    if (byId("sub").innerHTML !== told.sub) byId("sub").innerHTML = told.sub;
    byId("call").hidden = !told.call;
    if (byId("call").textContent !== (told.call || "")) byId("call").textContent = told.call || "";
    ui.hero = told.id === "food" ? run.facts.firstAnt : -1; // who found food first is marked until it is home
    if (told.ghost && !ui.down) ui.ghost ||= run.suggestion();
    else ui.ghost = null;
    byId("rate").textContent = many(run.perMinute);
    if (runs.length > 1) byId("rate-left").textContent = many(runs[0].perMinute);
    byId("tick").textContent = many(run.tick);
    byId("hash").textContent = run.engine.hash();
    this.plot.draw(runs, this.colours);
    if (!byId("mind").hidden && this.minds++ % 3 === 0) byId("table").innerHTML = mindOf(run, ui);
  }

  restartAnimation({ head, options, ghost }) {
    const story = byId("headline").closest(".story");
    story.classList.remove("new");
    void /** @type {HTMLElement} */ (story).offsetWidth; // so that the animation starts again
    story.classList.add("new");
    byId("headline").textContent = head;
    byId("headline").className = head.length > 42 ? "long" : "";
    byId("options").hidden = !options;
    byId("options").innerHTML = (options || []).map((text, k) => `<button data-say="${k}">${text}</button>`).join("");
    document.querySelector('#brushes [data-value="rock"]').classList.toggle("called", Boolean(ghost) && this.ui.brush !== "rock");
  }

  /** Show what the ants have learned in place of the settings. */
  showMind(open) {
    byId("mind").hidden = !open;
    byId("settings").hidden = open;
    byId("learned").setAttribute("aria-expanded", String(open));
    if (!open) {
      Object.assign(this.ui, { arrows: "", followed: -1 });
      return byId("learned").focus();
    }
    byId("mind").innerHTML = '<button class="back">← Settings</button><h2>What they learned</h2>'
      + '<div class="group" role="radiogroup" aria-label="Arrows of the best actions" id="arrows"></div><div class="mind" id="table"></div>';
    this.controls.radios(byId("arrows"), [["", "No arrows", "No arrows"], ["empty", "Without food", "Arrows of ants without food"],
                                          ["loaded", "With food", "Arrows of ants with food"]],
                         () => this.ui.arrows, (arrows) => { this.ui.arrows = arrows; });
    byId("table").innerHTML = mindOf(this.runs[this.runs.length - 1], this.ui);
    byId("mind").querySelector("button").focus();
  }

  mindClick({ target }) {
    if (target.closest(".back")) this.showMind(false);
  }

  follow(ant) {
    this.ui.followed = ant;
    if (ant >= 0 && byId("mind").hidden) this.showMind(true);
  }

  /** Say something for a few seconds. */
  toast(text, ms = 3500) {
    byId("toast").textContent = text;
    byId("toast").classList.add("on");
    clearTimeout(this.toasting);
    this.toasting = setTimeout(() => byId("toast").classList.remove("on"), ms);
  }
}

const lab = new Lab();
lab.play(true);
lab.setTheme(/theme=light/.test(location.search) ? "light" : "dark"); // light scent needs dark ground
Object.assign(window, { lab });
requestAnimationFrame((now) => lab.frame(now));
