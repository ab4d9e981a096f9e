/* train.js: lone ants of the paper's grid, trained in the page: learning curves, and the whole grid. */

import { byId } from "./controls.js";
import { GRID, LoneAnts } from "./engine.js";
import { many } from "./story.js";

const SEEDS = 100, EPISODES = 500, LAST = 100; // the paper's; results are means over the last episodes
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

/** The mean of the middle half; a quarter of the values is left out at each end. */
export function interquartileMean(values) {
  const sorted = [...values].sort((a, b) => a - b), cut = sorted.length / 4, whole = Math.floor(cut);
  let sum = 0, weight = 0;
  sorted.forEach((value, k) => {
    const inside = Math.max(0, Math.min(k + 1, sorted.length - cut) - Math.max(k, cut));
    sum += inside * value;
    weight += inside;
  });
  return weight ? sum / weight : sorted[whole];
}

/** For each run, its mean over the last episodes. */
const lastOf = (values, seeds) => Array.from({ length: seeds }, (_, k) => mean(values.subarray((k + 1) * EPISODES - LAST, (k + 1) * EPISODES)));

/** Points of a curve: episode, mean over seeds, and half the width of its 95 % interval. */
function curveOf(returns, seeds) {
  return Array.from({ length: EPISODES / SMOOTH }, (_, point) => {
    const each = Array.from({ length: seeds }, (__, k) => mean(returns.subarray(k * EPISODES + point * SMOOTH, k * EPISODES + (point + 1) * SMOOTH)));
    const middle = mean(each), deviation = Math.sqrt(each.reduce((sum, v) => sum + (v - middle) ** 2, 0) / (seeds - 1));
    return { episode: (point + 0.5) * SMOOTH, mean: middle, half: 1.96 * deviation / Math.sqrt(seeds) };
  });
}

export class Training {
  /** @param {any} lab  @param {Uint8Array} bytes ant.wasm */
  constructor(lab, bytes) {
    this.lab = lab;
    this.bytes = bytes;
    this.dialog = byId("training");
    this.curves = [];
    byId("train").addEventListener("click", () => this.open());
    this.dialog.addEventListener("click", ({ target }) => { if (target === this.dialog) this.dialog.close(); });
    this.dialog.addEventListener("close", () => this.stop());
  }

  open() {
    const options = ([name, label]) => {
      const words = [...new Set(GRID.map((setting) => wordingOf(name, setting)))];
      return `<label><span>${label}</span><select id="t-${name}">${words.map((word) => `<option>${word}</option>`).join("")}</select></label>`;
    };
    this.dialog.innerHTML = `<button class="close" aria-label="Close">×</button><h2>One ant, alone</h2>
      <p>The paper trains single ants: ${EPISODES} episodes in a small world, from nothing. Choose a setting, and train ${SEEDS} ants with it; they differ only in their seed. A delivery ends the episode: if it terminates, nothing is worth more after it; if it truncates, ants learn as if it went on.</p>
      <div class="choices">${CHOICES.map(options).join("")}</div>
      <p class="acts"><button id="t-one">Train ${SEEDS} ants</button><button id="t-grid">Train the whole grid: ${many(GRID.length * SEEDS)} ants</button></p>
      <progress id="t-bar" max="1" value="0" hidden aria-label="Trained so far"></progress>
      <canvas id="t-plot" role="img" aria-label="Return of an episode, mean over seeds with its 95 % interval"></canvas><div id="t-results" aria-live="polite"></div>`;
    byId("t-one").addEventListener("click", () => this.one());
    byId("t-grid").addEventListener("click", () => this.grid());
    this.dialog.querySelector(".close").addEventListener("click", () => this.dialog.close());
    this.dialog.showModal();
    this.lab.play(false);
    this.curves = [];
    this.draw();
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
      const [home, points] = [lastOf(deliveries, SEEDS), lastOf(returns, SEEDS)];
      this.curves = [...this.curves.slice(-2), { setting, points: curveOf(returns, SEEDS) }];
      byId("t-results").innerHTML = `<p>${SEEDS} ants, ${many(steps.reduce((a, b) => a + b, 0))} steps, ${((performance.now() - began) / 1000).toFixed(1)} s. `
        + `In the last ${LAST} episodes: return <b>${mean(points).toFixed(1)}</b> (mean), <b>${interquartileMean(points).toFixed(1)}</b> (IQM, the middle half of the ants); `
        + `deliveries per episode <b>${mean(home).toFixed(2)}</b> and <b>${interquartileMean(home).toFixed(2)}</b>.</p>`;
    });
    this.draw();
  }

  /** The paper's 128 settings with 100 seeds each: a dot for the IQM of each, and the best five. */
  async grid() {
    const bar = byId("t-bar"), began = performance.now(), rows = [];
    bar.hidden = false;
    byId("t-results").textContent = "";
    await this.train(GRID, ({ returns, deliveries }, setting) => {
      const [points, home] = [lastOf(returns, SEEDS), lastOf(deliveries, SEEDS)];
      rows.push({ setting, mean: mean(points), iqm: interquartileMean(points), home: interquartileMean(home) });
      bar.value = rows.length / GRID.length;
      this.drawGrid(rows);
    });
    bar.hidden = true;
    this.rows = rows;
    const best = [...rows].sort((a, b) => b.iqm - a.iqm).slice(0, 5);
    byId("t-results").innerHTML = `<p>${many(GRID.length * SEEDS)} ants in ${((performance.now() - began) / 1000).toFixed(1)} s. The five settings with the highest IQM of the return:</p>`
      + `<table><thead><tr>${CHOICES.map(([, label]) => `<th>${label}</th>`).join("")}<th>Mean</th><th>IQM</th><th>Deliveries (IQM)</th></tr></thead><tbody>`
      + best.map((row) => `<tr>${CHOICES.map(([name]) => `<td>${wordingOf(name, row.setting)}</td>`).join("")}<td>${row.mean.toFixed(1)}</td><td>${row.iqm.toFixed(1)}</td><td>${row.home.toFixed(2)}</td></tr>`).join("")
      + "</tbody></table>";
  }

  /** A clean canvas, its size in CSS pixels, and colours. */
  surface() {
    const canvas = byId("t-plot"), dpr = Math.min(2, devicePixelRatio || 1), [w, h] = [canvas.clientWidth, canvas.clientHeight];
    [canvas.width, canvas.height] = [w * dpr, h * dpr];
    const x = canvas.getContext("2d");
    x.scale(dpr, dpr);
    x.font = "11.5px Inter, system-ui, sans-serif";
    return { x, w, h, colours: this.lab.colours };
  }

  draw() {
    const { x, w, h, colours } = this.surface(), all = this.curves.flatMap(({ points }) => points);
    const low = Math.min(0, ...all.map((p) => p.mean - p.half)), high = Math.max(10, ...all.map((p) => p.mean + p.half));
    const px = (episode) => 34 + episode / EPISODES * (w - 40), py = (v) => h - 20 - (v - low) / (high - low) * (h - 34);
    [x.fillStyle, x.strokeStyle, x.textAlign] = [colours.soft, colours.line, "right"];
    for (const v of [low, 0, high]) {
      x.fillText(v.toFixed(0), 28, py(v) + 4);
      x.beginPath();
      x.moveTo(34, py(v));
      x.lineTo(w, py(v));
      x.stroke();
    }
    x.fillText(`episode ${EPISODES}`, w - 4, h - 5);
    this.curves.forEach(({ setting, points }, k) => {
      const colour = k === this.curves.length - 1 ? colours.accent : colours.soft;
      [x.fillStyle, x.strokeStyle, x.lineWidth] = [colour, colour, 2];
      x.beginPath();
      points.forEach((p, j) => x[j ? "lineTo" : "moveTo"](px(p.episode), py(p.mean + p.half)));
      for (const p of [...points].reverse()) x.lineTo(px(p.episode), py(p.mean - p.half));
      x.globalAlpha = 0.22;
      x.fill();
      x.globalAlpha = 1;
      x.beginPath();
      points.forEach((p, j) => x[j ? "lineTo" : "moveTo"](px(p.episode), py(p.mean)));
      x.setLineDash(k === this.curves.length - 1 ? [] : [5, 4]);
      x.stroke();
      x.setLineDash([]);
      x.textAlign = "right";
      x.fillText(CHOICES.map(([name]) => wordingOf(name, setting)).join(" · "), w - 6, h - 30 - 17 * (this.curves.length - 1 - k));
    });
  }

  drawGrid(rows) {
    const { x, w, h, colours } = this.surface(), names = [...new Set(GRID.map(nameOf))], space = (h - 22) / names.length;
    const all = rows.map((row) => row.iqm), low = Math.floor(Math.min(...all) - 1), high = Math.ceil(Math.max(...all) + 1);
    const px = (v) => 10 + (v - low) / (high - low) * (w - 20);
    names.forEach((name, k) => {
      [x.fillStyle, x.textAlign] = [colours.text, "left"];
      x.fillText(name, 0, k * space + 12);
      x.fillStyle = colours.accent;
      x.globalAlpha = 0.6;
      for (const { setting, iqm } of rows) {
        if (nameOf(setting) !== name) continue;
        x.beginPath();
        x.arc(px(iqm), k * space + (setting.truncates ? 24 : 36), 4, 0, 7);
        x.fill();
      }
      x.globalAlpha = 1;
    });
    x.fillStyle = colours.soft;
    x.fillText(low.toFixed(0), 6, h - 5);
    x.textAlign = "right";
    x.fillText(`${high.toFixed(0)} return of an episode (IQM); upper row: deliveries truncate`, w - 4, h - 5);
  }
}
