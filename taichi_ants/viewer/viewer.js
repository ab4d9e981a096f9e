/* The page: frames of a source, and input by mouse, touch and keys. */

const KEYS = [
  ["Space", "play or pause"],
  ["← →", "one tick back or forward; with Shift ten"],
  ["Home End", "go to the start or the end"],
  ["↑ ↓", "faster, slower"],
  ["E", "go to the next pick-up or delivery; with Shift to the previous one"],
  ["N P", "follow the next or the previous ant"],
  ["F", "keep the followed ant centred"],
  ["+ −", "zoom in or out"],
  ["W A S D", "move the view"],
  ["0", "show the whole world"],
  ["U I O J K L", "move the cell cursor to one of its six neighbours"],
  ["Enter", "follow the ant at the cursor (when the world has the focus)"],
  ["T", "switch between light and dark"],
  ["Esc", "stop following the ant, or close the cell"],
  ["?", "show this help"],
];
const CURSOR = { u: 5, i: 0, o: 1, j: 4, k: 3, l: 2 }; // headings, in the layout of the keys
const PANEL_SHARE = 0.5; // largest share of time for updates of the panel while playing

class Viewer {
  constructor(source) {
    this.source = source;
    this.history = new History(source.header);
    this.history.live = source.live;
    this.closing = new AbortController(); // removes all listeners
    this.tool = null; // {down(cell), move(cell), up()}: a drawing tool
    this.followed = -1;
    this.cell = -1;
    this.cursor = false; // whether the chosen cell is the keyboard cursor
    this.aims = false;
    this.dirty = true;
    this.frames = 0; // number of drawn frames, for measurements
    this.panelTells = -1; // the moment that the panel shows
    this.panelDue = -Infinity; // milliseconds
    this.still = matchMedia("(prefers-reduced-motion: reduce)");
    source.start((bytes, whole) => this.receive(bytes, whole));
  }

  /* Whether the page is out of date. If so, it is drawn in the next frame of the screen. A page
     without changes does nothing. */
  get dirty() {
    return this.asks;
  }
  set dirty(asks) {
    this.asks = asks;
    if (asks) this.wake();
  }

  wake() {
    if (this.opened) this.due ??= requestAnimationFrame((now) => this.tick(now));
  }

  receive(bytes, whole) {
    this.history.add(bytes, whole);
    this.dirty = true;
  }

  /* Give up the page to another viewer. */
  close() {
    this.closing.abort();
  }

  /* Build the page from at least one frame. */
  open() {
    const { header } = this.history;
    document.title = byId("title").textContent = header.title;
    byId("subtitle").textContent = header.about.map(([name, value]) => `${name}: ${value}`).slice(0, 3).join(" · ");
    document.body.classList.toggle("single", this.history.length === 1 && !this.source.live);
    const { signal } = this.closing, changed = () => (this.dirty = true);
    this.player = this.source.player?.(this.history, changed) ?? new Player(this.history, changed);
    this.stage = new Stage(byId("world"), this.history);
    this.panel = new Panel(this.history, this.stage, {
      follow: (number) => this.follow(number), unfollow: () => this.follow(-1),
      cell: (cell) => this.chooseCell(cell), other: (step) => this.followOther(step), aim: () => this.toggleAim(),
      pheromone: (number) => this.choosePheromone(number),
    }, signal);
    this.timeline = new Timeline(this.history, this.player, signal);
    if (this.source.live) document.querySelector(".about summary").textContent = "About this session";
    byId("hint").textContent = matchMedia("(hover: none)").matches ? "Tap an ant to follow it or a cell to inspect it."
      : "Click an ant to follow it or a cell to inspect it. Press ? for all keys.";
    byId("keys").innerHTML = [...(this.source.keys ?? []), ...KEYS].map(([keys, does]) =>
      `<dt>${keys.split(" ").map((key) => `<kbd>${key}</kbd>`).join(" ")}</dt><dd>${does}</dd>`).join("");
    this.listen();
    this.setTheme(this.storedTheme());
    this.stage.resize();
    if (header.follow !== null) this.follow(header.follow);
    this.source.stand?.(this);
    this.opened = true;
    this.wake();
  }

  tick(now) {
    this.due = null;
    if (this.closing.signal.aborted) return;
    const passed = (now - (this.before ?? now)) / 1000;
    const moved = this.player.pass(passed), goesOn = moved || this.player.playing;
    this.before = goesOn ? now : null; // null pauses time until the next change
    if (moved || this.dirty) this.draw(now, moved);
    if (goesOn) this.wake();
  }

  draw(now, moved) {
    const asked = this.dirty;
    this.dirty = false;
    const { player, history, stage, followed } = this, moment = player.moment;
    const smooth = player.playing && player.speed <= SMOOTH_BELOW && !this.still.matches;
    const share = smooth ? player.share : 0;
    const ant = followed >= 0 ? history.ant(moment, followed) : null;
    const next = ant && moment < player.last && history.frames[moment + 1].passed === 1 ? history.ant(moment + 1, followed) : null;
    if (ant && this.aims) this.aimAt(ant, next, share);
    stage.draw(moment, share, {
      ant, next, cell: this.cell, cursor: this.cursor, tool: this.tool?.cells() ?? [],
      path: ant ? history.path(moment, followed) : [],
      letters: ant ? history.stateName(ant.state).letters : [],
    });
    this.frames++;
    this.source.seen?.();
    // The panel shows the same moment, unless its updates would take too long while playing.
    if (moved && player.playing) {
      if (moment === this.panelTells && !asked) return;
      if (now < this.panelDue) {
        this.dirty = true;
        return;
      }
    }
    const began = performance.now();
    history.worldAt(moment);
    this.panel.show(moment, followed, this.cell, this.aims);
    this.timeline.show();
    this.panelTells = moment;
    this.panelDue = now + (performance.now() - began) * (1 / PANEL_SHARE - 1);
    if (!player.playing) {
      const said = this.panel.sentence(moment, followed);
      if (byId("spoken").textContent !== said) byId("spoken").textContent = said;
    }
  }

  aimAt(ant, next, share) {
    const [x0, y0] = this.history.grid.centre(ant.cell), [x1, y1] = this.history.grid.centre((next ?? ant).cell);
    this.stage.camera.x = x0 + share * (x1 - x0);
    this.stage.camera.y = y0 + share * (y1 - y0);
    this.stage.fitted = false;
  }

  follow(number) {
    this.followed = number;
    if (number >= 0) this.cell = -1;
    else this.aims = false;
    this.dirty = true;
  }

  followOther(step) {
    const { numbers } = this.history.frames[this.player.moment];
    if (!numbers.length) return;
    const at = this.history.place(this.player.moment, this.followed);
    const from = at < 0 && step < 0 ? 0 : at;
    this.follow(numbers[(from + step + numbers.length) % numbers.length]);
  }

  toggleAim() {
    this.aims = !this.aims && this.followed >= 0;
    if (this.aims && this.stage.camera.scale < 16) this.stage.camera.scale = 16;
    this.dirty = true;
  }

  chooseCell(cell, cursor = false) {
    this.cell = cell;
    this.cursor = cursor;
    this.dirty = true;
  }

  /* Choose the ant nearest to a point of the page, if near enough for a finger, else the cell. */
  chooseAt(x, y) {
    const { numbers, cells } = this.history.frames[this.player.moment], { stage, history } = this;
    let nearest = -1, least = Math.max(0.85 * stage.camera.scale, 9);
    for (let i = 0; i < cells.length; i++) {
      const [ax, ay] = stage.toPage(history.grid.centre(cells[i])), away = Math.hypot(ax - x, ay - y);
      if (away < least) [nearest, least] = [numbers[i], away];
    }
    if (nearest >= 0) this.follow(nearest);
    else this.chooseCell(stage.cellAt(x, y));
  }

  moveCursor(heading) {
    const { history, stage } = this, { grid } = history;
    const followed = this.followed >= 0 ? history.ant(this.player.moment, this.followed) : null;
    const middle = stage.cellAt(stage.width / 2, stage.height / 2);
    const from = this.cell >= 0 ? this.cell : followed ? followed.cell : middle;
    if (from < 0) return;
    const to = this.cell >= 0 ? from + grid.offsets[heading] : from;
    if (grid.exists(to)) this.chooseCell(to, true);
    const [x, y] = stage.toPage(grid.centre(this.cell));
    const out = (place, size) => Math.min(place - 40, 0) + Math.max(place - size + 40, 0);
    stage.pan(-out(x, stage.width), -out(y, stage.height));
  }

  nextEvent(step) {
    const { events } = this.history, moment = this.player.moment;
    const found = step > 0 ? events.find((one) => one.moment - 1 > moment) : events.findLast((one) => one.moment - 1 < moment);
    if (!found) return;
    this.player.pause();
    this.player.go(found.moment - 1); // the moment before, to show the reason
    if (this.history.frames[moment].ants > 1 || this.followed < 0) this.follow(found.ant);
  }

  storedTheme() {
    try {
      return localStorage.getItem("taichi-ants-theme") ?? "";
    } catch {
      return ""; // no storage in a frame of a notebook, or from a file
    }
  }

  /* Set the theme to "light", "dark", or "" for that of the system. */
  setTheme(theme) {
    this.theme = theme;
    const dark = theme ? theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
    byId("theme").setAttribute("aria-label", `Theme: ${theme || "same as the system"}`);
    this.wear(dark ? "dark" : "light");
  }

  choosePheromone(number) {
    this.history.shown = number;
    History.chosen = this.history.pheromone.name;
    this.dirty = true;
  }

  wear(theme) {
    document.documentElement.dataset.theme = theme;
    this.stage.readColours();
    this.panel.showLegend();
    this.dirty = true;
  }

  switchTheme() {
    const dark = document.documentElement.dataset.theme === "dark";
    this.setTheme(dark ? "light" : "dark");
    try {
      localStorage.setItem("taichi-ants-theme", this.theme);
    } catch {
      // Without storage, the theme lasts as long as the page.
    }
  }

  listen() {
    const { stage } = this, { signal } = this.closing, world = byId("world"), help = byId("help");
    const on = (target, kind, act) => target.addEventListener(kind, act, { signal, passive: false });
    const change = (act) => () => {
      act();
      this.dirty = true;
    };
    // Draw at once, because a canvas is empty after a change of its size.
    const observer = new ResizeObserver(() => stage.resize() && this.draw(performance.now(), false));
    observer.observe(world);
    on(signal, "abort", () => observer.disconnect());
    on(matchMedia("(prefers-color-scheme: dark)"), "change", () => this.setTheme(this.theme));
    on(byId("zoom-in"), "click", change(() => stage.zoom(1.4)));
    on(byId("zoom-out"), "click", change(() => stage.zoom(1 / 1.4)));
    on(byId("fit"), "click", change(() => stage.fit()));
    on(byId("skip"), "click", () => byId("play").focus());
    // Print in the light theme. A canvas does not follow the style sheet by itself.
    on(window, "beforeprint", () => {
      document.querySelector(".about").open = true;
      this.wear("light");
      this.draw(performance.now(), false); // there is no frame of the screen before the print
    });
    on(window, "afterprint", () => this.setTheme(this.theme));
    on(byId("theme"), "click", () => this.switchTheme());
    on(byId("help-button"), "click", () => help.showModal());
    on(help, "click", (event) => event.target === help && help.close());
    on(document, "keydown", (event) => this.key(event));
    this.listenToPointers(world, on);
  }

  listenToPointers(world, on) {
    const held = new Map(); // fingers or mouse buttons that are down
    let moved = 0, works = false; // whether the tool is drawing
    const place = (event) => {
      const box = world.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    const stop = () => {
      if (works) this.tool?.up();
      works = false;
    };
    on(world, "pointerdown", (event) => {
      world.setPointerCapture(event.pointerId);
      held.set(event.pointerId, place(event));
      if (held.size === 1) moved = 0;
      else stop();
      if (!this.tool || held.size > 1 || event.button !== 0) return;
      works = true;
      this.tool.down(this.stage.cellAt(...place(event)));
    });
    on(world, "pointermove", (event) => {
      if (this.tool && (works || !held.size)) {
        // Include all cells on the way if the mouse is fast.
        for (const one of event.getCoalescedEvents?.() ?? [event]) this.tool.move(this.stage.cellAt(...place(one)), works);
        this.dirty = true;
      }
      if (works || !held.has(event.pointerId)) return;
      const [x, y] = place(event), [x0, y0] = held.get(event.pointerId);
      moved += Math.hypot(x - x0, y - y0);
      if (moved < 5 && held.size === 1) return;
      if (held.size === 2) {
        moved = Infinity;
        const [, other] = [...held].find(([id]) => id !== event.pointerId);
        const apart = Math.hypot(x - other[0], y - other[1]), before = Math.hypot(x0 - other[0], y0 - other[1]);
        this.stage.pan((x - x0) / 2, (y - y0) / 2);
        this.stage.zoom(apart / Math.max(before, 1), (x + other[0]) / 2, (y + other[1]) / 2);
      } else if (held.size === 1) {
        this.aims = false;
        this.stage.pan(x - x0, y - y0);
      }
      held.set(event.pointerId, [x, y]);
      this.dirty = true;
    });
    on(world, "pointerup", (event) => {
      const clicked = held.delete(event.pointerId) && moved < 5 && held.size === 0 && !works;
      stop();
      if (clicked && !this.tool) this.chooseAt(...place(event));
    });
    on(world, "pointerleave", () => {
      this.tool?.move(-1, works);
      this.dirty = true;
    });
    on(world, "pointercancel", (event) => {
      held.delete(event.pointerId);
      stop();
    });
    on(world, "wheel", (event) => {
      event.preventDefault();
      const turned = event.deltaY * (event.deltaMode === 1 ? 16 : 1);
      this.stage.zoom(Math.exp(-Math.min(Math.max(turned, -200), 200) / 400), ...place(event));
      this.dirty = true;
    });
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || byId("help").open) return;
    const { player, timeline, stage } = this, inside = event.target;
    const slider = inside.type === "range", pressable = inside.closest?.("button, summary, a, [type=checkbox]");
    const times = event.shiftKey ? 10 : 1, key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const acts = {
      " ": () => (player.playing ? player.pause() : player.play()),
      ArrowLeft: () => player.step(-times), ArrowRight: () => player.step(times),
      ArrowUp: () => timeline.setSpeed(player.speed * 1.25), ArrowDown: () => timeline.setSpeed(player.speed / 1.25),
      Home: () => player.step(-Infinity), End: () => player.step(Infinity),
      e: () => this.nextEvent(event.shiftKey ? -1 : 1),
      n: () => this.followOther(1), p: () => this.followOther(-1), f: () => this.toggleAim(),
      "+": () => stage.zoom(1.25), "=": () => stage.zoom(1.25), "-": () => stage.zoom(0.8), 0: () => stage.fit(),
      w: () => stage.pan(0, 60), a: () => stage.pan(60, 0), s: () => stage.pan(0, -60), d: () => stage.pan(-60, 0),
      Enter: () => this.enter(), t: () => this.switchTheme(), "?": () => byId("help").showModal(),
      Escape: () => (this.cell >= 0 ? this.chooseCell(-1) : this.follow(-1)),
    };
    Object.assign(acts, this.source.acts);
    for (const [letter, heading] of Object.entries(CURSOR)) acts[letter] = () => this.moveCursor(heading);
    // Leave keys that move sliders, keys that press buttons, and all keys in text fields.
    if (inside.closest?.("textarea, select, input:not([type=range], [type=checkbox])")) return;
    if (slider && /^(Arrow|Home|End|Page)/.test(event.key)) return;
    if (pressable && (event.key === "Enter" || event.key === " ")) return;
    if (event.key === "Enter" && inside.id !== "world") return;
    if (!acts[key]) return;
    event.preventDefault();
    acts[key]();
    this.dirty = true;
  }

  enter() {
    if (this.cell < 0) return;
    if (this.tool) {
      this.tool.down(this.cell);
      this.tool.up();
      return;
    }
    const [number] = this.history.antsOn(this.player.moment, this.cell);
    if (number !== undefined) this.follow(number);
  }
}

/* Show a source, by default the recording in the page. For tests and debugging, `window.viewer` is
   the viewer once it is ready. */
function show(source) {
  const viewer = new Viewer(source);
  viewer.open();
  window.viewer = viewer;
}

if (byId("recording").textContent.trim()) {
  recordingIn(byId("recording").textContent).then(show);
}
