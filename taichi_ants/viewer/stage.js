/* The picture of the world: hexagons and ants by WebGL, and over them, on a second canvas, what is
   said of the followed ant. The outlines are those of rendering/shapes.py, the colours are those of
   the style sheet. */

const SHAPES = `
  float disc(vec2 p, float x, float y, float radius) { return length(p - vec2(x, y)) - radius; }
  float ellipse(vec2 p, float y, float a, float b) {
    vec2 s = (p - vec2(0.0, y)) / vec2(a, b);
    float level = length(s);
    return level * (level - 1.0) / max(length(s / vec2(a, b)), 1e-6);
  }
  float segment(vec2 p, vec2 a, vec2 b) {
    vec2 along = b - a, from = p - a;
    return length(from - clamp(dot(from, along) / dot(along, along), 0.0, 1.0) * along);
  }
  float hexagon(vec2 p) {
    return max(abs(p.x) * 0.8660254 + abs(p.y) * 0.5, abs(p.y)) - 0.8660254;
  }
  float body(vec2 p) {
    return min(ellipse(p, -0.37, 0.19, 0.17),
               min(ellipse(p, -0.06, 0.13, 0.20), ellipse(p, 0.45, 0.27, 0.39)));
  }
  float limbs(vec2 p) {
    vec2 q = vec2(abs(p.x), p.y);
    float front = min(segment(q, vec2(0.08, -0.16), vec2(0.42, -0.34)),
                      segment(q, vec2(0.42, -0.34), vec2(0.56, -0.66)));
    float middle = min(segment(q, vec2(0.08, -0.06), vec2(0.48, -0.02)),
                       segment(q, vec2(0.48, -0.02), vec2(0.74, 0.20)));
    float hind = min(segment(q, vec2(0.08, 0.04), vec2(0.44, 0.26)),
                     segment(q, vec2(0.44, 0.26), vec2(0.58, 0.70)));
    float antenna = min(segment(q, vec2(0.07, -0.48), vec2(0.17, -0.68)),
                        segment(q, vec2(0.17, -0.68), vec2(0.30, -0.86)));
    return min(min(front, middle), min(hind, antenna));
  }
  float dart(vec2 p) {
    vec2 q = vec2(abs(p.x), p.y);
    return max(dot(q, vec2(0.932, -0.362)) - 0.326, dot(q, vec2(-0.336, 0.942)) - 0.551);
  }
  float crumbs(vec2 p) {
    return min(disc(p, 0.0, -0.36, 0.36), disc(vec2(abs(p.x), p.y), 0.40, 0.30, 0.36));
  }
  float crown(vec2 p) {
    vec2 q = vec2(abs(p.x), p.y);
    float top = min(dot(q, vec2(0.832, -0.555)) - 0.277, dot(q, vec2(-0.476, -0.879)) + 0.135);
    float side = dot(q, vec2(0.975, 0.222)) - 0.718;
    return min(max(max(top, side), p.y - 0.60),
               min(disc(p, 0.0, -0.60, 0.12), disc(q, 0.84, -0.38, 0.12)));
  }
  // How much of a pixel a shape covers, from its signed distance in pixels.
  float cover(float pixels) { return clamp(0.5 - pixels, 0.0, 1.0); }`;

const CELLS = {
  vertex: `#version 300 es
  void main() {
    gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
  }`,
  // Each pixel finds its cell, and looks it up.
  fragment: `#version 300 es
  precision highp float;
  precision highp int;
  uniform vec2 centre, size;
  uniform float scale;         // pixels from the middle of a hexagon to its corners
  uniform ivec3 grid;          // width, height, and where the origin lies
  uniform sampler2D cells;     // what a cell holds, and its trail
  uniform sampler2D ramp;      // the colours of trails
  uniform vec3 page, empty, rock, food, queen, foodFloor, queenFloor;
  out vec4 colour;
  ${SHAPES}
  void main() {
    vec2 pixel = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y);
    vec2 p = (pixel - 0.5 * size) / scale + centre;
    float r = p.x / 1.5, q = r * 0.5 - p.y * 0.57735027;
    float Q = floor(q + 0.5), R = floor(r + 0.5), D = floor(q - r + 0.5);
    float dq = abs(Q - q), dr = abs(R - r), dd = abs(D - (q - r));
    if (dq > dr && dq > dd) Q = R + D; else if (dr > dd) R = Q - D;
    ivec2 at = ivec2(int(Q), int(R)) + grid.z;
    colour = vec4(page, 1.0);
    if (at.x < 0 || at.y < 0 || at.x >= grid.x || at.y >= grid.y) return;
    vec2 cell = floor(texelFetch(cells, at, 0).xy * 255.0 + 0.5);
    if (cell.x == 0.0) return;
    vec2 d = p - vec2(1.5 * R, 1.7320508 * (0.5 * R - Q));
    bool small = scale < 6.0;
    vec3 fill = empty;
    if (cell.x == 2.0) fill = rock;
    else if (cell.x == 3.0) fill = small ? food : foodFloor;
    else if (cell.x == 4.0) fill = small ? queen : queenFloor;
    else if (cell.y > 0.0) fill = texelFetch(ramp, ivec2(int(cell.y), 0), 0).rgb;
    if (!small && cell.x == 3.0) {
      fill = mix(fill, food, cover(crumbs(d / 0.72) * 0.72 * scale));
    } else if (!small && cell.x == 4.0) {
      fill = mix(fill, queen, cover(crown(d / 0.72) * 0.72 * scale));
    }
    // The lines between cells fade away where these are small, and do not grow for ever.
    float line = clamp(0.09 * scale - 0.25, 0.0, 3.0);
    float inside = line > 0.0 ? cover(hexagon(d) * scale + 0.5 * line) : 1.0;
    colour = vec4(mix(page, fill, inside), 1.0);
  }`,
};

const ANTS = {
  vertex: `#version 300 es
  precision highp float;
  layout(location = 0) in vec3 from;  // where an ant is, and its heading
  layout(location = 1) in vec4 to;    // where it is next, and whether it carries food now
  uniform vec2 centre, size;
  uniform float scale, radius, share; // the share of a tick that has passed
  out vec2 place;
  flat out float load;
  void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
    vec2 middle = (mix(from.xy, to.xy, share) - centre) * scale;
    float angle = mix(from.z, to.z, share) * 1.04719755;
    place = corner * 1.1;
    load = to.w;
    vec2 turned = vec2(place.x * cos(angle) - place.y * sin(angle),
                       place.x * sin(angle) + place.y * cos(angle));
    vec2 at = (middle + turned * radius) / size * 2.0;
    gl_Position = vec4(at.x, -at.y, 0.0, 1.0);
  }`,
  fragment: `#version 300 es
  precision highp float;
  in vec2 place;
  flat in float load;
  uniform float radius;
  uniform int detail;          // 0 a dot, 1 a dart, 2 an ant
  uniform vec3 ant, halo, food, loadedDot;
  uniform float opacity;
  out vec4 colour;
  ${SHAPES}
  void main() {
    float crumb = disc(place, 0.0, -0.70, detail == 2 ? 0.25 : 0.34) * radius;
    float shape = detail == 2 ? min(body(place), limbs(place) - 0.035)
                : detail == 1 ? dart(place) : length(place) - 0.9;
    shape *= radius;
    vec3 fill = detail == 0 && load > 0.5 ? loadedDot : ant;
    float covered = cover(shape), around = 0.0;
    // A line of the colour of the page sets ants apart from a dark trail.
    if (detail > 0) around = 0.75 * cover(shape - min(1.6, 0.08 * radius));
    if (detail > 0 && load > 0.5) {
      around = max(around, cover(crumb - min(1.6, 0.08 * radius)));
      float food_here = cover(crumb);
      fill = mix(fill, food, food_here);
      covered = max(covered, food_here);
    }
    float all = max(covered, around);
    if (all < 0.004) discard;
    colour = vec4(mix(halo, fill, covered / all), all * opacity);
  }`,
};

const DOTS_BELOW = 2.5, DARTS_BELOW = 11; // pixels, as in rendering/marks.py
const FLOATS_OF_ANT = 7;

class Stage {
  constructor(canvas, overlay, history) {
    this.canvas = canvas;
    this.overlay = overlay;
    this.history = history;
    this.grid = history.grid;
    this.camera = { x: 0, y: 0, scale: 10 }; // the scale is in pixels of the page
    this.fitted = true; // until somebody pans or zooms
    this.shownMoment = -1;
    this.queens = [];
    this.gl = canvas.getContext("webgl2", { antialias: false, alpha: false, powerPreference: "low-power" });
    if (this.gl) this.prepare();
  }

  prepare() {
    const { gl, grid } = this;
    this.programs = { cells: program(gl, CELLS), ants: program(gl, ANTS) };
    this.cellTexture = texture(gl, grid.width, grid.height);
    this.rampTexture = texture(gl, 256, 1);
    this.cellBytes = new Uint8Array(grid.size * 4);
    this.exists = new Uint8Array(grid.size);
    for (let cell = 0; cell < grid.size; cell++) this.exists[cell] = grid.exists(cell) ? 1 : 0;
    this.nothing = gl.createVertexArray();
    this.antArray = gl.createVertexArray();
    this.antBuffer = gl.createBuffer();
    this.antNumbers = new Float32Array(0);
    gl.bindVertexArray(this.antArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.antBuffer);
    for (const [place, length, offset] of [[0, 3, 0], [1, 4, 12]]) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, length, gl.FLOAT, false, 4 * FLOATS_OF_ANT, offset);
      gl.vertexAttribDivisor(place, 1);
    }
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    this.readColours();
  }

  /* Take the colours from the style sheet; to be called when the theme has changed. */
  readColours() {
    const style = getComputedStyle(document.documentElement);
    const read = (name) => style.getPropertyValue(`--${name}`).trim();
    this.colours = {};
    for (const name of ["page", "empty", "rock", "food", "queen", "food-floor", "queen-floor", "ant",
      "halo", "loaded-dot", "ink", "chosen", "mark"]) {
      this.colours[name] = read(name);
    }
    const samples = read("trail").split(/\s+/).map(rgb), bytes = new Uint8Array(256 * 4);
    for (let i = 0; i < 256; i++) {
      const place = (i / 255) * (samples.length - 1), k = Math.min(Math.floor(place), samples.length - 2);
      for (let c = 0; c < 3; c++) {
        bytes[4 * i + c] = 255 * (samples[k][c] + (place - k) * (samples[k + 1][c] - samples[k][c])) + 0.5;
      }
    }
    this.ramp = bytes;
    if (!this.gl) return;
    const { gl } = this;
    gl.bindTexture(gl.TEXTURE_2D, this.rampTexture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 256, 1, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  }

  resize() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(1, this.canvas.clientWidth), height = Math.max(1, this.canvas.clientHeight);
    this.ratio = ratio;
    this.width = width;
    this.height = height;
    for (const one of [this.canvas, this.overlay]) {
      one.width = Math.round(width * ratio);
      one.height = Math.round(height * ratio);
    }
    if (this.fitted) this.fit();
  }

  /* Show the whole world, as large as possible. */
  fit() {
    const { grid } = this, margin = 16;
    this.camera.x = (grid.left + grid.right) / 2;
    this.camera.y = (grid.top + grid.bottom) / 2;
    this.camera.scale = Math.min(
      Math.max(this.width - 2 * margin, 40) / (grid.right - grid.left + 1.5),
      Math.max(this.height - 2 * margin, 40) / (grid.bottom - grid.top + 1.7),
    );
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

  /* Where a point of the world lies on the page, and the other way round. */
  toPage([x, y]) {
    const { camera } = this;
    return [(x - camera.x) * camera.scale + this.width / 2, (y - camera.y) * camera.scale + this.height / 2];
  }
  cellAt(x, y) {
    const { camera } = this;
    return this.grid.at((x - this.width / 2) / camera.scale + camera.x, (y - this.height / 2) / camera.scale + camera.y);
  }

  /* Draw a moment, or what lies a share of the way to the next one; marks are for the overlay. */
  draw(moment, share, marks) {
    if (this.gl) {
      if (moment !== this.shownMoment) this.load(moment);
      this.drawCells();
      this.drawAnts(share);
    }
    this.drawMarks(moment, share, marks);
  }

  /* Hand the cells and ants of a moment to the graphics processor. */
  load(moment) {
    const { gl, grid, history, cellBytes: bytes } = this;
    const { ground, trail } = history.worldAt(moment), strongest = history.header.trail.strongest;
    this.queens = [];
    for (let cell = 0; cell < grid.size; cell++) {
      if (!this.exists[cell]) continue;
      const held = ground[cell];
      if (held === QUEEN) this.queens.push(cell);
      bytes[4 * cell] = held === EMPTY ? 1 : held === OBSTACLE ? 2 : held === FOOD ? 3 : 4;
      bytes[4 * cell + 1] = trail[cell] >= 1 ? Math.max(1, Math.min(trail[cell] / strongest, 1) * 255 + 0.5) : 0;
    }
    gl.bindTexture(gl.TEXTURE_2D, this.cellTexture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, grid.width, grid.height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    this.loadAnts(moment);
    this.shownMoment = moment;
  }

  loadAnts(moment) {
    const { history, grid, gl } = this, frame = history.frames[moment], next = history.frames[moment + 1];
    const n = frame.cells.length, moves = next && next.passed === 1;
    const same = moves && next.numbers === frame.numbers;
    if (this.antNumbers.length < n * FLOATS_OF_ANT) this.antNumbers = new Float32Array(n * FLOATS_OF_ANT);
    const numbers = this.antNumbers;
    const z = grid.ranges[2], width = grid.width, height = Math.sqrt(3);
    for (let i = 0; i < n; i++) {
      const cell = frame.cells[i], heading = frame.poses[i] & 7;
      const k = same ? i : moves ? history.place(moment + 1, frame.numbers[i]) : -1;
      const to = k >= 0 ? next.cells[k] : cell, later = k >= 0 ? next.poses[k] & 7 : heading;
      const r = Math.floor(cell / width) - z, q = (cell % width) - z;
      const r2 = Math.floor(to / width) - z, q2 = (to % width) - z;
      // The shorter way round.
      const turn = ((later - heading + 9) % 6) - 3;
      const at = i * FLOATS_OF_ANT;
      numbers[at] = 1.5 * r;
      numbers[at + 1] = height * (0.5 * r - q);
      numbers[at + 2] = heading;
      numbers[at + 3] = 1.5 * r2;
      numbers[at + 4] = height * (0.5 * r2 - q2);
      numbers[at + 5] = heading + turn;
      numbers[at + 6] = frame.poses[i] >> 3;
    }
    this.nAnts = n;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.antBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, numbers.subarray(0, n * FLOATS_OF_ANT), gl.DYNAMIC_DRAW);
  }

  use(name, extra) {
    const { gl, camera, ratio, colours } = this, { handle, uniforms } = this.programs[name];
    gl.useProgram(handle);
    gl.uniform2f(uniforms.centre, camera.x, camera.y);
    gl.uniform2f(uniforms.size, this.canvas.width, this.canvas.height);
    gl.uniform1f(uniforms.scale, camera.scale * ratio);
    for (const [uniform, colour] of Object.entries(extra)) gl.uniform3fv(uniforms[uniform], rgb(colours[colour]));
    return uniforms;
  }

  drawCells() {
    const { gl, grid } = this;
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.disable(gl.BLEND);
    gl.bindVertexArray(this.nothing);
    const uniforms = this.use("cells", {
      page: "page", empty: "empty", rock: "rock", food: "food", queen: "queen",
      foodFloor: "food-floor", queenFloor: "queen-floor",
    });
    gl.uniform3i(uniforms.grid, grid.width, grid.height, grid.ranges[2]);
    gl.uniform1i(uniforms.cells, 0);
    gl.uniform1i(uniforms.ramp, 1);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.rampTexture);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.cellTexture);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  drawAnts(share) {
    const { gl, ratio } = this, hexagon = this.camera.scale * ratio;
    gl.enable(gl.BLEND);
    gl.bindVertexArray(this.antArray);
    const uniforms = this.use("ants", { ant: "ant", halo: "halo", food: "food", loadedDot: "loaded-dot" });
    const detail = hexagon < DOTS_BELOW ? 0 : hexagon < DARTS_BELOW ? 1 : 2;
    const dot = 1.3 * ratio;
    // Dots that would hide the world and each other become a shade.
    const covered = (this.nAnts * Math.PI * dot ** 2) / (this.grid.size * 2.6 * hexagon ** 2);
    gl.uniform1f(uniforms.radius, detail === 0 ? Math.max(0.83 * hexagon, dot) : 0.83 * hexagon);
    gl.uniform1f(uniforms.opacity, detail === 0 ? Math.min(1, 0.5 * Math.max(covered, 1e-9) ** -0.6) : 1);
    gl.uniform1f(uniforms.share, share);
    gl.uniform1i(uniforms.detail, detail);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, this.nAnts);
  }

  /* The path, the view and the ring of the followed ant; the chosen cell. */
  drawMarks(moment, share, { ant, next, path, letters, cell, cursor }) {
    const context = this.overlay.getContext("2d"), { grid, colours, camera, ratio } = this;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, this.width, this.height);
    const hexagon = (which, radius) => {
      const [x, y] = this.toPage(grid.centre(which));
      context.beginPath();
      for (let k = 0; k < 6; k++) {
        context.lineTo(x + radius * Math.cos((k * Math.PI) / 3), y + radius * Math.sin((k * Math.PI) / 3));
      }
      context.closePath();
    };
    context.lineJoin = context.lineCap = "round";
    // Where cells are small, a ring shows where the queen is.
    for (const queen of camera.scale < 7 ? this.queens : []) {
      hexagon(queen, 9);
      context.strokeStyle = colours.halo;
      context.lineWidth = 5;
      context.stroke();
      context.strokeStyle = colours.queen;
      context.lineWidth = 2.5;
      context.stroke();
    }
    if (cell >= 0) {
      hexagon(cell, Math.max(camera.scale, 5));
      context.strokeStyle = colours.mark;
      context.lineWidth = cursor ? 3 : 2;
      context.stroke();
    }
    if (!ant) return;
    this.drawPath(context, path);
    const small = camera.scale < 7, [x0, y0] = grid.centre(ant.cell);
    const [x1, y1] = next ? grid.centre(next.cell) : [x0, y0];
    const middle = this.toPage([x0 + share * (x1 - x0), y0 + share * (y1 - y0)]);
    context.beginPath();
    context.arc(...middle, Math.max(1.02 * camera.scale, 9), 0, 2 * Math.PI);
    for (const [colour, width] of [["halo", 5.5], ["chosen", 2.5]]) {
      context.strokeStyle = colours[colour];
      context.lineWidth = width;
      context.stroke();
    }
    if (small || share > 0) return; // what it sees belongs to where it stands
    const view = this.history.header.view;
    view.forEach((turn, i) => {
      const seen = ant.cell + grid.offsets[(ant.heading + turn + 6) % 6];
      hexagon(seen, 0.93 * camera.scale);
      context.strokeStyle = colours.ink;
      context.lineWidth = Math.min(2, camera.scale / 8);
      context.stroke();
      if (camera.scale >= 10 && letters[i]) {
        const [x, y] = this.toPage(grid.centre(seen));
        context.font = `600 ${Math.min(0.62 * camera.scale, 30)}px ${getComputedStyle(document.body).fontFamily}`;
        context.textAlign = "center";
        context.textBaseline = "middle";
        context.lineWidth = 4;
        context.strokeStyle = colours.halo;
        context.strokeText(letters[i], x, y);
        context.fillStyle = colours.ink;
        context.fillText(letters[i], x, y);
      }
    });
  }

  drawPath(context, path) {
    if (!path || path.length < 2) return;
    const places = path.map((cell) => this.toPage(this.grid.centre(cell))), [[x0, y0], [x1, y1]] = places;
    const away = Math.min(0.9 * this.camera.scale / (Math.hypot(x1 - x0, y1 - y0) || 1), 1);
    places[0] = [x0 + away * (x1 - x0), y0 + away * (y1 - y0)]; // not over the ant itself
    const width = Math.min(Math.max(0.16 * this.camera.scale, 2), 5), parts = Math.min(24, places.length - 1);
    context.lineCap = "butt";
    // A light edge, for dark trails, then the line; the older, the fainter.
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

function rgb(hex) {
  const word = parseInt(hex.replace("#", ""), 16);
  return [(word >> 16) / 255, ((word >> 8) & 255) / 255, (word & 255) / 255];
}

function texture(gl, width, height) {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, width, height);
  for (const name of ["TEXTURE_MIN_FILTER", "TEXTURE_MAG_FILTER"]) gl.texParameteri(gl.TEXTURE_2D, gl[name], gl.NEAREST);
  return made;
}

function program(gl, { vertex, fragment }) {
  const handle = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source.trim());
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(handle, shader);
  }
  gl.linkProgram(handle);
  if (!gl.getProgramParameter(handle, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(handle));
  const uniforms = {};
  for (let i = 0; i < gl.getProgramParameter(handle, gl.ACTIVE_UNIFORMS); i++) {
    const { name } = gl.getActiveUniform(handle, i);
    uniforms[name] = gl.getUniformLocation(handle, name);
  }
  return { handle, uniforms };
}
