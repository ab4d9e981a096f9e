/* story.js: what the page says, told by facts that were measured; nothing here is a timer. */

import { TICKS_A_SECOND } from "./run.js";

const UNTOUCHED = 150; // ticks of lanes without a wall until the page offers another thing to try

export const many = (n) => Math.round(n).toLocaleString("en").replace(/,/g, "\u202f");
export const bold = (text) => `<b>${text}</b>`;
const plural = (n, word) => `${bold(many(n))} ${word}${n === 1 ? "" : "s"}`;

/** Ticks as seconds at speed 1. */
export function seconds(ticks) {
  const s = ticks / TICKS_A_SECOND;
  return `${s < 10 ? s.toFixed(1) : many(s)} s`;
}

/**
 * What to tell about a run. `id` changes whenever something has happened.
 * @typedef {{id: string, head: string, sub: string, call?: string, ghost?: boolean, options?: string[]}} Story
 * @returns {Story}
 */
export function storyOf(run) {
  const { facts, wall, gift } = run;
  if (gift && (!wall || gift.tick > wall.last)) return giftStory(run);
  if (wall && wall.crossed) return wallStory(run);
  if (wall && facts.lanes >= 0) {
    return { id: `missed${wall.number}`, head: "You missed their way.", call: "Draw across the lane.", ghost: true,
             sub: "No ant with food passed there in the last seconds. Follow the brightest scent between food and nest." };
  }
  if (facts.lanes >= 0) {
    const each = 200 / Math.max(1, run.sum(200)) / TICKS_A_SECOND;
    return { id: "lanes", head: "Nobody told them the way.", call: "Draw a wall across it.", ghost: true,
             sub: `It took them ${bold(seconds(facts.lanes))}. Now food comes home every ${bold(`${each.toFixed(2)} s`)}`
               + (run.tick - facts.lanes < UNTOUCHED ? ", along scent that they lay themselves."
                 : ". Without learning, hardly any comes: switch Learning off, and start again.") };
  }
  if (facts.firstHome >= 0) {
    const several = run.engine.deliveries > 1;
    return { id: several ? "home" : "home-one", head: several ? "They bring food home." : "One brought food home.",
             sub: `The first, after ${bold(seconds(facts.firstHome))}: 10 points. `
               + `What one ant learns, all ${many(run.engine.ants)} know.` };
  }
  if (facts.firstFood >= 0) {
    const { looks, ants } = run.engine, alone = looks.subarray(0, ants).filter((look) => look & 1).length < 2;
    return { id: alone ? "food-one" : "food", head: alone ? "One has found food." : "They have found food.",
             sub: `The first by chance, after ${bold(seconds(facts.firstFood))}. Picking it up pays 3 points, bringing it home 10. `
               + "What is the nest for? They have to find out." };
  }
  const n = run.engine.ants;
  return { id: "start", head: n === 1 ? "This ant knows nothing." : `These ${many(n)} ants know nothing.`,
           sub: `${n === 1 ? "It is" : "They are"} paid for food brought home. Nobody tells them where to find it, or how.` };
}

function giftStory(run) {
  const { gift } = run;
  if (gift.found < 0) {
    return { id: `gift${gift.number}`, head: "You laid out food.",
             sub: `For ${bold(seconds(run.tick - gift.tick))} now, nobody has noticed. Ants see one cell far.` };
  }
  return { id: `found${gift.number}`, head: `They found your food in ${seconds(gift.found - gift.tick)}.`, call: "Wall it in?",
           sub: `${plural(gift.taken, "load")} ${gift.taken === 1 ? "was" : "were"} taken from it since. `
             + "Ants with food mark the way for the others." };
}

function wallStory(run) {
  const { wall } = run, since = run.tick - wall.last;
  if (wall.detour >= 0) {
    const share = wall.rate ? Math.round(100 * run.sum(200) / wall.rate) : 0;
    const sub = since < 260 ? "Ten loads from behind your wall are home. Nobody told the ants that it is there."
      : wall.compares ? `${share < 100 ? `Now ${bold(`${share} %`)} as much food` : "As much food or more"} comes home as before your wall. Scent shows the others the way round.`
      : `${plural(wall.came, "load")} came round your wall. Scent shows the others the way.`;
    return { id: `detour${wall.number}`, head: `They found a detour in ${seconds(wall.detour - wall.last)}.`, sub,
             call: wall.number > 2 ? "Erase a gap. What do they do?" : "Can you stop them?" };
  }
  if (wall.stopped) {
    return { id: `stopped${wall.number}`, head: "You stopped them.", call: "Erase a gap, and watch.",
             sub: `In ${bold(seconds(since))} only ${plural(wall.came, "load")} from behind the wall came home. `
               + "Ants walk straight for the nest, and a long wall catches them." };
  }
  return { id: `wall${wall.number}`, head: "Their way is blocked.",
           sub: `Since your wall: ${bold(seconds(since))}. Loads that came round it: ${bold(String(wall.came))}. A detour counts from ten.` };
}
