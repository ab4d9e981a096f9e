"""The pheromones of a colony: expiry clocks, or levels if dense, by cell.

Number 0 is the trail, in the array `trail`, or `level` if dense; 1, 2, ... are further fields, in
`field_1`, `field_2`, ... Ants deposit in further fields on an `Occasion`. An ant deposits on its
last or its present cell, or on the cell of the food that it takes, so that no two ants deposit on
one cell of a field in a tick.
"""

from collections import namedtuple

import taichi as ti

from taichi_ants.engines.colony.columns import function
from taichi_ants.features.fields import Occasion
from taichi_ants.features.pheromone import Pheromone
from taichi_ants.task.constants import EMPTY, OBSTACLE, PICK_UP, Event
from taichi_ants.task.rules import pheromone, vision

# A pheromone in kernels: whether it is dense; its view; its arrays, of which `spare` has the next
# levels, with diffusion; `Pheromone.numbers`; the occasions of deposits, None for the trail; and
# your rules, or None.
NUMBERS = tuple(Pheromone().numbers)
PheromoneArrays = namedtuple(
    "PheromoneArrays",
    ("dense", "half", "under_carriers", "levels", "spare", *NUMBERS)
    + ("deposited_when", "own_deposit", "own_evaporation"),
)


@function
def level_of(field, index, tick):
    """Return the level of a cell in a tick: i32, or f32 if dense."""
    level = field.levels[index]
    if ti.static(not field.dense):
        level = pheromone.level_left(level, tick * field.evaporates)
    return level


@function
def level_in_view(c, field, index, tick):
    """Return the level that an ant sees in a cell: 0 unless the cell is empty."""
    # Read without a branch, because the processor cannot predict which cells are empty.
    return ti.select(c.ground[index] & 15 == EMPTY, level_of(field, index, tick), 0)


@function
def level_that_counts(c, field, index, tick):
    """Return the level of a cell as it counts for the strongest one, 0 if it does not count."""
    level = level_in_view(c, field, index, tick)
    if ti.static(field.under_carriers):
        carrier = c.ground[index] >> 7 == 1  # of any nest
        level = ti.select(carrier, level_of(field, index, tick), level)
    return level


@function
def deposit(c, v, field, w, ant, index, tick, carried, carries, event, paper_state):
    """Deposit, by the rule of a pheromone, what an ant lays after some ticks with its load.

    `carries` and `event` are those after the ant's action, `paper_state` is that before it.
    """
    if ti.static(field.own_deposit):
        level = level_of(field, index, tick)
        laid = field.own_deposit(
            c, v, w, ant, level, index, carried, carries, event, paper_state, tick
        )
        if ti.static(field.dense):
            field.levels[index] = ti.cast(laid, ti.f32)
        else:
            field.levels[index] = ti.cast(ti.floor(laid), ti.i32) + tick * field.evaporates
    elif field.deposits != pheromone.NONE:
        level = level_of(field, index, tick)
        laid = pheromone.level_after_deposit(field, field.deposits, level, carried)
        if ti.static(not field.dense):
            laid += tick * field.evaporates
        field.levels[index] = laid


@ti.func
def occasions_of(had_food, paper_state, action, event, has_moved):
    """Return the occasions of an ant in a tick, by its load and paper state before it acted."""
    occasions = 0
    if has_moved:
        occasions = ti.select(had_food == 1, Occasion.MOVED_WITH_FOOD, Occasion.MOVED_WITHOUT_FOOD)
    if event == Event.PICKED_UP:
        occasions |= Occasion.PICKED_UP
    if event == Event.DELIVERED:
        occasions |= Occasion.DELIVERED
    if had_food == 0:
        if paper_state == vision.DEAD_END:
            occasions |= Occasion.DEAD_END
        if (action == PICK_UP) & (event == Event.FAILED):
            occasions |= Occasion.FAILED_PICK_UP
    return occasions


@function
def lay(c, v, field, w, ant, laid, cell, goes, food, tick, carried, carries, event, paper_state):
    """Deposit on the cell that an ant leaves or enters, or on its food's, on an occasion `laid`."""
    base = w * c.size
    if laid != 0:
        index = base + ti.select(laid == Occasion.DEAD_END, cell, goes)
        deposit(c, v, field, w, ant, index, tick, carried, carries, event, paper_state)
        if laid == Occasion.PICKED_UP:
            food_place = base + food
            deposit(c, v, field, w, ant, food_place, tick, carried, carries, event, paper_state)


@function
def evaporate(c, v, index, tick):
    """Evaporate the dense pheromones of a cell for one tick."""
    for field in ti.static(v.dense_fields(c)):
        if ti.static(field.own_evaporation):
            if c.ground[index] != OBSTACLE:  # rocks and the outside hold no trail
                level = field.own_evaporation(c, field.levels[index], tick)
                field.levels[index] = ti.cast(level, ti.f32)
        else:
            field.levels[index] = pheromone.evaporated(field.levels[index], field.decay)


@function
def diffuse(c, v, index, tick):
    """Compute the levels of a cell after one tick of diffusion."""
    for field in ti.static(v.dense_fields(c)):
        if field.share > 0.0:
            field.spare[index] = pheromone.diffused(
                field.levels, c.walls, c.compass, index, field.share
            )


@function
def apply_diffusion(c, v, index, tick):
    """Set the levels of a cell to the results of `diffuse`."""
    for field in ti.static(v.dense_fields(c)):
        if field.share > 0.0:
            field.levels[index] = field.spare[index]
