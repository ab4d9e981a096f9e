/* run.js: a colony that somebody watches: the engine, and measured facts about its past, which the story, the plot
 * and the drawing need. Nothing here changes what the ants do; it needs no DOM. */

import { CAPACITY, Engine, EVENTS } from "./engine.js";
import { centre } from "./geometry.js";
import { FOOD, hexDistance, STEPS } from "./worlds.js";

export const TICKS_A_SECOND = 18;      // at speed 1
const WINDOW = 200;                    // ticks over which food per minute is measured
const MINUTE = 60 * TICKS_A_SECOND;
const LANES = { ticks: 100, loads: 25 }; // lanes are there when every fourth tick brings food
const BLOCKS = 4;                      // carriers that were on the cells of a wall lately
const SAME_STROKE = 40;                // ticks between the pieces of a wall
const STOPPED = 450;                   // ticks without a detour
const DETOUR = 10;                     // loads that come round a wall
const MOST_SPARKS = 80;

export class Run {
  /** @param {WebAssembly.Module} module  @param {import("./worlds.js").Scene} scene  @param {any[]} events a replay, see engine.js */
  constructor(module, scene, events = []) {
    const e = this.engine = new Engine(module, scene, events);
    this.scene = e.scene;
    this.picked = new Int32Array(CAPACITY).fill(-1); // the tick of an ant's last pick-up; -1: none, or a gift
    this.total = [0];                                  // deliveries until each tick
    this.facts = { firstFood: -1, firstHome: -1, lanes: -1, firstAnt: -1 };
    this.wall = null;                                  // the last rock that was drawn
    this.gift = null;                                  // food that was drawn
    this.visits = new Int32Array(e.values.length / 8); // how often an ant was in a state
    this.sparks = [];                                  // pick-ups and deliveries, which the drawing shows for a moment
    this.seen = 0;                                     // events that are noted
    this.marks = [];                                   // ticks with a word, for the plot
    this.given = 0;                                    // events at the start that are part of a question
    this.start = 0;                                    // the tick at which somebody began to watch
    this.earned = 0;                                   // the returns then
  }

  get tick() { return this.engine.tick; }

  /** Deliveries of the last ticks. */
  sum(ticks) {
    const n = this.total.length - 1;
    return this.total[n] - this.total[Math.max(0, n - ticks)];
  }

  perMinuteAt(tick) {
    const from = Math.max(0, tick - WINDOW);
    return (this.total[tick] - this.total[from]) * MINUTE / Math.min(WINDOW, Math.max(100, tick));
  }

  get perMinute() { return this.perMinuteAt(this.total.length - 1); }

  apply(event) {
    this.engine.apply(event);
    this.noteEvents();
  }

  advance() {
    this.engine.pass(1);
    this.noteEvents();
    this.noteAnts();
    const { facts, wall, tick } = this;
    this.total.push(this.engine.deliveries);
    if (facts.lanes < 0 && tick >= LANES.ticks && this.sum(LANES.ticks) >= LANES.loads) {
      facts.lanes = tick;
      this.mark("lanes appear");
    }
    if (wall && wall.crossed && wall.detour < 0 && tick - wall.last >= STOPPED) wall.stopped = true;
  }

  /** Pass ticks at once, up to a tick. */
  skip(tick) {
    while (this.tick < tick) this.advance();
    this.sparks = [];
  }

  /** Begin to watch now: plots and questions count from here, and what was done before is part of the question. */
  watch() { [this.start, this.earned, this.given, this.marks] = [this.tick, this.engine.returns, this.engine.events.length, []]; }

  mark(word) { this.marks.push({ tick: this.tick, word }); }

  noteAnts() {
    const e = this.engine, { facts, tick } = this;
    for (let i = 0; i < e.ants; i++) {
      const event = e.looks[i] >> 1 & 7, cell = e.cells[i];
      this.visits[e.states[i]]++;
      if (event === EVENTS.pickedUp) {
        this.picked[i] = this.isGift(cell) ? -1 : tick;
        if (facts.firstFood < 0) [facts.firstFood, facts.firstAnt] = [tick, i];
        if (this.sparks.length < MOST_SPARKS) this.sparks.push({ cell, food: true, age: 0 });
      } else if (event === EVENTS.delivered) {
        if (facts.firstHome < 0) facts.firstHome = tick;
        if (this.wall && this.picked[i] > this.wall.last) this.noteDetour();
        if (this.sparks.length < MOST_SPARKS) this.sparks.push({ cell: e.queen, food: false, age: 0 });
      }
    }
  }

  /** Note what was drawn or set since the last call: by the visitor, or by a replay. */
  noteEvents() {
    const { events } = this.engine;
    for (; this.seen < events.length; this.seen++) {
      const event = events[this.seen];
      if (event.do === "ants") this.picked.fill(-1, event.value);
      if (event.do === "rock") this.noteWall(event);
      else if (event.do === "food") this.noteGift(event);
      else if (this.wall) this.wall.compares = false; // the rate before the wall was that of other settings
    }
  }

  cellsOf({ path, reach }) { return new Set(path.flatMap((cell) => this.engine.disc(cell, reach))); }

  /** Rock was drawn: does it cross where carriers walked lately? The detour counts from the last piece of a wall. */
  noteWall(event) {
    let crossed = 0;
    for (const cell of this.cellsOf(event)) crossed += this.engine.traffic[cell];
    const old = this.wall;
    if (old && event.tick - old.last <= SAME_STROKE && old.detour < 0) Object.assign(old, { last: event.tick, came: 0 });
    else {
      this.wall = { tick: event.tick, last: event.tick, traffic: 0, came: 0, detour: -1, stopped: false, crossed: false,
                    compares: true, rate: this.sum(WINDOW), number: old ? old.number + 1 : 1 };
      this.mark("wall");
    }
    this.wall.traffic += crossed;
    this.wall.crossed = this.wall.traffic >= BLOCKS;
  }

  /** A load that was picked up after the wall was finished is home. */
  noteDetour() {
    if (++this.wall.came !== DETOUR || !this.wall.crossed) return;
    this.wall.detour = this.tick;
    this.mark("detour");
  }

  noteGift(event) {
    if (this.wall) this.wall.compares = false;
    const old = this.gift;
    if (!old || event.tick - old.last > SAME_STROKE) {
      this.gift = { tick: event.tick, last: event.tick, found: -1, taken: 0, number: old ? old.number + 1 : 1,
                    cells: new Set(old ? old.cells : []) };
    }
    this.gift.last = event.tick;
    for (const cell of this.cellsOf(event)) this.gift.cells.add(cell);
  }

  /** Whether food that an ant on a cell has just taken was drawn by the visitor: it came from no detour. */
  isGift(cell) {
    const { gift, engine } = this;
    if (!gift || !STEPS.some(([q, r]) => gift.cells.has(cell + q + r * engine.width))) return false;
    if (gift.found < 0) gift.found = this.tick;
    gift.taken++;
    return true;
  }

  /** The ends of the wall that would hurt most, across the measured traffic; null without food. */
  suggestion() {
    const e = this.engine, place = (cell) => centre(e.q(cell), e.r(cell)), nest = place(e.queen);
    const apart = (a, b) => hexDistance(e.q(a) - e.q(b), e.r(a) - e.r(b));
    const foods = [...e.laid.keys()].filter((cell) => e.laid[cell] === FOOD);
    if (!foods.length) return null;
    const nearest = foods.reduce((a, b) => (apart(b, e.queen) < apart(a, e.queen) ? b : a));
    const pile = foods.filter((cell) => apart(cell, nearest) <= 9).map(place);
    const mean = (axis) => pile.reduce((sum, point) => sum + point[axis], 0) / pile.length;
    const dx = mean(0) - nest[0], dy = mean(1) - nest[1], length = Math.hypot(dx, dy), ux = dx / length, uy = dy / length;
    let total = 0, side = 0; // where traffic crosses the middle of the way
    for (let cell = 0; cell < e.size; cell++) {
      if (!(e.traffic[cell] > 0.3)) continue;
      const [x, y] = place(cell), along = (x - nest[0]) * ux + (y - nest[1]) * uy;
      if (Math.abs(along / length - 0.47) > 0.07) continue;
      total += e.traffic[cell];
      side += e.traffic[cell] * ((y - nest[1]) * ux - (x - nest[0]) * uy);
    }
    const off = total ? side / total : 0, half = 9; // long enough to hurt, short enough for a detour
    const x = nest[0] + ux * length * 0.47 - uy * off, y = nest[1] + uy * length * 0.47 + ux * off;
    return [[x - uy * half, y + ux * half], [x + uy * half, y - ux * half]];
  }
}
