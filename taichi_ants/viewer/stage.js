/* The picture of the world. The cell of each pixel is computed once per view, so another moment needs
   only new colours. These pixels are on a hidden canvas; the visible one is a copy with ants and marks,
   because browsers print no pixels that were put, but those that were drawn. Outlines are those of
   rendering/raster_kernels.py, colours are those of the style sheet. */

const DOTS_BELOW = 2.1, DRAWN_FROM = 9; // radius of an ant in pixels; between them it is an arrowhead
const ANT = 0.83; // radius of an ant as a share of its cell
const SEEN = 5.5; // pixels, the radius of an ant that is easily visible
const CROWDED = 0.06; // largest share of the world covered by ants that are larger than their cells
const DRAWINGS_FROM = 6; // in smaller cells, food is a dot and the queen is a filled cell
const CRUMB = 1.4, CRUMB_RING = 1.8; // pixels: minimum radius of such a dot, width of its ring
const MOST_PIXELS = 3e6; // pixels of the cells, also on sharper screens
const INSIDE = 7; // largest coverage of a pixel by its cell, in sevenths; the remainder is a line
const COLOURS = [
  "page", "empty", "rock", "food", "queen", "food-floor", "queen-floor", "ant", "halo", "loaded-dot",
  "ink", "chosen", "mark",
];

class Stage {
  constructor(visible, history) {
    this.visible = visible;
    this.canvas = document.createElement("canvas");
    this.history = history;
    this.grid = history.grid;
    this.camera = { x: 0, y: 0, scale: 10 }; // the scale is in pixels of the page
    this.fitted = true; // until the user pans or zooms
    this.covered = 0; // pixels at the top that tools cover
    this.shown = ""; // the moment and the view of the drawn cells
    this.laidOut = "";
    this.foods = []; // cells with food, by kind
    this.queens = [];
    this.exists = Uint8Array.from({ length: this.grid.size }, (_, cell) => (this.grid.exists(cell) ? 1 : 0));
    this.count = this.exists.reduce((sum, one) => sum + one);
    this.fills = new Uint32Array(this.grid.size);
    // Only this script writes pixels, so the canvas should not be on a graphics processor.
    this.context = this.canvas.getContext("2d", { alpha: false, willReadFrequently: true });
    this.above = visible.getContext("2d", { alpha: false });
    this.readColours();
  }

  /* Read the colours from the style sheet; call it after a change of the theme. */
  readColours() {
    const style = getComputedStyle(document.documentElement);
    const read = (name) => style.getPropertyValue(`--${name}`).trim();
    this.colours = Object.fromEntries(COLOURS.map((name) => [name, read(name)]));
    // The colours of further nests and kinds of food: "queen 1", "ant 1", "food 1", ...
    for (const [name, several] of [["queen", "nests"], ["ant", "nests"], ["food", "foods"]]) {
      read(several).split(/\s+/).forEach((colour, n) => (this.colours[`${name} ${n + 1}`] = colour));
    }
    this.words = Object.fromEntries(Object.keys(this.colours).map((name) => [name, word(...bytesOf(this.colours[name]))]));
    // Colours of trails from just above 0 to the strongest one.
    const samples = read("trail").split(/\s+/).map(bytesOf), last = samples.length - 1;
    this.ramp = Array.from({ length: 256 }, (_, i) => {
      const place = (i / 255) * last, k = Math.min(Math.floor(place), last - 1);
      return [0, 1, 2].map((c) => Math.round(samples[k][c] + (place - k) * (samples[k + 1][c] - samples[k][c])));
    });
    this.rampWords = Uint32Array.from(this.ramp, (colour) => word(...colour));
    this.sprites = new Map();
    this.shown = this.laidOut = "";
  }

  /* The name of the colour of the queen on a cell. */
  queenColour(cell) {
    return ofNest("queen", this.history.frames[this.moment].queens.indexOf(cell));
  }

  /* The colour of a trail, by its share of the strongest one. */
  trailColour(level) {
    return Math.round(Math.min(level / this.history.pheromone.strongest, 1) * 255);
  }

  /* Read the size from the page; return whether it has changed. */
  resize() {
    const width = Math.max(1, this.visible.clientWidth), height = Math.max(1, this.visible.clientHeight);
    const ratio = Math.min(window.devicePixelRatio || 1, 3), size = `${width} ${height} ${ratio}`;
    if (size === this.size) return false;
    Object.assign(this, { width, height, size });
    this.ratio = Math.min(ratio, Math.sqrt(MOST_PIXELS / (this.width * this.height)));
    this.sharpness = Math.max(this.ratio, Math.min(ratio, 2)); // of the visible canvas
    this.canvas.width = Math.round(this.width * this.ratio);
    this.canvas.height = Math.round(this.height * this.ratio);
    this.visible.width = Math.round(this.width * this.sharpness);
    this.visible.height = Math.round(this.height * this.sharpness);
    this.sprites.clear();
    this.shown = this.laidOut = "";
    if (this.fitted) this.fit();
    return true;
  }

  /* Show the whole world, as large as possible. */
  fit() {
    const { grid } = this, margin = 16;
    this.camera.x = (grid.left + grid.right) / 2;
    this.camera.scale = Math.min(
      Math.max(this.width - 2 * margin, 40) / (grid.right - grid.left + 1.5),
      Math.max(this.height - 2 * margin - this.covered, 40) / (grid.bottom - grid.top + 1.7),
    );
    this.camera.y = (grid.top + grid.bottom) / 2 - this.covered / 2 / this.camera.scale;
    this.fitted = true;
  }

  /* Zoom so that the point of the page under (x, y) stays where it is. */
  zoom(factor, x = this.width / 2, y = this.height / 2) {
    const { camera } = this, before = camera.scale;
    const smallest = 0.5 * Math.min(this.width / (this.grid.right - this.grid.left),
      this.height / (this.grid.bottom - this.grid.top));
    camera.scale = Math.min(Math.max(before * factor, Math.min(smallest, 20)), 120);
    const gained = 1 / before - 1 / camera.scale;
    camera.x += (x - this.width / 2) * gained;
    camera.y += (y - this.height / 2) * gained;
    this.keepInside();
    this.fitted = false;
  }

  pan(x, y) {
    this.camera.x -= x / this.camera.scale;
    this.camera.y -= y / this.camera.scale;
    this.keepInside();
    this.fitted = false;
  }

  keepInside() {
    const { camera, grid } = this;
    camera.x = Math.min(Math.max(camera.x, grid.left), grid.right);
    camera.y = Math.min(Math.max(camera.y, grid.top), grid.bottom);
  }

  /* Convert a point of the world to the page, and back. */
  toPage([x, y]) {
    const { camera } = this;
    return [(x - camera.x) * camera.scale + this.width / 2, (y - camera.y) * camera.scale + this.height / 2];
  }
  cellAt(x, y) {
    const { camera } = this;
    return this.grid.at((x - this.width / 2) / camera.scale + camera.x, (y - this.height / 2) / camera.scale + camera.y);
  }

  /* Draw a moment, with ants a share of the way to the next moment, and marks of the followed ant. */
  draw(moment, share, marks) {
    const { camera, above, sharpness, visible } = this, view = `${camera.x} ${camera.y} ${camera.scale}`;
    if (this.shown !== `${moment} ${view}`) {
      this.layOut(view);
      this.drawCells(moment);
      this.shown = `${moment} ${view}`;
    }
    above.resetTransform();
    above.drawImage(this.canvas, 0, 0, visible.width, visible.height);
    above.setTransform(sharpness, 0, 0, sharpness, 0, 0);
    this.drawThings();
    if (marks.ant) this.drawPath(above, marks.path);
    this.drawAnts(moment, share);
    this.drawMarks(share, marks);
  }

  /* Find the cell of each pixel of a view, and its coverage of the pixel. */
  layOut(view) {
    if (this.laidOut === view) return;
    this.laidOut = view;
    const { grid, camera, ratio, exists } = this, { width, height } = this.canvas, z = grid.ranges[2];
    if (this.image?.width !== width || this.image?.height !== height) {
      this.image = this.context.createImageData(width, height);
      this.pixels = new Uint32Array(this.image.data.buffer);
      this.cells = new Int32Array(width * height); // 8 * cell + coverage, -1 outside the world
    }
    this.pixels.fill(this.words.page);
    const { cells } = this, scale = camera.scale * ratio, root = Math.sqrt(3);
    // The lines between cells vanish in small cells, and are at most 3 pixels wide.
    const line = Math.min(Math.max(0.09 * camera.scale - 0.25, 0), 3) * ratio;
    for (let j = 0, i = 0; j < height; j++) {
      const y = (j + 0.5 - height / 2) / scale + camera.y, up = y / root;
      for (let column = 0; column < width; column++, i++) {
        const x = (column + 0.5 - width / 2) / scale + camera.x, r = x / 1.5, q = r / 2 - up;
        let a = Math.floor(q + 0.5), b = Math.floor(r + 0.5);
        const c = Math.floor(q - r + 0.5), da = Math.abs(a - q), db = Math.abs(b - r), dc = Math.abs(c - q + r);
        if (da > db && da > dc) a = b + c;
        else if (db > dc) b = a - c;
        const row = b + z, place = a + z;
        cells[i] = -1;
        if (row < 0 || place < 0 || row >= grid.height || place >= grid.width) continue;
        const cell = row * grid.width + place;
        if (!exists[cell]) continue;
        let covered = INSIDE;
        if (line > 0) {
          const dx = Math.abs(x - 1.5 * b), dy = Math.abs(y - root * (0.5 * b - a));
          const away = (Math.max(dx * 0.8660254 + dy * 0.5, dy) - 0.8660254) * scale + 0.5 * line;
          covered = Math.round(INSIDE * Math.min(Math.max(0.5 - away, 0), 1));
        }
        cells[i] = 8 * cell + covered;
      }
    }
  }

  drawCells(moment) {
    this.moment = moment;
    const { grid, history, fills, exists, words, rampWords, cells, pixels } = this;
    const { ground, kinds, trail } = history.worldAt(moment), small = this.camera.scale < DRAWINGS_FROM;
    const held = { [EMPTY]: words.empty, [OBSTACLE]: words.rock, [FOOD]: words["food-floor"],
      [QUEEN]: words["queen-floor"] };
    this.foods = [];
    this.queens = [];
    for (let cell = 0; cell < grid.size; cell++) {
      if (!exists[cell]) continue;
      const holds = ground[cell];
      if (holds === FOOD) (this.foods[kinds[cell]] ??= []).push(cell);
      else if (holds === QUEEN) this.queens.push(cell);
      if (small && holds === QUEEN) held[QUEEN] = words[this.queenColour(cell)];
      const marked = holds === EMPTY && trail[cell] >= 1;
      fills[cell] = marked ? rampWords[this.trailColour(trail[cell])] : held[holds];
    }
    const page = words.page, even = page & 0xff00ff, odd = (page >>> 8) & 0xff00ff;
    for (let i = 0; i < cells.length; i++) {
      const at = cells[i];
      if (at < 0) continue;
      const fill = fills[at >> 3], covered = at & 7;
      if (covered === INSIDE) pixels[i] = fill;
      else {
        // Blends two of the four bytes at a time, in eighths.
        const k = covered + (covered >> 2), rest = 8 - k;
        pixels[i] = ((((fill & 0xff00ff) * k + even * rest) >>> 3) & 0xff00ff)
          | ((((((fill >>> 8) & 0xff00ff) * k + odd * rest) >>> 3) & 0xff00ff) << 8);
      }
    }
    this.context.putImageData(this.image, 0, 0);
    if (small) this.drawCrumbs();
  }

  /* Food in small cells: dots with a ring, which distinguishes them from trails as light as the dot. */
  drawCrumbs() {
    const { context, camera, grid, ratio, colours } = this;
    const radius = Math.max(0.6 * camera.scale, CRUMB);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    const layers = this.foods.flatMap((cells, kind) => [["food-floor", radius + CRUMB_RING, cells], [ofKind(kind), radius, cells]]);
    for (const [colour, size, cells] of layers) {
      const { canvas, half } = this.sprite(`crumb ${colour}`, size, (drawing) => {
        drawing.fillStyle = colours[colour];
        drawing.fill(circle(0, 0, 1));
      });
      for (const cell of cells) {
        const [x, y] = this.toPage(grid.centre(cell));
        if (this.sees([x, y])) context.drawImage(canvas, x - half, y - half, 2 * half, 2 * half);
      }
    }
    context.setTransform(1, 0, 0, 1, 0, 0);
  }

  /* A drawing with a radius in pixels, cached as a canvas to copy. */
  sprite(name, radius, paint) {
    const key = `${name} ${radius.toFixed(2)}`;
    if (!this.sprites.has(key)) {
      if (this.sprites.size > 60) this.sprites.clear();
      const canvas = document.createElement("canvas"), side = 2 * Math.ceil(1.15 * radius * this.sharpness + 2);
      canvas.width = canvas.height = side;
      const context = canvas.getContext("2d");
      context.translate(side / 2, side / 2);
      context.scale(radius * this.sharpness, radius * this.sharpness);
      context.lineJoin = context.lineCap = "round";
      paint(context);
      this.sprites.set(key, { canvas, half: side / 2 / this.sharpness });
    }
    return this.sprites.get(key);
  }

  /* Whether a point of the page is visible. */
  sees([x, y]) {
    const { scale } = this.camera;
    return x > -scale && y > -scale && x < this.width + scale && y < this.height + scale;
  }

  /* Food and queens. */
  drawThings() {
    const { above, camera, colours, grid } = this;
    if (camera.scale < DRAWINGS_FROM) return;
    const queens = this.queens.map((cell) => [this.queenColour(cell), [cell], CROWN]);
    const foods = this.foods.map((cells, kind) => [ofKind(kind), cells, CRUMBS]);
    for (const [name, cells, outline] of [...foods.filter(Boolean), ...queens]) {
      const { canvas, half } = this.sprite(name, 0.72 * camera.scale, (context) => {
        context.fillStyle = colours[name];
        context.fill(new Path2D(outline));
      });
      for (const cell of cells) {
        const place = this.toPage(grid.centre(cell));
        if (this.sees(place)) above.drawImage(canvas, place[0] - half, place[1] - half, 2 * half, 2 * half);
      }
    }
  }

  /* The radius of ants; in small cells they are larger than these, unless they would hide the world. */
  antRadius(ants) {
    const { scale } = this.camera, cells = 2.6 * scale ** 2 * this.count; // square pixels
    return Math.max(ANT * scale, Math.min(SEEN, Math.sqrt((CROWDED * cells) / (2 * Math.max(ants, 1)))));
  }

  drawAnts(moment, share) {
    const { history, grid, above, sharpness, camera } = this, frame = history.frames[moment];
    const next = history.frames[moment + 1], moves = share > 0 && next && next.passed === 1;
    const same = moves && next.numbers === frame.numbers, z = grid.ranges[2], root = Math.sqrt(3);
    const radius = this.antRadius(frame.cells.length), dots = radius < DOTS_BELOW;
    const looks = [], squares = []; // by `kindOf`
    const side = Math.max(1.5 * camera.scale, 2 * DOT);
    for (let i = 0; i < frame.cells.length; i++) {
      const cell = frame.cells[i];
      let heading = frame.poses[i] & 7, r = Math.floor(cell / grid.width) - z, q = (cell % grid.width) - z;
      const k = same ? i : moves ? history.place(moment + 1, frame.numbers[i]) : -1;
      if (k >= 0) {
        const to = next.cells[k], turn = (((next.poses[k] & 7) - heading + 9) % 6) - 3; // the shorter way
        heading += share * turn;
        r += share * (Math.floor(to / grid.width) - z - r);
        q += share * ((to % grid.width) - z - q);
      }
      const x = (1.5 * r - camera.x) * camera.scale + this.width / 2;
      const y = (root * (0.5 * r - q) - camera.y) * camera.scale + this.height / 2;
      if (!this.sees([x, y])) continue;
      const kind = kindOf(frame.poses[i], frame.groups[i], this.fadeOf(frame, i));
      if (dots) {
        (squares[kind] ??= new Path2D()).rect(x - side / 2, y - side / 2, side, side);
        continue;
      }
      const look = (looks[kind] ??= this.antSprite(kind, radius));
      const { canvas, half } = look, angle = (heading * Math.PI) / 3;
      const cos = sharpness * Math.cos(angle), sin = sharpness * Math.sin(angle);
      above.setTransform(cos, sin, -sin, cos, x * sharpness, y * sharpness);
      above.drawImage(canvas, -half, -half, 2 * half, 2 * half);
    }
    above.setTransform(sharpness, 0, 0, sharpness, 0, 0);
    if (!dots) return;
    // Crowded dots would hide the world, so they become transparent.
    const covered = (frame.cells.length * side ** 2) / (grid.size * 2.6 * camera.scale ** 2);
    const alpha = Math.min(1, 0.6 * Math.max(covered, 1e-9) ** -0.5);
    squares.forEach((square, kind) => {
      above.globalAlpha = alpha * opacityOf(kind);
      above.fillStyle = this.colours[dotColour(kind)];
      above.fill(square);
    });
    above.globalAlpha = 1;
  }

  /* How faded an ant is by all of its marks. */
  fadeOf(frame, i) {
    const n = frame.cells.length;
    let fade = frame.marks[i] ?? 0;
    for (let k = n + i; k < frame.marks.length; k += n) fade = Math.max(fade, frame.marks[k]);
    return fade;
  }

  /* The drawing of an ant of a kind, see `kindOf`. */
  antSprite(kind, radius) {
    const { colours } = this, loaded = kind & 1;
    // A line in the colour of the page separates ants from a dark trail.
    const large = radius >= DRAWN_FROM, edge = large ? Math.min(0.11, 2 / radius) : 2 / radius;
    const crumb = circle(0, -0.7, large ? 0.25 : 0.34), body = new Path2D(large ? BODY : DART);
    // Food alone would be too small to see.
    const ink = colours[large ? antColour(kind) : dotColour(kind)], carried = colours[ofKind((kind >> 4) & 7)];
    return this.sprite(`ant ${kind}`, radius, (context) => {
      context.globalAlpha = opacityOf(kind);
      const legs = new Path2D(LIMBS), sides = large ? [1, -1] : [];
      for (const [colour, food, more] of [[colours.halo, colours.halo, edge], [ink, carried, 0]]) {
        context.fillStyle = context.strokeStyle = colour;
        for (const side of sides) {
          context.save();
          context.scale(side, 1);
          context.lineWidth = 0.07 + more;
          context.stroke(legs);
          context.restore();
        }
        context.lineWidth = more;
        if (more) context.stroke(body);
        context.fill(body);
        if (!loaded) continue;
        context.fillStyle = context.strokeStyle = food;
        if (more) context.stroke(crumb);
        context.fill(crumb);
      }
    });
  }

  /* Begin the outline of a cell, with a radius in pixels. */
  outline(cell, radius) {
    const [x, y] = this.toPage(this.grid.centre(cell)), { above } = this;
    above.beginPath();
    for (let k = 0; k < 6; k++) above.lineTo(x + radius * Math.cos((k * Math.PI) / 3), y + radius * Math.sin((k * Math.PI) / 3));
    above.closePath();
  }

  stroke(colour, width) {
    this.above.strokeStyle = this.colours[colour];
    this.above.lineWidth = width;
    this.above.stroke();
  }

  /* The ring and the view of the followed ant; the chosen cell. */
  drawMarks(share, { ant, next, letters, cell, cursor, tool = [] }) {
    const { above, grid, colours, camera } = this;
    above.lineJoin = "round";
    // In small cells, a ring marks the queen.
    for (const queen of camera.scale < DRAWINGS_FROM ? this.queens : []) {
      this.outline(queen, 9);
      this.stroke("halo", 5);
      this.stroke(this.queenColour(queen), 2.5);
    }
    if (cell >= 0) {
      this.outline(cell, Math.max(camera.scale, 5));
      this.stroke("halo", cursor ? 6 : 5);
      this.stroke("mark", cursor ? 3 : 2);
    }
    for (const one of tool) {
      this.outline(one, 0.9 * Math.max(camera.scale, 4));
      this.stroke("halo", 4);
      this.stroke("chosen", 1.8);
    }
    if (!ant) return;
    const [x0, y0] = grid.centre(ant.cell), [x1, y1] = next ? grid.centre(next.cell) : [x0, y0];
    above.beginPath();
    above.arc(...this.toPage([x0 + share * (x1 - x0), y0 + share * (y1 - y0)]), Math.max(1.02 * camera.scale, 9), 0, 2 * Math.PI);
    this.stroke("halo", 5.5);
    this.stroke("chosen", 2.5);
    if (camera.scale < 7 || share > 0) return; // the view belongs to the ant's cell, not to points between cells
    this.history.header.view.forEach((turn, i) => {
      const seen = ant.cell + grid.offsets[(ant.heading + turn + 6) % 6];
      this.outline(seen, 0.93 * camera.scale);
      this.stroke("ink", Math.min(2, camera.scale / 8));
      if (camera.scale < 10 || !letters[i]) return;
      const place = this.toPage(grid.centre(seen));
      above.font = `600 ${Math.min(0.62 * camera.scale, 30)}px ${getComputedStyle(document.body).fontFamily}`;
      above.textAlign = "center";
      above.textBaseline = "middle";
      above.lineWidth = 4;
      above.strokeStyle = colours.halo;
      above.strokeText(letters[i], ...place);
      above.fillStyle = colours.ink;
      above.fillText(letters[i], ...place);
    });
  }

  drawPath(context, path) {
    if (!path || path.length < 2) return;
    const places = path.map((cell) => this.toPage(this.grid.centre(cell))), [[x0, y0], [x1, y1]] = places;
    const away = Math.min(0.9 * this.camera.scale / (Math.hypot(x1 - x0, y1 - y0) || 1), 1);
    places[0] = [x0 + away * (x1 - x0), y0 + away * (y1 - y0)]; // not over the ant itself
    const width = Math.min(Math.max(0.16 * this.camera.scale, 2), 5), parts = Math.min(24, places.length - 1);
    context.lineCap = "butt";
    // A light edge, for dark trails, then the line, which is fainter in older parts.
    for (const [colour, more] of [["halo", 2.5], ["chosen", 0]]) {
      context.strokeStyle = this.colours[colour];
      context.lineWidth = width + more;
      for (let part = 0; part < parts; part++) {
        const from = Math.floor((part * (places.length - 1)) / parts);
        const until = Math.floor(((part + 1) * (places.length - 1)) / parts);
        context.beginPath();
        for (let k = from; k <= until; k++) context.lineTo(...places[k]);
        context.globalAlpha = 0.85 * (1 - part / parts) + 0.05;
        context.stroke();
      }
    }
    context.globalAlpha = 1;
  }
}

// Outlines within the unit circle, for ants with heading up. Legs and antennae are of the right side.
const DOT = 1.3; // pixels, the radius of an ant that is a dot
const LIMBS = "M.08-.16.42-.34.56-.66M.08-.06.48-.02.74.2M.08.04.44.26.58.7M.07-.48.17-.68.3-.86";
const oval = (y, a, b) => `M${-a} ${y}a${a} ${b} 0 1 0 ${2 * a} 0a${a} ${b} 0 1 0 ${-2 * a} 0z`;
const BODY = oval(-0.37, 0.19, 0.17) + oval(-0.06, 0.13, 0.2) + oval(0.45, 0.27, 0.39);
const DART = "M0-.9.67.824 0 .585-.67.824z";
const disc = (x, y, r) => `M${x - r} ${y}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0z`;
const CRUMBS = disc(0, -0.36, 0.36) + disc(0.4, 0.3, 0.36) + disc(-0.4, 0.3, 0.36);
const CROWN = "M-.8-.28-.32-.02 0-.5.32-.02.8-.28.6.6h-1.2z"
  + disc(0, -0.6, 0.12) + disc(0.84, -0.38, 0.12) + disc(-0.84, -0.38, 0.12);

/* The name of a colour of a nest; the seven colours repeat, as in pictures. */
function ofNest(name, nest) {
  return nest % 7 > 0 ? `${name} ${nest % 7}` : name;
}

/* The name of the colour of a kind of food. */
function ofKind(kind) {
  return kind > 0 ? `food ${kind}` : "food";
}

/* What determines the drawing of an ant besides its heading, from its pose, its group and how faded it is, 0
   to 255: 1 with food, plus 2 times the nest, plus 16 times the kind of food, plus 128 for each 32 of its fading. */
function kindOf(pose, group, fade) {
  return (pose >> 3) | (group & 0x70) | ((fade >> 5) << 7);
}
function antColour(kind) {
  return ofNest("ant", (kind >> 1) & 7);
}
function dotColour(kind) {
  const food = (kind >> 4) & 7;
  return !(kind & 1) ? antColour(kind) : food ? ofKind(food) : "loaded-dot";
}
function opacityOf(kind) {
  return 1 - (0.6 * (kind >> 7)) / 7;
}

function circle(x, y, radius) {
  const path = new Path2D();
  path.arc(x, y, radius, 0, 2 * Math.PI);
  return path;
}

/* Red, green and blue, 0 to 255, of "#rrggbb". */
function bytesOf(hex) {
  const number = parseInt(hex.slice(1), 16);
  return [number >> 16, (number >> 8) & 255, number & 255];
}

/* A colour in the format of the pixels of an image. */
function word(red, green, blue) {
  return ((255 << 24) | (blue << 16) | (green << 8) | red) >>> 0;
}
