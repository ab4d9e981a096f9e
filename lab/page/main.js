/* main.js: the lab: time, the runs in view, and what the page says about them. */

import { Address } from "./address.js";
import { Brush } from "./brush.js";
import { Controls } from "./controls.js";
import { beginDaily, dailyStory, isDaily, isOver, mayPlace } from "./daily.js";
import { Painter } from "./draw.js";
import { Embed } from "./embed.js";
import { Film } from "./film.js";
import { mindOf } from "./mind.js";
import { byId, bytesOf, icon, openPage } from "./page.js";
import { drawPlot } from "./plot.js";
import { Run, TICKS_A_SECOND } from "./run.js";
import { QUESTIONS, questionStory, settle } from "./scenes.js";
import { many, storyOf } from "./story.js";
import { Training } from "./train.js";
import { SCENE, STEPS } from "./worlds.js";

const MOST_TICKS_MS = 22; // of a frame; ticks that do not fit are dropped
const WORDS_MS = 100;     // between two changes of words
const OVER = "The time is over. Start again to play.";

/** The events of a run without the visitor's last stroke, whose pieces follow each other. */
function withoutLastStroke({ engine: { events, width }, given }) {
  const last = events.findLastIndex((event, k) => k >= given && "path" in event);
  if (last < 0) return events;
  const joins = (piece, next) => piece.path && piece.do === next.do && piece.reach === next.reach
    && STEPS.some(([q, r]) => piece.path[piece.path.length - 1] + q + r * width === next.path[0]);
  let from = last;
  while (from > given && joins(events[from - 1], events[from])) from--;
  return [...events.slice(0, from), ...events.slice(last + 1)];
}

const hasStroke = ({ engine, given }) => engine.events.some((event, k) => k >= given && "path" in event);

class Lab {
  constructor() {
    const calm = matchMedia("(prefers-reduced-motion: reduce)");
    this.module = new WebAssembly.Module(bytesOf("colony.wasm"));
    this.ui = { playing: true, speed: 1, brush: "rock", reach: 1, theme: "dark", pointer: null, down: false, focused: false,
                followed: -1, hero: -1, ghost: null, arrows: "", still: calm.matches, now: 0 };
    calm.addEventListener("change", () => { this.ui.still = calm.matches; });
    const views = /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll(".view"));
    this.sides = [...views].map((view) => {
      const canvas = view.querySelector("canvas");
      return { view, canvas, caption: view.querySelector("figcaption"), painter: new Painter(canvas), run: null };
    });
    this.owed = 0;    // ticks that are due
    this.last = 0;    // ms of the last frame, of the last words, and of the first frame
    this.wordsAt = 0;
    this.firstFrame = 0;
    this.told = "";   // what the story told last
    this.minds = 0;
    byId("questions").innerHTML = "<h2>What do you expect?</h2><p>Six questions, each with its own world. Opening one ends your run.</p>"
      + QUESTIONS.map(({ id, title, ask, sub }) => `<button data-question="${id}" title="${ask} ${sub}">${title}</button>`).join("")
      + '<button data-question="daily" title="Bring home the most food in 2000 ticks with at most ten rocks">Today’s map: ten rocks</button>'
      + '<button id="train" title="Train the paper’s single ants, and compare how fast they learn">One ant, alone: learning curves</button>';
    this.begin();
    this.controls = new Controls(this);
    this.address = new Address(this);
    this.film = new Film(this);
    this.training = new Training(this, bytesOf("ant.wasm"));
    this.brushes = this.sides.map((side) => new Brush(this, side));
    new ResizeObserver(() => { this.fits = false; }).observe(byId("views"));
    byId("questions").addEventListener("click", ({ target }) => {
      if (target.dataset.question) this.address.open(target.dataset.question);
      if (target.dataset.question) scrollTo({ top: 0, behavior: this.ui.still ? "auto" : "smooth" });
    });
    byId("options").addEventListener("click", ({ target }) => { if (target.dataset.say) this.say(Number(target.dataset.say)); });
    byId("learned").addEventListener("click", () => this.showMind(true));
    byId("mind").addEventListener("click", ({ target }) => { if (target.closest(".back")) this.showMind(false); });
    this.play(true);
    this.setTheme(/theme=light/.test(location.search) ? "light" : "dark"); // dark by default: bright scent needs dark ground
    this.address.open();
    new Embed(this);
    requestAnimationFrame((now) => this.frame(now));
  }

  get runs() { return this.sides.filter((side) => side.run).map((side) => side.run); }

  /**
   * Start one run, or two next to each other.
   * @param {{scene: any, events?: any[], label?: string, skip?: number}[]} starts
   */
  begin(starts = [{ scene: SCENE }], question = null) {
    this.question = question;
    this.sides.forEach((side, k) => {
      const start = starts[k];
      side.view.hidden = !start;
      side.run = start ? new Run(this.module, start.scene, start.events) : null;
      if (start && start.skip) side.run.skip(start.skip);
      if (start && question) side.run.watch();
      side.caption.hidden = !start || !start.label;
      side.caption.innerHTML = start && start.label || "";
      const what = starts.length > 1 ? `The ${k ? "right" : "left"} world` : "The world";
      side.canvas.setAttribute("aria-label", `${what}. Arrow keys move the brush, Enter lowers and lifts it. `
        + "R, F, T, E and L choose rock, food, trail, eraser and eye.");
    });
    byId("views").classList.toggle("two", starts.length > 1);
    byId("other").hidden = starts.length < 2;
    byId("figures").classList.toggle("two", starts.length > 1);
    byId("unit").innerHTML = starts.length < 2 ? "food per <br>minute" : "right, per minute";
    Object.assign(this.ui, { followed: -1, hero: -1, ghost: null });
    [this.told, this.owed, this.fits] = ["", 0, false];
    if (!this.controls) return;
    this.controls.show();
    for (const button of byId("questions").children) button.setAttribute("aria-current", String(Boolean(question) && button.dataset.question === question.id));
  }

  /** Ask for a prediction; the runs wait until the visitor has said one. */
  ask(question) {
    this.begin(question.sides, { ...question, said: -1, found: null });
    this.address.show(question.id);
    this.ui.speed = question.speed;
    this.controls.markSpeed();
    this.play(false);
  }

  /** A button below the story was pressed: a prediction, or what comes after the answer. */
  say(k) {
    const { question } = this;
    if (!question) return k === 0 ? beginDaily(this, this.runs[0].scene.seed) : undefined;
    if (question.said < 0) question.said = k;
    else if (k === 0) return this.ask(questionStory(question, this.runs).next);
    else this.home();
    return this.play(true);
  }

  /** The first screen. */
  home() {
    this.begin();
    this.ui.speed = 1;
    this.controls.markSpeed();
    this.address.show("");
  }

  /** Start again, with the present settings and these changes; nothing that was drawn is kept. */
  restart(changes = {}) {
    const last = this.runs.length - 1;
    if (this.question && !Object.keys(changes).length) return this.ask(this.question);
    this.begin(this.runs.map((run, k) => ({
      scene: { ...run.engine.scene, ...(k === last ? changes : {}) }, label: this.sides[k].caption.innerHTML,
    })));
    this.address.save();
    return this.play(true);
  }

  /** A change by the visitor; whatever a replay still holds is dropped. */
  act(event, runs = this.runs) {
    for (const run of runs) {
      run.engine.forget();
      run.apply(event);
    }
    this.address.save();
  }

  /** Change a setting; of two runs, that of the right one. */
  set(name, value) {
    this.act({ do: name, value }, this.runs.slice(-1));
    this.controls.show();
  }

  mayDraw() {
    const [run] = this.runs;
    if (!isDaily(run) || this.ui.brush !== "rock" || mayPlace(run)) return true;
    this.toast(run.tick < 2000 ? "All ten rocks are placed." : OVER);
    return false;
  }

  /** Play the runs again without their last stroke, up to now: as if it had never been drawn. */
  undo() {
    const old = this.runs, captions = this.sides.map((side) => side.caption.innerHTML);
    if (!old.some(hasStroke)) return;
    this.begin(old.map((run, k) => ({ scene: run.engine.first, events: withoutLastStroke(run), label: captions[k] })), this.question);
    this.runs.forEach((run, k) => {
      run.skip(old[k].tick);
      Object.assign(run, { start: old[k].start, earned: old[k].earned, given: old[k].given });
    });
    this.controls.show();
    this.toast("Played again without your last stroke.");
    this.address.save();
  }

  play(on) {
    if (on && this.question && this.question.said < 0) return this.toast("First say what you expect.");
    if (on && isOver(this.runs[0])) return this.toast(OVER);
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
    for (const { painter, run, caption } of this.sides) {
      if (!run) continue;
      painter.fit(run, this.ui.theme);
      caption.style.bottom = `${painter.headroom}px`;
    }
    this.fits = true;
  }

  advance() {
    if (isOver(this.runs[0])) return this.play(false);
    for (const run of this.runs) run.advance();
    return this.question && settle(this.question, this.runs);
  }

  frame(now) {
    requestAnimationFrame((next) => this.frame(next));
    if (this.training.dialog.open) return; // the processor is for the ants that train
    const { ui } = this, passed = Math.min(0.3, (now - this.last) / 1000 || 0);
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
    for (const { painter, run } of this.sides) if (run) painter.frame(ui.speed > 3 ? 1 : this.owed, passed, ui);
    this.firstFrame ||= performance.now(); // ms since the page was opened
    if (this.film.copy) this.film.add();
    if (now - this.wordsAt > WORDS_MS) {
      this.wordsAt = now;
      this.words();
    }
  }

  words() {
    const { ui } = this, runs = this.runs, run = runs[runs.length - 1];
    /** @type {import("./story.js").Story} */
    const told = this.question ? questionStory(this.question, runs) : isDaily(run) ? dailyStory(run) : storyOf(run);
    if (told.id !== this.told) {
      this.told = told.id;
      this.restartAnimation(told);
    }
    if (byId("sub").innerHTML !== told.sub) byId("sub").innerHTML = told.sub;
    byId("call").hidden = !told.call;
    if (byId("call").textContent !== (told.call || "")) byId("call").textContent = told.call || "";
    ui.hero = told.id.startsWith("food") ? run.facts.firstAnt : -1; // who found food first is marked until it is home
    if (told.ghost && !ui.down && !this.film.copy) ui.ghost ||= run.suggestion();
    else ui.ghost = null;
    const rateOf = (one) => (this.question?.said < 0 ? "?" : many(one.perMinute)); // it would give the answer away
    byId("rate").textContent = rateOf(run);
    byId("rate-left").textContent = rateOf(runs[0]);
    byId("undo").disabled = !runs.some(hasStroke);
    byId("tick").textContent = many(run.tick);
    byId("hash").textContent = run.engine.hash();
    drawPlot(byId("plot"), runs);
    if (!byId("mind").hidden && this.minds++ % 3 === 0) byId("table").innerHTML = mindOf(run, ui);
  }

  /** Show a new headline. @param {import("./story.js").Story} told */
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
    this.controls.radios(byId("arrows"), [["", "No arrows", "No arrows"], ["empty", "Searching", "Arrows of ants without food"],
                                          ["loaded", "Carrying", "Arrows of ants with food"]],
                         () => this.ui.arrows, (arrows) => { this.ui.arrows = arrows; });
    byId("table").innerHTML = mindOf(this.runs[this.runs.length - 1], this.ui);
    byId("mind").querySelector("button").focus();
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

openPage("lab", Lab);
