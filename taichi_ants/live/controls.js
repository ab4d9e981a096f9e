/* What stands beside the live world: a new session, sliders, files. */

const SLIDERS = {
  ants: "Ants", evaporation: "Trails evaporate", half_life: "Half-life of trails", diffusion: "Diffusion",
  deposit: "Deposit", cap: "Most of a trail", slope: "Slope of trails", epsilon: "Epsilon", learning_rate: "Learning rate",
};
const FILE_TYPES = { html: "text/html", gif: "image/gif" };
const MOST_UPLOAD = 2 ** 24;
const MAP = `; lines are offset by two columns
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

/* Whether a value is either 0 or 1. */
const isSwitch = ({ least, most, step }) => least === 0 && most === 1 && step === 1;

class Controls {
  constructor(live) {
    this.live = live;
    this.held = new Map(); // sliders that somebody moves -> until when
    this.filled = "";
    byId("theme").insertAdjacentHTML("beforebegin", '<span class="watchers" id="watchers"></span>');
    const on = (id, kind, act) => byId(id).addEventListener(kind, act);
    on("chosen", "submit", (event) => {
      event.preventDefault();
      this.busy("The session begins …");
      live.ask("begin", { chosen: this.chosen() });
    });
    on("world-name", "change", () => this.showWorld());
    on("task", "change", () => this.showTask());
    on("rules", "change", () => this.nameTask());
    on("sees", "change", () => this.nameTask());
    on("policy", "change", () => this.showPolicy());
    on("restart", "click", () => live.ask("restart"));
    on("next-episode", "click", () => live.ask("edit", { edit: { kind: "episode" } }));
    on("files", "click", (event) => {
      const kind = event.target.dataset.export;
      if (!kind) return;
      this.busy("Making the file …");
      live.ask("export", { kind });
    });
    on("load", "click", () => byId("upload").click());
    on("upload", "change", () => this.upload());
    on("quit", "click", () => this.quit());
    on("sliders", "input", (event) => this.slide(event.target));
    live.news.addEventListener("begin", () => this.fill());
    live.news.addEventListener("state", ({ detail }) => this.show(detail));
    live.news.addEventListener("error", ({ detail }) => this.say(detail.words, true));
    live.news.addEventListener("file", ({ detail }) => this.download(detail));
    live.news.addEventListener("over", () => this.end());
  }

  /* Offer what there is, and choose what the session has. */
  fill() {
    const { choices, chosen } = this.live, options = (pairs) =>
      pairs.map(([value, words]) => `<option value="${safe(value)}">${safe(words)}</option>`).join("");
    if (!this.filled) {
      this.filled = "yes";
      byId("world-name").innerHTML = options(Object.entries(choices.worlds));
      byId("task").innerHTML = options([...Object.entries(choices.tasks).map(([name, { words }]) => [name, words]), ["", "single rules"]]);
      byId("rules").innerHTML = Object.entries(choices.rules).map(([name, words]) =>
        `<label class="rule"><input type="checkbox" value="${name}"> ${safe(words)}</label>`).join("");
      byId("sees").innerHTML = options(Object.entries(choices.sees).map(([name, words]) => [name, `${name}: ${words}`]));
      byId("policy").innerHTML = `<optgroup label="Learn now">${options(Object.keys(choices.learners).map((name) => [`learn ${name}`, `learn now: ${name.replaceAll("_", " ")}`]))}</optgroup>
        <optgroup label="Follow a policy">${options([["by hand", "follow the trail, by hand"], ...Object.keys(choices.policies).map((name) => [`file ${name}`, `follow ${name}`])])}</optgroup>`;
      byId("ants").max = choices.most.ants;
      [byId("size").min, byId("size").max] = choices.sizes;
      byId("map").value = MAP;
      byId("map").maxLength = choices.most.text;
    }
    this.choose(chosen);
    this.hush();
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
    this.setRules(chosen.rules ?? [], chosen.sees);
    this.keepsRules = chosen.rules === null; // those of a policy, which have no names
    this.showWorld();
    this.nameTask();
  }

  chosen() {
    const value = (id) => byId(id).value, number = (id) => byId(id).valueAsNumber;
    return {
      world: value("world-name"), map: value("map"), world_seed: number("world-seed"), size: number("size"), sees: value("sees"), policy: value("policy"),
      rules: this.keepsRules ? null : this.rules(), ants: number("ants"), ticks: number("episode"), seed: number("seed"),
    };
  }

  rules() {
    return [...document.querySelectorAll("#rules input:checked")].map(({ value }) => value);
  }

  setRules(rules, sees) {
    for (const box of document.querySelectorAll("#rules input")) box.checked = rules.includes(box.value);
    byId("sees").value = sees;
  }

  showWorld() {
    const world = byId("world-name").value;
    byId("map-label").hidden = world !== "map";
    byId("drawn").hidden = !this.live.choices.drawn.includes(world);
  }

  showTask() {
    const task = this.live.choices.tasks[byId("task").value];
    this.keepsRules = false;
    if (task) this.setRules([...task.rules, ...this.rules().filter((rule) => this.live.choices.life.includes(rule))], task.sees);
    else byId("rules-box").open = true;
    this.showPolicy(false);
  }

  /* Name the rules by the task that they make. */
  nameTask() {
    const rules = this.rules().filter((rule) => !this.live.choices.life.includes(rule)).join(), sees = byId("sees").value;
    const [name] = Object.entries(this.live.choices.tasks).find(([, task]) => task.rules.join() === rules && task.sees === sees) ?? [""];
    byId("task").value = name;
    this.keepsRules = false;
  }

  /* A policy of a file has rules of its own, and reads what its ants saw. */
  showPolicy(brings = true) {
    const { policies, by_hand: known } = this.live.choices, value = byId("policy").value, policy = policies[value.replace(/^file /, "")];
    const sees = byId("sees");
    if (value.startsWith("file ") && policy) {
      if (brings && policy.rules) this.setRules(policy.rules, policy.sees);
      sees.value = policy.sees;
      this.nameTask();
      this.keepsRules = brings && policy.rules === null;
    } else if (value === "by hand" && !known.includes(sees.value)) {
      sees.value = known[0];
      this.nameTask();
    }
    sees.disabled = value.startsWith("file ");
  }

  /* Show how things stand; sliders that somebody moves are left alone. */
  show({ values, pages }) {
    const box = byId("sliders"), names = Object.keys(values).join();
    if (box.dataset.names !== names) {
      box.dataset.names = names;
      box.innerHTML = Object.entries(values).map(([name, one]) => {
        const words = SLIDERS[name] ?? name.replaceAll("_", " "), about = `id="set-${name}" data-name="${name}"`;
        if (isSwitch(one)) return `<label class="rule"><input type="checkbox" ${about}> ${words}</label>`;
        return `<label class="slider" for="set-${name}"><span>${words}</span><output for="set-${name}"></output><input type="range" ${about}></label>`;
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
    byId("watchers").textContent = pages > 1 ? `${pages} pages look on` : "";
  }

  showSlider(slider, value) {
    const digits = Math.max(0, -Math.floor(Math.log10(Number(slider.step)))), { min, max } = slider;
    slider.style.setProperty("--filled", `${(100 * (slider.value - min)) / (max - min || 1)}%`);
    slider.previousElementSibling.value = Number(value).toFixed(Math.min(digits, 4));
  }

  slide(slider) {
    const { name } = slider.dataset, waits = this.held.get(name) > performance.now() && this.sliding === name;
    this.held.set(name, performance.now() + 500);
    if (slider.type === "range") this.showSlider(slider, slider.valueAsNumber);
    this.sliding = name;
    if (waits && this.timer) return; // the last of several values is sent
    this.timer = setTimeout(() => {
      this.timer = null;
      const value = slider.type === "range" ? slider.valueAsNumber : Number(slider.checked);
      this.live.ask("edit", { edit: { kind: "set", name, value } });
    }, 40);
  }

  async upload() {
    const [file] = byId("upload").files;
    if (!file) return;
    if (file.size > MOST_UPLOAD) this.say("This file is larger than any session.", true);
    else {
      this.busy("The session is replayed …");
      this.live.socket.send(await file.arrayBuffer());
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

  /* Twice, so that nobody ends it by chance. */
  quit() {
    if (this.quits) this.live.ask("quit");
    this.quits = !this.quits;
    byId("quit").textContent = this.quits ? "Press again to quit" : "Quit the server";
    setTimeout(() => {
      this.quits = false;
      byId("quit").textContent = "Quit the server";
    }, 4000);
  }

  end() {
    this.say("The server has ended; this page shows what happened so far.", true);
    clearTimeout(this.fading);
    for (const one of document.querySelectorAll(".controls :is(button, input, select, textarea), .palette :is(button, input), #play, #speed")) one.disabled = true;
    this.live.running = false;
    this.live.viewer?.player.take();
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
