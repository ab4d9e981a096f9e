/* brush.js: drawing into the world, by pointer, touch or keyboard; and picking an ant with the eye. */

import { cellAt, centre, lineTo } from "./geometry.js";
import { STEPS } from "./worlds.js";

const HEADINGS = { ArrowUp: [0, 0], ArrowDown: [3, 3], ArrowRight: [1, 2], ArrowLeft: [5, 4] }; // in even and odd columns: the brush keeps its row
const NEAR = 3.5; // of an ant that is picked, in the unit of geometry.js

/**
 * A stroke is a path of adjacent cells. What is drawn between two frames is one event, and the next event goes on
 * with the cell after it.
 */
export class Brush {
  /** @param {any} lab  @param {{canvas: HTMLCanvasElement, painter: import("./draw.js").Painter, run: any}} side */
  constructor(lab, side) {
    this.lab = lab;
    this.side = side;
    this.end = null; // the last cell of the stroke
    this.fresh = []; // cells that are not applied yet
    const on = (name, act) => side.canvas.addEventListener(name, act);
    on("pointerdown", (event) => this.press(event));
    on("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"]) on(name, (event) => this.lift(event));
    on("pointerleave", () => { if (!lab.ui.down) lab.ui.pointer = null; });
    on("keydown", (event) => this.key(event));
    on("focus", () => { lab.ui.focused = side.canvas.matches(":focus-visible"); });
    on("blur", () => { [lab.ui.focused, lab.ui.pointer] = [false, null]; this.lift(); });
  }

  press(event) {
    if (event.button) return;
    const { ui } = this.lab;
    this.side.canvas.setPointerCapture(event.pointerId);
    ui.focused = false;
    ui.pointer = cellAt(...this.side.painter.under(event));
    if (ui.brush === "look") this.pick(this.side.painter.under(event));
    else this.lower();
  }

  move(event) {
    const { ui } = this.lab;
    ui.pointer = cellAt(...this.side.painter.under(event));
    if (!ui.down) return;
    const moves = event.getCoalescedEvents ? event.getCoalescedEvents() : [];
    for (const one of moves.length ? moves : [event]) this.drawTo(cellAt(...this.side.painter.under(one)));
  }

  lower() {
    if (!this.lab.mayDraw()) return;
    this.lab.ui.down = true;
    this.end = null;
    this.drawTo(this.lab.ui.pointer);
    this.flush();
  }

  lift(event) {
    this.flush();
    this.lab.ui.down = false;
    if (event && event.pointerType === "touch") this.lab.ui.pointer = null;
  }

  /** Extend the stroke to a cell, along a straight line, as far as the world goes. */
  drawTo(cell) {
    const { engine } = this.side.run;
    if (!engine.exists(...cell)) return;
    for (const one of this.end ? lineTo(this.end, cell) : [cell]) this.fresh.push(engine.at(...one));
    this.end = cell;
  }

  /** Apply what was drawn since the last frame. */
  flush() {
    const { lab, fresh } = this;
    if (!fresh.length) return;
    this.fresh = [];
    lab.act({ do: lab.ui.brush, reach: lab.ui.reach, path: fresh });
  }

  /** Arrows move the brush, Enter lowers and lifts it. */
  key(event) {
    const { ui } = this.lab, { engine } = this.side.run;
    if (!HEADINGS[event.key] && event.key !== "Enter") return;
    event.preventDefault();
    ui.focused = true;
    ui.pointer ||= [engine.q(engine.queen), engine.r(engine.queen)];
    const [q, r] = ui.pointer;
    if (HEADINGS[event.key]) {
      const step = STEPS[HEADINGS[event.key][r & 1]];
      if (engine.exists(q + step[0], r + step[1])) ui.pointer = [q + step[0], r + step[1]];
      if (ui.down) this.drawTo(ui.pointer);
    } else if (ui.brush === "look") this.pick(centre(q, r));
    else if (ui.down) this.lift();
    else this.lower();
  }

  /** Follow the ant nearest to a point, if one is near. */
  pick([x, y]) {
    const { engine } = this.side.run;
    let best = -1, near = NEAR;
    for (let i = 0; i < engine.ants; i++) {
      const [a, b] = centre(engine.q(engine.cells[i]), engine.r(engine.cells[i])), far = Math.hypot(a - x, b - y);
      if (far < near) [near, best] = [far, i];
    }
    this.lab.follow(best);
  }
}
