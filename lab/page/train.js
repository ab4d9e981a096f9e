/* train.js: lone ants of the paper's grid, trained in the page: learning curves, and the whole grid. */

import { GRID, LoneAnts } from "./engine.js";
import { pictureOf, plotOf, tableOf } from "./figures.js";
import { byId } from "./page.js";
import { many } from "./story.js";

const SEEDS = 100, EPISODES = 500, LAST = 100; // the paper's; a quarter of the seeds is a whole number; results are means over the last episodes
const SMOOTH = 10; // episodes that a point of a curve covers
const NAMES = { q_learning: "Q-learning", sarsa: "SARSA", dyna_q: "Dyna-Q" };
const nameOf = ({ learner, planningSteps }) => NAMES[learner] + (planningSteps ? `, ${planningSteps} planning steps` : "");
const CHOICES = [["learner", "Learner"], ["truncates", "A delivery"], ["rate", "Learning rate"], ["discount", "Discount"],
                 ["epsilon", "Exploration"], ["decay", "Its decay"]];
const WORDS = { learner: nameOf, truncates: ({ truncates }) => (truncates ? "truncates" : "terminates") };
const wordingOf = (name, setting) => (WORDS[name] ? WORDS[name](setting) : String(setting[name]));

/* What a worker runs: the engine's class as text, so that the page needs no other file. */
const WORKER = `${LoneAnts}
let ants;
onmessage = ({ data }) => {
  if (data.bytes) { ants = new LoneAnts(new WebAssembly.Module(data.bytes)); return; }
  postMessage({ job: data.job, ...ants.train(data.setting) });
};`;

const mean = (values) => values.reduce((a, b) => a + b, 0) / values.length;

/** The mean of the middle half. */
const interquartileMean = (values) => mean([...values].sort((a, b) => a - b).slice(SEEDS / 4, 3 * SEEDS / 4));

/** For each run, its mean over some episodes: by default, the last ones. */
const meansOf = (values, from = EPISODES - LAST, n = LAST) => Array.from({ length: SEEDS }, (_, k) => mean(values.subarray(k * EPISODES + from, k * EPISODES + from + n)));

/** A curve: means over seeds, and half the widths of their 95 % intervals. @returns {[number[], number[]]} */
function curveOf(returns) {
  const points = Array.from({ length: EPISODES / SMOOTH }, (_, point) => meansOf(returns, point * SMOOTH, SMOOTH));
  const halfOf = (values) => 1.96 * Math.sqrt(mean(values.map((v) => (v - mean(values)) ** 2)) / (SEEDS - 1));
  return [points.map(mean), points.map(halfOf)];
}

export class Training {
  /** @param {any} lab  @param {Uint8Array} bytes ant.wasm */
  constructor(lab, bytes) {
    this.lab = lab;
    this.bytes = bytes;
    this.dialog = byId("training");
    byId("train").addEventListener("click", () => this.open());
    this.dialog.addEventListener("click", ({ target }) => { if (target === this.dialog) this.dialog.close(); });
    this.dialog.addEventListener("close", () => this.stop());
  }

  open() {
    const options = ([name, label]) => {
      const words = [...new Set(GRID.map((setting) => wordingOf(name, setting)))];
      return `<label><span>${label}</span><select id="t-${name}">${words.map((word) => `<option>${word}</option>`).join("")}</select></label>`;
    };
    this.dialog.innerHTML = `<button class="close" aria-label="Close">×</button><h2 tabindex="-1" autofocus>One ant, alone</h2>
      <p>The paper trains single ants: ${EPISODES} episodes in a small world, from nothing. Choose a setting, and train ${SEEDS} ants with it; they differ only in their seed. A delivery ends the episode: if it terminates, nothing is worth more after it; if it truncates, ants learn as if it went on.</p>
      <div class="choices">${CHOICES.map(options).join("")}</div>
      <p class="acts"><button id="t-one">Train ${SEEDS} ants</button><button id="t-grid">Train the whole grid: ${many(GRID.length * SEEDS)} ants</button></p>
      <progress id="t-bar" max="1" value="0" hidden aria-label="Trained so far"></progress>
      <div id="t-plot"></div><div id="t-results" aria-live="polite"></div>`;
    byId("t-one").addEventListener("click", () => this.one());
    byId("t-grid").addEventListener("click", () => this.grid());
    this.dialog.querySelector(".close").addEventListener("click", () => this.dialog.close());
    this.dialog.showModal(); // the world waits, see main.js
    this.curves = [];
  }

  stop() {
    for (const worker of this.workers || []) worker.terminate();
    this.workers = null;
  }

  /** Train settings in workers; `done` gets each result as it comes. @returns {Promise<void>} */
  train(settings, done) {
    this.stop();
    const url = URL.createObjectURL(new Blob([WORKER], { type: "text/javascript" }));
    const count = Math.min(settings.length, navigator.hardwareConcurrency || 1);
    this.workers = Array.from({ length: count }, () => new Worker(url));
    let next = 0, left = settings.length;
    const seeds = Array.from({ length: SEEDS }, (_, k) => k);
    return new Promise((resolve, reject) => {
      const give = (worker) => { if (next < settings.length) worker.postMessage({ job: next, setting: { ...settings[next++], seeds } }); };
      for (const worker of this.workers) {
        worker.addEventListener("error", (event) => reject(new Error(event.message)));
        worker.addEventListener("message", ({ data }) => {
          done(data, settings[data.job]);
          give(worker);
          if (--left) return;
          this.stop();
          URL.revokeObjectURL(url);
          resolve();
        });
        worker.postMessage({ bytes: this.bytes });
        give(worker);
      }
    });
  }

  chosen() {
    const wanted = Object.fromEntries(CHOICES.map(([name]) => [name, byId(`t-${name}`).value]));
    return GRID.find((setting) => CHOICES.every(([name]) => wordingOf(name, setting) === wanted[name]));
  }

  async one() {
    const began = performance.now(), setting = this.chosen();
    await this.train([setting], ({ returns, steps, deliveries }) => {
      const [home, points] = [meansOf(deliveries), meansOf(returns)];
      this.curves = [[CHOICES.map(([name]) => wordingOf(name, setting)).join(" · "), ...curveOf(returns)], ...this.curves.slice(0, 2)];
      byId("t-plot").innerHTML = plotOf(this.curves, `Return of an episode, from the first to episode ${EPISODES}: mean of ${SEEDS} ants with its 95 % interval`);
      byId("t-results").innerHTML = `<p>${SEEDS} ants, ${many(steps.reduce((a, b) => a + b, 0))} steps, ${((performance.now() - began) / 1000).toFixed(1)} s. `
        + `In the last ${LAST} episodes: return <b>${mean(points).toFixed(1)}</b> (mean), <b>${interquartileMean(points).toFixed(1)}</b> (IQM, the middle half of the ants); `
        + `deliveries per episode <b>${mean(home).toFixed(2)}</b> and <b>${interquartileMean(home).toFixed(2)}</b>.</p>`;
    });
  }

  /** The paper's 128 settings with 100 seeds each: a dot for the IQM of each, and the best five. */
  async grid() {
    const bar = byId("t-bar"), began = performance.now(), rows = [];
    bar.hidden = false;
    byId("t-results").textContent = "";
    await this.train(GRID, ({ returns, deliveries }, setting) => {
      const [points, home] = [meansOf(returns), meansOf(deliveries)];
      rows.push({ setting, mean: mean(points), iqm: interquartileMean(points), home: interquartileMean(home) });
      bar.value = rows.length / GRID.length;
      this.drawGrid(rows);
    });
    bar.hidden = true;
    this.rows = rows;
    const best = [...rows].sort((a, b) => b.iqm - a.iqm).slice(0, 5);
    byId("t-results").innerHTML = `<p>${many(GRID.length * SEEDS)} ants in ${((performance.now() - began) / 1000).toFixed(1)} s. The five settings with the highest IQM of the return:</p>`
      + tableOf([...CHOICES.map(([, label]) => label), "Mean", "IQM", "Deliveries (IQM)"],
                best.map((row) => [...CHOICES.map(([name]) => wordingOf(name, row.setting)), row.mean.toFixed(1), row.iqm.toFixed(1), row.home.toFixed(2)]));
  }

  /** For each learner, a dot for the IQM of each setting. */
  drawGrid(rows) {
    const names = [...new Set(GRID.map(nameOf))], all = rows.map((row) => row.iqm), low = Math.floor(Math.min(...all)), high = Math.ceil(Math.max(...all));
    const x = (value) => (10 + 740 * (value - low) / (high - low || 1)).toFixed(1), text = (words, at, y, anchor = "start") => `<text x="${at}" y="${y}" text-anchor="${anchor}">${words}</text>`;
    const dots = rows.map(({ setting, iqm }) => `<circle cx="${x(iqm)}" cy="${52 * names.indexOf(nameOf(setting)) + (setting.truncates ? 25 : 38)}" r="4.5" fill="var(--accent)" opacity=".6"/>`);
    const words = [...names.map((name, k) => text(name, 0, 52 * k + 13)), text(String(low), 4, 226), text(`${high}: return of an episode (IQM)`, 756, 226, "end")];
    byId("t-plot").innerHTML = `<div class="plot">${pictureOf([...dots, ...words], 760, 230, "Return of an episode by learner")}<p>A dot is a setting. In the upper row of a learner, deliveries truncate.</p></div>`;
  }
}
