/* draw.js: a run on a canvas. Layers: ground, scent (one pixel a cell, drawn by one sheared and smoothed drawImage),
 * rocks and food, pick-ups and deliveries, ants, arrows of the policy, the brush. */

import { CAPACITY } from "./engine.js";
import { angleOf, centre, outline, ROOT3, scatter } from "./geometry.js";
import { fade, LOOKS, scentRamp } from "./looks.js";
import { FOOD, hexDistance, ROCK, STEPS } from "./worlds.js";

const DIRECTIONS = 32;          // of the pictures of ants
const MOST_PIXELS = 2;          // per CSS pixel
const DOTS = { ants: 4000, scale: 1.7 }; // more ants, or smaller cells: ants are dots
const TAU = 2 * Math.PI;
const POINTER = [[0, 0], [0, 20], [5, 15], [8, 22], [11, 21], [8, 14], [14, 14]]; // its corners, in CSS pixels

export class Painter {
  /** @type {import("./run.js").Run} */ run;
  ground = document.createElement("canvas");
  things = document.createElement("canvas");
  scent = document.createElement("canvas");  // one pixel a cell
  bloom = document.createElement("canvas");
  sprites = document.createElement("canvas");
  angles = new Float32Array(CAPACITY);

  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
  }

  /** Prepare for a run, a size of the canvas and a theme. */
  fit(run, theme) {
    const box = this.canvas.getBoundingClientRect(), e = run.engine;
    this.run = run;
    this.look = LOOKS[theme];
    this.dpr = Math.min(MOST_PIXELS, window.devicePixelRatio || 1); // pixels per CSS pixel
    const w = Math.max(1, Math.round(box.width * this.dpr)), h = Math.max(1, Math.round(box.height * this.dpr));
    for (const one of [this.canvas, this.ground, this.things]) [one.width, one.height] = [w, h];
    const margin = 6 * this.dpr, R = e.radius - 1;
    this.s = Math.max(0.1, Math.min((w - 2 * margin) / (3 * R + 2), (h - 2 * margin) / (2 * ROOT3 * R + 1.9))); // pixels per unit of geometry.js
    this.letter = Math.max(10.5 * this.dpr, 1.15 * this.s); // the size of labels
    this.x0 = w / 2; // where the origin of geometry.js is
    this.y0 = h / 2;
    this.headroom = (h / 2 + (ROOT3 * R + 2) * this.s) / this.dpr; // CSS pixels from the bottom to the top of the world
    this.scent.width = this.scent.height = e.width;
    this.bloom.width = this.bloom.height = Math.ceil(e.width / 3);
    this.image = this.scent.getContext("2d").createImageData(e.width, e.width);
    this.pixels = new Uint32Array(this.image.data.buffer);
    this.shown = new Float32Array(e.size); // levels of scent on their way to the present ones
    this.blurred = new Float32Array(e.size);
    this.ramp = scentRamp(this.look.scent);
    for (let i = 0; i < e.ants; i++) this.angles[i] = angleOf(e.headings[i]);
    this.drawSprites();
    this.drawGround();
    this.drawThings();
  }

  /** The point of the canvas at a point of geometry.js. @returns {[number, number]} */
  at([x, y]) { return [this.x0 + x * this.s, this.y0 + y * this.s]; }

  place(cell) { return this.at(centre(this.run.engine.q(cell), this.run.engine.r(cell))); }

  /** The point of geometry.js under a pointer. @returns {[number, number]} */
  under(event) {
    const box = this.canvas.getBoundingClientRect();
    return [((event.clientX - box.left) * this.dpr - this.x0) / this.s, ((event.clientY - box.top) * this.dpr - this.y0) / this.s];
  }

  /** Pictures of an ant in 32 directions (columns), without and with food, each in two steps of its gait (rows). */
  drawSprites() {
    const length = Math.max(2.1 * this.s, 7.2 * this.dpr), side = Math.ceil(length * 1.6), { look } = this;
    const small = length < 11 * this.dpr;
    this.antLength = length;
    this.spriteSide = side;
    [this.sprites.width, this.sprites.height] = [side * DIRECTIONS, side * 4];
    const x = this.sprites.getContext("2d");
    for (let row = 0; row < 4; row++) {
      for (let column = 0; column < DIRECTIONS; column++) {
        x.save();
        x.translate((column + 0.5) * side, (row + 0.5) * side);
        x.rotate(column * TAU / DIRECTIONS);
        x.scale(length, length);
        [x.shadowColor, x.shadowBlur, x.shadowOffsetY] = [look.shadow, 2.5 * this.dpr, this.dpr];
        drawLegs(x, look, row & 1 ? 0.07 : -0.07, small);
        x.fillStyle = look.ant;
        for (const [place, rx, ry] of [[-0.27, 0.19, 0.125], [0.02, 0.125, 0.08], [0.25, 0.105, 0.095]]) oval(x, place, 0, rx, ry).fill();
        if (row > 1) drawLoad(x, look, small);
        x.restore();
      }
    }
  }

  /** The outline of the world as a path, `grow` units outside the centres of its outer cells. */
  hexagon(x, grow = 0) {
    const R = this.run.engine.radius - 1 + grow / ROOT3;
    lines(x, STEPS.map(([q, r]) => this.at(centre(q * R, r * R)))).closePath();
  }

  drawGround() {
    const x = this.ground.getContext("2d"), { look, s } = this, { width, height } = this.ground;
    x.lineJoin = "round";
    this.hexagon(x);
    [x.lineWidth, x.strokeStyle] = [2.4 * s, look.rim];
    x.stroke();
    const floor = x.createRadialGradient(width / 2, height / 2, 0, width / 2, height / 2, Math.max(width, height) * 0.52);
    look.floor.forEach((colour, k) => floor.addColorStop(k, colour));
    [x.lineWidth, x.strokeStyle, x.fillStyle] = [2 * s, floor, floor];
    x.stroke();
    x.fill();
    x.save();
    this.hexagon(x, 0.9);
    x.clip();
    x.fillStyle = look.grain;
    for (let k = 0; k < 5200; k++) {
      const size = (0.5 + scatter(k, 3, 100) / 75) * this.dpr;
      x.fillRect(scatter(k, 1, 4096) / 4096 * width, scatter(k, 2, 4096) / 4096 * height, size, size);
    }
    glow(x, this.place(this.run.engine.queen), 8.5 * s, look.nestGlow);
    x.restore();
  }

  /** Rocks, food and the nest: drawn again only after something has changed. */
  drawThings() {
    const e = this.run.engine, x = this.things.getContext("2d"), { look, s } = this;
    const rocks = [], foods = [];
    for (let cell = 0; cell < e.size; cell++) {
      if (e.laid[cell] === FOOD) foods.push(cell);
      else if (this.isRock(cell)) rocks.push(cell);
    }
    x.clearRect(0, 0, this.things.width, this.things.height);
    this.drawRocks(x, rocks);
    for (const cell of foods) glow(x, this.place(cell), 3.2 * s, look.foodGlow);
    for (const cell of foods) this.drawFood(x, cell);
    this.drawNest(x);
    this.piles = this.pilesOf(foods);
    e.changed = false;
  }

  isRock(cell) {
    const e = this.run.engine;
    return e.laid[cell] === ROCK && e.exists(e.q(cell), e.r(cell));
  }

  drawRocks(x, rocks) {
    const { look, s } = this, shape = outline(this.run.engine, rocks, (cell) => this.isRock(cell), (point) => this.at(point));
    const moved = (y, draw) => { x.translate(0, y); draw(); x.translate(0, -y); };
    x.fillStyle = look.rockShade;
    moved(0.8 * s, () => x.fill(shape));
    x.fillStyle = look.rockLow;
    x.fill(shape);
    x.save();
    x.clip(shape);
    x.fillStyle = look.rock; // lit from above: the same shape, moved up, leaves a dark rim below
    moved(-0.42 * s, () => x.fill(shape));
    [x.lineWidth, x.strokeStyle, x.globalAlpha] = [0.34 * s, look.rockTop, 0.85];
    moved(0.1 * s, () => x.stroke(shape));
    for (const cell of rocks) { // pits and grains
      const [a, b] = this.place(cell), k = scatter(cell, 11, 100);
      if (k >= 62) continue;
      [x.fillStyle, x.globalAlpha] = k & 1 ? [look.rockLow, 0.5] : [look.rockTop, 0.28];
      const [px, py] = [12, 13].map((axis) => (scatter(cell, axis, 100) / 50 - 1) * 0.8 * s);
      oval(x, a + px, b + py, (0.08 + k / 260) * s, (0.06 + k / 380) * s, k).fill();
    }
    x.restore();
  }

  drawFood(x, cell) {
    const { look, s } = this, [a, b] = this.place(cell), size = (0.5 + scatter(cell, 23, 100) / 420) * s;
    const px = a + (scatter(cell, 21, 100) / 100 - 0.5) * 0.3 * s, py = b + (scatter(cell, 22, 100) / 100 - 0.5) * 0.3 * s;
    for (const [colour, dx, dy, radius, alpha] of [[1, 0, 0.1, 1, 1], [0, 0, 0, 0.92, 1], [2, -0.16, -0.18, 0.34, 0.8]]) {
      [x.fillStyle, x.globalAlpha] = [look.food[colour], alpha];
      oval(x, px + dx * s, py + dy * s, size * radius).fill();
    }
    x.globalAlpha = 1;
  }

  drawNest(x) {
    const { look } = this, [nx, ny] = this.place(this.run.engine.queen), size = Math.max(this.s, 3 * this.dpr);
    [x.fillStyle, x.strokeStyle, x.globalAlpha, x.lineWidth] = [look.nest, look.nest, 0.45, 0.16 * size];
    oval(x, nx, ny, 1.55 * size).stroke();
    x.globalAlpha = 1;
    x.save();
    x.translate(nx, ny);
    x.rotate(-0.5);
    for (const [place, rx, ry] of [[-0.62, 0.62, 0.4], [0.16, 0.34, 0.25], [0.66, 0.27, 0.25]]) // the queen
      oval(x, place * size, 0, rx * size, ry * size).fill();
    x.restore();
  }

  /** Where to write "food": above some piles, so that labels do not overlap. */
  pilesOf(foods) {
    const e = this.run.engine, piles = [];
    for (const cell of foods) {
      const near = piles.find((pile) => pile.some((one) => hexDistance(e.q(one) - e.q(cell), e.r(one) - e.r(cell)) < 3));
      if (near) near.push(cell);
      else piles.push([cell]);
    }
    return piles.filter((pile) => pile.length > 4).map((pile) => {
      const places = pile.map((cell) => this.place(cell));
      return [places.reduce((sum, [px]) => sum + px / places.length, 0), Math.min(...places.map(([, py]) => py)) - this.letter];
    }).filter(([px, py], k, all) => all.slice(0, k).every(([a, b]) => this.isApart(px - a, py - b))).slice(0, 4);
  }

  /** Draw a frame. `part` of the present tick has passed, `passed` seconds since the frame before. */
  frame(part, passed, ui) {
    const x = this.context, e = this.run.engine, { s } = this;
    if (e.changed) this.drawThings();
    x.setTransform(1, 0, 0, 1, 0, 0);
    [x.globalCompositeOperation, x.globalAlpha] = ["copy", 1];
    x.drawImage(this.ground, 0, 0);
    x.globalCompositeOperation = "source-over";
    this.drawScent(x, passed);
    x.drawImage(this.things, 0, 0);
    if (ui.arrows) this.drawArrows(x, ui);
    this.drawSparks(x, passed, ui);
    const size = this.letter, [nx, ny] = this.place(e.queen);
    if (s < DOTS.scale * this.dpr || e.ants > DOTS.ants) this.drawDots(x, part);
    else this.drawAnts(x, part, passed, ui);
    const below = Math.max(4.4 * s, 18 * this.dpr), fits = ny + below + size < this.canvas.height;
    this.label(x, "nest", nx, fits ? ny + below : ny - below, size);
    for (const [fx, fy] of this.piles) this.label(x, "food", fx, fy, size);
    this.labelScent(x, nx, ny, size);
    if (ui.ghost) this.drawGhost(x, ui);
    if (ui.pointer) this.drawBrush(x, ui);
  }

  label(x, text, px, py, size) {
    x.font = `600 ${size}px Inter, system-ui, sans-serif`;
    [x.textAlign, x.textBaseline, x.shadowColor, x.shadowBlur] = ["center", "middle", this.look.halo, 5 * this.dpr];
    x.fillStyle = this.look.label;
    x.fillText(text, px, py);
    x.fillText(text, px, py); // the halo is twice as strong
    x.shadowBlur = 0;
  }

  /** Whether two labels that are so far apart do not overlap. */
  isApart(dx, dy) { return Math.abs(dx) > 3.5 * this.letter || Math.abs(dy) > 1.5 * this.letter; }

  /** Write "scent" on the way to the food, for as long as scent lies there. */
  labelScent(x, nx, ny, size) {
    const { levels } = this.run.engine, [pile] = this.piles;
    let near = 12 * this.s, found = levels[this.scented] ? this.scented : 0;
    for (let cell = 0; pile && !levels[this.scented] && cell < levels.length; cell++) {
      if (levels[cell] < 60) continue;
      const [px, py] = this.place(cell), far = Math.hypot(px - 0.35 * nx - 0.65 * pile[0], py - 0.35 * ny - 0.65 * pile[1]);
      if (far < near && this.piles.every(([fx, fy]) => this.isApart(px - fx, py - fy))) [near, found] = [far, cell];
    }
    this.scented = found;
    if (found) this.label(x, "scent", ...this.place(found), size);
  }

  /** Levels ease towards the present ones; two rounds of averages over neighbours hide the shear of the pixels. */
  drawScent(x, passed) {
    const e = this.run.engine, { shown, blurred, pixels, ramp, s } = this, W = e.width, { levels } = e;
    const ease = 1 - Math.exp(-passed * 9), last = shown.length - W - 1;
    for (let i = 0; i < shown.length; i++) {
      const v = shown[i];
      shown[i] = levels[i] || v > 0.02 ? v + (levels[i] - v) * ease : 0;
    }
    for (let i = W + 1; i < last; i++) {
      blurred[i] = shown[i] * 0.4 + 0.1 * (shown[i - 1] + shown[i + 1] + shown[i - W] + shown[i + W] + shown[i - W - 1] + shown[i + W + 1]);
    }
    for (let i = W + 1; i < last; i++) {
      const around = blurred[i - 1] + blurred[i + 1] + blurred[i - W] + blurred[i + W] + blurred[i - W - 1] + blurred[i + W + 1];
      pixels[i] = ramp[blurred[i] * 0.46 + around * 0.09 | 0];
    }
    this.scent.getContext("2d").putImageData(this.image, 0, 0);
    const bloom = this.bloom.getContext("2d");
    bloom.globalCompositeOperation = "copy";
    bloom.drawImage(this.scent, 0, 0, this.bloom.width, this.bloom.height);
    const k = ROOT3 * s, o = e.radius + 0.5;
    x.save();
    this.hexagon(x, 0.9);
    x.clip();
    [x.globalCompositeOperation, x.imageSmoothingEnabled, x.imageSmoothingQuality] = [this.look.blend, true, "high"];
    // Pixel (column q, row r) -> x = 1.5 s r, y = sqrt(3) s (r / 2 - q): one affine map.
    x.setTransform(0, -k, 1.5 * s, k / 2, this.x0 - 1.5 * s * o, this.y0 + k * o - k / 2 * o);
    x.globalAlpha = this.look.bloom;
    x.drawImage(this.bloom, 0, 0, W, e.width);
    x.globalAlpha = 1;
    x.drawImage(this.scent, 0, 0);
    x.restore();
  }

  drawDots(x, part) {
    const e = this.run.engine, W = e.width, R = e.radius, d = Math.max(1.5 * this.dpr, 1.25 * this.s);
    const X = 1.5 * this.s, Y = ROOT3 * this.s;
    for (const load of [0, 1]) {
      x.fillStyle = load ? this.look.load : this.look.ant;
      for (let i = 0; i < e.ants; i++) {
        if ((e.looks[i] & 1) !== load) continue;
        const a = e.before[i], b = e.cells[i];
        const r = (a / W | 0) * (1 - part) + (b / W | 0) * part - R, q = (a % W) * (1 - part) + (b % W) * part - R;
        x.fillRect(this.x0 + X * r - d / 2, this.y0 + Y * (r / 2 - q) - d / 2, d, d);
      }
    }
  }

  /** Ants on a quadratic B-spline through their last three cells: no corners, half a tick late. */
  drawAnts(x, part, passed, ui) {
    const { run, s, angles, spriteSide: side } = this, e = run.engine, W = e.width, R = e.radius;
    const f = part, g = 1 - part, u = g * g / 2, v = (1 + 2 * f * g) / 2, w = f * f / 2;
    const turn = ui.still ? 1 : 1 - Math.exp(-passed * 16), step = Math.floor((run.tick + part) * 2);
    x.imageSmoothingQuality = "low";
    for (let i = 0; i < e.ants; i++) {
      const a = e.before2[i], b = e.before[i], c = e.cells[i];
      const ra = (a / W | 0) - R, rb = (b / W | 0) - R, rc = (c / W | 0) - R, qa = a % W - R, qb = b % W - R, qc = c % W - R;
      const r = ra * u + rb * v + rc * w, q = qa * u + qb * v + qc * w;
      const dr = g * (rb - ra) + f * (rc - rb), dq = g * (qb - qa) + f * (qc - qb);
      const vx = 1.5 * dr, vy = ROOT3 * (dr / 2 - dq), moving = vx * vx + vy * vy > 0.02;
      let off = (moving ? Math.atan2(vy, vx) : angleOf(e.headings[i])) - angles[i];
      off -= Math.round(off / TAU) * TAU;
      const angle = angles[i] += off * turn, column = ((Math.round(angle * DIRECTIONS / TAU) % DIRECTIONS) + DIRECTIONS) % DIRECTIONS;
      const aside = ((i * 37) % 16 / 15 - 0.5) * 0.34 * s; // each ant keeps to its own side of a lane
      const px = this.x0 + 1.5 * s * r - Math.sin(angle) * aside, py = this.y0 + ROOT3 * s * (r / 2 - q) + Math.cos(angle) * aside;
      const row = (e.looks[i] & 1) * 2 + (moving && (i + step) & 1);
      x.drawImage(this.sprites, column * side, row * side, side, side, px - side / 2, py - side / 2, side, side);
      if (i === ui.hero || i === ui.followed) this.ring(x, px, py, i === ui.hero, ui);
    }
  }

  ring(x, px, py, hero, ui) {
    const beat = hero && !ui.still ? 1.15 + 0.2 * Math.sin(ui.now / 260) : 1;
    [x.strokeStyle, x.lineWidth] = [hero ? this.look.load : this.look.ghost, 1.6 * this.dpr];
    oval(x, px, py, this.antLength * 0.95 * beat).stroke();
  }

  drawSparks(x, passed, ui) {
    const { run, s, look } = this;
    run.sparks = run.sparks.filter((spark) => (spark.age += passed * 1.6) < 1);
    if (ui.still) return;
    for (const { cell, food, age } of run.sparks) {
      x.globalAlpha = (1 - age) * (food ? 0.7 : 0.4);
      [x.strokeStyle, x.lineWidth] = [food ? look.food[2] : look.nest, (1 - age) * 0.35 * s + 0.5];
      oval(x, ...this.place(cell), (food ? 0.6 + 1.4 * age : 1.6 + 4.2 * age) * s).stroke();
    }
    x.globalAlpha = 1;
  }

  /** Where an ant would go next on each cell, on average over its headings: the best action of the table. */
  drawArrows(x, ui) {
    const e = this.run.engine, { s } = this, carries = ui.arrows === "loaded" ? 1 : 0, spacing = e.size > 8000 ? 4 : 2;
    [x.strokeStyle, x.lineWidth, x.lineCap] = [carries ? this.look.load : this.look.arrow, Math.max(1, 0.2 * s), "round"];
    x.beginPath();
    for (let r = 1 - e.radius; r < e.radius; r += spacing) {
      for (let q = 1 - e.radius; q < e.radius; q += spacing) {
        const cell = e.at(q, r);
        if (!STEPS.every(([a, b]) => e.exists(q + a, r + b))) continue;
        if (e.laid[cell] === FOOD || this.isRock(cell) || cell === e.queen) continue;
        const [dx, dy] = flowAt(e, cell, carries), length = Math.hypot(dx, dy);
        if (length < 0.12) continue;
        const [px, py] = this.at(centre(q, r)), k = s * 1.35 * Math.min(1, length * 1.6) / length, ux = dx * k, uy = dy * k;
        x.moveTo(px - ux, py - uy);
        for (const aside of [0.32, -0.32]) { // the shaft and a half of the head, then the other half
          x.lineTo(px + ux, py + uy);
          x.lineTo(px + 0.5 * ux - aside * uy, py + 0.5 * uy + aside * ux);
        }
      }
    }
    x.stroke();
  }

  /** A pointer that drags a wall along a dashed line, over and over. */
  drawGhost(x, ui) {
    const { dpr, look } = this, [[ax, ay], [bx, by]] = ui.ghost.map((point) => this.at(point));
    const cycle = ui.still ? 0.5 : ui.now / 2600 % 1, t = Math.min(1, cycle / 0.7), ease = t * t * (3 - 2 * t);
    const hx = ax + (bx - ax) * ease, hy = ay + (by - ay) * ease;
    [x.lineCap, x.strokeStyle, x.fillStyle] = ["round", look.ghost, look.ghost];
    const line = (alpha, width, dash, px, py) => {
      [x.globalAlpha, x.lineWidth] = [alpha, width];
      x.setLineDash(dash);
      lines(x, [[ax, ay], [px, py]]).stroke();
    };
    line(0.9, 2 * dpr, [5 * dpr, 7 * dpr], bx, by);
    line(0.4, 3.4 * this.s, [], hx, hy);
    x.globalAlpha = 1;
    [x.strokeStyle, x.lineWidth] = [look.halo, 2.5 * dpr];
    lines(x, POINTER.map(([px, py]) => [hx + px * dpr, hy + py * dpr])).closePath();
    x.stroke();
    x.fill();
    this.label(x, "drag", hx + 34 * dpr, hy + 17 * dpr, 15 * dpr);
  }

  /** The cells that the brush would change. */
  drawBrush(x, ui) {
    const e = this.run.engine, { look, s } = this;
    const colour = { rock: look.rockTop, food: look.food[0], scent: look.scentBrush, erase: look.ghost }[ui.brush];
    if (!colour || !e.exists(...ui.pointer)) return;
    const cells = new Set(e.disc(e.at(...ui.pointer), ui.reach));
    const shape = outline(e, [...cells], (cell) => cells.has(cell), (point) => this.at(point));
    [x.fillStyle, x.strokeStyle, x.lineWidth] = [colour, colour, 1.5 * this.dpr];
    x.globalAlpha = ui.down ? 0.2 : 0.35;
    x.fill(shape);
    x.globalAlpha = 0.9;
    x.stroke(shape);
    x.globalAlpha = 1;
    if (ui.focused) { // by keyboard, the brush must be found
      oval(x, ...this.at(centre(...ui.pointer)), (ui.reach * ROOT3 + 2.4) * s).stroke();
    }
  }
}

/** The mean step of ants on a cell over their six headings, by the best actions of their table. */
function flowAt(engine, cell, carries) {
  let dx = 0, dy = 0;
  for (let heading = 0; heading < 6; heading++) {
    const { best } = engine.policy(cell, heading, carries);
    for (const action of best) {
      if (action > 2 || best.length > 3) continue; // no step, or nothing learned
      const [x, y] = centre(...STEPS[(heading + action + 5) % 6]);
      dx += x / best.length / 6 / ROOT3;
      dy += y / best.length / 6 / ROOT3;
    }
  }
  return [dx, dy];
}

/** The outline of an ellipse, or of a circle, as the path of a context. @returns {CanvasRenderingContext2D} */
function oval(x, px, py, across, along = across, angle = 0) {
  x.beginPath();
  x.ellipse(px, py, across, along, angle, 0, TAU);
  return x;
}

/** Lines between points as the path of a context. @returns {CanvasRenderingContext2D} */
function lines(x, points) {
  x.beginPath();
  for (const [px, py] of points) x.lineTo(px, py);
  return x;
}

/** A glow around a point, in a colour that ends with its opacity. */
function glow(x, [px, py], radius, colour) {
  const gradient = x.createRadialGradient(px, py, 0, px, py, radius);
  gradient.addColorStop(0, colour);
  gradient.addColorStop(1, fade(colour));
  x.fillStyle = gradient;
  x.fillRect(px - radius, py - radius, 2 * radius, 2 * radius);
}

function drawLegs(x, look, swing, small) {
  [x.strokeStyle, x.lineWidth, x.lineCap] = [look.legs, small ? 0.05 : 0.042, "round"];
  x.beginPath();
  for (const side of [-1, 1]) {
    for (let pair = -1; pair <= 1; pair++) {
      const moved = swing * (pair === 0 ? -side : side);
      x.moveTo(0.02 + pair * 0.07, 0);
      x.quadraticCurveTo(pair * 0.2 + moved * 0.5, side * 0.22, pair * 0.27 + moved - 0.02, side * 0.34);
    }
    x.moveTo(0.3, side * 0.03); // an antenna
    x.quadraticCurveTo(0.42, side * 0.08, 0.5, side * 0.17);
  }
  x.stroke();
}

/** Food in front of the head, with a ring: shape and size tell it from scent, not only its colour. */
function drawLoad(x, look, small) {
  glow(x, [0.42, 0], 0.36, look.loadGlow);
  [x.fillStyle, x.strokeStyle, x.lineWidth] = [look.load, look.edge, 0.07];
  oval(x, 0.42, 0, small ? 0.2 : 0.165).stroke();
  x.shadowColor = "transparent";
  x.fill();
}
