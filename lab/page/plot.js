/* plot.js: food per minute over time, of one run or of two, with the difference between them shaded. */

import { TICKS_A_SECOND } from "./run.js";

const LONGEST = 180 * TICKS_A_SECOND, SHORTEST = 60 * TICKS_A_SECOND; // ticks in view
const TOP = 27, BELOW = 17, LETTER = 6.2; // CSS pixels: above and below the lines, and the width of a letter
const FADE = '<linearGradient id="fade" x2="0" y2="1"><stop stop-color="var(--accent)"/><stop offset="1" stop-color="var(--accent)" stop-opacity="0"/></linearGradient>';

const clock = (t) => {
  const s = Math.round(t / TICKS_A_SECOND);
  return s < 60 ? `${s} s` : `${Math.floor(s / 60)}:${String(s % 60).padStart(2, "0")}`;
};
const through = (points) => points.map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join("L");
const textAt = (x, y, words, more = 'fill="var(--soft)"') => `<text x="${x}" y="${y}" ${more}>${words}</text>`;

/** Words in two rows; a mark that finds no room keeps its line only. */
function marksOf(marks, x, w, bottom) {
  const free = [-99, -99];
  return marks.map(({ tick, word }) => {
    const at = Math.round(x(tick)) + 0.5, wide = LETTER * word.length, left = Math.min(at, w - wide - 1), row = free.findIndex((end) => left > end);
    if (row >= 0) free[row] = left + wide + 9;
    return `<path d="M${at},13V${bottom}" stroke="var(--text)" stroke-dasharray="2 3" opacity=".5"/>`
      + (row < 0 ? "" : textAt(left + 3 * row, row ? 22 : 10, word, 'fill="var(--text)"'));
  });
}

/** One run, or two: they may have started at different ticks, and are compared from there. @param {import("./run.js").Run[]} runs */
export function drawPlot(box, runs) {
  const w = box.clientWidth, h = box.clientHeight, bottom = h - BELOW;
  const last = runs[0].tick, first = runs[0].start, span = Math.max(SHORTEST, Math.min(last - first, LONGEST)), from = Math.max(first, last - span);
  const ticks = Array.from({ length: Math.floor((last - from) / TICKS_A_SECOND) + 1 }, (_, k) => from + k * TICKS_A_SECOND);
  const values = runs.map((run) => ticks.map((t) => run.perMinuteAt(run.start - first + t)));
  const most = Math.max(120, Math.ceil(Math.max(...values.flat(), ...runs.map((run) => run.perMinute)) / 60) * 60); // of the axis, loads per minute
  const x = (t) => (t - from) / span * (w - 2) + 1, y = (v) => bottom - v / most * (bottom - TOP);
  const lines = values.map((line) => line.map((v, k) => [x(ticks[k]), y(v)])), own = lines[lines.length - 1], two = runs.length > 1;
  const parts = [0, most].map((v) => `<path d="M0,${Math.round(y(v)) + 0.5}H${w}" stroke="var(--line)"/>`);
  const words = [textAt(0, TOP + 12, most), textAt(0, h - 3, clock(from - first)), textAt(w, h - 3, clock(from - first + span), 'fill="var(--soft)" text-anchor="end"')];
  if (ticks.length > 1) {
    const below = two ? [...lines[0]].reverse() : [[own[own.length - 1][0], bottom], [own[0][0], bottom]];
    parts.push(FADE, `<path d="M${through([...own, ...below])}Z" fill="${two ? "var(--accent)" : "url(#fade)"}" opacity=".2"/>`);
    for (const line of lines) {
      const colour = line === own ? "var(--accent)" : "var(--soft)", [px, py] = line[line.length - 1];
      parts.push(`<path d="M${through(line)}" fill="none" stroke="${colour}" stroke-width="2" stroke-linejoin="round" stroke-dasharray="${line === own ? "" : "5 4"}"/>`
        + `<circle cx="${Math.min(w - 4, px)}" cy="${py}" r="3.5" fill="${colour}"/>`);
    }
  }
  if (!two) parts.push(...marksOf(runs[0].marks.filter(({ tick }) => tick >= from), x, w, bottom));
  box.innerHTML = `<svg width="${w}" height="${h}" font-size="11.5">${[...parts, ...words].join("")}</svg>`;
}
