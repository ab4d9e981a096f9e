"""The twins of the package's observations: what an ant observes."""

from __future__ import annotations

from collections.abc import Callable

from taichi_ants.reference.ants import Ant
from taichi_ants.reference.vision import (
    cells_in_view,
    codes_in_view,
    is_better,
    levels_in_view,
    strongest_in_view,
)
from taichi_ants.reference.world_state import Level, WorldState
from taichi_ants.task.constants import SEES_GOAL, SEES_LURE, SEES_OBSTACLE

ANOTHER_ANT = 4  # a code of its own, beside the paper's four
# Another ant: with the other load on a better cell or not, with the same load on a better one.
BETTER, OTHER, AHEAD = 4, 5, 6
NOTHING, OBSTACLE, WEAK, MIDDLE, STRONG, GOAL = range(6)


def paper(world: WorldState, ant: Ant) -> int:
    """The percept itself."""
    return ant.percept


def five_cells(world: WorldState, ant: Ant) -> int:
    """The load, then the paper's codes from behind left to behind right."""
    return _number([ant.carries, *codes_in_view(world, ant, (-2, -1, 0, 1, 2))], 4)


def six_cells(world: WorldState, ant: Ant) -> int:
    """The load, then the paper's codes from behind left to behind right, then behind."""
    return _number([ant.carries, *codes_in_view(world, ant, (-2, -1, 0, 1, 2, 3))], 4)


def ants_seen(world: WorldState, ant: Ant) -> int:
    """The load, then the codes of the cells ahead; another ant is a code of its own."""
    codes = [
        ANOTHER_ANT if cell in world.ants else code
        for cell, code in zip(cells_in_view(ant), codes_in_view(world, ant), strict=True)
    ]
    return _number([ant.carries, *codes], 5)


def trail_levels(world: WorldState, ant: Ant) -> int:
    """The load, then the cells ahead; trails in three levels: thirds of the strongest one."""
    levels = levels_in_view(world, ant)
    strongest = strongest_in_view(world, ant)
    codes = []
    for code, level in zip(codes_in_view(world, ant), levels, strict=True):
        if code == SEES_GOAL:
            codes.append(GOAL)
        elif code == SEES_OBSTACLE:
            codes.append(OBSTACLE)
        elif ant.carries:
            codes.append(STRONG if code == SEES_LURE else NOTHING)
        else:
            codes.append(_share(level, strongest))
    return _number([ant.carries, *codes], 6)


def ants(world: WorldState, ant: Ant) -> int:
    """The load, then the codes of the cells ahead; ants with the other load have their own."""
    return _number([ant.carries, *_crowd(world, ant, queue=False)], 6)


def queues(world: WorldState, ant: Ant) -> int:
    """As `ants`; ants with the same load on a better cell have a code of their own, too."""
    return _number([ant.carries, *_crowd(world, ant, queue=True)], 7)


def _crowd(world: WorldState, ant: Ant, queue: bool) -> list[int]:
    codes = codes_in_view(world, ant)
    for side, cell in enumerate(cells_in_view(ant)):
        there = world.ants.get(cell)
        if there is None:
            continue
        better = is_better(world, ant, cell)
        if there.carries != ant.carries:
            codes[side] = BETTER if better else OTHER
        elif queue and better:
            codes[side] = AHEAD
    return codes


def _share(level: Level, strongest: Level) -> int:
    if level < 1:
        return NOTHING
    if level >= 2 * (strongest - level):  # two thirds
        return STRONG
    return MIDDLE if level >= strongest - 2 * level else WEAK


def _number(digits: list[int], base: int) -> int:
    """The number of these digits, the first one the most significant."""
    value = 0
    for digit in digits:
        value = base * value + digit
    return value


OBSERVATIONS: dict[str, Callable[[WorldState, Ant], int]] = {
    "paper": paper,
    "five_cells": five_cells,
    "six_cells": six_cells,
    "trail_levels": trail_levels,
    "ants_seen": ants_seen,
    "ants": ants,
    "queues": queues,
}
