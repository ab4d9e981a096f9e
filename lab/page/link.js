/* Links: a scene and all that a visitor did, as text for an address: CODE;TICK;HASH, with the tick
 * at which it was copied and the hash of the state then. taichi_ants/lab.py replays them.
 *
 * The code is base64 for addresses of the bytes below. A number has seven bits in each byte, the
 * lowest first; all but its last byte are above 127.
 *
 *   version; world | learner << 4; rules
 *   seed, ants, 1000 epsilon, 1000 learning rate, 1000 discount, learns, first value *, level,
 *   1 + regrowth, shaping *
 *   events: ticks since the event before; then
 *     kind | reach << 3 for a stroke, its first cell, and bytes kind | n << 3:
 *       0 .. 5: n + 1 steps along this heading; 6: a wait of n + 1 ticks; 7: the end
 *     4 | setting << 3 for a setting, and its value
 *
 * Numbers marked * can be negative: n is written as 2 n, or -2 n - 1. Each part of a stroke between
 * waits is an event, which paints all cells within `reach` of its path.
 */
import { LIMITS, SIGNED, THOUSANDTHS, leastOf } from "./engine.js";
import { hexDistance, STEPS, WORLDS } from "./worlds.js";

/** @typedef {import("./worlds.js").Scene} Scene */
/** @typedef {import("./engine.js").Change} Change */

const LINK_VERSION = 1, SETTING = 4, WAIT = 6, END = 7, LONGEST_WAIT = 96;
export const STROKES = { rock: 0, food: 1, scent: 2, erase: 3, trail: 5 }; // 4 is SETTING
export const SETTING_KINDS = ["ants", "epsilon", "rate", "discount", "level", "shaping", "learns"];
const SCENE_NUMBERS = ["seed", "ants", "epsilon", "rate", "discount", "learns", "first", "level", "regrowth", "shaping"];

/**
 * The code of a visit: `engine.first` and `engine.events`.
 * @param {Scene} scene as it was at the start
 * @param {Change[]} events
 */
export function encode(scene, events) {
  const bytes = [LINK_VERSION, scene.world | scene.learner << 4, scene.rules];
  const put = (n) => {
    for (; n > 127; n = Math.floor(n / 128)) bytes.push(n % 128 + 128);
    bytes.push(n);
  };
  const putSetting = (name, value) => {
    let n = Math.round(THOUSANDTHS.includes(name) ? value * 1000 : value);
    if (name === "regrowth") n += 1;
    if (SIGNED.includes(name)) n = n < 0 ? -2 * n - 1 : 2 * n;
    put(n);
  };
  for (const name of SCENE_NUMBERS) putSetting(name, scene[name]);
  const width = 2 * WORLDS[scene.world].radius + 1;
  const heading = (from, to) => STEPS.findIndex(([q, r]) => from + q + r * width === to);
  const run = (kind, n) => {
    for (; n > 32; n -= 32) bytes.push(kind | 31 << 3);
    if (n > 0) bytes.push(kind | n - 1 << 3);
  };
  let tick = 0, last = null, end = -1; // the stroke that is open, and its last cell
  for (const event of events) {
    const stroke = "path" in event, wait = /** @type {number} */ (event.tick) - tick;
    const goesOn = stroke && last && last.do === event.do && last.reach === event.reach &&
      wait > 0 && wait <= LONGEST_WAIT && heading(end, event.path[0]) >= 0;
    if (last && !goesOn) bytes.push(END);
    if (goesOn) run(WAIT, wait);
    else put(wait);
    tick += wait;
    last = stroke ? event : null;
    if (!("path" in event)) {
      bytes.push(SETTING | SETTING_KINDS.indexOf(event.do) << 3);
      putSetting(event.do, event.value);
      continue;
    }
    const cells = goesOn ? [end, ...event.path] : event.path, steps = cells.slice(1).map((cell, k) => heading(cells[k], cell));
    if (!goesOn) {
      bytes.push(STROKES[event.do] | event.reach << 3);
      put(cells[0]);
    }
    for (let k = 0, n; k < steps.length; k += n) {
      for (n = 1; steps[k + n] === steps[k]; n++);
      run(steps[k], n);
    }
    end = cells[cells.length - 1];
  }
  if (last) bytes.push(END);
  return btoa(String.fromCharCode(...bytes)).replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "");
}

const damaged = () => new Error("This link is damaged.");

/**
 * What a code has; an error with one sentence if it is damaged.
 * @param {string} code
 * @returns {{ scene: Scene, events: Change[] }}
 */
export function decode(code) {
  if (!/^[\w-]+$/.test(code) || code.length % 4 === 1) throw damaged();
  const raw = atob(code.replaceAll("-", "+").replaceAll("_", "/"));
  let at = 0;
  const byte = () => {
    if (at >= raw.length) throw damaged();
    return raw.charCodeAt(at++);
  };
  const take = () => {
    let n = 0, unit = 1, b;
    do {
      b = byte();
      n += (b & 127) * unit;
      unit *= 128;
    } while (b > 127);
    if (n > LIMITS.seed) throw damaged();
    return n;
  };
  const takeSetting = (name) => {
    let n = take();
    if (SIGNED.includes(name)) n = n % 2 ? -(n + 1) / 2 : n / 2;
    if (name === "regrowth") n -= 1;
    if (n < leastOf(name) || n > LIMITS[name]) throw damaged();
    return THOUSANDTHS.includes(name) ? n / 1000 : n;
  };
  const version = byte(), both = byte(), rules = byte(), scene = /** @type {any} */ ({ world: both & 15, learner: both >> 4, rules });
  if (version !== LINK_VERSION || !WORLDS[scene.world] || scene.learner > 2 || (rules > 7 && rules !== 15)) throw damaged();
  for (const name of SCENE_NUMBERS) scene[name] = takeSetting(name);
  const R = WORLDS[scene.world].radius, width = 2 * R + 1, events = /** @type {any[]} */ ([]);
  let tick = 0;
  while (at < raw.length) {
    tick += take();
    const head = byte(), number = head >> 3, kind = Object.keys(STROKES).find((name) => STROKES[name] === (head & 7));
    if ((head & 7) === SETTING && SETTING_KINDS[number]) {
      events.push({ tick, do: SETTING_KINDS[number], value: takeSetting(SETTING_KINDS[number]) });
      continue;
    }
    if (!kind) throw damaged();
    const start = take();
    let q = start % width - R, r = Math.floor(start / width) - R, path = [start];
    if (hexDistance(q, r) >= R) throw damaged();
    for (let b = 0; (b & 7) !== END;) {
      b = byte();
      if ((b & 7) >= WAIT && path.length) {
        events.push({ tick, do: kind, reach: number, path });
        path = [];
      }
      if ((b & 7) === WAIT) tick += (b >> 3) + 1;
      for (let n = b >> 3; (b & 7) < WAIT && n >= 0; n--) {
        q += STEPS[b & 7][0];
        r += STEPS[b & 7][1];
        if (hexDistance(q, r) >= R) throw damaged();
        path.push((r + R) * width + q + R);
      }
    }
  }
  return { scene, events };
}

/** The part of an address after "#" that replays an engine's visit up to now. @param {any} engine */
export const linkOf = (engine) => `${encode(engine.first, engine.events)};${engine.tick};${engine.hash()}`;

/** Three lines of Python that replay it and print the hash. @param {any} engine */
export const pythonOf = (engine) => `from taichi_ants import replay\nvisit = replay("${linkOf(engine)}")\nprint(visit.hash)  # ${engine.hash()}`;

/** The parts of such a text: code, and tick and hash if it has them; an error like that of `decode`. @param {string} text */
export function partsOf(text) {
  const [code, tick = "", hash = ""] = decodeURIComponent(text.slice(text.indexOf("#") + 1)).split(";");
  if (!/^\d{0,7}$/.test(tick)) throw damaged();
  return { code, tick: tick ? Number(tick) : null, hash };
}
