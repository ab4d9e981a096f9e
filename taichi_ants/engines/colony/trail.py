"""Trails of a colony: levels, deposits, evaporation and diffusion.

Integer mode stores the clock at which a trail has evaporated, so that evaporation costs nothing.
Dense mode (exponential evaporation, diffusion) stores levels as f32 and walks over all cells.
"""

import taichi as ti

from taichi_ants.engines.colony.layout import STANDS_WITH_FOOD
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task.constants import EMPTY

LINEAR = -1.0  # the value of `decay` that stands for linear evaporation in dense mode


@ti.func
def level_of(c: ti.template(), v: ti.template(), place, clock):
    """The trail on a cell: i32, or f32 if dense."""
    level = 0.0 if ti.static(v.dense) else 0
    if ti.static(v.dense):
        level = c.level[place]
    else:
        level = ti.max(c.trail[place] - clock, 0)
    return level


@ti.func
def level_in_view(c: ti.template(), v: ti.template(), place, clock):
    """The trail that an ant can see in a cell: 0 unless the cell is empty."""
    # Always read, never branch: most cells are empty, and nobody can predict which.
    return ti.select(c.ground[place] & 15 == EMPTY, level_of(c, v, place, clock), 0)


@ti.func
def level_that_counts(c: ti.template(), v: ti.template(), place, clock):
    """The trail of a cell in view for the strongest one: 0 where it does not count."""
    level = level_in_view(c, v, place, clock)
    if ti.static(v.view == "strongest_under_carriers"):
        carrier = c.ground[place] >> 4 == STANDS_WITH_FOOD
        level = ti.select(carrier, level_of(c, v, place, clock), level)
    return level


@ti.func
def deposit(c: ti.template(), v: ti.template(), place, clock, carried):
    """Lay the trail of an ant that has carried its food for so many ticks on a cell."""
    if ti.static(v.dense):
        if c.adds == 1:
            laid = c.level[place] + ti.cast(c.deposit_level, ti.f32)
            c.level[place] = ti.min(laid, ti.cast(c.cap, ti.f32))
        elif c.adds == 0:
            c.level[place] = ti.cast(c.deposit_level, ti.f32)
        elif c.adds == 2:
            fresh = ti.cast(c.deposit_level - c.slope * ti.min(carried, c.fades_after), ti.f32)
            c.level[place] = ti.max(c.level[place], fresh)
    elif c.adds == 1:
        c.trail[place] = clock + ti.min(ti.max(c.trail[place] - clock, 0) + c.deposit_level, c.cap)
    elif c.adds == 0:
        c.trail[place] = clock + c.deposit_level
    elif c.adds == 2:
        fresh = c.deposit_level - c.slope * ti.min(carried, c.fades_after)
        c.trail[place] = ti.max(c.trail[place], clock + fresh)


@ti.func
def evaporate(c: ti.template(), place):
    """One tick of evaporation of a cell in dense mode."""
    level = c.level[place]
    if c.decay == LINEAR:
        level = ti.max(level - 1.0, 0.0)
    elif c.decay < 1.0:
        level *= c.decay
        if level < 1.0:
            level = 0.0
    c.level[place] = level


@ti.func
def diffused(c: ti.template(), place):
    """The level of a cell after one tick of diffusion; the share aimed at a wall stays."""
    level = c.level[place]
    if c.walls[place] == 0:
        n_open, received = 0.0, 0.0
        for heading in ti.static(range(N_HEADINGS)):
            neighbour = place + c.compass[heading + 1]
            if c.walls[neighbour] == 0:
                n_open += 1.0
                received += c.level[neighbour] * c.share
        # At rate 1 all is given away, and rounding could leave less than nothing.
        level = ti.max(level - level * c.share * n_open + received, 0.0)
    return level
