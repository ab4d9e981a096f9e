/* Time: where in the recording the page is, how fast it goes on, what happened when, and curves. */

const CURVES = [
  ["delivered", (frame) => frame.delivered, 0],
  ["return", (frame) => frame.returns, 0],
  ["epsilon", (frame) => frame.epsilon, 3],
];
const MOST_POINTS = 1500;
const SLOWEST = 0.5, FASTEST = 200; // ticks a second
const SMOOTH_BELOW = 24; // ticks a second: ants glide from cell to cell

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
    // Back from between two moments leads to the first of them.
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
  /* Let some seconds pass; whether anything moves. */
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
    this.time.addEventListener("input", () => player.seek(Number(this.time.value)), { signal });
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
    for (const curve of this.curves) {
      const svg = curve.querySelector("svg");
      const seek = (event) => {
        const box = svg.getBoundingClientRect();
        player.seek(((event.clientX - box.left) / box.width) * player.last);
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
    const shown = unlimited ? "fastest" : `${speed < 3 ? speed.toFixed(1) : Math.round(speed)} / s`;
    byId("speed-value").textContent = shown;
    this.speed.setAttribute("aria-valuetext", unlimited ? "as fast as it can" : `${shown.split(" ")[0]} ticks a second`);
  }

  /* Draw the events and the curves, as far as the history goes. */
  draw() {
    const { history, player } = this, last = Math.max(player.last, 1);
    this.drawn = history.length;
    this.time.max = player.last;
    const strokes = { [PICKED_UP]: new Set(), [DELIVERED]: new Set() };
    for (const { moment, kind } of history.events) strokes[kind].add(Math.round((2000 * moment) / last) / 2);
    const paths = Object.entries(strokes).map(([kind, places]) => {
      const [name, y] = Number(kind) === PICKED_UP ? ["picked", 9] : ["delivered", 1];
      return `<path class="${name}" d="${[...places].map((x) => `M${x} ${y}v4`).join("")}"/>`;
    });
    const svg = byId("events");
    svg.setAttribute("viewBox", "0 0 1000 14");
    svg.innerHTML = paths.join("");
    const every = Math.ceil(history.length / MOST_POINTS), picked = [];
    for (let i = 0; i < history.length; i += every) picked.push(i);
    if (picked[picked.length - 1] !== history.length - 1) picked.push(history.length - 1);
    this.curves.forEach((curve, number) => {
      const values = picked.map((i) => CURVES[number][1](history.frames[i]));
      const low = Math.min(0, ...values), high = Math.max(0, ...values, low + 1e-9);
      const at = (value) => 100 - (94 * (value - low)) / (high - low);
      const points = values.map((value, i) => `${((100 * picked[i]) / last).toFixed(2)} ${at(value).toFixed(2)}`);
      curve.querySelector(".line").setAttribute("d", `M${points.join("L")}`);
      curve.querySelector(".area").setAttribute("d", `M0 ${at(0)}L${points.join("L")}L${(100 * player.last) / last} ${at(0)}Z`);
      curve.querySelector(".base").setAttribute("d", `M0 ${at(0)}H100`);
    });
  }

  show() {
    const { player, history } = this, frame = history.frames[player.moment];
    if (history.length !== this.drawn) this.draw();
    this.time.value = player.moment;
    this.time.style.setProperty("--filled", `${(100 * player.moment) / Math.max(player.last, 1)}%`);
    const end = history.frames[player.last];
    const episode = end.episode > (history.live ? 0 : history.frames[0].episode) ? `, episode ${frame.episode}` : "";
    this.time.setAttribute("aria-valuetext", `tick ${frame.tick}${episode}`);
    const of = episode || history.live ? `<span>${episode}</span>` : ` <span>of ${end.tick}</span>`;
    byId("place").innerHTML = `<span>tick</span> <b>${frame.tick}</b>${of}`;
    const main = byId("play");
    main.classList.toggle("playing", player.playing);
    main.setAttribute("aria-label", player.playing ? "Pause" : "Play");
    byId("first").disabled = byId("back").disabled = player.moment <= history.first;
    byId("last").disabled = player.moment === player.last;
    byId("forward").disabled = player.moment === player.last && !history.live;
    this.curves.forEach((curve, number) => {
      const [, value, digits] = CURVES[number];
      curve.querySelector("b").textContent = plain(value(frame), digits);
      const x = (100 * player.moment) / Math.max(player.last, 1), cursor = curve.querySelector(".cursor");
      cursor.setAttribute("x1", x);
      cursor.setAttribute("x2", x);
    });
  }
}
