/* plot.js: food per minute over time, of one run or of two, with the difference between them shaded. */

import { TICKS_A_SECOND } from "./run.js";

const LONGEST = 180 * TICKS_A_SECOND, SHORTEST = 60 * TICKS_A_SECOND; // ticks in view
const TOP = 27, BELOW = 17;

export class Plot {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.most = 120; // of the axis, loads per minute
  }

  reset() { this.most = 120; }

  /** @param {import("./run.js").Run[]} runs one or two  @param {Record<string, string>} colours */
  draw(runs, colours) {
    const { canvas } = this, x = canvas.getContext("2d"), dpr = Math.min(2, devicePixelRatio || 1);
    const w = canvas.clientWidth, h = canvas.clientHeight;
    if (canvas.width !== Math.round(w * dpr) || canvas.height !== Math.round(h * dpr)) {
      [canvas.width, canvas.height] = [Math.round(w * dpr), Math.round(h * dpr)];
    }
    x.setTransform(dpr, 0, 0, dpr, 0, 0);
    x.clearRect(0, 0, w, h);
    const last = runs[0].tick, first = runs[0].start, span = Math.max(SHORTEST, Math.min(last - first, LONGEST));
    const from = Math.max(first, last - span);
    const points = Math.floor((last - from) / TICKS_A_SECOND) + 1, ticks = Array.from({ length: points }, (_, k) => k * TICKS_A_SECOND);
    // Runs may have started at different ticks; they are compared from there.
    const lines = runs.map((run) => ticks.map((t) => [from + t, run.perMinuteAt(run.start - first + from + t)]));
    const wanted = Math.max(120, Math.ceil(Math.max(0, ...lines.flat().map(([, v]) => v)) / 60) * 60);
    this.most = wanted > this.most ? wanted : this.most + (wanted - this.most) * 0.12;
    const bottom = h - BELOW, px = (t) => (t - from) / span * (w - 2) + 1, py = (v) => bottom - v / this.most * (bottom - TOP);
    this.drawAxes(x, w, h, py, from - first, span, colours);
    const follow = (points) => points.forEach(([t, v], k) => (k ? x.lineTo(px(t), py(v)) : x.moveTo(px(t), py(v))));
    if (ticks.length > 1) {
      this.shade(x, lines, bottom, follow, px, colours);
      lines.forEach((points, k) => {
        x.beginPath();
        follow(points);
        [x.strokeStyle, x.lineWidth, x.lineJoin] = [k === runs.length - 1 ? colours.accent : colours.soft, 2, "round"];
        x.setLineDash(k === runs.length - 1 ? [] : [5, 4]);
        x.stroke();
        x.setLineDash([]);
        const [t, v] = points[points.length - 1];
        x.fillStyle = x.strokeStyle;
        x.beginPath();
        x.arc(Math.min(w - 4, px(t)), py(v), 3.5, 0, 7);
        x.fill();
      });
    }
    if (runs.length === 1) this.drawMarks(x, w, runs[0].marks.filter(({ tick }) => tick >= from), bottom, px, colours);
  }

  drawAxes(x, w, h, py, from, span, colours) {
    const middle = Math.round(this.most / 60) * 30;
    x.font = "11.5px Inter, system-ui, sans-serif";
    [x.fillStyle, x.strokeStyle, x.lineWidth] = [colours.soft, colours.line, 1];
    for (const v of [0, middle]) {
      x.beginPath();
      x.moveTo(0, Math.round(py(v)) + 0.5);
      x.lineTo(w, Math.round(py(v)) + 0.5);
      x.stroke();
    }
    const clock = (t) => { const s = Math.round(t / TICKS_A_SECOND); return s < 60 ? `${s} s` : `${Math.floor(s / 60)}:${String(s % 60).padStart(2, "0")}`; };
    x.textAlign = "left";
    x.fillText(String(middle), 0, py(middle) - 4);
    x.fillText(clock(from), 0, h - 3);
    x.textAlign = "right";
    x.fillText(clock(from + span), w, h - 3);
  }

  /** Under one line, or between two: what the setting has changed. */
  shade(x, lines, bottom, follow, px, colours) {
    const upper = lines[lines.length - 1];
    x.beginPath();
    follow(upper);
    if (lines.length > 1) for (const point of [...lines[0]].reverse()) x.lineTo(px(point[0]), this.yOf(point[1], bottom));
    else {
      x.lineTo(px(upper[upper.length - 1][0]), bottom);
      x.lineTo(px(upper[0][0]), bottom);
    }
    x.closePath();
    const gradient = x.createLinearGradient(0, TOP, 0, bottom);
    gradient.addColorStop(0, colours.accent);
    gradient.addColorStop(1, lines.length > 1 ? colours.accent : "transparent");
    [x.globalAlpha, x.fillStyle] = [0.2, gradient];
    x.fill();
    x.globalAlpha = 1;
  }

  yOf(value, bottom) { return bottom - value / this.most * (bottom - TOP); }

  /** Words in two rows; a mark that finds no room keeps its line only. */
  drawMarks(x, w, marks, bottom, px, colours) {
    const free = [-99, -99];
    x.textAlign = "left";
    [x.strokeStyle, x.fillStyle] = [colours.text, colours.text];
    for (const { tick, word } of marks) {
      const at = Math.round(px(tick)) + 0.5, wide = x.measureText(word).width, left = Math.min(at, w - wide - 1);
      x.globalAlpha = 0.5;
      x.setLineDash([2, 3]);
      x.beginPath();
      x.moveTo(at, 13);
      x.lineTo(at, bottom);
      x.stroke();
      x.setLineDash([]);
      x.globalAlpha = 1;
      const row = free.findIndex((end) => left > end);
      if (row < 0) continue;
      x.fillText(word, left + 3 * row, row ? 22 : 10);
      free[row] = left + wide + 9;
    }
  }
}
