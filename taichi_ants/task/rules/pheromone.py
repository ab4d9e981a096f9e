"""How trails are laid, evaporate and spread.

Trails that fall by 1 per tick, or stay, are stored as expiry clocks: the clock (i32, it advances by
1 per tick, or stands still without evaporation) at which the level becomes 0. Their evaporation
costs nothing. All others are stored as levels (f32), and change in every cell each tick.
"""

import taichi as ti

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task.pheromone import DEPOSITS, LINEAR

SET, ADD, FADING, NONE = range(len(DEPOSITS))


@ti.func
def level_left(expiry, clock):
    """The level of a trail that is stored as an expiry clock."""
    return ti.max(expiry - clock, 0)


@ti.func
def level_after_deposit(p: ti.template(), kind: ti.template(), level, carried):
    """The level of a cell on which an ant that has `carried` food for so many ticks lays its trail.

    `p` has `Pheromone.numbers`; `kind` is SET, ADD, FADING or NONE; `level` is that before.
    """
    after = level
    if kind == SET:
        after = p.deposit_level
    elif kind == ADD:
        after = ti.min(level + p.deposit_level, p.cap)
    elif kind == FADING:
        after = ti.max(level, p.deposit_level - p.slope * ti.min(carried, p.fades_after))
    return after


@ti.func
def evaporated(level, decay):
    """A level (f32) after a tick; `decay` is the factor of exponential evaporation, or LINEAR."""
    after = level
    if decay == LINEAR:
        after = ti.max(level - 1.0, 0.0)
    elif decay < 1.0:
        after = level * decay
        if after < 1.0:
            after = 0.0
    return after


@ti.func
def diffused(levels: ti.template(), walls: ti.template(), compass: ti.template(), place, share):
    """The level (f32) of a cell after each cell has given `share` to each of its neighbours.

    The share that is aimed at a wall stays.
    """
    level = levels[place]
    if walls[place] == 0:
        n_open, received = 0.0, 0.0
        for heading in ti.static(range(N_HEADINGS)):
            neighbour = place + compass[heading + 1]
            if walls[neighbour] == 0:
                n_open += 1.0
                received += levels[neighbour] * share
        # At rate 1 all is given away, and rounding could leave less than nothing.
        level = ti.max(level - level * share * n_open + received, 0.0)
    return level
