/* engine.js: ants in WebAssembly. It needs no DOM, so that workers and Node can use it as well.
 *
 * COLONIES (colony.wasm)
 *   const module = await WebAssembly.compile(bytes)       // once
 *   const engine = new Engine(module, scene, events?)     // starts; takes 3 ms
 *   scene: see SCENE in worlds.js; new Engine(module, { ...SCENE, rules: RULES.foraging, seed: 7 })
 *   events: what to replay, as `decode` of link.js returns it; see `apply`
 *
 *   engine.pass(ticks)    events of a replay are applied on the way, each at its tick
 *   engine.apply(event)   a change between two ticks, which is recorded in `engine.events`:
 *     { do: "rock" | "food" | "scent" | "erase", reach: 0..7, path: [cells] }
 *       a stroke: all cells within `reach` of a path of adjacent cells. While a visitor draws, apply
 *       the new cells of each frame as an event of its own, without the last cell of the one before.
 *     { do: "ants" | "epsilon" | "rate" | "discount" | "level" | "shaping" | "learns", value }
 *       `level` is how long new scent lasts, in ticks; `learns` is 0 or 1
 *   engine.forget()       drops the rest of a replay, when the visitor acts
 *   engine.tick, .ants, .deliveries, .returns, .moves, .blocked
 *   engine.changed        true after ground has changed by `apply`; the page sets it to false
 *   engine.hash()         16 hexadecimal digits: two engines with the same hash have the same state
 *
 * A frame is in these arrays after each `pass` and `apply`; they keep their place in memory:
 *   by cell: ground (EMPTY, ROCK, FOOD, QUEEN; ants stand on ROCK), levels (0..255 of the scent),
 *            traffic (carriers of the last ticks, fading by 1 %)
 *   by ant:  cells, before, before2 (cells now, one and two ticks ago), headings (0..5),
 *            looks (carries | event << 1 | action << 4; see EVENTS and ACTIONS), states (see `mind`)
 *   by state: values (8 floats each, the first 5 are those of ACTIONS)
 *
 *   engine.mind(ant)      what an ant sees and will do: { carries, codes: [left, forward, right],
 *                         levels: [...], state, values: [5], best: [actions], next, why }
 *                         `codes` index LETTERS; `why` is "best", "tie" or "explores"
 *   engine.policy(cell, heading, carries)   { state, values, best } of an ant that would stand there
 *
 * CELLS are numbers: engine.at(q, r), engine.q(cell), engine.r(cell), engine.exists(q, r),
 *   engine.disc(cell, reach), engine.line(from, to); STEPS[heading] is the step (q, r) to a neighbour.
 *
 * LONE ANTS (ant.wasm)
 *   const lone = new LoneAnts(module)
 *   lone.train({ learner, rate, discount, epsilon, decay, planningSteps, truncates, seeds, episodes,
 *                maxSteps }) -> { returns, steps, deliveries }, each Int32Array (seeds * episodes);
 *   lone.values   the tables of the last call, Float32Array (seeds * 640)
 *   GRID is the paper's grid, 128 settings for `train`; 100 seeds of one take about 0.15 s
 */
