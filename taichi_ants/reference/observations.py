"""The view of an ant, and the observations of the package, implemented a second time."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from taichi_ants.reference.ants import Ant
from taichi_ants.reference.geometry import Cell, distance, neighbour
from taichi_ants.reference.world_state import Level, WorldState
from taichi_ants.task.constants import (
    EMPTY,
    FOOD,
    QUEEN,
    SEES_EMPTY,
    SEES_GOAL,
    SEES_LURE,
    SEES_OBSTACLE,
)

AHEAD = (-1, 0, 1)  # headings relative to the ant's: left, forward, right
ANOTHER_ANT = 4  # in addition to the paper's four codes
# Codes of ants: other load on a better cell, other load elsewhere, same load on a better cell.
BETTER, OTHER, IN_QUEUE = 4, 5, 6
NOTHING, OBSTACLE, WEAK, MIDDLE, STRONG, GOAL = range(6)


def cells_in_view(ant: Ant, turns: tuple[int, ...] = AHEAD) -> list[Cell]:
    """Return the cells at these headings relative to the ant's."""
    return [neighbour(ant.cell, ant.heading + turn) for turn in turns]


def strongest_in_view(world: WorldState, ant: Ant) -> Level:
    """Return the largest trail level among the cells ahead that count, 0 if none does."""
    counting = [cell for cell in cells_in_view(ant) if world.content(cell) == EMPTY]
    if world.pheromone.view == "strongest_under_carriers":
        others = [world.ants.get(cell) for cell in cells_in_view(ant)]
        counting += [other.cell for other in others if other is not None and other.carries]
    return max((world.trail.level(cell) for cell in counting), default=0)


def is_better(world: WorldState, ant: Ant, cell: Cell) -> bool:
    """Return whether a cell is better for an ant than its own.

    A better cell is nearer to the queen for a carrier, and has a stronger trail for a forager.
    """
    if ant.carries:
        return distance(cell, world.queen) < distance(ant.cell, world.queen)
    return bool(world.trail.level(cell) > world.trail.level(ant.cell))


def codes_in_view(world: WorldState, ant: Ant, turns: tuple[int, ...] = AHEAD) -> list[int]:
    """Return the code of each cell: SEES_EMPTY, SEES_OBSTACLE, SEES_LURE or SEES_GOAL."""
    strongest = 0 if ant.carries else strongest_in_view(world, ant)
    return [_code(world, ant, cell, strongest) for cell in cells_in_view(ant, turns)]


def _code(world: WorldState, ant: Ant, cell: Cell, strongest: Level) -> int:
    content = world.content(cell)
    if content == (QUEEN if ant.carries else FOOD):
        return SEES_GOAL
    if content != EMPTY:  # also the queen for foragers, and food for carriers
        return SEES_OBSTACLE
    if ant.carries:
        lures = is_better(world, ant, cell)
    else:
        level = world.trail.level(cell)
        enough = 2 * level if world.pheromone.view == "half" else level
        lures = bool(level >= 1 and enough >= strongest)
    return SEES_LURE if lures else SEES_EMPTY


def observe(world: WorldState, ant: Ant) -> int:
    """Return the percept, the paper's state: load, left, forward and right as a number, 0..127."""
    left, forward, right = codes_in_view(world, ant)
    return 64 * ant.carries + 16 * left + 4 * forward + right


def paper(world: WorldState, ant: Ant) -> int:
    """Return the percept."""
    return ant.percept


def more_cells(turns: tuple[int, ...], world: WorldState, ant: Ant) -> int:
    """Return the state index of the load and the codes of the cells at these turns from ahead."""
    return _number([ant.carries, *codes_in_view(world, ant, turns)], 4)


def ants_seen(world: WorldState, ant: Ant) -> int:
    """Return the state index of the load and the cells ahead; other ants have their own code."""
    codes = [
        ANOTHER_ANT if cell in world.ants else code
        for cell, code in zip(cells_in_view(ant), codes_in_view(world, ant), strict=True)
    ]
    return _number([ant.carries, *codes], 5)


def trail_levels(world: WorldState, ant: Ant) -> int:
    """Return the state index of load and cells ahead; trails have three codes, by strength."""
    strongest = strongest_in_view(world, ant)
    codes = []
    for code, cell in zip(codes_in_view(world, ant), cells_in_view(ant), strict=True):
        if code == SEES_GOAL:
            codes.append(GOAL)
        elif code == SEES_OBSTACLE:
            codes.append(OBSTACLE)
        elif ant.carries:
            codes.append(STRONG if code == SEES_LURE else NOTHING)
        else:
            # Ants do not see trails under food or the queen.
            level = world.trail.level(cell) if world.content(cell) == EMPTY else 0
            codes.append(_share(level, strongest))
    return _number([ant.carries, *codes], 6)


def crowd(queue: bool, world: WorldState, ant: Ant) -> int:
    """Return the state index of the load and the cells ahead; ants with the other load have codes.

    If `queue`, ants with the same load on a better cell have a code, too.
    """
    codes = codes_in_view(world, ant)
    for side, cell in enumerate(cells_in_view(ant)):
        there = world.ants.get(cell)
        if there is None:
            continue
        better = is_better(world, ant, cell)
        if there.carries != ant.carries:
            codes[side] = BETTER if better else OTHER
        elif queue and better:
            codes[side] = IN_QUEUE
    return _number([ant.carries, *codes], 7 if queue else 6)


def _share(level: Level, strongest: Level) -> int:
    if level < 1:
        return NOTHING
    if level >= 2 * (strongest - level):  # two thirds
        return STRONG
    return MIDDLE if level >= strongest - 2 * level else WEAK


def _number(digits: list[int], base: int) -> int:
    """Return the number with these digits, the most significant first."""
    value = 0
    for digit in digits:
        value = base * value + digit
    return value


OBSERVATIONS: dict[str, Callable[[WorldState, Ant], int]] = {
    "paper": paper,
    # From back left to back right, in `six_cells` then back.
    "five_cells": partial(more_cells, (-2, -1, 0, 1, 2)),
    "six_cells": partial(more_cells, (-2, -1, 0, 1, 2, 3)),
    "trail_levels": trail_levels,
    "ants_seen": ants_seen,
    "ants": partial(crowd, False),
    "queues": partial(crowd, True),
}
