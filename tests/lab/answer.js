// Answers questions about the lab's modules: a line of JSON for each line of JSON.
import fs from "fs";
import { createInterface } from "readline";
import { Engine, GRID, LoneAnts, allowed } from "../../lab/page/engine.js";
import { decode, encode, linkOf, partsOf } from "../../lab/page/link.js";
import { SCENE, makeWorld } from "../../lab/page/worlds.js";

const folder = process.argv[2];
const load = (name) => new WebAssembly.Module(fs.readFileSync(`${folder}/${name}.wasm`));
const colony = load("colony"), ant = load("ant");

function visited({ scene, changes, ticks }) {
  const engine = new Engine(colony, { ...SCENE, ...scene });
  const memory = engine.wasm.memory.buffer;
  for (const { tick, ...change } of changes) {
    engine.pass(tick - engine.tick);
    engine.apply(change);
  }
  engine.pass(ticks - engine.tick);
  const link = linkOf(engine), { code, tick } = partsOf(link), { scene: first, events } = decode(code);
  const again = new Engine(colony, first, events);
  again.pass(tick);
  const frame = Object.fromEntries(["cells", "before", "headings", "looks"].map((name) => [name, [...engine[name].slice(0, engine.ants)]]));
  return {
    link, hash: engine.hash(), again: again.hash(), grown: memory !== engine.wasm.memory.buffer, ...frame,
    counts: [0, 1, 2, 3].map((k) => engine.wasm.count(k)), // returns, deliveries, moves, blocked
    ground: [...engine.ground], levels: [...engine.levels],
  };
}

// Whether each ant does what its mind has said, and sees what an ant in its place would see.
function minds({ scene, ticks }) {
  const engine = new Engine(colony, { ...SCENE, ...scene });
  let right = 0, wrong = 0;
  for (let tick = 0; tick < ticks; tick++) {
    const said = [...Array(engine.ants).keys()].map((k) => engine.mind(k));
    said.forEach((mind, k) => {
      const policy = engine.policy(engine.cells[k], engine.headings[k], mind.carries);
      if (policy.state !== engine.states[k] || (mind.why === "best" && mind.next !== policy.best[0]) || (mind.why === "was best" && scene.learner !== 1)) wrong++;
    });
    engine.pass(1);
    said.forEach((mind, k) => (mind.next === engine.looks[k] >> 4 ? right++ : wrong++));
  }
  return { right, wrong };
}

const ANSWERS = {
  visit: visited,
  minds,
  encode: ({ scene, events }) => encode({ ...SCENE, ...scene }, events),
  decode: ({ code }) => decode(code),
  world: (scene) => makeWorld(scene),
  allowed: ({ name, value }) => allowed(name, value),
  grid: () => GRID,
  train: (setting) => {
    const { returns, steps, deliveries } = new LoneAnts(ant).train(setting);
    return { returns: [...returns], steps: [...steps], deliveries: [...deliveries] };
  },
  // The steps of an ant that learns, its table, and its steps when it then follows the table.
  notes: ({ setting, rollout }) => {
    const lone = new LoneAnts(ant), learned = (lone.train({ ...setting, notes: 3000 }), { table: [...lone.values], steps: lone.notes });
    lone.follow(learned.table, { seeds: setting.seeds, rollout, notes: 600 });
    return { ...learned, followed: lone.notes };
  },
};
for await (const line of createInterface({ input: process.stdin })) {
  const [name, question] = JSON.parse(line);
  let answer;
  try {
    answer = ANSWERS[name](question);
  } catch (error) {
    answer = { error: error.message };
  }
  console.log(JSON.stringify(answer));
}
