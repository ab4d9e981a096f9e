/* The simulation that runs now, as a source of the viewer: one socket, see live/server.py.

   What has arrived is drawn before the server is told that it was seen; a page that is slow, or that
   nobody looks at, is then sent less, and later a whole frame from which to go on.

   Where the connection is lost, the page keeps what it has and tries again. It goes on with the same
   session by itself; another one it shows only if asked to, since that takes the place of what it has. */

const PAGE = document.documentElement.outerHTML; // before anything has changed it
const LIVE_SCRIPT = "/* The secret of the address"; // where the scripts of the live page begin, in token.js
const FIRST_RETRY = 500, LAST_RETRY = 15_000; // milliseconds
const CUT_OFF = 1008; // the server has closed the socket, since the page has sent something wrong

class Live {
  constructor() {
    this.news = new EventTarget(); // "state", "error", "drawn", "file", "cancelled", "lost", "back"
    this.waiting = null; // what the next bytes are, if no frame
    this.arrived = 0; // frames since the server was told
    this.running = false;
    this.stands = false;
    this.speed = 12;
    this.speedUntil = 0;
    this.strokes = 0;
    this.viewer = null;
    this.session = null; // which one the page shows
    this.retry = FIRST_RETRY;
    this.connect();
  }

  get open() {
    return this.socket.readyState === WebSocket.OPEN;
  }

  connect() {
    clearTimeout(this.timer);
    const socket = new WebSocket(`ws://${location.host}/socket?token=${encodeURIComponent(TOKEN)}`);
    const on = (kind, act) => socket.addEventListener(kind, (event) => this.socket === socket && act(event));
    this.socket?.close();
    this.socket = socket;
    this.joins = true; // until it is told which session there is
    this.ended = false;
    socket.binaryType = "arraybuffer";
    on("message", ({ data }) => (typeof data === "string" ? this.hear(JSON.parse(data)) : this.take(data)));
    on("close", (event) => this.lose(event));
  }

  /* Why there is no connection: "lost" or "ended", and it is tried again; "no token", "cut off", or "another" session. */
  lose({ code, reason }) {
    const why = TOKEN === "" ? "no token" : code === CUT_OFF ? "cut off" : this.differs ? "another" : this.ended ? "ended" : "lost";
    this.waiting = this.begins = null;
    this.arrived = 0;
    this.running = this.stands = false;
    if (why === "lost" || why === "ended") {
      this.timer = setTimeout(() => this.connect(), this.retry);
      this.retry = Math.min(2 * this.retry, LAST_RETRY);
    }
    this.tell("lost", { why, reason });
    this.viewer?.player.take();
  }

  /* Try at once, and show whatever session there is if `any`. */
  reconnect(any) {
    if (any) this.session = null;
    this.differs = false;
    this.retry = FIRST_RETRY;
    this.connect();
  }

  ask(what, more = {}) {
    if (this.open) this.socket.send(JSON.stringify({ do: what, ...more }));
  }

  /* Edits of one stroke are undone together. */
  edit(edit, stroke) {
    this.ask("edit", { edit, stroke });
  }
  nextStroke() {
    return ++this.strokes;
  }

  /* Another session stands still at first; who presses play before it is there means that one. */
  stand() {
    this.stands = true; // until it begins, or cannot
    this.running = false;
    this.viewer?.player.take();
  }

  tell(kind, detail) {
    this.news.dispatchEvent(new CustomEvent(kind, { detail }));
  }

  hear(message) {
    if (this.differs) return;
    if (["begin", "error", "cancelled"].includes(message.say)) this.stands = false;
    if (message.say === "begin") this.meet(message);
    else if (message.say === "over") this.ended = true; // the socket closes next
    else if (message.say === "names") Object.assign(this.viewer.history.header.names, message.names);
    else if (message.say === "snapshot" || message.say === "file") this.waiting = message;
    else {
      if (message.say === "state") {
        if (!this.stands) this.running = message.playing;
        if (performance.now() > this.speedUntil) this.speed = message.speed; // not while somebody moves it
        this.state = message;
      }
      this.tell(message.say, message);
    }
  }

  /* A session is announced. A page that comes back goes on with the one that it has. */
  meet({ session, header, choices, chosen }) {
    const comesBack = this.joins && this.session !== null;
    this.joins = false;
    if (comesBack && session !== this.session) {
      this.differs = true;
      this.socket.close();
      return;
    }
    this.retry = FIRST_RETRY;
    if (comesBack) {
      Object.assign(this.viewer.history.header.names, header.names);
      this.tell("back");
      return;
    }
    Object.assign(this, { session, choices, chosen, begins: header });
  }

  /* A page that plays what this one has, by itself; it holds the script of the viewer alone. */
  async recording() {
    const { history } = this.viewer, page = new DOMParser().parseFromString(PAGE, "text/html");
    const reader = new FileReader(), script = page.querySelector("script:not([type])");
    reader.readAsDataURL(await history.packed());
    await new Promise((done) => reader.addEventListener("load", done));
    for (const part of page.querySelectorAll(".controls, .palette, .notices, meta[http-equiv]")) part.remove();
    page.querySelector("[name=color-scheme]").insertAdjacentHTML("afterend", '<meta http-equiv="Content-Security-Policy"'
      + ` content="default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:">`);
    page.title = history.header.title;
    page.querySelector("#recording").textContent = reader.result.split(",")[1];
    script.textContent = script.textContent.slice(0, script.textContent.indexOf(LIVE_SCRIPT));
    return new Blob([`<!doctype html>\n${page.documentElement.outerHTML}`]).arrayBuffer();
  }

  take(bytes) {
    const { waiting } = this;
    if (this.differs) return;
    this.waiting = null;
    if (waiting?.say === "file") {
      this.tell("file", { ...waiting, bytes });
      return;
    }
    this.arrived++;
    if (waiting && this.begins) this.begin(this.begins, bytes);
    else this.receive(bytes, Boolean(waiting));
  }

  /* A session begins: the viewer starts anew, and looks as it did where it can. */
  begin(header, bytes) {
    const before = this.viewer, source = {
      header, live: true, acts: this.acts, keys: this.keys,
      start: (receive) => {
        this.receive = receive;
        receive(bytes, true);
      },
      player: (history, changed) => new LivePlayer(history, changed, this),
      stand: (viewer) => (this.viewer = viewer),
      seen: () => this.seen(),
    };
    this.begins = null;
    before?.close();
    show(source);
    if (before) this.lookAs(before);
    this.tell("begin", { header });
  }

  /* What was in sight stays there, as where a change is undone, if the world is as large. */
  lookAs({ history, stage, followed, aims, cell, cursor }) {
    const { viewer } = this, { header } = viewer.history;
    if (history.header.ranges.join() !== header.ranges.join()) return;
    if (!stage.fitted) Object.assign(viewer.stage.camera, stage.camera);
    viewer.stage.fitted = stage.fitted;
    if (header.follow === null && viewer.history.place(0, followed) >= 0) {
      viewer.follow(followed);
      viewer.aims = aims;
    }
    if (cell >= 0) viewer.chooseCell(cell, cursor);
    viewer.dirty = true;
  }

  seen() {
    const { history, player } = this.viewer;
    if (player.moment === player.last) this.tell("drawn", history.frames[player.last]);
    if (this.arrived) this.ask("seen", { frames: this.arrived });
    this.arrived = 0;
  }
}

/* Time, which passes on the server. Who looks back still gets what happens meanwhile. */
class LivePlayer extends Player {
  constructor(history, changed, live) {
    super(history, changed);
    this.live = live;
    this.slowest = 1;
    this.fastest = 1000;
    this.speed = live.speed;
    this.still = matchMedia("(prefers-reduced-motion: reduce)");
    this.newest = 0; // the last moment that was there before
    this.back = false; // whether it looks back
    live.news.addEventListener("state", () => this.take());
    this.take();
  }

  take() {
    this.playing = this.live.running && !this.back;
    this.speed = this.live.speed;
    this.changed();
  }
  setSpeed(speed) {
    this.speed = this.live.speed = speed;
    this.live.speedUntil = performance.now() + 500;
    this.live.ask("speed", { value: speed });
  }
  play() {
    if (!this.live.open) return;
    this.back = false;
    this.wish(true);
    this.live.ask("play");
  }
  pause() {
    this.wish(false);
    this.live.ask("pause");
  }
  /* The page shows what is wanted until the server tells how things stand. */
  wish(running) {
    this.live.running = running;
    this.take();
  }
  go(moment) {
    super.go(moment);
    this.back = this.moment < this.last;
    this.take();
  }
  seek(moment) {
    this.go(moment);
  }
  step(n) {
    if (Number.isFinite(n) && n > 0 && !this.back) this.live.ask("step", { ticks: n });
    else this.go(this.moment + n);
  }
  /* Between two ticks ants glide, so the picture is up to a tick behind. */
  pass(seconds) {
    if (this.back) return false;
    const { last, history } = this, moment = this.moment, share = this.share;
    if (last !== this.newest) {
      const glides = last === this.newest + 1 && history.frames[last].passed === 1 && this.playing
        && this.speed <= SMOOTH_BELOW && !this.still.matches;
      this.newest = last;
      this.moment = glides ? last - 1 : last;
      this.share = 0;
    } else if (this.moment < last) {
      this.share += seconds * this.speed;
      if (this.share >= 1 || !this.playing) {
        this.moment = last;
        this.share = 0;
      }
    }
    return this.moment !== moment || this.share !== share;
  }
}
