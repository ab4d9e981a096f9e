"""The deposit, evaporation and diffusion of trails.

Trails with linear evaporation, or with none, are stored as expiry clocks: the value of the clock at
which the level becomes 0. The clock (i32) advances by 1 per tick, or by 0 without evaporation, so
evaporation costs no time. All other trails are levels (f32), which change in every cell each tick.
"""

import taichi as ti

from taichi_ants.features.pheromone import DEPOSITS, LINEAR
from taichi_ants.grid.constants import N_HEADINGS

SET, ADD, FADING, NONE = range(len(DEPOSITS))


@ti.func
def level_left(expiry, clock):
    """Return the level of a trail that is stored as an expiry clock."""
    return ti.max(expiry - clock, 0)


@ti.func
def level_after_deposit(p: ti.template(), kind: ti.template(), level, carried):
    """Return the level of a cell after the deposit of an ant.

    `p` has `Pheromone.numbers`; `kind` is SET, ADD, FADING or NONE; `level` is the level before;
    `carried` is the number of ticks for which the ant has carried food.
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
    """Return a level (f32) after a tick; `decay` is the exponential factor, or LINEAR."""
    after = level
    if decay == LINEAR:
        after = ti.max(level - 1.0, 0.0)
    elif decay < 1.0:
        after = level * decay
        if after < 1.0:
            after = 0.0
    return after


@ti.func
def diffused(levels: ti.template(), walls: ti.template(), compass: ti.template(), index, share):
    """Return the level (f32) of a cell after each cell has given `share` to each neighbour.

    A cell keeps the shares for walls.
    """
    level = levels[index]
    if walls[index] == 0:
        n_open, received = 0.0, 0.0
        for heading in ti.static(range(N_HEADINGS)):
            neighbour = index + compass[heading + 1]
            if walls[neighbour] == 0:
                n_open += 1.0
                received += levels[neighbour] * share
        # At rate 1 a cell gives everything, and rounding could make the rest negative.
        level = ti.max(level - level * share * n_open + received, 0.0)
    return level
