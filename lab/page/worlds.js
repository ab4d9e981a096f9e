// The scene of a visit, and its world. Worlds are painted in whole numbers, as in taichi_ants/worlds/lab.py.

import LAB from "../../taichi_ants/worlds/lab.json" with { type: "json" };

/**
 * @typedef {object} Scene
 * @property {number} world number in WORLDS
 * @property {number} rules see RULES and PARTS in engine.js
 * @property {number} learner see LEARNERS in engine.js
 * @property {number} seed of the ants, and of the daily world; at most 2 ** 53 - 1
 * @property {number} ants
 * @property {number} epsilon exploration, in thousandths like the next two
 * @property {number} rate
 * @property {number} discount
 * @property {number} learns 0 or 1
 * @property {number} first value of all actions at the start; high values make ants try everything
 * @property {number} level how many ticks new scent lasts; it fades with a slope of level / 50
 * @property {number} regrowth ticks until food grows back; -1 for never
 * @property {number} shaping reward for walking onto a trail, or nearer to the nest
 */

/** The first screen. @type {Scene} */
export const SCENE = {
  world: 0, rules: 15, learner: 0, seed: 85, ants: 64, epsilon: 0.03, rate: 0.1, discount: 0.9,
  learns: 1, first: 5, level: 600, regrowth: 0, shaping: 1,
};

export const WORLDS = /** @type {any[]} */ (LAB.worlds);
export const EMPTY = 0, ROCK = 5, FOOD = 7, QUEEN = 13; // what is on a cell
const PAINTS_SCENT = 2; // what else a world can have
/** Steps (q, r) to the neighbours of a cell by heading, clockwise; heading 0 points up. */
export const STEPS = [[1, 0], [1, 1], [0, 1], [-1, 0], [-1, -1], [0, -1]];

/** The distance of two cells that are (q, r) apart. */
export const hexDistance = (q, r) => Math.max(q, r, 0) - Math.min(q, r, 0);

/** A random word of 32 bits: a hash of two numbers. */
export function wordOf(seed, number) {
  let word = Math.imul(seed ^ 0x9E3779B9, 0x85EBCA6B) ^ Math.imul(number + 0x7F4A7C15, 0xC2B2AE35);
  word = Math.imul(word ^ word >>> 15, 0x2C1B3C6D);
  word = Math.imul(word ^ word >>> 12, 0x297A2D39);
  return (word ^ word >>> 15) >>> 0;
}

function drawnShapes({ radius, queen, rocks, largest, piles, nearest, daily }, seed) {
  let number = 0;
  const draw = (n) => wordOf(daily ? seed : 0, number++) % n;
  const place = (least) => {
    for (;;) {
      const q = draw(2 * radius) - radius, r = draw(2 * radius) - radius;
      if (hexDistance(q, r) < radius - LAB.fromEdge && hexDistance(q - queen[0], r - queen[1]) >= least) return [q, r];
    }
  };
  const shapes = [];
  for (let k = 0; k < rocks; k++) shapes.push([ROCK, ...place(LAB.fromHome), draw(largest)]);
  for (let k = 0; k < piles; k++) shapes.push([FOOD, ...place(nearest), LAB.pile]);
  return shapes;
}

/**
 * The world of a scene: its radius, and lists of cells (see engine.js).
 * @param {{ world: number, seed: number }} scene
 */
export function makeWorld({ world, seed }) {
  const lab = WORLDS[world], R = lab.radius, width = 2 * R + 1;
  const ground = new Uint8Array(width * width), scent = new Uint8Array(width * width);
  if (lab.walled) ground.fill(ROCK);
  const shapes = lab.shapes.length ? lab.shapes : drawnShapes(lab, seed);
  for (const [paints, q0, r0, square, heading = 0, n = 0] of [...shapes, [EMPTY, ...lab.queen, LAB.home]]) {
    const reach = Math.ceil(Math.sqrt(square * 4 / 3)) + 1;
    for (let k = 0; k <= n; k++) {
      const q = q0 + k * STEPS[heading][0], r = r0 + k * STEPS[heading][1];
      for (let b = -reach; b <= reach; b++)
        for (let a = -reach; a <= reach; a++)
          if (a * a - a * b + b * b <= square && hexDistance(q + a, r + b) < R)
            (paints === PAINTS_SCENT ? scent : ground)[(r + b + R) * width + q + a + R] = paints;
    }
  }
  /** @type {{ rocks: number[], foods: number[], scent: number[] }} */
  const cells = { rocks: [], foods: [], scent: [] };
  for (let cell = 0; cell < ground.length; cell++) {
    if (hexDistance(cell % width - R, Math.floor(cell / width) - R) >= R) continue;
    if (ground[cell] === ROCK) cells.rocks.push(cell);
    if (ground[cell] === FOOD) cells.foods.push(cell);
    if (scent[cell]) cells.scent.push(cell);
  }
  return { name: lab.name, radius: R, queen: (lab.queen[1] + R) * width + lab.queen[0] + R, ...cells };
}
