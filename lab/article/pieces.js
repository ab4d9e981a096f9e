/* pieces.js: the ten worlds of the article, and one of a lesson. Each has one control, and one number that is measured; no DOM is needed. */

import { Engine, PARTS, RULES } from "../page/engine.js";
import { longShare, wallPath } from "../page/scenes.js";
import { SCENE, WORLDS } from "../page/worlds.js";

/** @typedef {import("../page/worlds.js").Scene} Scene */
/**
 * @typedef {object} Piece
 * @property {string} ask legend of the control
 * @property {[number, string][]} options values of the control, and their names
 * @property {number} from the option that is shown first
 * @property {string} unit what the number is
 * @property {number} ticks after which it is measured
 * @property {number} speed
 * @property {number} seed that is shown; its numbers are near the medians of 20
 * @property {number} [followed] the ant with a ring
 * @property {boolean} [points] whether the reward is shown as well
 * @property {(value: number) => { scene: Partial<Scene>, events?: any[], skip?: number }} start `skip` ticks pass before anybody watches
 * @property {(engine: Engine, begun: Count) => number} [fact] by default the loads that were brought home
 */
/** @typedef {{ deliveries: number, returns: number }} Count */

const PAPER = WORLDS.findIndex(({ name }) => name === "paper"), BRIDGE = WORLDS.findIndex(({ name }) => name === "bridge");
const TRAINED = 20_000, TOGETHER = 8000, SETTLED = 1000; // ticks that have passed
const cellOf = (world, q, r) => (r + WORLDS[world].radius) * (2 * WORLDS[world].radius + 1) + q + WORLDS[world].radius;
const OLD_PILE = [cellOf(0, 17, 19)], NEW_PILE = [cellOf(0, 20, -3)];
const copies = (ants) => [{ tick: TRAINED, do: "learns", value: 0 }, { tick: TRAINED, do: "ants", value: ants }];
const wall = (length) => (length ? [{ tick: SETTLED, do: "rock", reach: 1, path: wallPath(length) }] : []);
const delivered = (engine, begun) => engine.deliveries - begun.deliveries;

/** @type {Record<string, Piece>} */
export const PIECES = {
  alone: {
    ask: "Steps it has practised", options: [[0, "none"], [1000, "1 000"], [5000, "5 000"], [TRAINED, "20 000"]], from: 0,
    unit: "loads in 1 000 ticks", ticks: 1000, speed: 3, seed: 3, followed: 0,
    start: (practice) => ({ scene: { world: PAPER, rules: RULES.paper, level: 250, ants: 1 }, skip: practice }),
  },
  scent: {
    ask: "New scent lasts", options: [[20, "20 ticks"], [60, "60 ticks"], [200, "200 ticks"], [1000, "1 000 ticks"]], from: 1,
    unit: "cells with scent after 400 ticks", ticks: 400, speed: 1.5, seed: 5, followed: 0,
    start: (level) => ({ scene: { ants: 1 }, skip: TRAINED, events: [{ tick: TRAINED, do: "level", value: level }] }),
    fact: (engine) => engine.levels.reduce((cells, level) => cells + (level > 0 ? 1 : 0), 0),
  },
  direction: {
    ask: "The trail is strongest", options: [[0, "nowhere: no scent"], [1, "at the ant"], [2, "at the food"]], from: 1,
    unit: "loads in 1 000 ticks", ticks: 1000, speed: 4, seed: 17,
    start: (kind) => ({ scene: { rules: kind === 2 ? PARTS.directed : RULES.paper, level: kind ? 600 : 1 } }),
  },
  copies: {
    ask: "Ants", options: [[1, "1, trained alone"], [8, "8 copies of it"], [64, "64 copies of it"], [-64, "64, trained together"]], from: 2,
    unit: "loads per ant in 1 000 ticks", ticks: 1000, speed: 4, seed: 8,
    start: (ants) => (ants > 0 ? { scene: { ants: 1 }, skip: TRAINED, events: copies(ants) }
      : { scene: {}, skip: TOGETHER, events: [{ tick: TOGETHER, do: "learns", value: 0 }] }),
    fact: (engine, begun) => Math.round(10 * delivered(engine, begun) / engine.ants) / 10,
  },
  bridge: {
    ask: "Ants", options: [[4, "4"], [8, "8"], [24, "24"], [64, "64"]], from: 1,
    unit: "% of carriers on the short path, on the right, after 2 000 ticks", ticks: 2000, speed: 8, seed: 9,
    start: (ants) => ({ scene: { world: BRIDGE, ants } }),
    fact: (engine) => 100 - longShare({ engine }),
  },
  chance: {
    ask: "Steps taken at random", options: [[0, "none"], [0.03, "3 %"], [0.1, "10 %"], [0.4, "40 %"]], from: 0,
    unit: "loads in 1 500 ticks", ticks: 1500, speed: 6, seed: 15,
    start: (epsilon) => ({ scene: { world: BRIDGE, ants: 8, first: 0, epsilon } }),
  },
  forget: {
    ask: "New scent lasts", options: [[30, "30 ticks"], [100, "100 ticks"], [600, "600 ticks"], [6000, "6 000 ticks"]], from: 3,
    unit: "loads in the 800 ticks after the move", ticks: 800, speed: 4, seed: 17,
    start: (level) => ({ scene: { level }, skip: SETTLED, events: [
      { tick: SETTLED, do: "erase", reach: 4, path: OLD_PILE }, { tick: SETTLED, do: "food", reach: 2, path: NEW_PILE }] }),
  },
  wall: {
    ask: "The wall", options: [[0, "none"], [7, "short"], [13, "longer"], [23, "from rock to rock"]], from: 2,
    unit: "loads in the 600 ticks after it", ticks: 600, speed: 3, seed: 11,
    start: (length) => ({ scene: {}, skip: SETTLED, events: wall(length) }),
  },
  learning: {
    ask: "Behind the wall, ants", options: [[1, "go on learning"], [0, "learn nothing more"]], from: 1,
    unit: "loads in the 1 000 ticks after it", ticks: 1000, speed: 4, seed: 4,
    start: (learns) => ({ scene: {}, skip: SETTLED, events: [...wall(13), { tick: SETTLED, do: "learns", value: learns }] }),
  },
  pay: {
    ask: "Pay for a step along the way", options: [[0, "nothing"], [1, "1 point"], [3, "3 points"], [10, "10 points"]], from: 3,
    unit: "loads in 1 000 ticks", ticks: 1000, speed: 3, seed: 8, points: true,
    start: (shaping) => ({ scene: { world: PAPER, rules: RULES.paper, level: 250, ants: 4, discount: 0.99, shaping }, skip: TRAINED }),
  },
  rules: { // of a lesson
    ask: "Rules", options: [[RULES.paper, "the paper’s"], [PARTS.directed, "A: a trail with a direction"], [PARTS.directed | PARTS.rightOfWay, "A and B: right of way"],
      [RULES.foraging, "A, B and C: ants in view"]], from: 3,
    unit: "loads in 1 000 ticks", ticks: 1000, speed: 4, seed: 17,
    start: (rules) => ({ scene: { rules } }),
  },
};

/** What a piece starts with: scene, events, and ticks to skip. */
export function startOf(piece, value, seed = piece.seed) {
  const { scene, events = [], skip = 0 } = piece.start(value);
  return { scene: { ...SCENE, seed, ...scene }, events, skip };
}

/** @returns {Count} */
export const countOf = (engine) => ({ deliveries: engine.deliveries, returns: engine.returns });

/** The number of a piece now, given the counts when somebody began to watch. */
export const factOf = (piece, engine, begun) => (piece.fact || delivered)(engine, begun);

/** The number that one run of a piece gives, without anybody watching. */
export function measured(module, piece, value, seed) {
  const { scene, events, skip } = startOf(piece, value, seed), engine = new Engine(module, scene, events);
  engine.pass(skip);
  const begun = countOf(engine);
  engine.pass(piece.ticks);
  return factOf(piece, engine, begun);
}
