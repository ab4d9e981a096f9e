/* experiments.js: what the lessons run. An experiment gives a sentence (`say`), a table (`head` and `rows`), lines of a plot, or
 * the steps of an ant (`walks`); one with `code` checks a function that a student writes, and throws a sentence if it is wrong.
 * No DOM is needed. */

import { hexDistance } from "../../../lab/page/worlds.js";
import { live, PLAN } from "./room.js";
import { Random } from "./random.js";

export const ACTS = ["left", "forward", "right", "pick up", "deliver"];
// What ants see: empty, obstacle, trail or nearer to the nest, food or queen.
const LETTERS = [["E", "O", "T", "F"], ["E", "O", "S", "Q"]];
const CUE = 2, CARRIES = 64; // the code of a trail or of a way home; the first observation with food
const ANTS = 2000, VISITS = 500, PLACES = 5;                  // of lesson 1
const STEPS_HOME = 34, QUEEN_AT = [-9, 0], COLUMNS = 21, CENTRE = 10; // of the paper's world
const LEARNER = { learner: "q_learning", rate: 0.1, discount: 0.9, epsilon: 0.3, decay: 0.99 };
const SARSA = { learner: "sarsa", rate: 0.01, discount: 0.9, epsilon: 0.3, decay: 0.995 };
const FAR = { ...LEARNER, learner: "dyna_q", discount: 0.99, planningSteps: 5 };
const T95 = { 4: 2.7764, 9: 2.2622, 19: 2.093, 39: 2.0227, 49: 2.0096, 99: 1.9842, 199: 1.972, 499: 1.9647 }; // Student's t, by degrees of freedom

export const viewOf = (state) => [state >> 4 & 3, state >> 2 & 3, state & 3];
export const nameOf = (state) => `${state >= CARRIES ? "carrying" : "foraging"} ${viewOf(state).map((code) => LETTERS[state >> 6][code]).join("\u00a0")}`;
const upTo = (n) => Array.from({ length: n }, (_, k) => k);
const sum = (values) => values.reduce((a, b) => a + b, 0), mean = (values) => sum(values) / values.length;
const percent = (share, digits = 0) => `${(100 * share).toFixed(digits)} %`;
const learned = (lone, k = 0) => lone.values.slice(640 * k, 640 * (k + 1));
const pause = () => new Promise((done) => { setTimeout(done); });

/** Half the width of the 95 % interval around the mean of values. */
function halfOf(values) {
  const middle = mean(values), n = values.length;
  return T95[n - 1] * Math.sqrt(sum(values.map((v) => (v - middle) ** 2)) / (n - 1) / n);
}

// Functions that students write -----------------------------------------------------------------

const MOST_ROUNDS = 3e7;
const must = (fine, sentence) => { if (!fine) throw new Error(sentence); };
const worded = (value) => (typeof value === "number" ? String(Math.round(value * 1e6) / 1e6) : value === undefined ? "nothing (is a `return` missing?)" : String(value));

/** The function of a text; its errors are sentences, and loops that do not end are stopped. */
export function written(code, name) {
  let rounds = 0, own;
  const round = () => { must(++rounds < MOST_ROUNDS, "a loop does not end"); return true; };
  const guarded = code.replace(/\bwhile\s*\(/g, "while (round() && ").replace(/\bfor\s*\(([^;()]*);\s*(?=[^;\s])/g, "for ($1; round() && ");
  try {
    new Function(`"use strict";\n${code}`); // alone, so that an error is about what the student wrote
    own = new Function("round", `"use strict";\n${guarded}\nreturn typeof ${name} === "function" && ${name};`)(round);
  } catch (error) {
    throw new Error(`This JavaScript does not run yet: ${error.message}.`);
  }
  must(own, `There is no function ${name}; do not change its name.`);
  return (...given) => {
    try { return own(...given); } catch (error) { throw new Error(`Your function stopped with an error: ${error.message}.`); }
  };
}

/** The first step after which the table of an update differs from that of the C engine, or null. */
function difference(update, notes, near = 0) {
  const [q, theirs] = [0, 1].map(() => Array.from({ length: 128 }, () => new Float32Array(5)));
  for (const [k, note] of notes.entries()) {
    const { state, action, reward, next, terminated, value } = note;
    update(q, state, action, reward, next, Boolean(terminated), Math.fround(0.1), Math.fround(0.9), notes[k + 1]?.action);
    theirs[state][action] = value;
    for (let s = 0; s < 128; s++)
      for (let a = 0; a < 5; a++)
        if (!(Math.abs(q[s][a] - theirs[s][a]) <= near)) return { note, entry: `(${nameOf(s)}, ${ACTS[a]})`, yours: q[s][a], right: theirs[s][a] };
  }
  return null;
}

const whenOf = ({ episode, step }) => `episode ${episode}, step ${step}`;

function checkUpdate(update, notes) {
  const wrong = difference(update, notes, 1e-4), { note } = wrong || {};
  must(!wrong, wrong && `In ${whenOf(note)}, the ant observed ${nameOf(note.state)}, chose “${ACTS[note.action]}”, got ${note.reward} and then observed ${nameOf(note.next)}`
    + `${note.terminated ? ", where the episode terminated" : ""}. Now the entry ${wrong.entry} is ${worded(wrong.right)} in the engine, and ${worded(wrong.yours)} in your table.`);
  const bits = difference(update, notes);
  return { say: `Right: after each of ${notes.length} steps, all 640 entries are those of the C engine, ${bits ? `nearly: in ${whenOf(bits.note)}, a last bit differs. `
    + "The engine rounds each result to 32 bits; Math.fround(x) does so in JavaScript." : "to the last bit."}` };
}

function updates(lone, learner) {
  lone.train({ ...LEARNER, learner, seeds: [1], episodes: 3, notes: 1800 });
  return lone.notes;
}

const UPDATE = (following) => (q, s, a, r, next, terminated, alpha, gamma) => {
  const f = Math.fround, target = f(r + following(q, s, next, terminated, gamma));
  q[s][a] += f(alpha * f(target - q[s][a]));
};
const after = (row, terminated, gamma) => (terminated ? 0 : Math.fround(gamma * row));
const WRONG = {
  "A forgets the end": UPDATE((q, s, next, terminated, gamma) => after(Math.max(...q[next]), false, gamma)),
  "B subtracts nothing": (q, s, a, r, next, terminated, alpha, gamma) => { q[s][a] += alpha * (r + after(Math.max(...q[next]), terminated, gamma)); },
  "C takes the present row": UPDATE((q, s, next, terminated, gamma) => after(Math.max(...q[s]), terminated, gamma)),
  "D takes the smallest": UPDATE((q, s, next, terminated, gamma) => after(Math.min(...q[next]), terminated, gamma)),
};

// Lesson 1 ---------------------------------------------------------------------------------------

/** The share of ants at their best place, and the mean reward, for each visit. */
function visits({ epsilon = 0, initial = 0, size = 0, change = -1 }) {
  const random = new Random(0), atBest = new Float64Array(VISITS), rewards = new Float64Array(VISITS);
  for (let ant = 0; ant < ANTS; ant++) {
    const chances = upTo(PLACES).map(() => random.number()), estimates = Array(PLACES).fill(initial), counts = Array(PLACES).fill(0);
    for (let t = 0; t < VISITS; t++) {
      if (t === change) for (let k = PLACES - 1; k; k--) { const other = random.below(k + 1); [chances[k], chances[other]] = [chances[other], chances[k]]; }
      let place = 0, equal = 0, best = 0; // one of equal places is drawn
      for (let k = 0; k < PLACES; k++) {
        if (estimates[k] > estimates[place]) [place, equal] = [k, 0];
        if (estimates[k] === estimates[place] && (!equal++ || random.below(equal) === 0)) place = k;
        if (chances[k] > chances[best]) best = k;
      }
      if (random.number() < epsilon) place = random.below(PLACES);
      const reward = random.number() < chances[place] ? 1 : 0;
      estimates[place] += (size || 1 / ++counts[place]) * (reward - estimates[place]);
      atBest[t] += Number(place === best) / ANTS;
      rewards[t] += reward / ANTS;
    }
  }
  return { atBest, rewards };
}
const tens = (values) => upTo(values.length / 10).map((k) => mean(values.slice(10 * k, 10 * k + 10)));
const CHOOSE = `function choose(row, epsilon, random) {
  // row has five numbers; random() gives a number from 0 to 1.
  // Return an action, 0 to 4.
  return 0;
}`;
const CHOSEN = `function choose(row, epsilon, random) {
  if (random() < epsilon) return Math.floor(5 * random());
  const most = Math.max(...row);
  const best = [0, 1, 2, 3, 4].filter((a) => row[a] === most);
  return best[Math.floor(best.length * random())];
}`;

function checkChoice(own) {
  const random = new Random(0), often = (row, epsilon) => {
    const counts = Array(5).fill(0);
    for (let k = 0; k < 10000; k++) {
      const action = own([...row], epsilon, () => random.number());
      must(Number.isInteger(action) && action >= 0 && action < 5, `An action is a whole number from 0 to 4, but choose gave ${worded(action)}.`);
      counts[action]++;
    }
    return counts.map((n) => n / 10000);
  };
  for (const [row, epsilon, wanted] of /** @type {[number[], number, number[]][]} */ ([[[0, 0.7, 0, -0.1, -0.2], 0, [0, 1, 0, 0, 0]], [[1, 1, 0, 0, 0], 0, [0.5, 0.5, 0, 0, 0]],
    [[-1, -2, -3, -1, -2], 0.5, [0.35, 0.1, 0.1, 0.35, 0.1]], [[0, 0.7, 0, -0.1, -0.2], 0.3, [0.06, 0.76, 0.06, 0.06, 0.06]]])) {
    const found = often(row, epsilon), k = wanted.findIndex((share, a) => Math.abs(share - found[a]) > 0.03);
    must(k < 0, `For the row ${row.join(", ")} and ε = ${epsilon}, action ${k} should come in ${percent(wanted[k])} of the cases; yours came in ${percent(found[k])}.`);
  }
  return { say: "Right. Of 10 000 choices with ε = 0.3 in a row in which the second number is the largest:", rows: often([0, 0.7, 0, -0.1, -0.2], 0.3).map((share, a) => [ACTS[a], percent(share, 1)]) };
}

/** Shares of deliveries while ants learn and when they follow their tables; see lesson 1, question 6. */
function practice(lone, initial, epsilon) {
  const seeds = upTo(20), { deliveries } = lone.train({ ...LEARNER, epsilon, decay: 1, first: initial, seeds, episodes: 200 });
  const tables = lone.values, tried = upTo(10).map((rollout) => lone.follow(tables, { seeds, rollout }));
  return [percent(mean(seeds.map((k) => mean(deliveries.subarray(200 * k + 150, 200 * k + 200))))), percent(mean(tried.map((one) => mean(one.deliveries)))),
          mean(tried.map(({ steps }) => mean(steps))).toFixed(2)];
}

// Lessons 2 and 5 --------------------------------------------------------------------------------

const FORWARD = [...Array(16).fill(1), 3, ...Array(16).fill(1), 10]; // rewards on the shortest way
function swept(values, gamma) {
  return values.map((_, s) => (s > 33 ? 0 : Math.max(FORWARD[s] + gamma * values[s + 1], s >= 1 && s <= 16 ? 1 + gamma * values[s - 1] : -Infinity)));
}

/** The steps of an ant that follows a table. */
function followed(lone, table, seed, maxSteps = 600) {
  lone.follow(table, { seeds: [seed], maxSteps, notes: maxSteps });
  return lone.notes;
}

const farAnt = (lone, seed) => { lone.train({ ...FAR, seeds: [seed] }); return learned(lone); };
function threeAnts(lone, most = 600) {
  lone.train({ ...SARSA, seeds: [0] });
  return [["A", followed(lone, learned(lone), 0, most)], ...[["B", 2], ["C", 3]].map(([name, seed]) => [name, followed(lone, farAnt(lone, Number(seed)), Number(seed), most)])];
}
const pointsOf = (notes) => sum(notes.map(({ reward }) => reward));
const discounted = (notes, gamma) => notes.reduceRight((later, { reward }) => reward + gamma * later, 0);

const BEHAVIOURS = ["deliver", "walk the trail", "circle with food", "other"];
/** What an ant does; as taichi_ants/analysis/behaviour.py has it. */
function behaviourOf(notes) {
  const late = notes.filter(({ step }) => step >= 300), carried = late.filter(({ state }) => state >= CARRIES).length;
  if (notes.some(({ reward }) => reward === 10)) return 0;
  if (late.filter(({ state, action }) => action < 3 && viewOf(state)[action] === CUE).length < late.length / 4) return 3;
  return carried === 0 ? 1 : carried === late.length ? 2 : 3;
}

async function behaviours(lone, show, truncates) {
  const rows = [];
  for (const [name, learner, planningSteps] of [["Q-learning", "q_learning", 0], ["SARSA", "sarsa", 0], ["Dyna-Q", "dyna_q", 5]])
    for (const cut of truncates) {
      const counts = [0, 0, 0, 0];
      for (const seed of upTo(40)) {
        if (seed % 5 === 0) await pause();
        lone.train({ ...FAR, learner, planningSteps, truncates: cut, seeds: [seed] });
        counts[behaviourOf(followed(lone, learned(lone), seed))]++;
      }
      rows.push([truncates.length > 1 ? `${name}, delivery ${cut ? "truncates" : "terminates"}` : name, ...counts]);
      show({ head: ["of 40 ants", ...BEHAVIOURS], rows });
    }
  return { head: ["of 40 ants", ...BEHAVIOURS], rows };
}

const fromQueen = (cell) => hexDistance(cell % COLUMNS - CENTRE - QUEEN_AT[0], Math.floor(cell / COLUMNS) - CENTRE - QUEEN_AT[1]);

// All of them ------------------------------------------------------------------------------------

/** What the worlds between the experiments are; they come from the article. */
export const SETTINGS = {
  chance: "A colony at the double bridge: eight ants share one table, which starts with 0 everywhere. How much should they explore?",
  learning: "The same question in the lab’s meadow, where 64 ants with the lab’s rules share one table of Q-learning. The wall appears after 1000 ticks.",
  pay: "Four ants in the paper’s world share one table, with discount 0.99. They have practised for 20 000 ticks; no delivery ends anything. What do they do for their pay?",
  direction: "Both kinds of trail in the lab’s meadow, where 64 ants learn together from scratch.",
  copies: "The same in the lab’s meadow, with the lab’s rules: which ants bring home most per head?",
  rules: "The rules, one after the other, in the lab’s meadow: 64 ants learn together from scratch.",
};

/**
 * @typedef {{ say?: string, head?: string[], rows?: any[][], lines?: [string, ArrayLike<number>][], across?: string, walks?: [string, any[]][], at?: number, views?: any[] }} Outcome
 * @typedef {{ ask?: string, label?: string, now?: boolean, code?: string, answer?: string, name?: string, go: (given: { lone: any, own: any, show: (outcome: Outcome) => void }) => Outcome | Promise<Outcome> }} Experiment
 * @type {Record<string, Experiment>}
 */
export const EXPERIMENTS = {
  updated: {
    ask: "Write the update:",
    name: "updated", code: "function updated(estimate, reward, n) {\n  // Return the estimate after the n-th visit.\n  return 0;\n}",
    answer: "function updated(estimate, reward, n) {\n  return estimate + (reward - estimate) / n;\n}",
    go({ own }) {
      const rows = [], rewards = [1, 0, 0, 1];
      rewards.reduce((estimate, reward, k) => {
        const found = own(estimate, reward, k + 1), right = mean(rewards.slice(0, k + 1));
        must(Math.abs(found - right) < 1e-9, `After visit ${k + 1}, the mean of ${rewards.slice(0, k + 1).join(", ")} is ${worded(right)}, but your estimate is ${worded(found)}.`);
        rows.push([`after visit ${k + 1}`, found.toFixed(3)]);
        return found;
      }, 0);
      return { say: "Right: after each visit, your estimate is the mean.", rows };
    },
  },
  greedy: {
    go() {
      const { atBest, rewards } = visits({});
      return { head: ["in the last 50 of 500 visits", ""], rows: [["ants at their best place", percent(mean(atBest.slice(-50)))], ["mean reward", mean(rewards.slice(-50)).toFixed(2)]] };
    },
  },
  epsilons: {
    go() {
      const found = [0, 0.01, 0.1, 0.3].map((epsilon) => /** @type {[string, any]} */ ([`ε = ${epsilon}`, visits({ epsilon })]));
      return { head: ["mean reward", "first 50 visits", "last 50"], rows: found.map(([name, { rewards }]) => [name, mean(rewards.slice(0, 50)).toFixed(3), mean(rewards.slice(-50)).toFixed(3)]),
               lines: found.map(([name, { atBest }]) => [name, tens(atBest)]), across: "share of 2000 ants at their best place, over 500 visits" };
    },
  },
  optimism: {
    go: () => ({ head: ["first estimate", "best place, last 50 visits", "mean reward, first 50"], rows: [0, 1, 5].map((initial) => {
      const { atBest, rewards } = visits({ initial, size: 0.1 });
      return [initial, percent(mean(atBest.slice(-50))), mean(rewards.slice(0, 50)).toFixed(2)];
    }) }),
  },
  change: {
    go() {
      const found = [["mean of all rewards", 0], ["step size 0.1", 0.1]].map(([name, size]) => /** @type {[string, Float64Array]} */ ([name, visits({ epsilon: 0.1, size: Number(size), change: 250 }).atBest]));
      const part = (values, from) => percent(mean(values.slice(from, from + 50)));
      return { head: ["at their best place", "just before", "just after", "at the end"], rows: found.map(([name, best]) => [name, part(best, 200), part(best, 250), part(best, 450)]),
               lines: found.map(([name, best]) => [name, tens(best)]), across: "share of 2000 ants at their best place, over 500 visits; the change is in the middle" };
    },
  },
  practice: {
    async go({ lone }) {
      const rows = [];
      for (const initial of [0, 10]) for (const epsilon of [0, 0.1, 0.3, 1]) { await pause(); rows.push([`first estimates ${initial}, ε = ${epsilon}`, ...practice(lone, initial, epsilon)]); }
      return { head: ["20 ants", "deliver in the last 50 episodes", "deliver afterwards, ε = 0", "in steps"], rows };
    },
  },
  choose: { ask: "Write epsilon-greedy choice between five actions (or five places):", name: "choose", code: CHOOSE, answer: CHOSEN, go: ({ own }) => checkChoice(own) },
  sees: {
    now: true,
    go({ lone }) {
      lone.train({ ...LEARNER, epsilon: 1, decay: 1, rate: 0, seeds: [5], episodes: 1, maxSteps: 80, notes: 80 });
      return { walks: [["an ant at random", lone.notes]] };
    },
  },
  observations: {
    go() {
      const names = upTo(128).map(nameOf), number = (name, letter) => name.split(letter).length - 1;
      const possible = (name) => number(name, "Q") + Math.sign(number(name, "S")) <= 1 && !/\sS\s.\sS$/.test(name);
      const rows = [["have a number", names.length], ["can occur", names.filter(possible).length], ...[8, 66, 98, 108].map((k) => [`observation ${k}: ${names[k]}`, possible(names[k]) ? "can occur" : "cannot occur"])];
      return { head: ["observations", ""], rows };
    },
  },
  discount: { go: () => ({ head: ["discount", "10 points after 33 more steps are worth"], rows: [0.5, 0.8, 0.9, 0.95, 0.99].map((gamma) => [gamma, (10 * gamma ** 33).toFixed(2)]) }) },
  markov: {
    go({ lone }) {
      lone.train({ ...LEARNER, epsilon: 1, decay: 1, seeds: [0], episodes: 160, notes: 160 * 600 });
      const trail = (state) => state < CARRIES && viewOf(state).includes(CUE), { notes } = lone;
      const rows = [0, 1, 2].flatMap((action) => [true, false].map((saw) => {
        const found = notes.filter((note, k) => note.state === 0 && note.action === action && (note.step > 0 && trail(notes[k - 1].state)) === saw);
        return [`${ACTS[action]}, ${saw ? "saw a trail just before" : "did not see one"}`, found.length, percent(mean(found.map(({ next }) => Number(trail(next)))))];
      }));
      return { head: ["the ant observes E E E and steps", "steps", "then sees a trail"], rows };
    },
  },
  sweep: {
    ask: "Write a sweep:",
    name: "sweep", code: `function sweep(values, discount, options) {
  // values has 35 numbers; return 35 new ones. options(s) lists the actions
  // of state s, each as [reward, next state]. State 34 is the end, with value 0.
  return values;
}`,
    answer: `function sweep(values, discount, options) {
  return values.map((old, s) => s === 34 ? 0 : Math.max(...options(s).map(([reward, next]) => reward + discount * values[next])));
}`,
    go({ own }) {
      const history = [Array(35).fill(0)], options = (s) => [[FORWARD[s], s + 1], ...(s >= 1 && s <= 16 ? [[1, s - 1]] : [])];
      for (let k = 1; k <= 60; k++) {
        const before = history[k - 1], right = swept(before, 0.9), found = own([...before], 0.9, options);
        must(Array.isArray(found) && found.length === 35, `sweep has to return 35 numbers, but gave ${worded(found)}.`);
        const s = right.findIndex((value, at) => !(Math.abs(value - found[at]) < 1e-9));
        must(s < 0, `In sweep ${k}, the value of state ${s} should become ${worded(right[s])}, but is ${worded(found[s])}.`);
        history.push(found);
      }
      return { say: "Right: all 35 values after each of 60 sweeps.", head: ["sweeps", "the start is worth"], rows: [0, 1, 5, 10, 20, 33, 34, 35, 60].map((k) => [k, history[k][0].toFixed(4)]) };
    },
  },
  values: {
    go({ lone }) {
      lone.train({ ...SARSA, seeds: [0] });
      const table = learned(lone), way = followed(lone, table, 0), entries = way.map(({ state, action }) => table[5 * state + action]);
      let values = Array(35).fill(0);
      for (let k = 0; k < 60; k++) values = swept(values, 0.9);
      return { head: ["step", "observation", "value of the state", "entry of the table"], rows: [0, 8, 15, 16, 17, 25, 33].map((k) => [k, nameOf(way[k].state), values[k].toFixed(2), entries[k].toFixed(2)]),
               lines: [["value of the state", values.slice(0, STEPS_HOME)], ["entry of the table", entries]], across: "over the 34 steps of the shortest way; food is picked up in step 16" };
    },
  },
  episodes: { now: true, go: ({ lone }) => ({ walks: [["three episodes", updates(lone, "q_learning")]], at: 117 }) },
  update: {
    go({ lone }) {
      const notes = updates(lone, "q_learning"), note = notes[117], q = upTo(128).map(() => Array(5).fill(0));
      notes.slice(0, 117).forEach(({ state, action, value }) => { q[state][action] = value; });
      const old = q[note.state][note.action], target = note.reward + 0.9 * Math.max(...q[note.next]), f = (x) => x.toFixed(4);
      return { rows: [["target", `${note.reward} + 0.9 · ${f(Math.max(...q[note.next]))} = ${f(target)}`], ["TD error", `${f(target)} - ${f(old)} = ${f(target - old)}`],
        ["new entry", `${f(old)} + 0.1 · ${f(target - old)} = ${f(old + 0.1 * (target - old))}`], ["entry in the C engine", f(note.value)]] };
    },
  },
  q_learning: {
    ask: "Write the update. The two tables are compared after each step:",
    name: "qLearning", code: `function qLearning(q, s, a, r, sNext, terminated, alpha, gamma) {
  // q[s] is the row of observation s, with five entries. Change q[s][a].
}`,
    answer: `function qLearning(q, s, a, r, sNext, terminated, alpha, gamma) {
  const round = Math.fround; // to 32 bits, after each operation
  const following = terminated ? 0 : round(gamma * Math.max(...q[sNext]));
  const target = round(r + following);
  q[s][a] += round(alpha * round(target - q[s][a]));
}`,
    go: ({ lone, own }) => checkUpdate(own, updates(lone, "q_learning")),
  },
  sarsa: {
    ask: "Exercise 1 as a program: write SARSA’s update. It is compared with the C engine after each step.",
    name: "sarsa", code: `function sarsa(q, s, a, r, sNext, terminated, alpha, gamma, aNext) {
  // aNext is the action that the ant takes next. Change q[s][a].
}`,
    answer: `function sarsa(q, s, a, r, sNext, terminated, alpha, gamma, aNext) {
  const round = Math.fround;
  const following = terminated ? 0 : round(gamma * q[sNext][aNext]);
  q[s][a] += round(alpha * round(round(r + following) - q[s][a]));
}`,
    go: ({ lone, own }) => checkUpdate(own, updates(lone, "sarsa")),
  },
  wrong: {
    go: ({ lone }) => ({ head: ["update", "the comparison fails after"], rows: Object.entries(WRONG).map(([name, update]) => {
      const found = difference(update, updates(lone, "q_learning"));
      return [name, found ? whenOf(found.note) : "no step"];
    }) }),
  },
  policy: {
    go({ lone }) {
      lone.train({ ...LEARNER, seeds: [0], notes: 500 * 600 });
      const table = learned(lone), often = new Map();
      for (const { state } of lone.notes) often.set(state, (often.get(state) || 0) + 1);
      const states = [...often.keys()].sort((a, b) => often.get(b) - often.get(a)).slice(0, 24).sort((a, b) => a - b);
      return { say: "The 24 observations that the ant has met most often in 500 episodes, with its best action. The bars are its five entries: left, forward, right, pick up, deliver.",
               views: states.map((state) => ({ state, values: [...table.slice(5 * state, 5 * state + 5)] })) };
    },
  },
  plan: {
    ask: "Write the planning steps:",
    name: "plan", ...PLAN,
    go({ own }) {
      let step = 0;
      const [, , wanted] = live({ n: 5, seed: 0, steps: 1200, summed: true }), compare = (q, model, n, draw) => {
        own(q, model, n, draw);
        const right = wanted[step++], found = sum(q.flat());
        must(Math.abs(found - right) < 1e-6, `In step ${step}, ${model.length} pairs were stored. After planning, all entries together should be ${worded(right)}, but yours are ${worded(found)}.`);
      };
      live({ n: 5, seed: 0, steps: 1200, plan: compare });
      return { say: "Right: the tables are equal after each of 1200 steps." };
    },
  },
  planning: {
    go() {
      const found = [0, 5, 50].map((n) => upTo(10).map((seed) => live({ n, seed, steps: 3000 })));
      const ends = (runs, k) => mean(runs.map(([, lengths]) => lengths[k])).toFixed(0), food = (runs) => upTo(60).map((k) => mean(runs.map(([eaten]) => eaten[50 * k + 49])));
      return { head: ["planning steps", "first episode", "second", "fifth", "food in 3000 steps"], rows: found.map((runs, k) => [`n = ${[0, 5, 50][k]}`, ...[0, 1, 4].map((e) => ends(runs, e)), food(runs)[59].toFixed(0)]),
               lines: found.map((runs, k) => [`n = ${[0, 5, 50][k]}`, food(runs)]), across: "food found so far, mean of 10 ants, over 3000 steps" };
    },
  },
  moved: {
    go() {
      const found = [0, 5, 50].map((n) => upTo(10).map((seed) => live({ n, seed, steps: 4000, later: "left" })[0])), rows = found.map((runs, k) => {
        const waits = runs.map((eaten) => { const at = eaten.findIndex((food) => food > eaten[1520]); return at < 0 ? 2500 : at - 1500; }).sort((a, b) => a - b);
        return [`n = ${[0, 5, 50][k]}`, (waits[4] + waits[5]) / 2, waits.filter((wait) => wait === 2500).length, mean(runs.map((eaten) => eaten[3999] - eaten[1520])).toFixed(0)];
      });
      return { head: ["planning steps", "first food after (median)", "ants never", "food afterwards"], rows,
               lines: found.map((runs, k) => [`n = ${[0, 5, 50][k]}`, upTo(80).map((at) => mean(runs.map((eaten) => eaten[50 * at + 49])))]), across: "food found so far, mean of 10 ants, over 4000 steps; the wall moves after 1500" };
    },
  },
  opens: {
    go: () => ({ head: ["curiosity", "steps per episode at the end, of each of 10 ants"], rows: [0, 0.001].map((kappa) => [`κ = ${kappa}`, upTo(10).map((seed) => {
      const [, lengths] = live({ n: 10, seed, steps: 6000, wall: "left", later: "both", kappa });
      let end = 0;
      return mean(lengths.filter((length) => (end += length) > 5500));
    }).sort((a, b) => a - b).map((steps) => steps.toFixed(1)).join(", ")]) }),
  },
  dyna: {
    go: ({ lone }) => ({ head: ["planning steps", "steps in episodes 1 to 10", "95 % interval", "in 41 to 50"], rows: [0, 5, 50].map((n) => {
      const { steps } = lone.train({ ...LEARNER, learner: n ? "dyna_q" : "q_learning", planningSteps: n, epsilon: 0.1, decay: 1, seeds: upTo(40), episodes: 50 });
      const part = (from) => upTo(40).map((k) => mean(steps.subarray(50 * k + from, 50 * k + from + 10))), begin = part(0), half = halfOf(begin);
      return [`n = ${n}`, mean(begin).toFixed(0), `${(mean(begin) - half).toFixed(0)} to ${(mean(begin) + half).toFixed(0)}`, mean(part(40)).toFixed(0)];
    }) }),
  },
  two: { go: ({ lone }) => ({ head: ["ant", "return", "steps", "deliveries"], rows: threeAnts(lone).slice(0, 2).map(([name, notes]) => [name, pointsOf(notes), notes.length, notes.filter(({ reward }) => reward === 10).length]) }) },
  maps: { label: "Show the ants", go: ({ lone }) => ({ walks: threeAnts(lone).map(([name, notes]) => [`${name}: return ${pointsOf(notes)}`, notes]) }) },
  discounts: {
    go({ lone }) {
      const ants = threeAnts(lone, 10000), gammas = [0.8, 0.9, 0.95, 0.96, 0.97, 0.99], names = ["A delivers", "B walks the trail", "C circles with food"];
      return { head: ["discount", ...names], rows: gammas.map((gamma) => [gamma, ...ants.map(([, notes]) => discounted(notes, gamma).toFixed(2))]),
               lines: ants.map(([, notes], k) => [names[k], upTo(39).map((g) => discounted(notes, 0.8 + 0.005 * g))]), across: "discounted return, for discounts from 0.8 to 0.99" };
    },
  },
  who: { go: ({ lone, show }) => behaviours(lone, show, [false]) },
  truncates: { go: ({ lone, show }) => behaviours(lone, show, [false, true]) },
  shaping: {
    ask: "Exercise 2 as a program: pay for coming nearer to the queen. Your function is tried on the walks of ants A and C, step by step.",
    name: "pay", code: `function pay(before, after) {
  // The distances from the queen before and after a step with food. Return points.
  return after < before ? 1 : 0; // as in this lesson
}`,
    answer: "function pay(before, after) {\n  return before - after;\n}",
    go({ lone, own }) {
      const [[, a], , [, c]] = threeAnts(lone), paid = (notes, from, to) => sum(upTo(to - from).map((k) => {
        const points = own(fromQueen(notes[from + k].cell), fromQueen(notes[from + k + 1].cell));
        must(Number.isFinite(points), `pay has to return a number, but gave ${worded(points)}.`);
        return points;
      }));
      const begin = a.findIndex(({ reward }) => reward === 3), home = paid(a, begin, a.length - 1);
      for (let k = c.findIndex(({ reward }) => reward === 3); k < c.length; k++) {
        const back = c.findIndex(({ cell }, j) => j > k + 1 && cell === c[k].cell);
        if (back < 0) continue;
        const points = paid(c, k, back);
        must(Math.abs(points) < 1e-9, `From step ${k} to step ${back}, ant C walks a circle and ends where it began, but your function pays it ${worded(points)}. Can you take back what the steps towards her have paid?`);
      }
      must(home > 0, `Ant A carries its food home, and your function pays it ${worded(home)}. Can it be paid for coming nearer?`);
      return { say: `Right: no circle of ant C pays, and ant A earns ${worded(home)} on its way home.` };
    },
  },
  lucky: {
    go({ lone }) {
      const random = new Random(0), [q, sarsa] = speeds(lone), drawn = (steps, n) => { let all = 0; for (let k = 0; k < n; k++) all += steps[random.below(1000)]; return all; };
      return { say: `Q-learning ${mean(q).toFixed(0)}, SARSA ${mean(sarsa).toFixed(0)} steps per episode.`, head: ["ants of each", "Q-learning seems faster in"], rows: [1, 2, 5, 10, 20].map((n) =>
        [n, percent(mean(upTo(10000).map(() => Number(drawn(q, n) < drawn(sarsa, n)))), 1)]) };
    },
  },
  intervals: {
    ask: "Write the test of an interval. The experiment uses it 16 000 times:",
    name: "contains", code: "function contains(low, high, truth) {\n  // Return true if the interval from low to high contains the truth.\n}",
    answer: "function contains(low, high, truth) {\n  return low <= truth && truth <= high;\n}",
    go({ lone, own }) {
      for (const [low, high, truth] of [[1, 3, 2], [1, 3, 3], [1, 3, 4], [1, 3, 0]])
        must(Boolean(own(low, high, truth)) === (truth >= low && truth <= high), `The interval from ${low} to ${high} ${truth >= low && truth <= high ? "contains" : "does not contain"} ${truth}, but yours says otherwise.`);
      const { steps } = lone.train({ ...LEARNER, epsilon: 0.1, decay: 1, seeds: upTo(1000), episodes: 50 }), random = new Random(0);
      const ants = upTo(1000).map((k) => [...steps.subarray(50 * k + 40, 50 * k + 50)]), truth = mean(ants.map(mean));
      const holds = (values) => { const half = halfOf(values), middle = mean(values); return own(middle - half, middle + half, truth); };
      return { head: ["ants", "intervals over ants contain the truth in", "intervals over episodes in"], rows: [5, 10, 20, 50].map((n) => {
        let [byAnt, byEpisode] = [0, 0];
        for (let k = 0; k < 2000; k++) {
          const some = upTo(n).map(() => ants[random.below(1000)]);
          byAnt += Number(holds(some.map(mean)));
          byEpisode += Number(holds(some.flat()));
        }
        return [n, percent(byAnt / 2000), percent(byEpisode / 2000)];
      }) };
    },
  },
};

/** Mean steps per episode of 1000 ants of Q-learning and of SARSA. */
function speeds(lone) {
  return ["q_learning", "sarsa"].map((learner) => {
    const { steps } = lone.train({ ...LEARNER, learner, epsilon: 0.1, decay: 1, seeds: upTo(1000), episodes: 50 });
    return upTo(1000).map((k) => mean(steps.subarray(50 * k, 50 * k + 50)));
  });
}
