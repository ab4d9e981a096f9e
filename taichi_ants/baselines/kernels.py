"""The kernels of the published models; cells are indices of the n `open_cells` of a world.

The double bridge and utilities use one parallel task per colony, and ants act one after the other;
colony optimisation uses one task per ant for tours and one per colony for pheromone. The arc from
a cell in the direction of a heading has the index 6 * cell + heading. Sets of headings are bitsets.
"""

import taichi as ti

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task.rules.random_bits import advance, below, bits_of, high_word, low_word

f64_1d = ti.types.ndarray(dtype=ti.f64, ndim=1)
f64_2d = ti.types.ndarray(dtype=ti.f64, ndim=2)
f64_3d = ti.types.ndarray(dtype=ti.f64, ndim=3)
i32_1d = ti.types.ndarray(dtype=ti.i32, ndim=1)
i32_2d = ti.types.ndarray(dtype=ti.i32, ndim=2)
i32_3d = ti.types.ndarray(dtype=ti.i32, ndim=3)
u8_2d = ti.types.ndarray(dtype=ti.u8, ndim=2)
u64_1d = ti.types.ndarray(dtype=ti.u64, ndim=1)
u64_2d = ti.types.ndarray(dtype=ti.u64, ndim=2)

NEST, FOOD = 0, 1  # goals; an ant comes from one and looks for the other
CELL, HEADING, ORIGIN = 0, 1, 2  # columns of `ants`


@ti.func
def power(base, n):
    """Return base ** n, multiplied from the left so that all machines round equally."""
    product = ti.f64(1.0)
    for _ in range(n):
        product *= base
    return product


@ti.kernel
def cross(
    took: u8_2d,
    states: u64_1d,
    short: ti.i32,
    long: ti.i32,
    k: ti.f64,
    n: ti.i32,
    opens: ti.i32,
):
    """Write the choices of all colonies to `took`, see `goss.choices`.

    Arrivals follow from `took`: an ant arrives `short` or `long` steps after its choice. Each step
    takes one draw from the streams `states`: the high word for the nest, the low word for the food.
    Ants that have no choice because of `opens` draw too.
    """
    for colony in range(took.shape[0]):
        state = states[colony]
        marks = ti.Vector([0, 0, 0, 0])  # at the nest: short, long; at the food: short, long
        for step in range(took.shape[1] // 2):
            state = advance(state)
            bits = bits_of(state)
            for end in ti.static(range(2)):
                if step >= short:
                    marks[2 * end] += took[colony, 2 * (step - short) + 1 - end]
                if step >= long:
                    marks[2 * end + 1] += 1 - took[colony, 2 * (step - long) + 1 - end]
                to_short = power(k + marks[2 * end], n)
                to_long = power(k + marks[2 * end + 1], n)
                word = high_word(bits)
                if ti.static(end == 1):
                    word = low_word(bits)
                takes_short = ti.cast(
                    ti.cast(word, ti.f64) * (to_short + to_long) < to_short * 4294967296.0, ti.i32
                )
                if 2 * step + end < opens:
                    takes_short = 0
                marks[2 * end] += takes_short
                marks[2 * end + 1] += 1 - takes_short
                took[colony, 2 * step + end] = ti.cast(takes_short, ti.u8)


@ti.func
def next_heading(neighbours: ti.template(), tau: ti.template(), colony, cell, back, alpha, word):
    """Draw the heading of the next arc by its weight; straight back only out of a dead end."""
    weights = ti.Vector.zero(ti.f64, N_HEADINGS)
    total = ti.f64(0.0)
    n_ways = 0
    for h in ti.static(range(N_HEADINGS)):
        if neighbours[cell, h] >= 0 and h != back:
            weights[h] = power(tau[colony, N_HEADINGS * cell + h], alpha)
            total += weights[h]
            n_ways += 1
    if total == 0.0:  # in a dead end, or if all pheromone has evaporated
        for h in ti.static(range(N_HEADINGS)):
            if neighbours[cell, h] >= 0 and (h != back or n_ways == 0):
                weights[h] = 1.0
                total += 1.0
    left = ti.cast(word, ti.f64) / 4294967296.0 * total
    chosen = -1
    for h in ti.static(range(N_HEADINGS)):
        # If rounding leaves a remainder, the last possible heading is chosen.
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
    """Walk with all ants from the start to food, and write their tours, without loops.

    Advances the streams `states`; writes the arcs of the `tours` (ants, n) and their `lengths`, 0
    for an ant that gave up. Missing `neighbours` are -1. `place` (ants, n) is workspace, 0 before
    and after: 1 + the position in the tour of each cell on it.
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
            if place[ant, cell] > 0:  # remove this loop
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
    """Evaporate, add the deposit of each ant to the arcs of its tour, and clip to the bounds."""
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


@ti.func
def best_headings(neighbours: ti.template(), utilities: ti.template(), colony, goal, cell, among):
    """Return the headings in `among` with the highest utility, and this utility; or 0 and -1."""
    headings, best = 0, ti.f64(-1.0)
    for h in ti.static(range(N_HEADINGS)):
        if neighbours[cell, h] >= 0 and (among >> h) & 1:
            level = utilities[colony, goal, neighbours[cell, h]]
            if level > best:
                headings, best = 0, level
            if level == best:
                headings |= 1 << h
    return headings, best


@ti.func
def one_of(headings, word):
    """Return a random heading of a set; -1 if the set is empty."""
    left = 0
    for h in ti.static(range(N_HEADINGS)):
        left += (headings >> h) & 1
    left = below(word, left)
    chosen = -1
    for h in ti.static(range(N_HEADINGS)):
        if (headings >> h) & 1:
            if left == 0:
                chosen = h
            left -= 1
    return chosen


@ti.kernel
def live(
    neighbours: i32_2d,
    goals: i32_2d,
    capacity: ti.i32,
    discount: ti.f64,
    kept: ti.f64,
    exploration: ti.f64,
    momentum: ti.f64,
    first: ti.i32,
    last: ti.i32,
    states: u64_2d,
    ants: i32_3d,
    standing: i32_2d,
    utilities: f64_3d,
    deliveries: i32_2d,
):
    """Advance all colonies through the ticks range(first, last), see `utility.forage`.

    `goals` (2, n) are 1 in cells of a goal; each tick multiplies all utilities by `kept`. Draws one
    random number per ant and tick from the random streams `states`. Updates `ants` (colonies, ants,
    3), which hold cell, heading and the goal that the ant comes from; the number of ants `standing`
    in each cell; and `utilities` (colonies, 2, n). Writes `deliveries` (colonies, ticks).
    """
    ti.loop_config(block_dim=1)
    for colony in range(states.shape[0]):
        for tick in range(first, last):
            delivered = 0
            for ant in range(states.shape[1]):
                cell, heading = ants[colony, ant, CELL], ants[colony, ant, HEADING]
                origin = ants[colony, ant, ORIGIN]
                _, level = best_headings(neighbours, utilities, colony, origin, cell, 63)
                level = discount * ti.max(level, 0.0)
                utilities[colony, origin, cell] = ti.max(
                    utilities[colony, origin, cell], goals[origin, cell] + level
                )

                free = 0
                for h in ti.static(range(N_HEADINGS)):
                    there = neighbours[cell, h]
                    if there >= 0:
                        if goals[NEST, there] == 1 or standing[colony, there] < capacity:
                            free |= 1 << h
                options, best = best_headings(neighbours, utilities, colony, 1 - origin, cell, free)
                state = advance(states[colony, ant])
                states[colony, ant] = state
                bits = bits_of(state)
                chance = ti.cast(high_word(bits), ti.f64) / 4294967296.0
                if best > 0.0 and chance < exploration:
                    options = free
                else:
                    straight = 1 << heading
                    ahead = straight | 1 << (heading + 5) % 6 | 1 << (heading + 1) % 6
                    if options & ahead:
                        options &= ahead
                    if best == 0.0 and chance < momentum and options & straight:
                        options = straight
                heading = one_of(options, low_word(bits))

                if heading >= 0:
                    there = neighbours[cell, heading]
                    standing[colony, cell] -= 1
                    standing[colony, there] += 1
                    ants[colony, ant, CELL] = there
                    ants[colony, ant, HEADING] = heading
                    if goals[1 - origin, there] == 1:
                        ants[colony, ant, ORIGIN] = 1 - origin
                        delivered += origin
            deliveries[colony, tick] = delivered
            for goal, cell in ti.ndrange(2, utilities.shape[2]):
                utilities[colony, goal, cell] *= kept


@ti.kernel
def measure(
    neighbours: i32_2d,
    goals: i32_2d,
    nest: ti.i32,
    utilities: f64_3d,
    span: ti.i32,
    lengths: i32_2d,
):
    """Measure, in each colony, the path to food and back that always follows the highest utility.

    Writes the number of steps, or 0 without such a path, into column `span` of `lengths`.
    """
    ti.loop_config(block_dim=1)
    for colony in range(lengths.shape[0]):
        cell, goal, steps, left = nest, FOOD, 0, neighbours.shape[0]
        while left > 0:
            options, best = best_headings(neighbours, utilities, colony, goal, cell, 63)
            left -= 1
            if best <= 0.0:  # nothing to follow
                steps, left = 0, 0
            elif left == 0:  # a circle
                steps = 0
            else:
                heading = 0
                while (options >> heading) & 1 == 0:
                    heading += 1
                cell = neighbours[cell, heading]
                steps += 1
                if goals[goal, cell] == 1:
                    left = neighbours.shape[0] if goal == FOOD else 0
                    goal = NEST
        lengths[colony, span] = steps
