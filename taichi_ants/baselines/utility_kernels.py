"""The kernels of ants that back up utilities: a task a colony, whose ants move one after the other.

Cells are the n open ones of a world. Goal 0 is the nest, goal 1 is food. Headings of which an ant
takes one are bits of a number.
"""

import taichi as ti

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task.rules.random_bits import advance, below, bits_of, high_word, low_word

f64_3d = ti.types.ndarray(dtype=ti.f64, ndim=3)
i32_2d = ti.types.ndarray(dtype=ti.i32, ndim=2)
i32_3d = ti.types.ndarray(dtype=ti.i32, ndim=3)
u64_2d = ti.types.ndarray(dtype=ti.u64, ndim=2)

NEST, FOOD = 0, 1
CELL, HEADING, ORIGIN = 0, 1, 2  # of an ant, which comes from one goal and looks for the other


@ti.func
def best_headings(neighbours: ti.template(), utilities: ti.template(), colony, goal, cell, among):
    """The headings with the highest utility among some, and this utility; 0 and -1 for none."""
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
    """One of these headings at random; -1 if there is none."""
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
    """Let the ticks from `first` to before `last` pass in all colonies, see `utility.forage`.

    `goals` (2, n) are 1 where a goal is; a tick leaves the share `kept` of all utilities. Moves the
    streams `states` on, one draw an ant and tick; changes the `ants` (colonies, ants, 3): cell,
    heading, the goal that the ant comes from; how many are `standing` in each cell; and the
    `utilities` (colonies, 2, n). Writes `deliveries` (colonies, ticks).
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
    """Walk from the nest to food and back, always to the highest utility, in all colonies.

    Writes the steps of the way out and back, 0 if there is none, into column `span` of `lengths`.
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
