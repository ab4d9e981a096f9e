/* scenes.js: six questions. Each asks for a prediction, then runs, and answers by what was measured. */

import { PARTS, RULES } from "./engine.js";
import { centre } from "./geometry.js";
import { bold, many, seconds } from "./story.js";
import { SCENE, WORLDS } from "./worlds.js";

const PAID = { ...SCENE, world: WORLDS.findIndex(({ name }) => name === "paper"), ants: 4, rules: RULES.paper, discount: 0.99, level: 250, seed: 8 };
const HOMEWARD = { ...SCENE, rules: RULES.paper };
const MIDDLE = { ...SCENE, seed: 88 };

/** A wall across the lanes of the meadow, as a path of cells: two cells up, one up and left, and so on. */
export function wallPath(length = 13) {
  const R = WORLDS[0].radius, path = [[0, 0]];
  for (let k = 1; k < length; k++) path.push([path[k - 1][0] + (k % 3 ? 1 : 0), path[k - 1][1] - (k % 3 ? 0 : 1)]);
  const [q0, r0] = path[length >> 1];
  return path.map(([q, r]) => (r - r0 - 1 + R) * (2 * R + 1) + q - q0 + 1 + R);
}
const WALL = { tick: 600, do: "rock", reach: 1, path: wallPath() };

/** How much of the traffic in the middle of the bridge takes the left, longer way. */
export function longShare({ engine }) {
  let long = 0, all = 0;
  for (let cell = 0; cell < engine.size; cell++) {
    const [x, y] = centre(engine.q(cell), engine.r(cell));
    if (Math.abs(y) > 12) continue;
    all += engine.traffic[cell];
    if (x < 0) long += engine.traffic[cell];
  }
  return all ? Math.round(100 * long / all) : 0;
}

/**
 * `sides`: one run, or two with the same world and seed; `skip` ticks have passed before the question.
 * `answer` gets what each side delivered and earned since, and says which option was right.
 */
export const QUESTIONS = [
  {
    id: "never", title: "Paid for walking", ticks: 1000, speed: 4,
    ask: "Who brings home more?", options: ["Those paid for each step", "Those paid for food alone"],
    sub: "On both sides, four ants have learned for 20 000 ticks. Food at home pays 10 points. On the right, so does every step along "
      + "scent, or with food nearer to the nest: a helpful hint.",
    sides: [{ label: "paid for food alone", scene: { ...PAID, shaping: 0 }, skip: 20000 },
            { label: "10 points for a step", scene: { ...PAID, shaping: 10 }, skip: 20000 }],
    answer: ([left, right]) => ({
      right: right.food > left.food ? 0 : 1,
      head: right.food > left.food ? "The hint helped." : "They walk for the sake of walking.",
      sub: `Right ${bold(many(right.food))}, left ${bold(many(left.food))} loads; yet right ${bold(many(right.points))}, left `
        + `${bold(many(left.points))} points. They do what they are paid for, and not what was meant.`,
    }),
  },
  {
    id: "copies", title: "Sixty-four copies of a good ant", ticks: 900, speed: 4,
    ask: "64 copies of one good ant. How much food?", options: ["As much as the left", "More", "Far less"],
    sub: "On the left, 64 ants learned together. On the right, one ant learned alone, and now there are 64 copies of it. Nobody learns any more.",
    sides: [{ label: "learned together", scene: SCENE, events: [{ tick: 8000, do: "learns", value: 0 }], skip: 8000 },
            { label: "64 copies", scene: { ...SCENE, ants: 1 }, skip: 20000,
              events: [{ tick: 20000, do: "learns", value: 0 }, { tick: 20000, do: "ants", value: 64 }] }],
    answer: ([left, right]) => {
      const share = right.food / Math.max(1, left.food);
      return { right: share > 1.25 ? 1 : share < 0.75 ? 2 : 0, head: share < 0.75 ? "Copies jam." : `${many(right.food)} loads.`,
               sub: `Right ${bold(many(right.food))}, left ${bold(many(left.food))} loads. The one ant never met another, so none of its copies `
                 + "knows how to pass one." };
    },
  },
  {
    id: "home", title: "The trail that points home", ticks: 1000, speed: 4,
    ask: "Where does a trail lead?", options: ["Left brings more", "Both the same", "Right brings more"],
    sub: "Ants with food lay scent. On the left, it is strongest where the ant is now; on the right, where it found the food. All else is equal.",
    sides: [{ label: "strongest at the ant", scene: HOMEWARD }, { label: "strongest at the food", scene: { ...HOMEWARD, rules: PARTS.directed } }],
    answer: ([left, right]) => {
      const ratio = right.food / Math.max(1, left.food);
      return { right: ratio > 1.25 ? 2 : ratio < 0.8 ? 0 : 1, head: ratio > 1.25 ? "The left trail points home." : "It hardly mattered.",
               sub: `Right: ${bold(`${ratio.toFixed(1)} times as much`)} food. On the left, an ant that follows the scent uphill walks after ants with food, `
                 + "to the nest, where no food is." };
    },
  },
  {
    id: "bridge", title: "The double bridge", ticks: 2000, speed: 4,
    ask: "Two ways. Which one will they take?", options: ["Mostly the short one", "About half each", "Mostly the long one"],
    sub: "The way on the left is longer. No ant sees further than one cell, and none has seen both ways.",
    sides: [{ scene: { ...SCENE, world: WORLDS.findIndex(({ name }) => name === "bridge"), ants: 24 } }],
    answer: (results, [run]) => {
      const share = longShare(run);
      return { right: share < 40 ? 0 : share > 60 ? 2 : 1,
               head: share < 40 ? "Most take the short way." : share > 60 ? "Most take the long way." : "They use both ways.",
               sub: `Of the ants with food, ${bold(`${share} %`)} take the long one. They feel where home is: even without scent, `
                 + "most of them take the short way. Real ants were asked in 1989. Do 64 ants choose the same? Try it." };
    },
  },
  {
    id: "wall", title: "A wall in mid-learning", ticks: 1000, speed: 4,
    ask: "Who finds a way round?", options: ["Those that still learn", "Those that stopped", "Both alike"],
    sub: "A wall has just been drawn across both lanes. At the same moment, the ants on the right stop learning.",
    sides: [{ label: "still learn", scene: MIDDLE, events: [WALL], skip: 600 },
            { label: "learn nothing more", scene: MIDDLE, events: [WALL, { tick: 600, do: "learns", value: 0 }], skip: 600 }],
    answer: ([left, right]) => {
      const ratio = left.food / Math.max(1, right.food);
      return { right: ratio > 1.25 ? 0 : ratio < 0.8 ? 1 : 2, head: ratio > 1.25 ? "It pays to go on learning." : "They know enough.",
               sub: `Left ${bold(many(left.food))}, right ${bold(many(right.food))} loads. What was right before the wall is wrong behind it: `
                 + "ants that learn give up pushing against it." };
    },
  },
  {
    id: "halves", title: "Two halves, one difference", ticks: 900, speed: 4,
    ask: "Does it help to try things out?", options: ["Right brings more", "Both the same", "Left brings more"],
    sub: "Same world, same seed. Only one setting differs: on the right, every fifth step is random.",
    sides: [{ label: "3 % random steps", scene: SCENE }, { label: "20 % random steps", scene: { ...SCENE, epsilon: 0.2 } }],
    answer: ([left, right]) => {
      const ratio = right.food / Math.max(1, left.food);
      return { right: ratio > 1.1 ? 0 : ratio < 0.9 ? 2 : 1, head: ratio > 1.1 ? "Random steps pay." : ratio < 0.9 ? "Random steps cost food." : "It hardly matters.",
               sub: `Right ${bold(many(right.food))}, left ${bold(many(left.food))} loads. Random steps find food, and lose the way. `
                 + "Now change any setting." };
    },
  },
];

/** What each run has delivered and earned since the question was asked. */
const resultsOf = (runs) => runs.map((run) => ({ food: run.engine.deliveries - run.total[run.start], points: run.engine.returns - run.earned }));

/** Answer a question by what was measured, at its last tick. */
export function settle(question, runs) {
  const last = runs[runs.length - 1];
  if (last.tick === last.start + question.ticks) question.found ||= question.answer(resultsOf(runs), runs);
}

/** What the page says about a question: before the prediction, while it runs, and after the answer. */
export function questionStory(question, runs) {
  const { id, ask, options, ticks, sides } = question, results = resultsOf(runs), last = runs[runs.length - 1];
  if (question.said < 0) return { id: `ask-${id}`, head: ask, sub: question.sub, options };
  if (!question.found) {
    const left = last.start + ticks - last.tick;
    const food = results.map((result) => bold(many(result.food)));
    const soFar = sides.length > 1 ? `Left ${food[0]}, right ${food[1]} loads of food.` : `${food[0]} loads of food.`;
    return { id: `run-${id}`, head: ask, sub: `You said: ${bold(options[question.said].toLowerCase())}. ${soFar} The answer comes in ${bold(seconds(left / question.speed))}.` };
  }
  const { right, head, sub } = question.found, next = QUESTIONS[(QUESTIONS.findIndex((one) => one.id === id) + 1) % QUESTIONS.length];
  return { id: `answer-${id}`, head, sub: `${right === question.said ? "You were right." : "Not what you said."} ${sub}${sides.length > 1 ? " Settings apply to the right half only." : ""}`,
           options: [`Next: ${next.title.charAt(0).toLowerCase()}${next.title.slice(1)}`, "Back to the first screen"], next };
}
