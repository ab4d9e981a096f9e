/* geometry.js: where cells lie, and their outlines as smooth shapes: rocks look like stones, not like tiles. The unit of length is the distance from the centre of a cell to its corners. */

import { hexDistance, STEPS, wordOf } from "./worlds.js";

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

/** The corner k of a cell; the edge to the neighbour at heading h lies between the corners h and h + 1. */
function corner(q, r, k) {
  const [x, y] = centre(q, r), angle = (k - 2) * Math.PI / 3;
  return [x + Math.cos(angle), y + Math.sin(angle)];
}

/** Corners of three cells are computed three times and differ in their last bits; keys are equal. @param {number[]} point */
const keyOf = ([x, y]) => Math.round(x * 2) * 65536 + Math.round(y * 4 / ROOT3);

/** @param {number[]} from  @param {number[]} to */
const mixed = ([x, y], [a, b], t) => [x + (a - x) * t, y + (b - y) * t];

/** The rings of corners around cells, in the unit of geometry.js. */
function ringsOf(engine, cells, has) {
  const edges = new Map();
  for (const cell of cells) {
    const q = engine.q(cell), r = engine.r(cell);
    for (let h = 0; h < 6; h++) {
      if (has(cell + STEPS[h][0] + STEPS[h][1] * engine.width)) continue;
      const from = corner(q, r, h), key = keyOf(from);
      if (!edges.has(key)) edges.set(key, []);
      edges.get(key).push([from, corner(q, r, h + 1)]);
    }
  }
  const rings = [];
  for (const starts of edges.values()) {
    while (starts.length) {
      const ring = [];
      for (let edge = starts.pop(); edge; edge = (edges.get(keyOf(edge[1])) || []).pop()) ring.push(edge[0]);
      rings.push(ring);
    }
  }
  return rings;
}

/** A ring without its corners: midpoints, averages, and two rounds of Chaikin's cutting. */
function smoothed(ring) {
  const next = (k) => ring[(k + 1) % ring.length], last = (k) => ring[(k || ring.length) - 1];
  ring = ring.map((p, k) => mixed(p, next(k), 0.5));
  for (let round = ring.length > 14 ? 7 : 1; round--;) {
    ring = ring.map((p, k) => mixed(p, mixed(last(k), next(k), 0.5), 0.5));
  }
  for (let round = 2; round--;) ring = ring.flatMap((p, k) => [mixed(p, next(k), 0.25), mixed(p, next(k), 0.75)]);
  return ring;
}

/** The smooth outline of cells, as a path of the canvas; `place` maps points of geometry.js to it. */
export function outline(engine, cells, has, place) {
  const path = new Path2D();
  for (const ring of ringsOf(engine, cells, has)) {
    smoothed(ring).forEach((point, k) => {
      const [x, y] = place(point);
      path[k ? "lineTo" : "moveTo"](x, y);
    });
    path.closePath();
  }
  return path;
}
