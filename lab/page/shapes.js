/* shapes.js: cells as smooth shapes: rocks look like stones, not like tiles. */

import { centre, ROOT3 } from "./geometry.js";
import { STEPS } from "./worlds.js";

/** The corner k of a cell; the edge to the neighbour at heading h lies between the corners h and h + 1. */
function corner(q, r, k) {
  const [x, y] = centre(q, r), angle = (k - 2) * Math.PI / 3;
  return [x + Math.cos(angle), y + Math.sin(angle)];
}

/* Corners of three cells are computed three times and differ in their last bits; keys are equal. */
/** @param {number[]} point */
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
