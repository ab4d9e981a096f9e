/* geometry.js: where cells lie. The unit of length is the distance from the centre of a cell to its corners. */

import { hexDistance, wordOf } from "./worlds.js";

export const ROOT3 = Math.sqrt(3);

/** The centre of a cell; y points down, heading 0 up. @returns {[number, number]} */
export const centre = (q, r) => [1.5 * r, ROOT3 * (r / 2 - q)];

/** The direction of a heading as an angle of the canvas. */
export const angleOf = (heading) => (heading - 1.5) * Math.PI / 3;

/** The coordinates of the cell at a point. @returns {[number, number]} */
export function cellAt(x, y) {
  const r = x / 1.5, q = r / 2 - y / ROOT3, p = r - q; // p + q - r = 0
  let Q = Math.round(q), R = Math.round(r);
  const P = Math.round(p), dq = Math.abs(Q - q), dr = Math.abs(R - r), dp = Math.abs(P - p);
  if (dq > dr && dq > dp) Q = R - P;
  else if (dr > dp) R = P + Q;
  return [Q, R];
}

/** The cells on the straight line between two cells, without the first one; each is a neighbour of the one before. */
export function lineTo([q0, r0], [q1, r1]) {
  const n = hexDistance(q1 - q0, r1 - r0), [x0, y0] = centre(q0, r0), [x1, y1] = centre(q1, r1);
  return Array.from({ length: n }, (_, k) => cellAt(x0 + (x1 - x0) * (k + 1) / n, y0 + (y1 - y0) * (k + 1) / n));
}

/** A whole number below n that looks random but depends only on a and b. */
export const scatter = (a, b, n) => wordOf(a, b) % n;
