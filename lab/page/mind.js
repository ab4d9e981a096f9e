/* mind.js: what the ants have learned: states of their table, drawn as the three cells that an ant sees. */

import { ACTIONS } from "./engine.js";
import { LOOKS } from "./looks.js";

/* Codes of a cell: empty, obstacle, trail or way home, food or queen, promising ant, other ant, queue. */
const OBSTACLE = 1, LURE = 2, GOAL = 3, PROMISING = 4, QUEUE = 6;
const SITUATIONS = [     // words, and the views they mean
  { name: "Nothing in view", fits: (load, l, a, r) => !load && !l && !a && !r },
  { name: "Food in front", fits: (load, l, a) => !load && a === GOAL },
  { name: "Scent ahead", fits: (load, l, a, r) => !load && a === LURE && l !== GOAL && r !== GOAL },
  { name: "A rock ahead", fits: (load, l, a, r) => !load && a === OBSTACLE && l !== GOAL && r !== GOAL },
  { name: "An ant with food comes", fits: (load, l, a) => !load && a === PROMISING },
  { name: "With food: nearer home", fits: (load, l, a, r) => load && a === LURE && l < GOAL && r < GOAL },
  { name: "With food: an ant in the way", fits: (load, l, a) => load && a === PROMISING },
  { name: "With food: at the nest", fits: (load, l, a, r) => load && [l, a, r].includes(GOAL) },
];
const CELLS = [[-26, 22], [0, 7], [26, 22]];
const HEXAGON = "M-15,0 -7.5,-13 7.5,-13 15,0 7.5,13 -7.5,13Z";

/** A view and its five values, as a drawing. @param {number[]} view load, and three codes */
export function glyph(view, values, look) {
  const [load, ...codes] = view;
  const low = Math.min(...values), high = Math.max(...values), same = high - low < 1e-6;
  const cells = codes.map((code, k) => {
    const fill = code === OBSTACLE ? look.rock : code !== LURE ? "transparent" : load ? look.nestGlow : look.scentBrush;
    const goal = code === GOAL ? `<circle r="6.5" fill="${load ? look.nest : look.load}"/>` : "";
    const carried = (code === QUEUE) === Boolean(load) ? `<circle cy="-7" r="3" fill="${look.load}"/>` : "";
    const ant = code > GOAL ? `<ellipse rx="4" ry="6.5" fill="${look.ant}"/>${carried}` : "";
    return `<g transform="translate(${CELLS[k]})"><path d="${HEXAGON}" fill="${fill}" stroke="var(--line)"/>${goal}${ant}</g>`;
  });
  const self = `<g transform="translate(0 39)"><ellipse cy="3.5" rx="3.4" ry="5" fill="${look.ant}"/><circle cy="-4" r="3" fill="${look.ant}"/>`
    + `${load ? `<circle cy="-9" r="3.4" fill="${look.load}"/>` : ""}</g>`;
  const bars = values.map((v, k) => {
    const tall = 3 + 20 * (same ? 0.5 : (v - low) / (high - low)), best = !same && v === high;
    const colour = best ? "var(--accent)" : "var(--soft)";
    return `<rect x="${-46 + 19 * k}" y="${78 - tall}" width="14" height="${tall}" rx="2.5" fill="${colour}" opacity="${best ? 1 : 0.5}"/>`
      + `<text x="${-39 + 19 * k}" y="89" text-anchor="middle" font-size="9" fill="${colour}">${"↖↑↗⤒⤓"[k]}</text>`;
  });
  return `<svg viewBox="-52 -12 104 104" aria-hidden="true">${cells.join("")}${self}${bars.join("")}</svg>`;
}

/** How often each action was the best one in the states that fit, weighted by visits; and a state to show. */
function summaryOf(run, fits) {
  const e = run.engine, often = [0, 0, 0, 0, 0], shown = [-1, -1, -1, -1, -1];
  let any = -1;
  for (let state = 0; state < run.visits.length; state++) {
    if (!fits(...e.codesOf(state))) continue;
    if (any < 0) any = state;
    if (!run.visits[state]) continue;
    const values = e.valuesOf(state), best = values.indexOf(Math.max(...values));
    often[best] += run.visits[state];
    if (shown[best] < 0 || run.visits[state] > run.visits[shown[best]]) shown[best] = state;
  }
  const met = often.reduce((a, b) => a + b), top = often.indexOf(Math.max(...often));
  return any < 0 ? null : { top, share: met ? Math.round(100 * often[top] / met) : -1, state: met ? shown[top] : any };
}

const REASONS = { best: "its value is the highest", tie: "several are equally good", explores: "it explores: a random action" };

function antCard(run, ant, look) {
  const mind = run.engine.mind(ant), words = mind.best.length > 3 ? "any action" : mind.best.map((k) => ACTIONS[k]).join(" or ");
  return `<div class="one card"><h3>Ant ${ant}, ${mind.carries ? "with" : "without"} food. It sees:</h3>`
    + glyph(run.engine.codesOf(mind.state), mind.values, look)
    + `<div class="does">${mind.why === "explores" ? ACTIONS[mind.next] : words} <span>${REASONS[mind.why]}</span></div></div>`;
}

/** The markup of the panel: the mind of the followed ant, then what the table says in eight situations. */
export function mindOf(run, ui) {
  const look = LOOKS[ui.theme], e = run.engine;
  const cards = SITUATIONS.map(({ name, fits }) => {
    const found = summaryOf(run, fits);
    if (!found) return "";
    const does = found.share < 0 ? '<div class="does none">never met</div>'
      : `<div class="does">${ACTIONS[found.top]} <span>${found.share} %</span></div>`;
    return `<div class="card"><h3>${name}</h3>${glyph(e.codesOf(found.state), e.valuesOf(found.state), look)}${does}</div>`;
  });
  const own = ui.followed >= 0 && ui.followed < e.ants ? antCard(run, ui.followed, look)
    : "<p>Click an ant with the eye to see what it sees, and why it does what it does.</p>";
  return `${own}<p>All ants share one table: for each view, the value of each action (bars: left, on, right, pick up, give). `
    + `Below: the action that is best most often in such views, and its share of the times that ants met them.</p>${cards.join("")}`;
}
