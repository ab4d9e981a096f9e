/* The report: light and dark mode, tables that sort and filter, and small players. */

const dark = matchMedia("(prefers-color-scheme: dark)");
const still = matchMedia("(prefers-reduced-motion: reduce)");
const players = [];
let chosenTheme = "", closed = []; // details that are open only in print

function showTheme(wanted = chosenTheme || (dark.matches ? "dark" : "light")) {
  document.documentElement.dataset.theme = wanted;
  for (const player of players) player.readColours();
}

/* Print in light mode, with all details open: before the browser divides the text into pages. */
function print(begins) {
  if (begins) closed = [...document.querySelectorAll("details:not([open])")];
  for (const one of closed) one.open = begins;
  showTheme(begins ? "light" : undefined);
}

class SmallPlayer {
  constructor(figure, source) {
    this.figure = figure;
    this.history = new History(source.header);
    source.start((bytes) => this.history.add(bytes));
    const canvas = figure.querySelector("canvas");
    [this.slider, this.place, this.button] = ["input", "output", "button"].map((name) => figure.querySelector(name));
    this.stage = new Stage(canvas, this.history);
    this.player = new Player(this.history, () => this.draw());
    this.player.speed = Number(figure.dataset.speed);
    this.player.moment = Math.round(this.player.last / 2); // shows the ants at work
    this.fresh = true;
    this.slider.max = this.player.last;
    this.button.addEventListener("click", () => this.press());
    this.slider.addEventListener("input", () => {
      const moment = Number(this.slider.value); // drawing moves the slider
      this.fresh = false;
      this.player.pause();
      this.player.go(moment);
    });
    new ResizeObserver(() => this.stage.resize() && this.draw()).observe(canvas);
    this.stage.resize();
    this.draw();
  }

  press() {
    const { player } = this;
    if (player.playing) return player.pause();
    for (const other of players) if (other !== this) other.player.pause();
    if (this.fresh) player.go(0);
    this.fresh = false;
    player.play();
    this.before = null;
    if (!this.runs) this.run();
  }

  run() {
    this.runs = true;
    requestAnimationFrame((now) => {
      const moved = this.player.pass((now - (this.before ?? now)) / 1000);
      this.before = now;
      if (moved) this.draw();
      this.runs = this.player.playing;
      if (this.runs) this.run();
    });
  }

  readColours() {
    this.stage.readColours();
    this.draw();
  }

  draw() {
    const { player, history, figure } = this, { moment } = player;
    const share = player.playing && !still.matches ? player.share : 0, followed = history.header.follow;
    const ant = followed === null ? null : history.ant(moment, followed);
    const next = ant && moment < player.last ? history.ant(moment + 1, followed) : null;
    this.stage.draw(moment, share, { ant, next, letters: [], cell: -1, path: ant ? history.path(moment, followed) : [] });
    this.slider.value = moment;
    this.place.textContent = `${moment} / ${player.last}`;
    this.slider.setAttribute("aria-valuetext", `tick ${moment} of ${player.last}`);
    figure.classList.toggle("playing", player.playing);
    this.button.setAttribute("aria-label", `${player.playing ? "Pause" : "Play"}: ${figure.dataset.title}`);
  }
}

/* A table that sorts by text, place or verdict, and hides rows that do not match the filters. */
class Statements {
  constructor(part) {
    this.part = part;
    this.body = part.querySelector("tbody");
    this.lines = [...this.body.rows];
    this.words = part.querySelector("input");
    this.verdict = part.querySelector("[name=verdict]");
    this.order = part.querySelector("[name=order]"); // for screens too narrow for headers
    this.found = part.querySelector("output");
    this.words.addEventListener("input", () => this.filter());
    this.verdict.addEventListener("change", () => this.filter());
    this.heads = [...part.querySelectorAll("th")];
    this.heads.forEach((head, column) => {
      head.querySelector("button").addEventListener("click", () => this.turn(column, head.getAttribute("aria-sort")));
    });
    this.order.addEventListener("change", () => this.sort(this.order.value));
    this.details = [...this.body.querySelectorAll("details")];
    this.opener = part.querySelector("[name=details]");
    this.opener.addEventListener("click", () => this.openAll(this.details.some((one) => !one.open)));
    for (const one of this.details) one.addEventListener("toggle", () => this.nameOpener());
    this.filter();
  }

  filter() {
    const words = this.words.value.toLowerCase().split(/\s+/).filter(Boolean), wanted = this.verdict.value;
    let shown = 0;
    for (const line of this.lines) {
      const text = line.textContent.toLowerCase();
      const verdicts = [...line.querySelectorAll("td.verdict")].map((one) => one.textContent.trim());
      line.hidden = !(words.every((word) => text.includes(word)) && (!wanted || verdicts.includes(wanted)));
      if (!line.hidden) shown++;
    }
    this.found.textContent = `${shown} of ${this.lines.length} ${this.part.dataset.noun}`;
  }

  openAll(opens) {
    for (const one of this.details) one.open = opens;
  }
  nameOpener() {
    this.opener.textContent = this.details.every((one) => one.open) ? "Close all details" : "Open all details";
  }

  /* Ascending, descending, then the order of the page. */
  turn(column, order) {
    const next = { none: "ascending", ascending: "descending", descending: "" }[order];
    this.sort(next && `${column} ${next}`);
  }

  /* Sort by the selected order; "" is the order of the page. */
  sort(chosen) {
    const [column, order] = chosen.split(" ");
    this.order.value = chosen;
    this.heads.forEach((head, place) => head.setAttribute("aria-sort", column === String(place) ? order : "none"));
    const key = (line) => line.cells[column].dataset.key, sign = order === "descending" ? -1 : 1;
    const compare = (one, other) => sign * key(one).localeCompare(key(other), "en", { numeric: true });
    this.body.append(...(chosen ? [...this.lines].sort(compare) : this.lines));
  }
}

/* Parts that can be scrolled sideways fade at that side. */
function fade(part) {
  const show = () => {
    const rest = part.scrollWidth - part.clientWidth - part.scrollLeft;
    part.classList.toggle("more-right", rest > 1);
    part.classList.toggle("more-left", part.scrollLeft > 1);
  };
  part.addEventListener("scroll", show, { passive: true });
  new ResizeObserver(show).observe(part); // also when a folded part is opened
}

async function open() {
  document.querySelectorAll(".scroll, .plot > div, .sheet").forEach(fade);
  document.querySelectorAll(".statements").forEach((part) => new Statements(part));
  const theme = document.getElementById("theme");
  theme.addEventListener("click", () => {
    chosenTheme = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
    showTheme();
  });
  dark.addEventListener("change", () => showTheme());
  for (const kind of ["beforeprint", "afterprint"]) addEventListener(kind, () => print(kind === "beforeprint"));
  showTheme();
  for (const figure of document.querySelectorAll(".player")) {
    players.push(new SmallPlayer(figure, await recordingIn(figure.querySelector("script").textContent)));
  }
  window.report = { players }; // for tests and for debugging
}

open();
