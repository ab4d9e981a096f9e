/* daily.js: a map for each day, the same for everyone: most food in 2000 ticks, with at most ten rocks. */

import { bold, many, seconds } from "./story.js";
import { SCENE, WORLDS } from "./worlds.js";

const DAILY = { ticks: 2000, rocks: 10, reach: 2 };
const WORLD = WORLDS.findIndex(({ daily }) => daily);

/** The date as a seed, like 20261127; UTC, so that all visitors have the same map. */
const seedOf = (date) => Number(date.toISOString().slice(0, 10).replace(/-/g, ""));

/** Whether a run plays the map of a day: its scene has the settings of all, and only rocks were drawn. */
const counts = ({ engine }) => Object.keys(SCENE).every((name) => ["world", "seed"].includes(name) || engine.first[name] === SCENE[name])
  && engine.events.every((event) => event.do === "rock" && event.reach === DAILY.reach && event.path.length === 1)
  && engine.events.length <= DAILY.rocks;

export function beginDaily(lab, seed = seedOf(new Date())) {
  lab.begin([{ scene: { ...SCENE, world: WORLD, seed } }]);
  lab.ui.reach = DAILY.reach;
  lab.choose("rock");
  lab.controls.show();
  lab.play(true);
  if (seed === seedOf(new Date())) lab.address.show("daily");
  else lab.address.save();
}

/** Whether a run is on a daily map. */
export const isDaily = (run) => run.scene.world === WORLD;

/** Whether a run has its result: it waits, so that its link holds the same. */
export const isOver = (run) => isDaily(run) && run.tick >= DAILY.ticks && counts(run);

/** Whether another rock may be drawn; a rock is one click. */
export const mayPlace = (run) => run.tick < DAILY.ticks && run.engine.events.length < DAILY.rocks;

export function dailyStory(run) {
  const used = run.engine.events.length, { seed } = run.scene, date = /^(20\d\d)(0[1-9]|1[0-2])([0-2]\d|3[01])$/;
  const name = seed === seedOf(new Date()) ? "Today’s map" : `The map of ${date.test(String(seed)) ? String(seed).replace(date, "$1-$2-$3") : `seed ${seed}`}`;
  if (!counts(run)) {
    return { id: "daily-free", head: `${name}, played freely.`, sub: "With other settings or strokes, this visit does not count. Start it anew for a result.",
             options: ["Play it by the rules"] };
  }
  if (run.tick >= DAILY.ticks) {
    const food = run.total[DAILY.ticks];
    return { id: "daily-done", head: `${many(food)} loads of food.`, options: ["Try again"],
             sub: `${name}, with ${bold(String(used))} of ${DAILY.rocks} rocks. “Copy link” holds your result: anyone can replay it.` };
  }
  return { id: `daily-${seed}`, head: `${name}. Most food wins.`, call: used < DAILY.rocks ? `${DAILY.rocks - used} rocks left. Click to place one.` : "",
           sub: `${bold(many(run.engine.deliveries))} loads so far; ${bold(seconds(DAILY.ticks - run.tick))} left. Rocks block ants. Where can they help all the same?` };
}
