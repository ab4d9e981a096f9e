/* The panel: facts about the world, the followed ant, the chosen cell, and the legend. */

const HOLDS = { [EMPTY]: "nothing", [OBSTACLE]: "a rock", [FOOD]: "food", [QUEEN]: "the queen" };
const CAME = {
  ENTERED_EMPTY: "It moves", BLOCKED: "It is blocked", PICKED_UP: "It picks up food",
  DELIVERED: "It delivers food to the queen", FAILED: "The action fails", PUSHED: "It is pushed aside",
};
const WHY = {
  best: () => "highest value", tie: ({ ties }) => `one of ${ties} equal values`, explored: () => "at random",
  rule: (_, rule) => `by the rule ${safe(rule)}`, "": () => "",
};
const LETTERS = { E: "empty", O: "obstacle", F: "food", Q: "queen" };
const STRONGER = { // what hides a level in view, by the view of the pheromone
  half: "below half of the strongest in view", strongest: "below the strongest in view",
  strongest_under_carriers: "below the strongest in view, also under ants with food",
};
const HEXAGON = "M1 0 .5 .866-.5 .866-1 0-.5-.866 .5-.866z";
const ICONS = {
  before: '<path d="M12.5 4.5 7 10l5.5 5.5"/>', after: '<path d="M7.5 4.5 13 10l-5.5 5.5"/>',
  close: '<path d="m5 5 10 10M15 5 5 15"/>',
  aim: '<circle cx="10" cy="10" r="5"/><path d="M10 2v4M10 14v4M2 10h4M14 10h4"/>',
};

const byId = (id) => document.getElementById(id);
const safe = (text) => String(text).replace(/[&<>"]/g, (letter) => `&#${letter.charCodeAt(0)};`);
const signed = (number, digits) => (number > 0 ? "+" : "") + plain(number, digits);
const plain = (number, digits = 2) => (Number(number.toFixed(digits)) + 0).toFixed(digits).replace("-", "−");
const grouped = (text) => String(text).replace(/\d{5,}/, (digits) => digits.replace(/\B(?=(\d{3})+$)/g, "\u202f"));
const nameOf = (pheromone) => (pheromone === "trail" ? "trail" : `field ${safe(pheromone)}`);
const icon = (name) => `<svg viewBox="0 0 20 20" aria-hidden="true">${ICONS[name]}</svg>`;
const button = (id, label, name, more = "") =>
  `<button type="button" class="icon" id="${id}" aria-label="${label}" title="${label}" ${more}>${icon(name)}</button>`;

/* Show small changes of a number with more digits. */
function digitsFor(a, b) {
  const gap = Math.abs(a - b);
  return gap === 0 || gap >= 0.01 ? 2 : Math.min(6, 1 - Math.floor(Math.log10(gap)));
}

class Panel {
  constructor(history, stage, choose, signal) {
    this.history = history;
    this.stage = stage;
    this.choose = choose; // {follow(number), unfollow(), cell(cell), other(step), aim(), pheromone(number)}
    byId("about").innerHTML = history.header.about
      .map(([name, value]) => `<dt>${safe(name)}</dt><dd>${safe(value)}</dd>`).join("");
    document.querySelector(".panel").addEventListener("click", (event) => {
      const link = event.target.closest("[data-follow]");
      if (link) choose.follow(Number(link.dataset.follow));
      const pressed = event.target.closest("button")?.id;
      if (pressed === "ant-before") choose.other(-1);
      if (pressed === "ant-after") choose.other(1);
      if (pressed === "ant-aim") choose.aim();
      if (pressed === "ant-close") choose.unfollow();
      if (pressed === "cell-close") choose.cell(-1);
    }, { signal });
    byId("legend").addEventListener("change", ({ target }) => choose.pheromone(target.selectedIndex), { signal });
  }

  show(moment, followed, cell, aims) {
    // Restore the focus.
    const focused = document.activeElement?.closest?.(".panel") ? document.activeElement.id : "";
    this.showWorld(moment);
    this.showAnt(moment, followed, aims);
    this.showCell(moment, cell);
    byId("hint").hidden = followed >= 0 || cell >= 0;
    if (focused && document.activeElement?.id !== focused) byId(focused)?.focus();
  }

  showWorld(moment) {
    const frame = this.history.frames[moment];
    let loaded = 0;
    for (const pose of frame.poses) loaded += (pose >> 3) & 1;
    const { length, frames, live } = this.history;
    const episodes = frames[length - 1].episode > (live ? 0 : frames[0].episode);
    const ofOne = this.history.several ? " this episode" : "";
    const facts = [
      ...(episodes ? [["episode", frame.episode]] : []),
      ["tick", frame.tick], ...(episodes && frame.ants === 1 ? [] : [["ants", frame.ants]]), ["with food", loaded],
      [`delivered${ofOne}`, frame.deliveries], [`return${ofOne}`, plain(frame.returns, 0)],
      ...(this.history.header.values ? [["epsilon", plain(frame.epsilon, frame.epsilon < 0.01 && frame.epsilon ? 4 : 2)]] : []),
    ];
    byId("now").innerHTML = facts.map(([name, value]) => `<div><dt>${name}</dt><dd>${grouped(value)}</dd></div>`).join("");
  }

  showAnt(moment, followed, aims) {
    const card = byId("ant");
    card.hidden = followed < 0;
    if (followed < 0) return;
    const ant = this.history.ant(moment, followed);
    const buttons = button("ant-before", "Previous ant (P)", "before") + button("ant-after", "Next ant (N)", "after")
      + button("ant-aim", "Keep this ant centred (F)", "aim", `aria-pressed="${aims}"`)
      + button("ant-close", "Stop following (Esc)", "close");
    const badge = ant ? ` <span class="badge ${ant.loaded ? "loaded" : ""}">${ant.loaded ? `with ${this.foodOf(ant.kind)}` : "no food"}</span>` : "";
    const head = `<div class="head"><h2>Ant ${followed}${badge}</h2>${buttons}</div>${ant ? this.groupsOf(ant) : ""}`;
    if (ant) ant.tick = this.history.frames[moment].tick;
    if (ant && !ant.act && this.history.live) ant.past = this.lastAct(moment, followed);
    card.innerHTML = head + (ant ? this.viewOf(ant) + this.barsOf(ant) + this.storyOf(ant) : "<p>This ant is not alive at this tick.</p>");
  }

  /* The name of a kind of food. */
  foodOf(kind) {
    return safe(this.history.header.foods[kind] ?? "food");
  }

  /* The nest and the caste of an ant where these differ between ants, and its marks. */
  groupsOf({ nest, caste, marks }) {
    const { castes, nests } = this.history.header;
    const shown = this.history.header.marks.map(({ words, most }, k) =>
      most === null ? (marks[k] > 127 ? words : "") : `${words} ${Math.round(most * (1 - marks[k] / 255))}`);
    const words = [...(nests > 1 ? [`nest ${nest}`] : []), ...(castes.length ? [castes[caste]] : []), ...shown.filter(Boolean)];
    return words.length ? `<span class="label groups">${safe(words.join(" · "))}</span>` : "";
  }

  /* The ant at its last known action, at most a few moments ago. */
  lastAct(moment, number) {
    for (let then = moment - 1; then >= Math.max(moment - 5, this.history.first); then--) {
      const ant = this.history.ant(then, number);
      if (ant?.act) return ant;
    }
    return null;
  }

  viewOf(ant) {
    const { header, world } = this.history;
    const { task, rest, letters } = this.history.stateName(ant.state);
    const { name: pheromone, seen_by: seenBy } = this.history.pheromone, cue = this.cueOf(ant), own = cue === pheromone;
    let hides = false; // whether the ant does not see a trail that exists
    const shapes = header.view.map((turn, i) => {
      const angle = (turn * Math.PI) / 3, x = 1.732 * Math.sin(angle), y = -1.732 * Math.cos(angle);
      const cell = ant.cell + this.history.grid.offsets[(ant.heading + turn + 6) % 6], letter = letters[i] ?? "";
      const hidden = seenBy && letter && (own ? letter === "E" : letter !== "O");
      hides ||= hidden && world.trail[cell] >= 1;
      return `<g transform="translate(${x} ${y})">
        <path d="${HEXAGON}" transform="scale(.93)" fill="${letter === "O" ? "var(--rock)" : this.fillOf(cell, world, hidden)}"/>
        <text font-size=".95" stroke="var(--halo)" stroke-width=".2" paint-order="stroke">${safe(letter)}</text></g>`;
    });
    const name = nameOf(pheromone), blind = !hides ? "" : own ? `where the ${name} is ${STRONGER[seenBy]}, the ant sees E`
      : `ants ${ant.loaded ? "with" : "without"} food do not see the ${name}`;
    const means = { ...LETTERS, T: nameOf(cue), S: header.senses[cue] ?? nameOf(cue) };
    const kinds = [...new Set(letters.map((letter) => letter[0]))], known = kinds.filter((kind) => means[kind]);
    const meanings = known.map((kind) => `${kind} ${means[kind]}`);
    const more = known.length < kinds.length || !kinds.length ? header.letters : "";
    const meaning = [meanings.join(", "), more, blind].filter(Boolean).join("; ");
    const around = header.view.some((turn) => Math.abs(turn) > 1);
    const box = around ? "-2.9 -2.9 5.8 5.8" : "-2.6 -2.65 5.2 3.65";
    return `<div class="sees"><svg viewBox="${box}" role="img" aria-label="It sees, from left to right: ${safe(rest)}">`
      + `${shapes.join("")}<path d="${HEXAGON}" transform="scale(.93)" fill="none" stroke="var(--rule)" stroke-width=".07"/>`
      + `${antShape(ant.loaded, "var(--ant)", this.stage.colours[ofKind(ant.kind)])}</svg><div><span class="label">state ${ant.state}</span><b>${safe(task)} ${safe(rest)}</b>`
      + `<small>${safe(meaning)}</small></div></div>`;
  }

  /* The name of what an ant follows. */
  cueOf({ loaded, caste }) {
    return this.history.header.groups[caste].cues[Number(loaded)];
  }

  /* The colour of a cell, without a trail that the ant does not see. */
  fillOf(cell, world, hidden) {
    const held = world.ground[cell];
    if (held === FOOD) return "var(--food-floor)";
    if (held === QUEEN) return "var(--queen-floor)";
    if (held === OBSTACLE || !this.history.grid.exists(cell)) return "var(--rock)";
    if (hidden || world.trail[cell] < 1) return "var(--empty)";
    return `rgb(${this.stage.ramp[this.stage.trailColour(world.trail[cell])].join(" ")})`;
  }

  barsOf(ant) {
    if (!this.history.header.values) return "";
    const values = ant.act?.values ?? ant.values;
    const low = Math.min(0, ...values), high = Math.max(0, ...values), span = high - low || 1;
    const share = (value) => (100 * (value - low)) / span;
    const rows = this.history.header.actions.map((name, action) => {
      const chosen = ant.act?.action === action ? "is-chosen" : "", value = values[action];
      const [from, to] = [Math.min(0, value), Math.max(0, value)].map(share);
      return `<span class="name ${chosen}">${chosen ? "▸ " : ""}${name}</span>
        <svg class="bar-of" aria-hidden="true"><rect class="fill ${chosen}" x="${from}%" width="${Math.max(to - from, 0)}%" height="100%" rx="3"/>
          <line class="zero" x1="${share(0)}%" x2="${share(0)}%" y1="-3" y2="14"/></svg>
        <span class="value ${chosen}">${plain(value)}</span>`;
    });
    const when = ant.act?.ahead ? "action values at its last choice" : "action values";
    return `<span class="label">${when}</span><div class="bars">${rows.join("")}</div>`;
  }

  storyOf(ant, before = "") {
    const { header, live } = this.history, act = ant.act;
    if (ant.rests) return '<div class="story"><span class="label">It rests, so it does not act.</span></div>';
    if (ant.past) return this.storyOf(ant.past, '<span class="label">In the last tick:</span>');
    if (!act) {
      const late = this.history.length === 1 ? "This page opened after the last tick. Actions appear from the next tick."
        : "At this speed, actions are not shown. Reduce the speed, or pause and advance by one tick.";
      const early = ant.tick === 0 ? "It has not acted yet." : late;
      const words = live ? early : "The recording ends here.";
      return `<div class="story"><span class="label">${words}</span></div>`;
    }
    const cue = this.cueOf(ant), sense = header.senses[cue], better = sense ? `It moves to a cell ${sense}` : `It steps onto the ${nameOf(cue)}`;
    const came = CAME[act.event] || better;
    const action = header.actions[act.action], worth = { 1: "up", "-1": "down" }[Math.sign(act.reward)] ?? "";
    const lines = [
      `Chooses <b>${action}</b> <span class="why ${act.why}">${WHY[act.why](act, header.rule)}</span>`,
      ...(act.executed === act.action ? [] : [`It slips: the action becomes <b>${header.actions[act.executed]}</b>`]),
      `${came}, reward <span class="reward ${worth}">${signed(act.reward, 0)}</span>`,
    ];
    if (header.groups[ant.caste].learns) {
      const digits = digitsFor(act.before, act.after), { task, rest } = this.history.stateName(ant.state);
      if (!Number.isNaN(act.tdError)) {
        const mean = act.sharers > 1 ? `, the mean of ${act.sharers} ants` : "";
        lines.push(`TD error <code>${signed(act.tdError)}</code>${mean}`);
      }
      const [before, after] = [act.before, act.after].map((value) => plain(value, digits));
      lines.push(`Q(${safe(`${task} ${rest}`.trim())}, ${action}) <code>${before} → ${after}</code>`);
    }
    return `<div class="story">${before}${lines.map((line) => `<span>${line}</span>`).join("")}</div>`;
  }

  showCell(moment, cell) {
    const card = byId("cell"), { history } = this;
    card.hidden = cell < 0;
    if (cell < 0) return;
    const { ground, kinds, trail } = history.worldAt(moment), ants = history.antsOn(moment, cell);
    const holds = ground[cell] === FOOD ? this.foodOf(kinds[cell]) : HOLDS[ground[cell]] ?? "?";
    const level = trail[cell];
    const link = (number) => `<button type="button" class="link" data-follow="${number}">ant ${number}</button>`;
    const wanting = history.wanting(moment, cell).map(({ number, action, event, several }) =>
      `${link(number)} (${history.header.actions[action]}${several ? ", here or next to it" : ""}${["BLOCKED", "FAILED"].includes(event) ? ", failed" : ""})`);
    const lines = [
      ["contains", ants.length ? ants.map(link).join(", ") : holds],
      [safe(history.pheromone.name), `${plain(level, Number.isInteger(level) ? 0 : 2)} (darkest from ${history.pheromone.strongest})`],
      ["next actions", wanting.join(", ") || "none"],
    ];
    card.innerHTML = `<div class="head"><h2>Cell (${history.grid.cube(cell).join(", ")})</h2>`
      + `${button("cell-close", "Close", "close")}</div><dl class="list">`
      + lines.map(([name, value]) => `<dt>${name}</dt><dd>${value}</dd>`).join("") + "</dl>";
  }

  /* A summary for screen readers. */
  sentence(moment, followed) {
    const frame = this.history.frames[moment];
    let said = `Tick ${frame.tick}, ${frame.deliveries} delivered${this.history.several ? " this episode" : ""}.`;
    const ant = followed >= 0 ? this.history.ant(moment, followed) : null;
    if (!ant) return said;
    const { task, rest } = this.history.stateName(ant.state);
    said += ` Ant ${followed}: ${task} ${rest}.`;
    if (ant.act) said += ` Chooses ${[this.history.header.actions[ant.act.action], WHY[ant.act.why](ant.act, this.history.header.rule)].filter(Boolean).join(", ")}, reward ${ant.act.reward}.`;
    return said;
  }

  /* Show the legend of colours. */
  showLegend() {
    const cell = (fill, more = "") =>
      `<svg viewBox="-1.1 -1 2.2 2" aria-hidden="true"><path d="${HEXAGON}" fill="${fill}"/>${more}</svg>`;
    const drawing = (colour, outline) => `<path transform="scale(.72)" fill="${colour}" d="${outline}"/>`;
    const samples = [0, 64, 128, 192, 255].map((i) => `rgb(${this.stage.ramp[i].join(" ")})`);
    const bodies = [false, true].map((loaded) => `<svg viewBox="-1 -1 2 2" aria-hidden="true">${antShape(loaded)}</svg>`);
    const nests = Array.from({ length: this.history.header.nests > 1 ? this.history.header.nests : 0 }, (_, n) => {
      const [queen, ant] = ["queen", "ant"].map((name) => this.stage.colours[ofNest(name, n)]);
      return `${cell("var(--queen-floor)", drawing(queen, CROWN))}<svg viewBox="-1 -1 2 2" aria-hidden="true">${antShape(false, ant)}</svg>nest ${n}`;
    });
    const { foods } = this.history.header;
    const kinds = (foods.length ? foods : ["food"]).map((name, kind) =>
      `${cell("var(--food-floor)", drawing(this.stage.colours[ofKind(kind)], CRUMBS))}${safe(name)}`);
    const faded = this.history.header.marks.map(({ words, most }) =>
      `${bodies[0].replace("<svg", '<svg opacity=".4"')}${safe(most === null ? `${words} ant` : `ant with little ${words}`)}`);
    const { pheromones } = this.history.header, { pheromone } = this.history;
    const several = pheromones.length < 2 ? safe(pheromone.name) : `<select id="shown" aria-label="Pheromone that the page shows">${pheromones.map((one) =>
      `<option${one === pheromone ? " selected" : ""}>${safe(one.name)}</option>`).join("")}</select>`;
    byId("legend").innerHTML = [
      `${bodies[0]}ant`, `${bodies[1]}ant with food`, ...faded, ...kinds,
      `${cell("var(--queen-floor)", drawing("var(--queen)", CROWN))}queen`, `${cell("var(--rock)")}rock`,
      `<span class="ramp"></span>${several}`, ...nests,
    ].map((item) => `<li>${item}</li>`).join("");
    document.querySelector(".ramp").style.background = `linear-gradient(to right,${samples.join()})`;
  }
}

/* An ant with heading up, as part of an SVG. */
function antShape(loaded, colour = "var(--ant)", food = "var(--food)") {
  const half = `<path d="${LIMBS}" fill="none" stroke="${colour}" stroke-width=".07" stroke-linecap="round"/>`;
  const crumb = loaded ? `<circle cy="-.7" r=".25" fill="${food}"/>` : "";
  return `${half}<g transform="scale(-1 1)">${half}</g><path d="${BODY}" fill="${colour}"/>${crumb}`;
}
