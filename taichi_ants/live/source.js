/* The live simulation as a source of the viewer, over one transport: a socket to live/server.py, or a
   worker that answers as it does.

   The page acknowledges frames after drawing them. The server sends fewer frames to a slow or hidden
   page, and later a complete one.

   If the connection is lost, the page keeps its history and reconnects. It resumes the same session
   automatically, but asks before it replaces its history with another session. */

const PAGE = document.documentElement.outerHTML; // before scripts change it
const LIVE_SCRIPT = "/* The transport"; // start of the live page's scripts
const FIRST_RETRY = 500, LAST_RETRY = 15_000; // milliseconds
const CUT_OFF = 1008; // the server has closed the socket because of an invalid request

class Live {
  constructor() {
    this.news = new EventTarget(); // "state", "error", "drawn", "file", "cancelled", "lost", "back"
    this.waiting = null; // message about the next bytes, if these are not a frame of changes
    this.arrived = 0; // frames that are not acknowledged yet
    this.running = false;
    this.stands = false;
    this.speed = 12;
    this.speedUntil = 0;
    this.strokes = 0;
    this.viewer = null;
    this.session = null; // the session that the page shows
    this.retry = FIRST_RETRY;
    this.connect();
  }

  get open() {
    return this.transport.readyState === WebSocket.OPEN;
  }

  connect() {
    clearTimeout(this.timer);
    const transport = openTransport(), mine = (act) => (event) => this.transport === transport && act(event);
    this.transport?.close();
    this.transport = transport;
    this.joins = true; // until the server sends the session
    this.ended = false;
    transport.onmessage = mine(({ data }) => (typeof data === "string" ? this.hear(JSON.parse(data)) : this.take(data)));
    transport.onclose = mine((event) => this.lose(event));
  }

  /* Find out why there is no connection: "lost" or "ended", which are retried; "no token", "cut off", or "another" session. */
  lose({ code, reason }) {
    const why = !this.transport.permit ? "no token" : code === CUT_OFF ? "cut off" : this.differs ? "another" : this.ended ? "ended" : "lost";
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

  /* Reconnect at once; `any` accepts another session. */
  reconnect(any) {
    if (any) this.session = null;
    this.differs = false;
    this.retry = FIRST_RETRY;
    this.connect();
  }

  ask(what, more = {}) {
    if (this.open) this.transport.send(JSON.stringify({ do: what, ...more }));
  }

  /* Edits of one stroke are undone together. */
  edit(edit, stroke) {
    this.ask("edit", { edit, stroke });
  }
  nextStroke() {
    return ++this.strokes;
  }

  /* Pause until another session begins; playing before that refers to the new session. */
  stand() {
    this.stands = true; // until the session begins or fails
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
    else if (message.say === "snapshot" || message.say === "file") this.waiting = message;
    else {
      if (message.say === "state") {
        if (!this.stands) this.running = message.playing;
        if (performance.now() > this.speedUntil) this.speed = message.speed; // not while the user moves the slider
        this.state = message;
      }
      this.tell(message.say, message);
    }
  }

  /* Handle the start of a session; a page that reconnects resumes its own session. */
  meet({ session, header, choices, chosen }) {
    const comesBack = this.joins && this.session !== null;
    this.joins = false;
    if (comesBack && session !== this.session) {
      this.differs = true;
      this.transport.close();
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

  /* The HTML of a page that plays the history, with only the viewer's scripts. Its policy allows
     this script by its hash, like the policies of other pages, see viewer/page.py. */
  async recording() {
    const { history } = this.viewer, page = new DOMParser().parseFromString(PAGE, "text/html");
    const reader = new FileReader(), script = page.querySelector("script:not([type])");
    reader.readAsDataURL(await history.packed());
    await new Promise((done) => reader.addEventListener("load", done));
    for (const part of page.querySelectorAll(".controls, .palette, .notices")) part.remove();
    page.title = history.header.title;
    page.querySelector("#recording").textContent = reader.result.split(",")[1];
    script.textContent = script.textContent.slice(0, script.textContent.indexOf(LIVE_SCRIPT));
    const policy = page.querySelector("meta[http-equiv]"), text = new TextEncoder().encode(script.textContent);
    const digest = btoa(String.fromCharCode(...new Uint8Array(await crypto.subtle.digest("SHA-256", text))));
    policy.content = policy.content.replace(/script-src [^;]+/, `script-src 'sha256-${digest}'`).replace(/; connect-src.*/, "");
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

  /* Begin a session with a new viewer, which keeps the view if possible. */
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

  /* Keep the view if the world has the same size, for example after an undo. */
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

/* The player of a live session, which runs on the server, also while the user looks back. */
class LivePlayer extends Player {
  constructor(history, changed, live) {
    super(history, changed);
    this.live = live;
    this.slowest = 1;
    this.fastest = 1000;
    this.speed = live.speed;
    this.still = matchMedia("(prefers-reduced-motion: reduce)");
    this.newest = 0; // the last moment at the previous call
    this.back = false; // whether the user looks back
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
  /* Show the requested state until the server sends the actual one. */
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
  /* Ants glide between two ticks, so the picture is up to one tick behind. */
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
