"use strict";

/* The history of a world, moment by moment.

   A source provides a header and frames (frames.py defines their format):

     source.header          facts about all frames, from `Recorder.header` in Python
     source.live            true if more frames may arrive
     source.start(receive)  calls receive(bytes, whole) with each frame, in order: at once for a
                            recording, as they arrive for a live simulation; whole is true for a
                            complete frame, and false for a frame of changes

   A live source may also have `player(history, changed)`; `stand(viewer)`, called once the page is
   complete; `seen()`, called after new frames are drawn; and `keys`, more lines for the help.

   A frame is an ArrayBuffer, or a view of one. */

const EMPTY = 0, OBSTACLE = 5, FOOD = 7, QUEEN = 13; // contents of a cell, as in task/constants.py
const N_ACTIONS = 5, RESTS = 15; // RESTS is the action of an ant that rests in frames
const MOST_BYTES = 2 ** 27; // bytes of stored frames; a live simulation has more after some hours
const CLOCK = ["episode", "tick", "deliveries", "returns", "epsilon", "learningRate", "ants", "delivered", "ticks", "trailClock"];
const POINT = ["episode", "ticks", "delivered", "returns", "epsilon", "ended"]; // as in frames.py
const MOST_POINTS = 1500;
const ARRAYS = {
  u1: Uint8Array, u2: Uint16Array, u4: Uint32Array, i4: Int32Array, f4: Float32Array, f8: Float64Array,
};

/* Return the source of a recording in the page, which is compressed and in base64. */
async function recordingIn(text) {
  const packed = Uint8Array.from(atob(text.trim()), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const whole = await new Response(stream).arrayBuffer();
  const end = 4 + new DataView(whole).getUint32(0, true);
  return {
    header: JSON.parse(new TextDecoder().decode(new Uint8Array(whole, 4, end - 4))),
    live: false,
    start(receive) {
      for (let at = end; at < whole.byteLength; ) {
        const length = new DataView(whole).getUint32(at, true);
        receive(new Uint8Array(whole, at, length));
        at += length;
      }
    },
  };
}

/* The geometry of a world, as in grid/hexgrid.py. Lengths are in sizes of a hexagon. */
class Grid {
  constructor([x, y, z]) {
    this.ranges = [x, y, z];
    this.width = x + z + 1;
    this.height = y + z + 1;
    this.size = this.width * this.height;
    // Headings run clockwise from up; a step adds one of these to an index.
    this.offsets = [1, 1 + this.width, this.width, -1, -1 - this.width, -this.width];
    this.left = -1.5 * (z - 1) - 1;
    this.right = 1.5 * (y - 1) + 1;
    this.top = -Math.sqrt(3) * (x - 0.5);
    this.bottom = (Math.sqrt(3) * (y + z - 1)) / 2;
  }
  axial(cell) {
    const z = this.ranges[2];
    return [(cell % this.width) - z, Math.floor(cell / this.width) - z];
  }
  centre(cell) {
    const [q, r] = this.axial(cell);
    return [1.5 * r, Math.sqrt(3) * (0.5 * r - q)];
  }
  /* The normal form of the cube coordinates. */
  cube(cell) {
    const [q, r] = this.axial(cell), low = Math.min(q, r, 0);
    return [q - low, r - low, 0 - low];
  }
  exists(cell) {
    if (cell < 0 || cell >= this.size) return false;
    const [x, y, z] = this.ranges, [i, j, k] = this.cube(cell);
    return i < x && j < y && k < z;
  }
  /* The cell at a point, -1 outside the world. */
  at(x, y) {
    const r = x / 1.5, q = r / 2 - y / Math.sqrt(3);
    let a = Math.round(q), b = Math.round(r);
    const c = Math.round(q - r), da = Math.abs(a - q), db = Math.abs(b - r), dc = Math.abs(c - (q - r));
    if (da > db && da > dc) a = b + c;
    else if (db > dc) b = a - c;
    const [, , z] = this.ranges;
    if (a < -z || b < -z || a >= this.width - z || b >= this.height - z) return -1;
    const cell = (b + z) * this.width + a + z;
    return this.exists(cell) ? cell : -1;
  }
}

/* All frames so far, from which the world at any moment is computed. */
class History {
  constructor(header) {
    this.header = header;
    this.grid = new Grid(header.ranges);
    this.names = Object.keys(header.types);
    this.kinds = this.names.map((name) => ARRAYS[header.types[name]]);
    this.headBytes = 8 * Math.ceil((1 + this.names.length) / 2);
    this.trails = header.pheromones.map((_, n) => `trail${n || ""}`); // their sections
    // The pheromone that the page shows, also after another session began if that has it.
    this.shown = Math.max(header.pheromones.findIndex(({ name }) => name === History.chosen), 0);
    this.frames = [];
    this.first = 0; // the earliest stored moment
    this.bytes = 0;
    this.events = []; // pick-ups and deliveries: {moment, kind, ant, cell}, in order
    this.within = []; // points for curves, within the first episode: objects of `POINT`
    this.ends = []; // points at the ends of episodes
    this.values = new Map(); // entry of a table -> [moments, values] of its changes
    // `stored` are the pheromones in the form of the kernels, `trail` the levels of the shown one.
    this.world = {
      moment: -1, ground: new Uint8Array(this.grid.size), kinds: new Uint8Array(this.grid.size),
      stored: this.trails.map((name) => new ARRAYS[header.types[name]](this.grid.size)), trail: new Float64Array(this.grid.size),
    };
    this.kept = []; // copies of the world at some moments, for fast seeking
    this.lastKept = -Infinity;
    // At most 64 MiB of copies, so large worlds have fewer.
    this.keepEvery = 32;
    this.mostKept = Math.max(8, Math.floor(2 ** 26 / ((1 + 4 * this.trails.length) * this.grid.size)));
  }

  get length() {
    return this.frames.length;
  }

  /* Facts about the pheromone that the page shows: {name, strongest, seen_by}. */
  get pheromone() {
    return this.header.pheromones[this.shown];
  }

  /* Zeros for the groups or marks of ants, in memory that frames share. */
  none(length) {
    if (!(this.zeros?.length >= length)) this.zeros = new Uint8Array(2 * length);
    return this.zeros.subarray(0, length);
  }

  /* Append a frame; keeps views of its bytes. A whole frame does not depend on earlier ones. */
  add(bytes, whole = false) {
    const { header } = this, frame = this.read(bytes), moment = this.length, before = this.frames[moment - 1];
    if (!frame.numbers.length && frame.ants) frame.numbers = before.numbers;
    if (!frame.queens.length) frame.queens = before.queens;
    if (frame.groups.length < frame.cells.length) frame.groups = this.none(frame.cells.length);
    if (frame.marks.length < frame.cells.length) frame.marks = this.none(frame.cells.length);
    frame.number = moment;
    frame.whole = whole;
    frame.passed = before && before.episode === frame.episode ? frame.tick - before.tick : 0;
    this.frames.push(frame);
    this.bytes += frame.size;
    for (let i = 0; i < frame.table.length; i++) {
      const entry = frame.table_at[i];
      if (!this.values.has(entry)) this.values.set(entry, [[], []]);
      const [moments, values] = this.values.get(entry);
      moments.push(moment);
      values.push(frame.table[i]);
    }
    for (let i = 0; i < frame.acts.length; i++) {
      const event = header.events[frame.acts[i] >> 4];
      if (event !== "PICKED_UP" && event !== "DELIVERED") continue;
      this.events.push({
        moment, kind: event, ant: before.numbers[i], cell: before.cells[i],
      });
    }
    if (whole) [this.within, this.ends] = [[], []];
    for (let at = 0; at < frame.progress.length; at += POINT.length) {
      const point = Object.fromEntries(POINT.map((name, i) => [name, frame.progress[at + i]]));
      if (point.ended) this.ends.push(point);
      else if (!moment || whole) this.within.push(point); // later frames are points themselves
    }
    if (this.ends.length > 2 * MOST_POINTS) this.ends = this.ends.filter((_, i) => i % 2 === 0);
    if (this.bytes > MOST_BYTES) this.forget();
    return frame;
  }

  /* Forget the earlier half of the history, except the numbers for curves. */
  forget() {
    this.worldAt(this.length - 1); // makes copies of the later half
    const { moment: first } = this.kept[this.kept.length >> 1];
    this.kept = this.kept.filter((copy) => copy.moment >= first);
    for (; this.first < first; this.first++) {
      const { number, size, ...rest } = this.frames[this.first];
      const clock = Object.fromEntries(CLOCK.map((name) => [name, rest[name]]));
      const nothing = { numbers: [], cells: [], poses: [], groups: [], marks: [], states: [], acts: [], choices: [], td_errors: [], passed: 0 };
      this.frames[this.first] = { number, ...clock, ...nothing };
      this.bytes -= size;
    }
    this.events = this.events.filter(({ moment }) => moment > first);
    for (const changes of this.values.values()) {
      const old = Math.max(0, changes[0].findLastIndex((moment) => moment <= first));
      changes.forEach((list) => list.splice(0, old));
    }
  }

  /* Whether there is more than one episode. */
  get several() {
    const last = this.frames[this.length - 1];
    return this.ends.length > 0 || last.delivered !== last.deliveries || last.episode > this.frames[0].episode;
  }

  /* The start of curves, in ticks over all episodes. */
  get origin() {
    return Math.min(this.frames[0].ticks, ...this.within.slice(0, 1).map(({ ticks }) => ticks));
  }

  /* The last moment at or before a number of ticks over all episodes. */
  momentAt(ticks) {
    let low = this.first, high = this.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.frames[middle].ticks <= ticks) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  read(bytes) {
    const view = ArrayBuffer.isView(bytes) ? bytes : new Uint8Array(bytes);
    const lengths = new Uint32Array(view.buffer, view.byteOffset, 1 + this.names.length);
    const frame = { size: view.byteLength, bytes: view };
    let at = view.byteOffset + this.headBytes;
    this.names.forEach((name, i) => {
      frame[name] = new this.kinds[i](view.buffer, at, lengths[i + 1]);
      at += 8 * Math.ceil(frame[name].byteLength / 8);
    });
    CLOCK.forEach((name, i) => (frame[name] = frame.clock[i]));
    return frame;
  }

  /* A complete frame of a moment, see `pack` in frames.py. */
  wholeFrame(moment) {
    const frame = this.frames[moment], { ground, kinds, stored } = this.worldAt(moment);
    const since = moment > this.first ? this.frames[moment - 1].ticks : -1;
    const points = [...(moment > this.first ? [] : this.within), ...this.ends].filter(({ ticks }) => ticks > since && ticks <= frame.ticks);
    const entries = [...this.values.keys()].filter((entry) => this.values.get(entry)[0][0] <= moment);
    const sections = {
      ...frame, acts: [], choices: [], rewards: [], td_errors: [], ground_at: ground.keys(), ground, kinds_at: kinds.keys(), kinds,
      ...Object.fromEntries(this.trails.flatMap((name, n) => [[`${name}_at`, stored[n].keys()], [name, stored[n]]])),
      table_at: entries, table: entries.map((entry) => this.entry(moment, entry)),
      progress: points.flatMap((point) => POINT.map((name) => point[name])),
    };
    const arrays = this.names.map((name, i) => this.kinds[i].from(sections[name]));
    const places = arrays.map(({ byteLength }) => 8 * Math.ceil(byteLength / 8));
    const bytes = new Uint8Array(places.reduce((sum, length) => sum + length, this.headBytes));
    new Uint32Array(bytes.buffer).set([bytes.length, ...arrays.map(({ length }) => length)]);
    let at = this.headBytes;
    arrays.forEach((array, i) => {
      bytes.set(new Uint8Array(array.buffer), at);
      at += places[i];
    });
    return bytes;
  }

  /* The stored history as a compressed Blob, which `recordingIn` reads. */
  async packed() {
    const encoded = new TextEncoder().encode(JSON.stringify(this.header));
    const head = new Uint8Array(8 * Math.ceil((4 + encoded.length) / 8)).fill(32); // spaces
    new DataView(head.buffer).setUint32(0, head.length - 4, true);
    head.set(encoded, 4);
    const parts = [head];
    for (let moment = this.first; moment < this.length; moment++) {
      const { whole, bytes } = this.frames[moment];
      parts.push(whole || moment === this.first ? this.wholeFrame(moment) : bytes);
    }
    return new Response(new Blob(parts).stream().pipeThrough(new CompressionStream("deflate"))).blob();
  }

  /* The world at a moment: {ground, trail}, where trail is levels. Valid until the next call. */
  worldAt(moment) {
    const world = this.world;
    if (moment === world.moment && world.shown === this.shown) return world;
    if (moment < world.moment || moment > world.moment + this.keepEvery) {
      let from = null;
      for (const copy of this.kept) if (copy.moment <= moment) from = copy;
      if (from && (moment < world.moment || from.moment > world.moment)) {
        world.moment = from.moment;
        world.ground.set(from.ground);
        world.kinds.set(from.kinds);
        world.stored.forEach((one, n) => one.set(from.stored[n]));
      } else if (moment < world.moment) {
        world.moment = -1;
        world.ground.fill(0);
        world.kinds.fill(0);
        for (const one of world.stored) one.fill(0);
      }
    }
    while (world.moment < moment) this.step();
    const { trail } = world, stored = world.stored[this.shown], clock = this.frames[moment].clock[CLOCK.length - 1 + this.shown];
    for (let cell = 0; cell < trail.length; cell++) trail[cell] = Math.max(stored[cell] - clock, 0);
    world.shown = this.shown;
    return world;
  }

  step() {
    const world = this.world, frame = this.frames[world.moment + 1];
    if (frame.whole) {
      world.ground.fill(0);
      world.kinds.fill(0);
      for (const one of world.stored) one.fill(0);
    }
    frame.ground_at.forEach((cell, i) => (world.ground[cell] = frame.ground[i]));
    frame.kinds_at.forEach((cell, i) => (world.kinds[cell] = frame.kinds[i]));
    this.trails.forEach((name, n) => frame[`${name}_at`].forEach((cell, i) => (world.stored[n][cell] = frame[name][i])));
    world.moment++;
    const last = this.kept[this.kept.length - 1];
    if (world.moment >= (last ? last.moment + this.keepEvery : 0)) {
      const { ground, kinds, stored } = world;
      this.kept.push({ moment: world.moment, ground: ground.slice(), kinds: kinds.slice(), stored: stored.map((one) => one.slice()) });
      if (this.kept.length > this.mostKept) {
        this.kept = this.kept.filter((_, i) => i % 2 === 0);
        this.keepEvery *= 2;
      }
    }
  }

  /* The index of an ant in the arrays of a frame, -1 if it does not live then. */
  place(moment, number) {
    const numbers = this.frames[moment]?.numbers ?? [];
    if (numbers[number] === number) return number; // no ant has died yet
    let low = 0, high = numbers.length - 1;
    while (low <= high) {
      const middle = (low + high) >> 1;
      if (numbers[middle] === number) return middle;
      if (numbers[middle] < number) low = middle + 1;
      else high = middle - 1;
    }
    return -1;
  }

  /* An ant at a moment, with its next action; null if it does not live then.

     {number, nest, caste, kind, marks, rests, cell, heading, loaded, state, values, act}. kind is that of its
     food. act is null if unknown or if the ant rests, else
     {action, executed, event, reward, why, ties, ahead, tdError, sharers, before, after, values}.
     action is the chosen one. why is "best", "tie" (of `ties` actions) or "explored", by the values
     at the time of the choice, one tick earlier if it was made `ahead`; "" if these are unknown; or
     "rule" if the ants are not greedy. tdError is a mean over `sharers`; before and after are action
     values. */
  ant(moment, number) {
    const i = this.place(moment, number);
    if (i < 0) return null;
    const frame = this.frames[moment];
    const ant = {
      number, nest: frame.poses[i] >> 4, caste: frame.groups[i] & 15, kind: (frame.groups[i] >> 4) & 7,
      marks: this.header.marks.map((_, k) => frame.marks[k * frame.cells.length + i]), cell: frame.cells[i], heading: frame.poses[i] & 7,
      loaded: (frame.poses[i] & 8) > 0, state: frame.states[i], act: null,
    };
    ant.values = this.row(moment, ant);
    const next = this.frames[moment + 1];
    ant.rests = next?.acts.length > 0 && (next.acts[i] & 15) === RESTS;
    if (next && next.acts.length && !ant.rests) ant.act = this.act(moment, i, ant);
    return ant;
  }

  /* The number of the table of an ant, as in `Colony.tables_of_ants`. */
  owner({ number, nest, caste }) {
    return this.header.own_tables ? number : nest * Math.max(1, this.header.castes.length) + caste;
  }

  act(moment, i, ant) {
    const { header } = this, frame = this.frames[moment], next = this.frames[moment + 1];
    const executed = next.acts[i] & 15, event = header.events[next.acts[i] >> 4];
    const action = next.choices[i] & 7, ahead = next.choices[i] > 7;
    // Some learners draw an action one tick ahead, from the values at that time.
    // If nothing came before the history, states have their first values until an ant visits them.
    const isNew = this.frames[0].ticks > 0 && !(this.values.get(this.firstOf(ant))?.[0][0] < moment);
    const known = !ahead || (frame.passed === 1 && !isNew);
    const values = ahead && known ? this.row(moment - 1, ant) : ant.values;
    const best = Math.max(...values), ties = values.filter((value) => value === best).length;
    const byValues = !known ? "" : values[action] < best ? "explored" : ties > 1 ? "tie" : "best";
    const why = header.rule === "greedy" ? byValues : "rule";
    const after = this.row(moment + 1, ant)[action];
    const before = ant.values[action];
    let sharers = 1;
    if (header.learns && !header.own_tables) {
      sharers = 0;
      for (let k = 0; k < next.acts.length; k++) {
        const group = { nest: frame.poses[k] >> 4, caste: frame.groups[k] & 15 };
        if (frame.states[k] === ant.state && this.owner(group) === this.owner(ant) && (next.choices[k] & 7) === action) sharers++;
      }
    }
    const tdError = next.td_errors.length ? next.td_errors[i] : NaN;
    return { action, executed, event, reward: next.rewards[i], why, ties, ahead, tdError, sharers, before, after, values };
  }

  /* The five action values of an ant's state as they stood at a moment. */
  row(moment, ant) {
    return Array.from({ length: N_ACTIONS }, (_, action) => this.entry(moment, this.firstOf(ant) + action));
  }

  firstOf(ant) {
    return (this.owner(ant) * this.header.n_states + ant.state) * N_ACTIONS;
  }

  entry(moment, entry) {
    const [moments, values] = this.values.get(entry) ?? [[], []];
    let low = 0, high = moments.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (moments[middle] <= moment) low = middle + 1;
      else high = middle;
    }
    return values[Math.max(low - 1, 0)] ?? 0;
  }

  /* The cells where an ant was, the latest first, back to the start of its episode or its birth, or
     to where more than a tick passed between two moments: nobody knows its way then. */
  path(moment, number, most = 150) {
    const cells = [], episode = this.frames[moment].episode;
    for (let then = moment; then >= 0 && cells.length < most; then--) {
      const i = this.frames[then].episode === episode ? this.place(then, number) : -1;
      if (i < 0 || (then < moment && this.frames[then + 1].passed > 1)) break;
      if (cells[cells.length - 1] !== this.frames[then].cells[i]) cells.push(this.frames[then].cells[i]);
    }
    return cells;
  }

  /* The task in a state's name, the rest of it, and the letters of the cells in view. */
  stateName(state) {
    const [task, rest, letters] = this.header.names[state] ?? ["", `state ${state}`, []];
    return { task, rest, letters };
  }

  /* The cells that an ant may turn to with a move, or where it may take or give. */
  targets(ant, action) {
    const { offsets } = this.grid;
    const towards = (turn) => ant.cell + offsets[(ant.heading + turn + 6) % 6];
    if (action < 3) return [towards(action - 1)];
    const { ground, moment } = this.world, queen = this.frames[moment].queens[ant.nest];
    return [-1, 0, 1].map(towards).filter((cell) => (action === 3 ? ground[cell] === FOOD : cell === queen));
  }

  /* The ants that want to enter a cell, or what lies in it: [{number, action, event, several}].
     There are several if an ant takes one of them, drawn at random. */
  wanting(moment, cell) {
    const frame = this.frames[moment], next = this.frames[moment + 1], found = [];
    if (!next || !next.acts.length) return found;
    this.worldAt(moment);
    for (const offset of this.grid.offsets) {
      for (let i = 0; i < frame.cells.length; i++) {
        if (frame.cells[i] !== cell + offset) continue;
        const ant = { nest: frame.poses[i] >> 4, cell: frame.cells[i], heading: frame.poses[i] & 7 };
        const action = next.acts[i] & 15, event = this.header.events[next.acts[i] >> 4];
        const targets = action === RESTS ? [] : this.targets(ant, action);
        if (targets.includes(cell)) found.push({ number: frame.numbers[i], action, event, several: targets.length > 1 });
      }
    }
    return found;
  }

  /* The ants on a cell. */
  antsOn(moment, cell) {
    const { cells, numbers } = this.frames[moment];
    return Array.from(numbers).filter((_, i) => cells[i] === cell);
  }
}
