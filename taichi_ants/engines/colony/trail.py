"""Trails of a colony: levels, deposits, evaporation and diffusion.

Integer mode stores the clock at which a trail has evaporated, so that evaporation costs nothing.
Dense mode (exponential evaporation, diffusion) stores levels as f32 and walks over all cells.
"""

import taichi as ti

from taichi_ants.engines.colony.layout import ADDS, FADES, LINEAR, STANDS_WITH_FOOD
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task.constants import EMPTY


@ti.func
def level_of(c: ti.template(), v: ti.template(), place, clock):
    """The trail on a cell: i32, or f32 if dense."""
    return c.level[place] if ti.static(v.dense) else ti.max(c.trail[place] - clock, 0)


@ti.func
def level_in_view(c: ti.template(), v: ti.template(), place, clock):
    """The trail that an ant can see in a cell: 0 unless the cell is empty."""
    # Always read, never branch: most cells are empty, and nobody can predict which.
    return ti.select(c.ground[place] & 15 == EMPTY, level_of(c, v, place, clock), 0)


@ti.func
def level_that_counts(c: ti.template(), v: ti.template(), place, clock):
    """The trail of a cell in view for the strongest one, 0 where it does not count."""
    level = level_in_view(c, v, place, clock)
    if ti.static(v.view == "strongest_under_carriers"):
        carrier = c.ground[place] >> 4 == STANDS_WITH_FOOD
        level = ti.select(carrier, level_of(c, v, place, clock), level)
    return level


@ti.func
def deposit(c: ti.template(), v: ti.template(), place, clock, carried):
    """Lay the trail of an ant that has carried its food for so many ticks, as the task says."""
    if c.deposits != 0:
        laid = c.deposit_level
        if c.deposits == ADDS:
            laid = ti.min(level_of(c, v, place, clock) + laid, c.cap)
        elif c.deposits == FADES:
            laid -= c.slope * ti.min(carried, c.fades_after)
            laid = ti.max(level_of(c, v, place, clock), laid)
        if ti.static(v.dense):
            c.level[place] = laid
        else:
            c.trail[place] = clock + laid


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
def diffuse(c: ti.template(), place):
    """Compute the level of a cell after one tick of diffusion.

    The share that is aimed at a wall stays.
    """
    if c.share > 0.0:
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
        c.spare[place] = level


@ti.func
def settle(c: ti.template(), place):
    """Take over what `diffuse` has computed for all cells."""
    if c.share > 0.0:
        c.level[place] = c.spare[place]
