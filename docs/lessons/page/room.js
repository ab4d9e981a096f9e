/* room.js: the room of lesson 4, in which ants know their state, and Dyna-Q; equal to the notebook, number by number. */

import { Random } from "./random.js";

const ROOM = { width: 9, height: 6, start: 5 * 9 + 2, food: 8, change: 1500 };
const AROUND = [[1, 0], [1, -1], [0, -1], [-1, 0], [-1, 1], [0, 1]];
const ALPHA = 0.5, GAMMA = 0.95, EPSILON = 0.1;
const WALLS = { right: [0, 8], left: [1, 9], both: [1, 8] }; // columns with rock, by the gap

export const PLAN = {
  code: `function plan(q, model, n, draw) {
  // model lists what was stored: { s, a, r, next, over }; q[s] is a row.
  // draw(k) gives a random whole number below k.
  // Learn from n stored steps, with step size 0.5 and discount 0.95.
}`,
  answer: `function plan(q, model, n, draw) {
  for (let k = 0; k < n; k++) {
    const { s, a, r, next, over } = model[draw(model.length)];
    const target = r + (over ? 0 : 0.95 * Math.max(...q[next]));
    q[s][a] += 0.5 * (target - q[s][a]);
  }
}`,
};

const largest = (/** @type {number[]} */ [a, b, c, d, e, f]) => Math.max(a, b, c, d, e, f);

function learn(q, { s, a, r, next, over }, bonus = 0) {
  q[s][a] += ALPHA * (r + bonus + (over ? 0 : GAMMA * largest(q[next])) - q[s][a]);
}

function planned(q, model, n, draw, bonus) {
  for (let k = 0; k < n; k++) {
    const step = model[draw(model.length)];
    learn(q, step, bonus(step));
  }
}

function move(cell, action, [from, to]) {
  const column = cell % ROOM.width + AROUND[action][0], row = Math.floor(cell / ROOM.width) + AROUND[action][1];
  const free = column >= 0 && column < ROOM.width && row >= 0 && row < ROOM.height && !(row === 3 && column >= from && column < to);
  return free ? row * ROOM.width + column : cell;
}

/** An ant's life: the food found so far after each step, the length of each episode, and if `summed` the sum of its table after each step. */
export function live({ n, seed, steps, summed = false, wall = "right", later = "", kappa = 0, plan = planned }) {
  const random = new Random(seed), q = Array.from({ length: ROOM.width * ROOM.height }, () => Array(6).fill(0)), model = [], place = [];
  const food = [], lengths = [], sums = [], draws = new Float64Array(n);
  const store = (s, a, r, next, over, t) => { model[place[6 * s + a] ??= model.length] = { s, a, r, next, over, t }; };
  let cell = ROOM.start, began = 0, columns = WALLS[wall];
  for (let t = 0; t < steps; t++) {
    if (later && t >= ROOM.change && cell === ROOM.start) columns = WALLS[later];
    if (kappa && place[6 * cell] === undefined) for (let a = 0; a < 6; a++) if (place[6 * cell + a] === undefined) store(cell, a, 0, cell, false, t);
    const most = largest(q[cell]), best = [0, 1, 2, 3, 4, 5].filter((a) => q[cell][a] === most);
    let a = best[random.below(best.length)];
    if (random.number() < EPSILON) a = random.below(6);
    const next = move(cell, a, columns), over = next === ROOM.food, r = Number(over);
    learn(q, { s: cell, a, r, next, over });
    store(cell, a, r, next, over, t);
    for (let k = 0; k < n; k++) draws[k] = random.number();
    let drawn = 0; // a plan that is wrong draws as much as one that is right
    plan(q, model, n, (k) => Math.floor(draws[drawn++ % n] * k), (step) => kappa * Math.sqrt(t - step.t));
    cell = over ? ROOM.start : next;
    if (over) [began] = [t + 1, lengths.push(t + 1 - began)];
    food.push(lengths.length);
    if (summed) sums.push(q.flat().reduce((x, y) => x + y, 0));
  }
  return /** @type {[number[], number[], number[]]} */ ([food, lengths, sums]);
}
