/* world.js: worlds in a text. They run only while they are in view; each shows what was measured for each choice. */

import { Painter } from "../page/draw.js";
import { encode } from "../page/link.js";
import { byId, bytesOf, icon } from "../page/page.js";
import { Run, TICKS_A_SECOND } from "../page/run.js";
import { many } from "../page/story.js";
import { countOf, factOf, measured, PIECES, startOf } from "./pieces.js";

const IN_VIEW = 0.3;       // of a world, from which it runs
const MOST_TICKS_MS = 12;  // of a frame, for each world
const FACT_MS = 100;       // between two numbers
const SEEDS = 20;
const shown = (number) => (number < 20 && number % 1 ? number.toFixed(1) : many(number));

class World {
  constructor(figure, article) {
    this.article = article;
    this.id = figure.dataset.piece;
    this.piece = PIECES[this.id];
    this.figure = figure;
    this.results = this.piece.options.map(() => /** @type {number | null} */ (null)); // what was measured for each option
    this.many = this.piece.options.map(() => /** @type {number[]} */ ([]));           // the same with other seeds
    this.option = this.piece.from;
    this.playing = !article.ui.still;
    this.inView = false;
    this.owed = 0;
    figure.insertAdjacentHTML("beforeend", this.markup());
    this.canvas = figure.querySelector("canvas");
    this.rows = [...figure.querySelectorAll(".option")];
    figure.querySelector(".options").addEventListener("change", ({ target }) => this.choose(Number(target.value)));
    figure.querySelector(".play").addEventListener("click", () => this.play(!this.playing));
    figure.querySelector(".again").addEventListener("click", () => this.choose(this.option));
    figure.querySelector(".seeds").addEventListener("click", () => this.compare());
    this.play(this.playing);
  }

  markup() {
    const { ask, options, unit } = this.piece, { id } = this;
    const rows = options.map(([, name], k) => `<label class="option"><input type="radio" name="${id}" value="${k}"${k === this.option ? " checked" : ""}>`
      + `<span class="name">${name}</span><output>–</output><span class="bar"><i></i><b></b></span></label>`);
    return `<div class="view"><canvas role="img" aria-label="A world of ants: ${ask}"></canvas><div class="buttons"><button class="play"></button>`
      + `<button class="again" aria-label="Start again" title="Start again">${icon("again")}</button></div></div>`
      + `<div class="side"><fieldset class="options"><legend>${ask}</legend>${rows.join("")}</fieldset><p class="unit">${unit}</p>`
      + `<button class="seeds">Was it luck? Run ${SEEDS} seeds</button><a class="open" href="lab.html">Open in the lab</a></div>`;
  }

  /** Show an option, from its start. */
  choose(option) {
    const { piece } = this, [value, name] = piece.options[option], { scene, events, skip } = startOf(piece, value);
    this.option = option;
    const run = this.run = new Run(this.article.module, scene, events);
    run.skip(skip);
    this.begun = countOf(run.engine);
    this.end = skip + piece.ticks;
    this.owed = 0;
    this.results[option] = null;
    this.canvas.setAttribute("aria-label", `A world of ants. ${piece.ask}: ${name}.`);
    this.code = encode(run.engine.first, run.engine.events) + (skip ? `;${skip}` : "");
    this.fit();
    this.tell();
    this.article.wake();
  }

  play(on) {
    this.playing = on;
    const button = this.figure.querySelector(".play");
    button.innerHTML = icon(on ? "pause" : "play");
    button.setAttribute("aria-label", on ? "Pause" : "Play");
    this.article.wake();
  }

  /** Come into view, or leave it; pictures of worlds out of view take no memory. */
  view(inView) {
    if (inView === this.inView) return;
    this.inView = inView;
    if (inView && !this.run) this.choose(this.option);
    else if (inView) this.fit();
    else this.painter = null;
    if (inView) this.article.last = this;
    this.article.wake();
  }

  fit() {
    if (!this.inView) return;
    this.painter = new Painter(this.canvas);
    this.painter.fit(this.run, this.article.theme);
    this.draw(1); // a second: scent that eases in would not be seen while the world waits
    this.figure.querySelector(".open").href = `lab.html${this.article.theme === "light" ? "?theme=light" : ""}#${this.code}`;
  }

  draw(passed) {
    const { piece, painter } = this, ui = { ...this.article.ui, followed: piece.followed ?? -1 };
    painter.frame(piece.speed > 3 ? 1 : this.owed, passed, ui);
  }

  advance() {
    const { run, option } = this;
    run.advance();
    if (run.tick === this.end) this.results[option] = factOf(this.piece, run.engine, this.begun);
  }

  frame(passed, now) {
    this.owed += passed * TICKS_A_SECOND * this.piece.speed;
    for (const until = performance.now() + MOST_TICKS_MS; this.owed >= 1; this.owed--) {
      this.advance();
      if (performance.now() > until) this.owed = 1;
    }
    this.draw(passed);
    if (now - (this.told || 0) < FACT_MS) return;
    this.told = now;
    this.tell();
  }

  /** Show the numbers: of the present run until now, and of those that have ended. */
  tell() {
    const { piece, results, run } = this, live = results[this.option] ?? factOf(piece, run.engine, this.begun);
    const numbers = results.map((result, k) => (k === this.option ? live : result));
    const most = Math.max(1e-9, ...numbers.map((number) => number || 0), ...this.many.flat());
    if (piece.points && results[this.option] === null)
      this.figure.querySelector(".unit").textContent = `${piece.unit}; ${many(run.engine.returns - this.begun.returns)} points earned`;
    this.rows.forEach((row, k) => {
      const seeds = [...this.many[k]].sort((a, b) => a - b), at = (share) => seeds[Math.round(share * (seeds.length - 1))];
      const range = seeds.length === SEEDS, [bar, band] = row.querySelectorAll(".bar > *");
      row.classList.toggle("running", k === this.option && results[k] === null);
      const middle = range ? ` <small>median ${shown((seeds[SEEDS / 2 - 1] + seeds[SEEDS / 2]) / 2)}</small>` : "";
      row.querySelector("output").innerHTML = (numbers[k] === null ? "–" : shown(numbers[k])) + middle;
      bar.style.width = `${100 * (numbers[k] || 0) / most}%`;
      band.hidden = !range;
      if (range) [band.style.left, band.style.width] = [`${100 * at(0.25) / most}%`, `${100 * (at(0.75) - at(0.25)) / most}%`];
    });
  }

  /** Run every option with seeds 1 to 20, in pieces, so that the page can be scrolled. */
  async compare() {
    const { piece } = this, button = this.figure.querySelector(".seeds");
    button.disabled = true;
    this.many = piece.options.map(() => []);
    for (let seed = 1; seed <= SEEDS; seed++) {
      button.textContent = `Seed ${seed} of ${SEEDS} …`;
      for (const [k, [value]] of piece.options.entries()) {
        await new Promise((done) => { setTimeout(done); });
        this.many[k].push(measured(this.article.module, piece, value, seed));
      }
    }
    button.textContent = `Medians of ${SEEDS} seeds; the band holds half of them`;
    if (!this.run) this.choose(this.option);
    this.tell();
  }
}

/** The worlds of a text, of which those in view run. */
export class Stage {
  constructor() {
    this.module = new WebAssembly.Module(bytesOf("colony.wasm"));
    this.theme = /theme=light/.test(location.search) ? "light" : "dark";
    this.ui = { arrows: "", still: matchMedia("(prefers-reduced-motion: reduce)").matches, now: 0, hero: -1, ghost: null, pointer: null };
    this.sleeping = true;
    this.worlds = [...document.querySelectorAll("[data-piece]")].map((figure) => new World(figure, this));
    this.last = null; // the world that came into view last
    byId("theme").addEventListener("click", () => this.setTheme(this.theme === "dark" ? "light" : "dark"));
    this.setTheme(this.theme);
    const sight = new IntersectionObserver((entries) => entries.forEach(({ target, intersectionRatio }) =>
      this.worlds.find(({ canvas }) => canvas === target).view(intersectionRatio >= IN_VIEW)), { threshold: [0, IN_VIEW] });
    const sizes = new ResizeObserver((entries) => entries.forEach(({ target }) => this.worlds.find(({ canvas }) => canvas === target).fit()));
    for (const { canvas } of this.worlds) [sight, sizes].forEach((observer) => observer.observe(canvas));
    document.fonts.ready.then(() => this.wake());
  }

  setTheme(theme) {
    this.theme = theme;
    document.documentElement.dataset.theme = theme;
    byId("theme").textContent = theme === "dark" ? "Light page" : "Dark page";
    for (const world of this.worlds) world.fit();
  }

  get running() { return this.worlds.filter((world) => world.inView && world.playing && world.run); }

  /** Ask for frames; they end when no world that is in view plays. */
  wake() {
    if (!this.sleeping || !this.worlds) return;
    this.sleeping = false;
    requestAnimationFrame((now) => this.frame(now, now));
  }

  frame(now, before) {
    this.ui.now = now;
    const running = this.running;
    for (const world of running) world.frame(Math.min(0.2, (now - before) / 1000), now);
    this.sleeping = !running.length;
    if (running.length) requestAnimationFrame((next) => this.frame(next, now));
  }
}
