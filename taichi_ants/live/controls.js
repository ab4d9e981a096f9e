/* The controls of the live page: new session, sliders, files. */

const SLIDERS = {
  ants: "Ants", evaporation: "Trails evaporate", half_life: "Half-life of trails", diffusion: "Diffusion",
  deposit: "Deposit", cap: "Largest trail level", slope: "Slope of trails", epsilon: "Exploration rate (epsilon)", learning_rate: "Learning rate",
};
// The settings that explain sliders whose edits have other names.
const EXPLAINS = { epsilon: "training.epsilon", learning_rate: "training.learning_rate", evaporation: "task.pheromone.evaporation" };
const PARTS = ".controls, .palette, .intro"; // what needs a connection
const FILE_TYPES = { html: "text/html", gif: "image/gif" };
const WORKS = { page: "page", gif: "GIF" };
// The state of a lost connection: its message, and the label of the second button.
const LOST = {
  "no token": ["This page has no token, so the server refuses it. Open the address that the server prints.", "Try again"],
  lost: ["The connection is lost. This page keeps everything it has shown, and reconnects when the server is back. "
    + "A restarted server has a new address; open that one.", "Try now"],
  ended: ["The server has stopped. This page keeps everything it has shown.", "Try to connect"],
  "cut off": ["The server has disconnected this page", "Connect again"],
  another: ["The server is back with another session. This page still shows the previous one; you can replace it.", "Show the new session"],
};
const MOST_UPLOAD = 2 ** 22;
const MAP = `; lines shift by two columns
          .
        .   F
      .   .   .
    .   .   #   .
      .   #   .
    .   .   .   .
      .   .   .
    0   .   .   .
      Q   .   .
        .   .
          .
`;

/* A button that shows the help of a setting below it. */
const helpOf = (words, help) => `<button type="button" class="help" aria-expanded="false" aria-label="Help: ${words}">?</button><small hidden>${safe(help)}</small>`;

/* Whether a value is either 0 or 1. */
const isSwitch = ({ least, most, step }) => least === 0 && most === 1 && step === 1;

class Controls {
  constructor(live) {
    this.live = live;
    this.held = new Map(); // sliders that the user moves -> end of the hold
    this.filled = "";
    this.works = new Map(); // kind of work in progress -> its element
    this.roomy = matchMedia("(min-height: 1150px) and (min-width: 841px)"); // all cards fit
    byId("new").open = this.roomy.matches;
    document.querySelector(".stage").append(byId("notices"));
    byId("hint").before(byId("intro"));
    for (const label of document.querySelectorAll("[data-help]")) {
      label.outerHTML = `<div class="field">${label.outerHTML}${helpOf(label.firstChild.data.trim(), label.dataset.help)}</div>`;
    }
    byId("controls").addEventListener("click", ({ target: { classList, ariaExpanded, nextSibling }, target }) => {
      if (classList.contains("help")) [target.ariaExpanded, nextSibling.hidden] = [ariaExpanded === "false", ariaExpanded === "true"];
    });
    byId("theme").insertAdjacentHTML("beforebegin", '<span class="watchers" id="watchers"></span>');
    const on = (id, kind, act) => byId(id).addEventListener(kind, act);
    on("chosen", "submit", (event) => {
      event.preventDefault();
      this.busy("Starting the session …");
      this.begins = true;
      live.stand();
      live.ask("begin", { chosen: this.chosen() });
    });
    on("chosen", "input", () => (this.touched = true));
    on("world-name", "change", () => this.showWorld());
    on("task", "change", () => this.showTask());
    on("settings", "change", () => this.nameTask());
    on("policy", "change", () => this.showPolicy());
    on("chosen", "change", () => this.explain());
    on("map", "beforeinput", (event) => this.paste(event));
    for (const [id, what] of [["restart", "restart"], ["undo", "undo"], ["go-back", "back"]]) on(id, "click", () => this.anew(what));
    document.addEventListener("keydown", (event) => {
      const fields = "textarea, input:not([type=range], [type=checkbox])"; // these undo typed text
      if (event.key.toLowerCase() !== "z" || event.shiftKey || !(event.ctrlKey || event.metaKey) || event.target.closest(fields)) return;
      event.preventDefault();
      if (!this.holds && live.open) this.anew("undo"); // the server refuses if there is nothing to undo
    });
    on("next-episode", "click", () => live.edit({ episode: {} }, live.nextStroke()));
    on("files", "click", (event) => {
      const kind = event.target.dataset.export;
      if (kind && !live.choices) this.keep();
      if (!kind || !live.choices) return;
      this.busy("Making the file …");
      live.ask("export", { kind });
    });
    on("load", "click", () => byId("upload").click());
    on("upload", "change", () => this.upload());
    on("quit", "click", () => this.quit());
    on("intro", "click", (event) => this.suggest(event.target.closest("button")?.dataset.try));
    on("sliders", "input", (event) => this.slide(event.target));
    live.news.addEventListener("begin", () => this.fill());
    live.news.addEventListener("state", ({ detail }) => this.show(detail));
    live.news.addEventListener("error", ({ detail }) => this.refuse(detail.words));
    live.news.addEventListener("drawn", ({ detail }) => this.showRates(detail));
    live.news.addEventListener("file", ({ detail }) => this.download(detail));
    live.news.addEventListener("cancelled", () => this.say("Cancelled."));
    live.news.addEventListener("lost", ({ detail }) => this.lose(detail));
    live.news.addEventListener("back", () => this.connected(true));
    on("keep", "click", () => this.keep());
    on("again", "click", () => live.reconnect(this.lost === "another"));
    addEventListener("beforeunload", (event) => this.lost && live.viewer && !this.kept && event.preventDefault());
    this.busy("Waiting for the simulation …");
    this.hold(true);
  }

  /* Fill the form with the choices, and select those of the session. */
  fill() {
    const { choices, chosen } = this.live, options = (pairs) =>
      pairs.map(([value, words]) => `<option value="${safe(value)}">${safe(words)}</option>`).join("");
    document.body.classList.toggle("alone", !choices); // without a server that could do the rest
    if (choices && !this.filled) {
      this.filled = "yes";
      byId("world-name").innerHTML = options(Object.entries(choices.worlds));
      byId("task").innerHTML = options([...Object.entries(choices.tasks).map(([name, { words }]) => [name, words]), ["", "other settings"]]);
      byId("settings").innerHTML = this.fields();
      byId("policy").innerHTML = `<optgroup label="Learn">${options(Object.entries(choices.learners).map(([name, { words }]) => [`learn ${name}`, words]))}</optgroup>
        <optgroup label="Follow a fixed policy">${options([["by hand", "trail following"], ...Object.keys(choices.policies).map((name) => [`file ${name}`, name.replaceAll("_", " ")])])}</optgroup>`;
      byId("ants").max = choices.most.ants;
      [byId("size").min, byId("size").max] = choices.sizes;
      byId("map").value = MAP;
      byId("map").maxLength = choices.most.text;
    }
    if (choices) this.refill(chosen);
    this.connected(true);
    this.held.clear(); // all sliders show the values of this session
    this.hold(false);
    this.hush();
  }

  /* Select the choices of the session, but keep the input if another page begins one. */
  refill(chosen) {
    const fields = [...byId("chosen").elements], typed = fields.map(({ value, checked }) => ({ value, checked }));
    this.choose(chosen);
    if (this.touched && !this.begins) {
      fields.forEach((field, place) => (field.type === "checkbox" ? (field.checked = typed[place].checked) : (field.value = typed[place].value)));
      this.showWorld();
      this.explain();
    } else this.touched = false;
    if (this.begins && !this.roomy.matches) byId("new").open = false;
    this.begins = false;
  }

  choose(chosen) {
    byId("world-name").value = chosen.world;
    if (chosen.map) byId("map").value = chosen.map;
    byId("world-seed").value = chosen.world_seed;
    byId("size").value = chosen.size;
    byId("policy").value = chosen.policy;
    byId("ants").value = chosen.ants;
    byId("episode").value = chosen.ticks;
    byId("seed").value = chosen.seed;
    this.set(chosen.settings);
    this.showWorld();
    this.nameTask();
    this.explain();
    const words = (id) => byId(id).selectedOptions[0]?.text ?? "";
    byId("now-chosen").textContent = [words("world-name"), words("task"), words("policy")].join(" · ");
  }

  /* Explain the chosen names. A policy from a file determines the observation, so that field is
     disabled. */
  explain() {
    const { choices } = this.live, policy = byId("policy").value, name = policy.replace(/^(learn|file) /, "");
    for (const [place, one] of choices.settings.entries()) {
      const field = byId(`setting-${place}`), box = field.closest(".setting"), { world = byId("world-name").value, learner } = one;
      const learns = learner === undefined || policy === `learn ${learner}` || (learner === "" && policy.startsWith("learn "));
      const [other, ...values] = one.only ?? [], counts = !other || values.includes(this.settings()[other]);
      box.hidden = field.disabled = !(learns && counts && world === byId("world-name").value);
      if (one.path === "task.observation") {
        field.disabled = policy.startsWith("file ");
        box.querySelector("small").textContent = `${one.help}: ${choices.sees[field.value] ?? ""}`;
      }
    }
    for (const group of document.querySelectorAll("#settings fieldset")) group.hidden = !group.querySelector(".setting:not([hidden])");
    const follows = policy === "by hand" ? "The ants follow trails by a fixed rule, and do not learn." : `The ants follow ${name}, and do not learn.`;
    byId("policy-help").textContent = this.settings()["task.choice.rule"] === "deneubourg" ? "The ants choose by the rule deneubourg, without a policy, and do not learn."
      : policy.startsWith("learn ") ? `The ants learn: ${choices.learners[name]?.summary ?? ""}.` : follows;
  }

  /* Insert long text into the map at once, because browsers need quadratic time in its lines. */
  paste(event) {
    const { target: map, data } = event;
    if ((data?.length ?? 0) < 1000) return;
    event.preventDefault();
    const { selectionStart: from, selectionEnd: to } = map, room = map.maxLength - map.textLength + to - from;
    map.setRangeText(data.slice(0, room), from, to, "end");
    if (room < data.length) this.say(`The map is longer than ${map.maxLength} characters and was cut.`, true);
  }

  chosen() {
    const value = (id) => byId(id).value, usual = this.live.chosen;
    const number = (id, name = id) => (byId(id).disabled ? usual[name] : byId(id).valueAsNumber);
    return {
      world: value("world-name"), map: value("map"), world_seed: number("world-seed", "world_seed"), size: number("size"), policy: value("policy"),
      settings: this.settings(), ants: number("ants"), ticks: number("episode"), seed: number("seed"),
    };
  }

  /* The HTML of a field for each declared setting, in groups. */
  fields() {
    const html = {};
    this.live.choices.settings.forEach((one, place) => {
      const [, name] = one.path.match(/([^.]+)$/), group = one.path.slice(0, -name.length - 1), about = `id="setting-${place}" data-path="${one.path}"`;
      const words = safe(name.replaceAll("_", " ")), step = one.kind === "int" ? 1 : "any";
      const input = one.kind === "bool" ? `<input type="checkbox" ${about}>`
        : one.words.length ? `<select ${about}>${one.words.map((word) => `<option value="${safe(word)}">${safe(word.replaceAll("_", " "))}</option>`).join("")}</select>`
          : `<input type="number" ${about} step="${step}" min="${one.least ?? one.above ?? ""}" max="${one.most ?? ""}" ${one.optional ? 'placeholder="none"' : "required"}>`;
      html[group] = (html[group] ?? "") + `<div class="setting"><label>${input} ${words}</label>${helpOf(words, one.help + (one.unit ? `, in ${one.unit}` : ""))}</div>`;
    });
    return Object.entries(html).map(([group, inner]) => `<fieldset><legend>${safe(group.split(".").at(-1).replace(/^./, (letter) => letter.toUpperCase()))}</legend>${inner}</fieldset>`).join("");
  }

  /* The values of the form by path, without hidden and empty fields. */
  settings() {
    const given = {};
    for (const field of document.querySelectorAll("#settings [data-path]")) {
      if (field.closest(".setting").hidden || field.value === "") continue;
      given[field.dataset.path] = field.type === "checkbox" ? field.checked : field.type === "number" ? field.valueAsNumber : field.value;
    }
    return given;
  }

  /* Put values into the form; the other fields get their defaults. */
  set(values) {
    for (const [place, one] of this.live.choices.settings.entries()) {
      const field = byId(`setting-${place}`), value = values[one.path] ?? one.default;
      if (field.type === "checkbox") field.checked = value;
      else field.value = value ?? "";
    }
  }

  showWorld() {
    const world = byId("world-name").value;
    byId("map-label").hidden = world !== "map";
    byId("drawn").hidden = !this.live.choices.drawn.includes(world);
    // Hidden fields must not block the form.
    for (const field of byId("drawn").querySelectorAll("input")) field.disabled = byId("drawn").hidden;
  }

  showTask() {
    const task = this.live.choices.tasks[byId("task").value];
    const others = Object.entries(this.settings()).filter(([path]) => !/^task\.(?!life)/.test(path));
    if (task) this.set({ ...task.settings, ...Object.fromEntries(others) });
    else byId("settings-box").open = true;
    this.showPolicy(false);
  }

  /* Select the task with these settings; `life` does not matter. */
  nameTask() {
    this.explain();
    const { settings, tasks } = this.live.choices, of = settings.filter(({ path }) => /^task\.(?!life)/.test(path));
    const values = (given) => JSON.stringify(of.map(({ path, default: usual }) => given[path] ?? usual));
    const now = values(this.settings()), [name] = Object.entries(tasks).find(([, task]) => values(task.settings) === now) ?? [""];
    byId("task").value = name;
  }

  /* Select the task of a policy file, or an observation that the policy "by hand" supports. */
  showPolicy(brings = true) {
    const { policies, by_hand: known, settings } = this.live.choices, value = byId("policy").value, policy = policies[value.replace(/^file /, "")];
    const sees = byId(`setting-${settings.findIndex(({ path }) => path === "task.observation")}`);
    if (value.startsWith("file ") && policy) {
      if (brings) this.set({ ...this.settings(), ...policy });
      sees.value = policy["task.observation"];
    } else if (value === "by hand" && !known.includes(sees.value)) sees.value = known[0];
    this.nameTask();
  }

  /* Show the state, except in sliders that the user moves. */
  show({ values, pages, works, can_undo: canUndo, can_go_back: canGoBack }) {
    this.showWorks(works);
    byId("undo").disabled = !canUndo;
    byId("go-back").hidden = !canGoBack;
    byId("sees").textContent = `Ants search for food and carry it to their queen${values.deposit ? ", and lay trails that other ants can follow" : ""}.`;
    document.querySelector("[data-try=rule]").hidden = !values.evaporation;
    const box = byId("sliders"), names = Object.keys(values).join();
    if (box.dataset.names !== names) {
      box.dataset.names = names;
      box.innerHTML = Object.entries(values).map(([name, one]) => {
        const words = SLIDERS[name] ?? safe(name.replace(".", ": ").replaceAll("_", " ")), about = `id="set-${name}" data-name="${name}"`;
        const path = EXPLAINS[name] ?? one.path, setting = this.live.choices?.settings.find((other) => other.path === path);
        const field = isSwitch(one) ? `<label class="rule"><input type="checkbox" ${about}> ${words}</label>`
          : `<label class="slider" for="set-${name}"><span>${words}</span><output for="set-${name}"></output><input type="range" ${about}></label>`;
        return `<div class="field">${field}${helpOf(words, one.help || (setting?.help ?? "living ants, also at the start of later episodes"))}</div>`;
      }).join("");
    }
    for (const [name, one] of Object.entries(values)) {
      const slider = byId(`set-${name}`);
      if ((this.held.get(name) ?? 0) > performance.now()) continue;
      if (isSwitch(one)) slider.checked = one.value === 1;
      else {
        Object.assign(slider, { min: one.least, max: one.most, step: one.step, value: one.value });
        this.showSlider(slider, one.value);
      }
    }
    this.live.viewer?.timeline.showSpeed();
    byId("watchers").innerHTML = pages > 1 ? `${pages} pages<span> show this session</span>` : "";
  }

  /* Do what a card suggests, or choose the tool for it. */
  suggest(what) {
    const { tools, viewer: { history } } = this.live, rule = byId("set-evaporation"), { trail } = history.worldAt(history.length - 1);
    if (what === "rule") rule.click();
    if (what === "wall") tools.choose("rock");
    if (what === "wall") byId("world").focus();
    if (what === "trail") tools.number = this.live.nextStroke();
    if (what === "trail") tools.edit("trail", { level: 0, ...tools.field() }, [...trail.keys()].filter((cell) => trail[cell] > 0));
    const said = { wall: "Draw on the world.", trail: "The trail is gone.", rule: `From now on, trails ${rule?.checked ? "" : "do not "}evaporate.` }[what];
    if (said) this.say(`${said} Undo takes it back.`);
  }

  /* Show the rates, which decay per episode, of the drawn frame. */
  showRates({ epsilon, learningRate }) {
    for (const [name, value] of Object.entries({ epsilon, learning_rate: learningRate })) {
      const slider = byId(`set-${name}`);
      if (!slider || (this.held.get(name) ?? 0) > performance.now()) continue;
      slider.value = value;
      this.showSlider(slider, value);
    }
  }

  /* Show work in progress, each with a bar and a button; disable other controls during a replay. */
  showWorks(works) {
    const box = byId("works"), kinds = works.map(({ kind }) => kind);
    for (const [kind, part] of this.works) {
      if (kinds.includes(kind)) continue;
      part.remove();
      this.works.delete(kind);
    }
    for (const { kind, done, total } of works) {
      if (!this.works.has(kind)) this.addWork(kind, box);
      const part = this.works.get(kind), number = (n) => n.toLocaleString("en").replaceAll(",", "\u202f");
      const words = kind === "kernels" ? "Compiling the simulation" : kind === "load" ? "Replaying" : `Making the ${WORKS[kind]}:`, bar = part.querySelector("progress");
      part.querySelector("span").textContent = done ? `${words} ${number(done)} of ${number(total)} ticks` : `${words.replace(":", "")} …`;
      if (done) Object.assign(bar, { value: done, max: total });
      else bar.removeAttribute("value");
    }
    this.hold(kinds.includes("load"));
  }

  /* Disable or enable all controls. */
  hold(holds) {
    if (this.holds === holds) return;
    this.holds = holds;
    if (holds) this.focused = document.activeElement;
    for (const part of document.querySelectorAll(`${PARTS}, .buttons`)) part.inert = holds || (this.lost && !part.matches(".buttons"));
    if (!holds && document.activeElement === document.body) this.focused?.focus(); // restore the focus
  }

  addWork(kind, box) {
    const part = document.createElement("div");
    part.innerHTML = `<span></span><progress aria-label="${{ load: "Replaying", kernels: "Compiling the simulation" }[kind] ?? WORKS[kind]}"></progress>`
      + (kind === "kernels" ? "" : '<button type="button" class="text-button">Cancel</button>');
    part.querySelector("button")?.addEventListener("click", () => this.live.ask("cancel", { kind }));
    box.append(part);
    this.works.set(kind, part);
    this.hush();
  }

  showSlider(slider, value) {
    const digits = Math.max(0, -Math.floor(Math.log10(Number(slider.step)))), { min, max } = slider;
    slider.style.setProperty("--filled", `${(100 * (slider.value - min)) / (max - min || 1)}%`);
    slider.previousElementSibling.value = Number(value).toFixed(Math.min(digits, 4));
  }

  slide(slider) {
    const { name } = slider.dataset, held = this.held.get(name) > performance.now() && this.sliding === slider;
    if (!held) {
      this.slid(); // another slider
      this.stroke = this.live.nextStroke();
    }
    this.held.set(name, performance.now() + 500);
    if (slider.type === "range") this.showSlider(slider, slider.valueAsNumber);
    this.sliding = slider;
    if (held && this.timer) return; // only the last of several values is sent
    this.timer = setTimeout(() => this.slid(), 40);
  }

  /* Send the value of the moved slider, unless it is already sent. */
  slid() {
    if (!this.timer) return;
    clearTimeout(this.timer);
    this.timer = null;
    const { sliding } = this, value = sliding.type === "range" ? sliding.valueAsNumber : Number(sliding.checked);
    const { path, edits } = this.live.state.values[sliding.dataset.name], [name, ...rest] = path.split(".");
    this.live.edit(edits ? edits[value] : { [name]: rest.length ? { [rest.join(".")]: value } : value }, this.stroke);
  }

  /* Request another session, or an undo; send pending edits first. */
  anew(what) {
    this.slid();
    this.live.tools.send();
    this.live.stand();
    this.live.ask(what);
  }

  async upload() {
    const [file] = byId("upload").files;
    if (!file) return;
    if (file.size > MOST_UPLOAD) this.say("This file is too large to be a session.", true);
    else {
      this.busy("Reading the session …");
      this.live.transport.send(await file.arrayBuffer());
    }
    byId("upload").value = "";
  }

  download({ name, bytes }) {
    const link = document.createElement("a");
    const type = FILE_TYPES[name.split(".").pop()] ?? "application/octet-stream";
    link.href = URL.createObjectURL(new Blob([bytes], { type }));
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
    this.say(`${name}: ${Math.ceil(bytes.byteLength / 1000)} kB`);
  }

  /* Quit after a second press, so that nobody quits by accident. */
  quit() {
    if (this.quits) this.live.ask("quit");
    this.quits = !this.quits;
    byId("quit").textContent = this.quits ? "Press again to quit" : "Quit the server";
    setTimeout(() => {
      this.quits = false;
      byId("quit").textContent = "Quit the server";
    }, 4000);
  }

  /* Show why there is no connection, and what the user can do. */
  lose({ why, reason }) {
    const [words, button] = LOST[why];
    if (this.lost === why || (this.lost === "ended" && why === "lost")) return; // the message is already shown
    this.showWorks([]);
    this.hush();
    this.connected(false);
    this.lost = why;
    byId("lost").querySelector("p").textContent = why === "cut off" ? `${words} (${reason}). This page keeps everything it has shown.` : words;
    byId("again").textContent = button;
    byId("keep").hidden = !this.live.viewer;
  }

  /* Enable controls if there is a connection; looking back is always possible. */
  connected(is) {
    if (is) [this.lost, this.kept] = ["", false];
    byId("lost").hidden = is;
    for (const part of document.querySelectorAll(PARTS)) part.inert = !is || this.holds;
    for (const id of ["play", "speed"]) byId(id).disabled = !is;
  }

  /* Save the history of this page as a page that plays it. */
  async keep() {
    this.busy("Making the file …");
    this.download({ name: "recording.html", bytes: await this.live.recording() });
    this.kept = true;
  }

  refuse(words) {
    this.begins = false;
    this.say(words.charAt(0).toUpperCase() + words.slice(1), true);
  }
  busy(words) {
    this.say(words);
    clearTimeout(this.fading);
  }
  hush() {
    byId("toast").hidden = true;
  }
  say(words, bad = false) {
    const toast = byId("toast");
    toast.textContent = words;
    toast.classList.toggle("bad", bad);
    toast.hidden = false;
    clearTimeout(this.fading);
    this.fading = setTimeout(() => this.hush(), bad ? 8000 : 3000);
  }
}

const live = new Live();
live.tools = new Tools(live);
live.controls = new Controls(live);
