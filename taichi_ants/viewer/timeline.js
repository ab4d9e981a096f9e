/* The timeline: position, speed, events and curves. */

/* Name, name if there are several episodes, key of a frame or a point, digits. */
const CURVES = [
  ["delivered", "delivered in total", "delivered", 0],
  ["return", "return per episode", "returns", 0],
  ["epsilon", "epsilon", "epsilon", 3],
];
const SLOWEST = 0.5, FASTEST = 200; // ticks/s
const SMOOTH_BELOW = 24; // ticks/s up to which ants glide from cell to cell

class Player {
  constructor(history, changed) {
    this.slowest = SLOWEST;
    this.fastest = FASTEST;
    this.history = history;
    this.changed = changed;
    this.moment = 0;
    this.share = 0; // of the way to the next moment
    this.playing = false;
    this.speed = 6;
  }
  get last() {
    return Math.max(this.history.length - 1, 0);
  }
  go(moment) {
    this.moment = Math.min(Math.max(Math.round(moment), this.history.first), this.last);
    this.share = 0;
    this.changed();
  }
  setSpeed(speed) {
    this.speed = speed;
  }
  seek(moment) {
    this.pause();
    this.go(moment);
  }
  step(n) {
    this.pause();
    // A step back from between two moments leads to the first of them.
    this.go(this.moment + n + (n < 0 && this.share > 0 ? 1 : 0));
  }
  play() {
    if (this.last === 0 && !this.history.live) return;
    if (this.moment >= this.last && !this.history.live) this.moment = 0;
    this.playing = true;
    this.changed();
  }
  pause() {
    this.playing = false;
    this.share = 0;
    this.changed();
  }
  /* Advance by some seconds; return whether anything moves. */
  pass(seconds) {
    if (!this.playing) return false;
    this.share += Math.min(seconds, 0.25) * this.speed;
    const whole = Math.floor(this.share);
    this.moment += whole;
    this.share -= whole;
    if (this.moment >= this.last) {
      this.moment = this.last;
      this.share = 0;
      if (!this.history.live) this.playing = false;
    }
    return true;
  }
}

class Timeline {
  constructor(history, player, signal) {
    this.history = history;
    this.player = player;
    this.time = byId("time");
    this.speed = byId("speed");
    this.time.addEventListener("input", () => this.seek(Number(this.time.value)), { signal });
    this.speed.addEventListener("input",
      () => this.setSpeed(player.slowest * (player.fastest / player.slowest) ** (this.speed.value / 100)), { signal });
    for (const [id, act] of Object.entries({
      first: () => player.step(-Infinity), back: () => player.step(-1), forward: () => player.step(1),
      last: () => player.step(Infinity), play: () => (player.playing ? player.pause() : player.play()),
    })) byId(id).addEventListener("click", act, { signal });
    byId("curves").innerHTML = CURVES.map(([name]) => `
      <div class="curve"><div class="label"><span>${name}</span><b></b></div>
        <svg viewBox="0 0 100 100" preserveAspectRatio="none" aria-hidden="true">
          <path class="base"/><path class="area"/><path class="line"/>
          <line class="cursor" y1="0" y2="100"/>
        </svg></div>`).join("");
    this.curves = [...document.querySelectorAll(".curve")];
    // There is no curve of epsilon if it is always 0, or has no effect.
    const explores = history.header.values && (history.live || history.frames.some((frame) => frame.epsilon > 0));
    this.curves.forEach((curve, number) => (curve.hidden = CURVES[number][0] === "epsilon" && !explores));
    for (const curve of this.curves) {
      const svg = curve.querySelector("svg");
      const seek = (event) => {
        const box = svg.getBoundingClientRect();
        const { origin } = history, share = (event.clientX - box.left) / box.width;
        player.seek(history.momentAt(Math.round(origin + share * (this.ticks(player.last) - origin))));
      };
      svg.addEventListener("pointerdown", (event) => {
        svg.setPointerCapture(event.pointerId);
        seek(event);
      });
      svg.addEventListener("pointermove", (event) => event.buttons && seek(event));
    }
    if (history.live) this.showSpeed();
    else this.setSpeed(history.length > 120 ? 12 : 6);
    this.drawn = 0;
    this.draw();
  }

  /* Ticks over all episodes at a moment, which the horizontal axis shows. */
  ticks(moment) {
    return this.history.frames[moment].ticks;
  }

  /* Mean ticks between two moments; a recording may skip most ticks. */
  get ticksAMoment() {
    const { history, player } = this;
    const passed = history.live ? 1 : (this.ticks(player.last) - this.ticks(0)) / Math.max(player.last, 1);
    return passed > 1.5 ? passed : 1;
  }

  /* The horizontal position of a number of ticks, in percent. */
  across(ticks) {
    const { origin } = this.history;
    return (100 * (ticks - origin)) / Math.max(this.ticks(this.player.last) - origin, 1);
  }

  /* Go to the position of the slider; a step forward always leads to another moment. */
  seek(ticks) {
    const { player, history } = this, moment = history.momentAt(ticks);
    const on = ticks > this.ticks(player.moment) && moment === player.moment;
    player.seek(moment + Number(on));
  }

  /* A path over the spans of ticks whose events are unknown, because no frame has their actions. */
  gaps() {
    const { history, player } = this, spans = [[history.origin, this.ticks(0)]];
    for (let moment = 1; moment <= player.last; moment++) {
      const [from, to] = [this.ticks(moment - 1), this.ticks(moment)], last = spans[spans.length - 1];
      if (history.frames[moment].acts.length || from === to) continue;
      if (last[1] === from) last[1] = to;
      else spans.push([from, to]);
    }
    const at = (ticks) => (10 * this.across(ticks)).toFixed(1);
    return spans.filter(([from, to]) => from < to).map(([from, to]) => `M${at(from)} 7H${at(to)}`).join("");
  }

  setSpeed(speed) {
    const { player } = this;
    player.setSpeed(Math.min(Math.max(speed, player.slowest), player.fastest));
    this.showSpeed();
  }

  showSpeed() {
    const { speed, slowest, fastest } = this.player, share = Math.log(speed / slowest) / Math.log(fastest / slowest);
    this.speed.value = Math.round(100 * share);
    this.speed.style.setProperty("--filled", `${this.speed.value}%`);
    const unlimited = this.history.live && speed >= fastest;
    const pace = speed * this.ticksAMoment;
    const shown = unlimited ? "fastest" : `${pace < 3 ? pace.toFixed(1) : Math.round(pace)} ticks/s`;
    byId("speed-value").textContent = shown;
    this.speed.setAttribute("aria-valuetext", unlimited ? "as fast as possible" : shown);
  }

  /* Draw the events and the curves of the history so far. */
  draw() {
    const { history, player } = this;
    this.drawn = history.length;
    this.time.min = history.origin;
    this.time.max = this.ticks(player.last);
    const strokes = { PICKED_UP: new Set(), DELIVERED: new Set() };
    for (const { moment, kind } of history.events) strokes[kind].add(Math.round(20 * this.across(this.ticks(moment))) / 2);
    const paths = Object.entries(strokes).map(([kind, places]) => {
      const [name, y] = kind === "PICKED_UP" ? ["picked", 9] : ["delivered", 1];
      return `<path class="${name}" d="${[...places].map((x) => `M${x} ${y}v4`).join("")}"/>`;
    });
    paths.unshift(`<path class="gaps" d="${this.gaps()}"/>`);
    const svg = byId("events");
    svg.setAttribute("viewBox", "0 0 1000 14");
    svg.innerHTML = paths.join("");
    const every = Math.ceil(history.length / MOST_POINTS), picked = [];
    for (let i = 0; i < history.length; i += every) picked.push(i);
    if (picked[picked.length - 1] !== history.length - 1) picked.push(history.length - 1);
    // A page opened later has points from before its first frame.
    const early = [...history.within, ...history.ends].filter(({ ticks }) => ticks < this.ticks(0));
    const known = [...early, ...picked.map((i) => history.frames[i])];
    this.curves.forEach((curve, number) => {
      const [name, ofAll, key] = CURVES[number], shown = key === "returns" && history.ends.length ? history.ends : known;
      curve.querySelector("span").textContent = history.several ? ofAll : name;
      const values = shown.map((one) => one[key]), places = shown.map(({ ticks }) => this.across(ticks).toFixed(2));
      const low = Math.min(0, ...values), high = Math.max(0, ...values, low + 1e-9);
      const at = (value) => 100 - (94 * (value - low)) / (high - low);
      const points = values.map((value, i) => `${places[i]} ${at(value).toFixed(2)}`);
      curve.querySelector(".line").setAttribute("d", `M${points.join("L")}h0`);
      curve.querySelector(".area").setAttribute("d", `M${places[0]} ${at(0)}L${points.join("L")}L${places.at(-1)} ${at(0)}Z`);
      curve.querySelector(".base").setAttribute("d", `M0 ${at(0)}H100`);
    });
  }

  show() {
    const { player, history } = this, frame = history.frames[player.moment];
    if (history.length !== this.drawn) this.draw();
    const x = this.across(frame.ticks);
    this.time.value = frame.ticks;
    this.time.style.setProperty("--filled", `${x}%`);
    const end = history.frames[player.last];
    const episode = end.episode > (history.live ? 0 : history.frames[0].episode) ? `, episode ${frame.episode}` : "";
    this.time.setAttribute("aria-valuetext", `tick ${frame.tick}${episode}`);
    const of = episode || history.live ? `<span>${episode}</span>` : ` <span>of ${grouped(end.tick)}</span>`;
    byId("place").innerHTML = `<span>tick</span> <b>${grouped(frame.tick)}</b>${of}`;
    const main = byId("play");
    main.classList.toggle("playing", player.playing);
    main.setAttribute("aria-label", player.playing ? "Pause" : "Play");
    byId("first").disabled = byId("back").disabled = player.moment <= history.first;
    byId("last").disabled = player.moment === player.last;
    byId("forward").disabled = player.moment === player.last && !history.live;
    this.curves.forEach((curve, number) => {
      const [, , key, digits] = CURVES[number], { ends } = history;
      const at = key === "returns" && ends.length ? ends.findLast(({ ticks }) => ticks <= frame.ticks) : frame;
      curve.querySelector("b").textContent = at ? grouped(plain(at[key], digits)) : "–";
      const cursor = curve.querySelector(".cursor");
      cursor.setAttribute("x1", x);
      cursor.setAttribute("x2", x);
    });
  }
}
