"""The trails of a colony: expiry clocks in the array `trail`, or levels in `level` if dense."""

import taichi as ti

from taichi_ants.engines.colony.layout import STANDS_WITH_FOOD
from taichi_ants.task.constants import EMPTY
from taichi_ants.task.rules import pheromone


@ti.func
def level_of(c: ti.template(), v: ti.template(), place, clock):
    """Return the trail of a cell: i32, or f32 if dense."""
    return c.level[place] if ti.static(v.dense) else pheromone.level_left(c.trail[place], clock)


@ti.func
def level_in_view(c: ti.template(), v: ti.template(), place, clock):
    """Return the trail that an ant sees in a cell: 0 unless the cell is empty."""
    # Read without a branch, because the processor cannot predict which cells are empty.
    return ti.select(c.ground[place] & 15 == EMPTY, level_of(c, v, place, clock), 0)


@ti.func
def level_that_counts(c: ti.template(), v: ti.template(), place, clock):
    """Return the trail of a cell, or 0 if it does not count as a candidate for the strongest."""
    level = level_in_view(c, v, place, clock)
    if ti.static(v.view == "strongest_under_carriers"):
        carrier = c.ground[place] >> 4 == STANDS_WITH_FOOD
        level = ti.select(carrier, level_of(c, v, place, clock), level)
    return level


@ti.func
def deposit(c: ti.template(), v: ti.template(), place, clock, carried):
    """Deposit, by the task's rule, the trail of an ant that has carried its food for some ticks."""
    if c.deposits != pheromone.NONE:
        laid = pheromone.level_after_deposit(c, c.deposits, level_of(c, v, place, clock), carried)
        if ti.static(v.dense):
            c.level[place] = laid
        else:
            c.trail[place] = clock + laid


@ti.func
def evaporate(c: ti.template(), place):
    """Evaporate the dense trail of a cell for one tick."""
    c.level[place] = pheromone.evaporated(c.level[place], c.decay)


@ti.func
def diffuse(c: ti.template(), place):
    """Compute the level of a cell after one tick of diffusion."""
    if c.share > 0.0:
        c.spare[place] = pheromone.diffused(c.level, c.walls, c.compass, place, c.share)


@ti.func
def settle(c: ti.template(), place):
    """Set the level of a cell to the result of `diffuse`."""
    if c.share > 0.0:
        c.level[place] = c.spare[place]
