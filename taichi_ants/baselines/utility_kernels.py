"""The kernels of ants that back up utilities: a task a colony.

Cells are the n open ones of a world. A colony has two utilities of each cell, those of the nest and
of food. Its ants move one after the other.
"""

import taichi as ti

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task.rules.random_bits import advance, below, bits_of, high_word, low_word

f64_3d = ti.types.ndarray(dtype=ti.f64, ndim=3)
i32_1d = ti.types.ndarray(dtype=ti.i32, ndim=1)
i32_2d = ti.types.ndarray(dtype=ti.i32, ndim=2)
i32_3d = ti.types.ndarray(dtype=ti.i32, ndim=3)
u64_2d = ti.types.ndarray(dtype=ti.u64, ndim=2)

NEST, FOOD = 0, 1  # whose utility it is
CELL, HEADING, CARRIES = 0, 1, 2  # what is known of an ant


@ti.func
def highest(neighbours: ti.template(), utilities: ti.template(), colony, goal, cell):
    """The highest utility of the cells around."""
    level = ti.f64(0.0)
    for h in ti.static(range(N_HEADINGS)):
        if neighbours[cell, h] >= 0:
            level = ti.max(level, utilities[colony, goal, neighbours[cell, h]])
    return level


@ti.func
def drawn_heading(options, word):
    """One of the headings whose bit is set, -1 if none is."""
    left = 0
    for h in ti.static(range(N_HEADINGS)):
        left += (options >> h) & 1
    left = below(word, left)
    chosen = -1
    for h in ti.static(range(N_HEADINGS)):
        if (options >> h) & 1:
            if left == 0:
                chosen = h
            left -= 1
    return chosen


@ti.func
def next_heading(
    neighbours: ti.template(),
    utilities: ti.template(),
    standing: ti.template(),
    colony,
    goal,
    cell,
    heading,
    nest,
    capacity,
    exploration,
    momentum,
    bits,
):
    """Where an ant goes on that looks for a goal; -1 if no cell around has room."""
    chance = ti.cast(high_word(bits), ti.f64) / 4294967296.0
    ahead = (1 << (heading + 5) % 6) | (1 << heading) | (1 << (heading + 1) % 6)
    free, options, best = 0, 0, ti.f64(-1.0)
    for h in ti.static(range(N_HEADINGS)):
        there = neighbours[cell, h]
        if there >= 0:
            if there == nest or standing[colony, there] < capacity:
                free |= 1 << h
                level = utilities[colony, goal, there]
                if level > best:
                    best, options = level, 0
                if level == best:
                    options |= 1 << h
    if best > 0.0 and chance < exploration:
        options = free
    else:
        if options & ahead:
            options &= ahead
        if best == 0.0 and chance < momentum:  # nothing to follow
            if options & (1 << heading):
                options = 1 << heading
    return drawn_heading(options, low_word(bits))


@ti.kernel
def live(
    neighbours: i32_2d,
    is_food: i32_1d,
    nest: ti.i32,
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
    """Let some ticks pass in all colonies.

    Args:
        neighbours: (n, 6), the neighbour of each cell, -1 where there is none.
        is_food: (n,), 1 where there is food.
        nest: The queen's cell, which has room for all.
        capacity: Ants that fit into any other cell.
        discount: Of what is backed up.
        kept: The share of all utilities that a tick leaves.
        exploration: The probability of a random step, where there is something to follow.
        momentum: The probability to go straight on, where there is not.
        first: The first tick.
        last: The tick after the last one.
        states: (colonies, ants) random streams, moved on; one draw an ant and tick.
        ants: (colonies, ants, 3), changed: cell, heading, whether it carries food.
        standing: (colonies, n), changed: how many ants stand in each cell.
        utilities: (colonies, 2, n), changed: those of the nest and of food.
        deliveries: (colonies, ticks), written: foods that come to the nest in each tick.
    """
    ti.loop_config(block_dim=1)
    for colony in range(states.shape[0]):
        for tick in range(first, last):
            delivered = 0
            for ant in range(states.shape[1]):
                cell, carries = ants[colony, ant, CELL], ants[colony, ant, CARRIES]
                # An ant backs up what it comes from, and looks for the other one.
                reward = ti.cast(cell == nest, ti.f64)
                if carries == 1:
                    reward = ti.cast(is_food[cell], ti.f64)
                level = discount * highest(neighbours, utilities, colony, carries, cell)
                utilities[colony, carries, cell] = ti.max(
                    utilities[colony, carries, cell], reward + level
                )
                state = advance(states[colony, ant])
                states[colony, ant] = state
                heading = next_heading(
                    *(neighbours, utilities, standing, colony, 1 - carries),
                    *(cell, ants[colony, ant, HEADING], nest, capacity),
                    *(exploration, momentum, bits_of(state)),
                )
                if heading >= 0:
                    there = neighbours[cell, heading]
                    standing[colony, cell] -= 1
                    standing[colony, there] += 1
                    ants[colony, ant, CELL] = there
                    ants[colony, ant, HEADING] = heading
                    if carries == 0 and is_food[there] == 1:
                        ants[colony, ant, CARRIES] = 1
                    if carries == 1 and there == nest:
                        ants[colony, ant, CARRIES] = 0
                        delivered += 1
            deliveries[colony, tick] = delivered
            for goal, cell in ti.ndrange(2, utilities.shape[2]):
                utilities[colony, goal, cell] *= kept


@ti.func
def walk(
    neighbours: ti.template(),
    is_food: ti.template(),
    utilities: ti.template(),
    colony,
    goal,
    start,
    nest,
):
    """Steps of the greedy walk to a goal, and where it ends; -1 steps if it does not get there."""
    cell, steps, arrived = start, 0, 0
    while arrived == 0 and steps >= 0:
        best, there = ti.f64(0.0), -1
        for h in ti.static(range(N_HEADINGS)):
            around = neighbours[cell, h]
            if around >= 0:
                if utilities[colony, goal, around] > best:
                    best, there = utilities[colony, goal, around], around
        steps += 1
        if there < 0 or steps > neighbours.shape[0]:  # nothing to follow, or a circle
            steps = -1
        else:
            cell = there
            arrived = ti.cast(cell == nest, ti.i32)
            if goal == FOOD:
                arrived = is_food[cell]
    return steps, cell


@ti.kernel
def measure(
    neighbours: i32_2d,
    is_food: i32_1d,
    nest: ti.i32,
    utilities: f64_3d,
    span: ti.i32,
    lengths: i32_2d,
):
    """Walk from the nest to food and back, always to the highest utility, in all colonies.

    Args:
        neighbours: As of `live`.
        is_food: As of `live`.
        nest: As of `live`.
        utilities: As of `live`.
        span: The column of `lengths`.
        lengths: (colonies, spans), written: steps of the way out and back; 0 if there is none.
    """
    ti.loop_config(block_dim=1)
    for colony in range(lengths.shape[0]):
        out, food = walk(neighbours, is_food, utilities, colony, FOOD, nest, nest)
        back = -1
        if out > 0:
            back, _ = walk(neighbours, is_food, utilities, colony, NEST, food, nest)
        lengths[colony, span] = ti.select(back > 0, out + back, 0)
