/* figures.js: tables, and plots of lines as pictures, as text for a page. */

const MOST = 760, HIGH = 230, LEFT = 38; // CSS pixels of a plot: its greatest width; its height; the place for numbers
const DASHES = ["", "7 4", "2 3", "11 3 2 3"], COLOURS = ["--accent", "--focus", "--soft", "--text"];

export const escaped = (text) => String(text).replace(/&/g, "&amp;").replace(/</g, "&lt;");
const rowOf = (cells, tag) => `<tr>${cells.map((cell) => `<${tag}>${escaped(cell)}</${tag}>`).join("")}</tr>`;
export const tableOf = (head, rows) => `<div class="sheet"><table>${head ? rowOf(head, "th") : ""}${rows.map((row) => rowOf(row, "td")).join("")}</table></div>`;

/** A picture that may be as wide as the page. */
export const pictureOf = (parts, width, height, label) => `<svg viewBox="0 0 ${width} ${height}" width="${width}" height="${height}" role="img" aria-label="${escaped(label)}">${parts.join("")}</svg>`;

/**
 * Lines of a plot, with a legend in words, colours and dashes.
 * @param {[string, ArrayLike<number>, number[]?][]} lines names, values, and half the widths of bands around them
 * @param {string} across what the plot shows
 */
export function plotOf(lines, across) {
  const bands = lines.map(([, values, halves]) => Array.from(values, (value, k) => [value - (halves?.[k] || 0), value + (halves?.[k] || 0)]));
  const W = Math.min(MOST, innerWidth - 40), all = bands.flat(2), high = Math.max(...all), low = Math.min(0, ...all);
  const y = (value) => HIGH - 8 - (value - low) / (high - low || 1) * (HIGH - 22), x = (k, n) => LEFT + k / (n - 1) * (W - LEFT - 8);
  const scale = [low, (low + high) / 2, high].map((value) => `<path d="M${LEFT},${y(value)}H${W}" stroke="var(--line)"/>`
    + `<text x="${LEFT - 6}" y="${y(value) + 4}" text-anchor="end">${value.toFixed(high - low < 2 ? 1 : 0)}</text>`);
  const colour = (k) => `var(${COLOURS[k]})`, style = (k) => `stroke="${colour(k)}" stroke-width="2" stroke-dasharray="${DASHES[k]}" fill="none"`;
  const point = (k, n, value) => `${x(k, n).toFixed(1)},${y(value).toFixed(1)}`;
  const drawn = lines.map(([, values, halves], k) => {
    const edge = (side) => bands[k].map((ends, j) => point(j, values.length, ends[side]));
    return (halves ? `<path d="M${[...edge(0), ...edge(1).reverse()].join("L")}Z" fill="${colour(k)}" opacity=".22"/>` : "")
      + `<path d="M${Array.from(values, (value, j) => point(j, values.length, value)).join("L")}" ${style(k)}/>`;
  });
  const legend = lines.map(([name], k) => `<span><svg width="28" height="6" aria-hidden="true"><path d="M0,3h28" ${style(k)}/></svg> ${escaped(name)}</span>`);
  return `<div class="plot"><p>${legend.join("")}</p>${pictureOf([...scale, ...drawn], W, HIGH, across)}<p>${escaped(across)}</p></div>`;
}
