"""The kernels of ant colony optimisation: the tours of all ants, and what they leave.

Cells are the n open ones of a world. The arc from a cell at a heading is number 6 * cell + heading.
"""

import taichi as ti

from taichi_ants.baselines.goss_kernel import power
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task.rules.random_bits import advance, bits_of, high_word

f64_1d = ti.types.ndarray(dtype=ti.f64, ndim=1)
f64_2d = ti.types.ndarray(dtype=ti.f64, ndim=2)
i32_1d = ti.types.ndarray(dtype=ti.i32, ndim=1)
i32_2d = ti.types.ndarray(dtype=ti.i32, ndim=2)
u64_1d = ti.types.ndarray(dtype=ti.u64, ndim=1)


@ti.func
def next_heading(neighbours: ti.template(), tau: ti.template(), colony, cell, back, alpha, word):
    """Where an ant goes on, by the roulette wheel; straight back only out of a dead end."""
    weights = ti.Vector.zero(ti.f64, N_HEADINGS)
    total = ti.f64(0.0)
    n_ways = 0
    for h in ti.static(range(N_HEADINGS)):
        if neighbours[cell, h] >= 0 and h != back:
            weights[h] = power(tau[colony, N_HEADINGS * cell + h], alpha)
            total += weights[h]
            n_ways += 1
    if total == 0.0:  # in a dead end, or where all has evaporated
        for h in ti.static(range(N_HEADINGS)):
            if neighbours[cell, h] >= 0 and (h != back or n_ways == 0):
                weights[h] = 1.0
                total += 1.0
    left = ti.cast(word, ti.f64) / 4294967296.0 * total
    chosen = -1
    for h in ti.static(range(N_HEADINGS)):
        # Rounding may leave a little at the end; then the last possible heading stays.
        if weights[h] > 0.0 and (chosen < 0 or left >= 0.0):
            chosen = h
            left -= weights[h]
    return chosen


@ti.kernel
def walk(
    neighbours: i32_2d,
    is_food: i32_1d,
    start: ti.i32,
    tau: f64_2d,
    alpha: ti.i32,
    max_steps: ti.i32,
    states: u64_1d,
    place: i32_2d,
    tours: i32_2d,
    lengths: i32_1d,
):
    """Let all ants walk from the start until they come to food, and take the loops out.

    Moves the streams `states` on; writes the arcs of the `tours` (ants, n) and their `lengths`, 0
    for an ant that gave up. `neighbours` are -1 where there is none. Before and after, `place`
    (ants, n) is 0; else 1 + the place in the tour of each cell on it.
    """
    ti.loop_config(block_dim=1)
    for ant in range(states.shape[0]):
        colony = ant // (states.shape[0] // tau.shape[0])
        state = states[ant]
        cell, back, length, step = start, -1, 0, 0
        place[ant, cell] = 1
        while step < max_steps and is_food[cell] == 0:
            state = advance(state)
            heading = next_heading(
                neighbours, tau, colony, cell, back, alpha, high_word(bits_of(state))
            )
            tours[ant, length] = N_HEADINGS * cell + heading
            cell = neighbours[cell, heading]
            back = (heading + 3) % N_HEADINGS
            if place[ant, cell] > 0:  # a loop, which is taken out
                first = place[ant, cell]
                while length >= first:
                    place[ant, tours[ant, length] // N_HEADINGS] = 0
                    length -= 1
                length = first - 1
            else:
                length += 1
                place[ant, cell] = length + 1
            step += 1
        for k in range(length):
            place[ant, tours[ant, k] // N_HEADINGS] = 0
        place[ant, cell] = 0
        place[ant, start] = 0
        lengths[ant] = ti.select(is_food[cell] == 1, length, 0)
        states[ant] = state


@ti.kernel
def lay(
    tau: f64_2d,
    evaporation: ti.f64,
    tours: i32_2d,
    lengths: i32_1d,
    deposits: f64_1d,
    lowest: f64_1d,
    highest: f64_1d,
):
    """Evaporate, add what each ant deposits on each arc of its tour, and keep within bounds."""
    for colony in range(tau.shape[0]):
        n_ants = lengths.shape[0] // tau.shape[0]
        for arc in range(tau.shape[1]):
            tau[colony, arc] *= 1.0 - evaporation
        for ant in range(colony * n_ants, (colony + 1) * n_ants):
            if deposits[ant] > 0.0:
                for k in range(lengths[ant]):
                    tau[colony, tours[ant, k]] += deposits[ant]
        for arc in range(tau.shape[1]):
            tau[colony, arc] = ti.min(ti.max(tau[colony, arc], lowest[colony]), highest[colony])
