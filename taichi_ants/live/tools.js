/* Tools for mouse, touch and keys: look, draw, erase, move the queen. */

const TOOLS = {
  look: ["Look", "follow an ant, select a cell, move the view", '<path d="M4.5 3 15 9.2l-4.7 1.1L8 15z"/>'],
  rock: ["Rock", "draw rock; ants in the way move aside", '<path class="fill-rock" d="M16.5 10l-3.2 5.6H6.7L3.5 10l3.2-5.6h6.6z"/>'],
  food: ["Food", "draw food; ants in the way move aside", '<g class="fill-food"><circle cx="10" cy="6.4" r="2.9"/><circle cx="6.6" cy="12.6" r="2.9"/><circle cx="13.4" cy="12.6" r="2.9"/></g>'],
  trail: ["Trail", "draw a trail", '<path class="line-trail" d="M3.5 15.5c5 0 1.5-7 6.5-7s2 6 6.5-4"/>'],
  ants: ["Ants", "add ants", '<g class="fill-ant"><ellipse cx="10" cy="5.2" rx="1.9" ry="1.7"/><ellipse cx="10" cy="8.8" rx="1.4" ry="2"/><ellipse cx="10" cy="13.8" rx="2.6" ry="3.6"/></g><path d="m7 4-2.2-1.6M13 4l2.2-1.6M8.4 8.6 4.6 8M11.6 8.6l3.8-.6M7.6 12 4 14.5M12.4 12l3.6 2.5"/>'],
  erase: ["Erase", "erase rock, food, trails and ants", '<path d="m8 16.2-4-4 7.6-7.6a1.4 1.4 0 0 1 2 0l2.3 2.3a1.4 1.4 0 0 1 0 2L8.6 16.2H16M7.2 8.9l4.5 4.5"/>'],
  queen: ["Queen", "move the queen", '<path class="fill-queen" d="M2.8 7 7 9.2 10 4.4l3 4.8L17.2 7 15.6 15H4.4z"/>'],
};
const MOST_RADIUS = 4;

class Tools {
  constructor(live) {
    this.live = live;
    this.name = "look";
    this.radius = 0;
    this.at = -1; // the cell under the mouse
    this.last = -1; // the last cell of the stroke
    this.stroke = new Set(); // cells of the stroke so far
    this.fresh = new Set(); // cells that are not sent yet
    const bar = byId("palette");
    bar.innerHTML = Object.entries(TOOLS).map(([name, [label, does, drawing]], number) =>
      `<button type="button" class="icon" data-tool="${name}" aria-pressed="false" aria-label="${label}: ${does}" title="${label}: ${does} (${number + 1})">
        <svg viewBox="0 0 20 20" aria-hidden="true">${drawing}</svg><span>${label}</span></button>`).join("")
      + `<button type="button" class="icon" id="undo" disabled title="Undo: return to the moment before the last change (Ctrl+Z)">
        <svg viewBox="0 0 20 20" aria-hidden="true"><path d="M7.5 4.5 4 8l3.5 3.5M4.4 8h7.1a4.2 4.2 0 0 1 0 8.4H8"/></svg><span>Undo</span></button>`
      + '<label id="kind-label" title="Kind of food" hidden><span class="unseen">Kind of food</span><select id="kind"></select></label>'
      + `<label class="brush" title="Brush size ([ and ])"><span class="unseen">Brush size</span>
        <input type="range" id="brush" min="1" max="${MOST_RADIUS + 1}" value="1" step="1"></label>`;
    document.querySelector(".stage").append(bar);
    bar.addEventListener("click", (event) => {
      const { tool } = event.target.closest("button")?.dataset ?? {};
      if (tool) this.choose(tool);
    });
    byId("brush").addEventListener("input", () => this.setRadius(Number(byId("brush").value) - 1));
    live.acts = { "[": () => this.setRadius(this.radius - 1), "]": () => this.setRadius(this.radius + 1) };
    Object.keys(TOOLS).forEach((name, number) => (live.acts[number + 1] = () => this.choose(name)));
    live.keys = [
      ["1 2 3 4 5 6 7", `choose a tool: ${Object.values(TOOLS).map(([label]) => label.toLowerCase()).join(", ")}`],
      ["[ ]", "smaller or larger brush"], ["Enter", "use the tool at the cell cursor"],
      ["Ctrl+Z", "undo the last change"],
    ];
    live.news.addEventListener("begin", () => this.choose(this.name));
  }

  choose(name) {
    this.name = name;
    for (const one of document.querySelectorAll("[data-tool]")) one.setAttribute("aria-pressed", one.dataset.tool === name);
    byId("brush").disabled = name === "look" || name === "queen";
    byId("world").style.cursor = name === "look" ? "" : "crosshair";
    const { viewer } = this.live;
    if (!viewer) return;
    const { foods } = viewer.history.header, kind = byId("kind");
    byId("kind-label").hidden = name !== "food" || foods.length < 2;
    if (kind.length !== foods.length || foods.some((one, n) => kind[n].value !== one)) {
      kind.replaceChildren(...foods.map((one) => new Option(one)));
    }
    viewer.stage.covered = 62;
    if (viewer.stage.fitted) viewer.stage.fit();
    viewer.tool = name === "look" ? null : this;
    viewer.dirty = true;
  }

  setRadius(radius) {
    this.radius = Math.min(Math.max(radius, 0), MOST_RADIUS);
    byId("brush").value = this.radius + 1;
    byId("brush").style.setProperty("--filled", `${(100 * this.radius) / MOST_RADIUS}%`);
    this.live.viewer.dirty = true;
  }

  /* The cells under the brush. */
  cells() {
    return this.at < 0 ? [] : this.around(this.at);
  }

  around(cell) {
    const { grid } = this.live.viewer.history, found = new Set([cell]);
    for (let ring = this.name === "queen" ? 0 : this.radius; ring > 0; ring--) {
      for (const one of [...found]) for (const offset of grid.offsets) if (grid.exists(one + offset)) found.add(one + offset);
    }
    return [...found];
  }

  down(cell) {
    this.stroke.clear();
    this.aside = 0; // number of ants that the stroke has moved
    this.number = this.live.nextStroke();
    this.last = -1;
    this.draw(cell);
  }

  move(cell, works) {
    this.at = cell;
    if (works) this.draw(cell);
  }

  up() {
    if (this.name === "queen" && this.last >= 0) this.edit("place", { what: "queen", ...this.nest(this.last) }, [this.last]);
    this.send();
    this.last = -1;
    if (this.aside) this.live.controls.say(`${this.aside} ${this.aside > 1 ? "ants" : "ant"} moved aside.`);
  }

  /* The pheromone that the page shows, as {field}; {} for the trail. */
  field() {
    const field = this.live.viewer.history.pheromone.name;
    return field === "trail" ? {} : { field };
  }

  /* The nest of the queen nearest to a cell, as {nest}; {} for the first nest. */
  nest(cell) {
    const { history } = this.live.viewer, [x, y] = history.grid.centre(cell);
    const far = [...history.frames[history.length - 1].queens].map((queen) => {
      const [across, down] = history.grid.centre(queen);
      return Math.hypot(across - x, down - y);
    });
    const nest = far.indexOf(Math.min(...far));
    return nest > 0 ? { nest } : {};
  }

  /* Extend the stroke to a cell, with all cells on the way. */
  draw(cell) {
    if (cell < 0 || !this.live.open) return;
    const { grid } = this.live.viewer.history, [x1, y1] = grid.centre(cell);
    const [x0, y0] = this.last < 0 ? [x1, y1] : grid.centre(this.last), n = Math.ceil(Math.hypot(x1 - x0, y1 - y0));
    for (let k = 0; k <= n; k++) {
      const share = n ? k / n : 1, passed = grid.at(x0 + share * (x1 - x0), y0 + share * (y1 - y0));
      for (const one of passed < 0 ? [] : this.around(passed)) {
        if (this.stroke.has(one)) continue;
        this.stroke.add(one);
        if (!this.fresh.size) requestAnimationFrame(() => this.send());
        this.fresh.add(one);
      }
    }
    this.last = cell;
  }

  /* Send the edits of the new part of a stroke. */
  send() {
    const cells = [...this.fresh];
    this.fresh.clear();
    if (!cells.length || this.name === "queen") return;
    const { history } = this.live.viewer;
    const { ground, trail } = history.worldAt(history.length - 1);
    const taken = new Set(history.frames[history.length - 1].cells);
    const free = cells.filter((cell) => ground[cell] !== QUEEN && !taken.has(cell));
    if (this.name === "rock" || this.name === "food") {
      this.aside += cells.filter((cell) => taken.has(cell)).length;
      const kind = this.name === "food" && history.header.foods.length > 1 ? { kind: byId("kind").value } : {};
      this.edit("place", { what: this.name, ...kind }, cells.filter((cell) => ground[cell] !== QUEEN));
    } else if (this.name === "trail") {
      this.edit("trail", { level: history.pheromone.strongest, ...this.field() }, cells.filter((cell) => ground[cell] !== OBSTACLE));
    } else if (this.name === "ants") this.edit("add_ants", {}, free.filter((cell) => ground[cell] === EMPTY));
    else {
      if (this.live.choices) this.edit("remove_ants", {}, cells.filter((cell) => taken.has(cell)));
      this.edit("clear", {}, free.filter((cell) => ground[cell] !== EMPTY));
      this.edit("trail", { level: 0, ...this.field() }, cells.filter((cell) => trail[cell] > 0));
    }
  }

  edit(name, settings, cells) {
    if (cells.length) this.live.edit({ [name]: { ...settings, cells } }, this.number);
  }
}
