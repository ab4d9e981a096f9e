"""The view of an ant, and the observations of the package, implemented a second time."""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np

from taichi_ants.reference.ants import Ant
from taichi_ants.reference.cues import homing_sense, sense
from taichi_ants.reference.geometry import Cell, neighbour
from taichi_ants.reference.world_state import Level, Trail, WorldState
from taichi_ants.rules.inputs import Vector
from taichi_ants.task import Observation, Traffic
from taichi_ants.task.constants import EMPTY, FOOD, SEES_CUE, SEES_EMPTY, SEES_GOAL, SEES_OBSTACLE

AHEAD = (-1, 0, 1)  # headings relative to the ant's: left, forward, right
# From back left to back right; the sixth cell is the one behind.
FIVE, SIX = (-2, -1, 0, 1, 2), (-2, -1, 0, 1, 2, 3)
ANOTHER_ANT = 4  # in addition to the paper's four codes
# Codes of ants: other load on a better cell, other load elsewhere, same load on a better cell.
BETTER, OTHER, IN_QUEUE = 4, 5, 6
NOTHING, OBSTACLE, WEAK, MIDDLE, STRONG, GOAL = range(6)


def cells_in_view(ant: Ant, turns: tuple[int, ...] = AHEAD) -> list[Cell]:
    """Return the cells at these headings relative to the ant's."""
    return [neighbour(ant.cell, ant.heading + turn) for turn in turns]


def levels_in_view(
    world: WorldState, ant: Ant, trail: Trail, turns: tuple[int, ...], hidden: Container[int]
) -> list[Level]:
    """Return the levels of cells on empty ground or under ants, 0 for others and `hidden` turns."""
    return [
        trail.level(cell) if world.ground.get(cell) == EMPTY and turn not in hidden else 0
        for turn, cell in zip(turns, cells_in_view(ant, turns), strict=True)
    ]


def strongest_in_view(world: WorldState, ant: Ant) -> Level:
    """Return the largest level of the ant's cue in the cells ahead that count, 0 if none does."""
    trail = world.cue(ant)
    counting = [cell for cell in cells_in_view(ant) if world.content(cell) == EMPTY]
    if trail.rule.view == "strongest_under_carriers":
        others = [world.ants.get(cell) for cell in cells_in_view(ant)]
        counting += [other.cell for other in others if other is not None and other.carries]
    return max((trail.level(cell) for cell in counting), default=0)


def nestmate(world: WorldState, ant: Ant, cell: Cell) -> Ant | None:
    """Return the ant on a cell if it is of the same nest; ants of other nests are obstacles."""
    other = world.ants.get(cell)
    return other if other is not None and other.nest == ant.nest else None


def is_better(world: WorldState, ant: Ant, cell: Cell) -> bool:
    """Return whether a cell is better for an ant than its own.

    A better cell has a higher level of the ant's cue, unless that is not a pheromone, see `cues`.
    """
    if better := sense(world, ant):
        return better(world, ant, cell)
    trail = world.cue(ant)
    return bool(trail.level(cell) > trail.level(ant.cell))


def codes_in_view(world: WorldState, ant: Ant, turns: tuple[int, ...] = AHEAD) -> list[int]:
    """Return the code of each cell: SEES_EMPTY, SEES_OBSTACLE, SEES_CUE or SEES_GOAL."""
    strongest = 0 if sense(world, ant) else strongest_in_view(world, ant)
    return [_code(world, ant, cell, strongest) for cell in cells_in_view(ant, turns)]


def _code(world: WorldState, ant: Ant, cell: Cell, strongest: Level) -> int:
    content, queen = world.content(cell), world.queens[ant.nest]
    is_goal = cell == queen if ant.carries else content == FOOD
    if is_goal:
        return SEES_GOAL
    if content != EMPTY:  # also queens, and food for carriers
        return SEES_OBSTACLE
    if sense(world, ant):
        shows_cue = is_better(world, ant, cell)
    else:
        trail = world.cue(ant)
        level = trail.level(cell)
        enough = 2 * level if trail.rule.view == "half" else level
        shows_cue = bool(level >= 1 and enough >= strongest)
    return SEES_CUE if shows_cue else SEES_EMPTY


def observe(world: WorldState, ant: Ant) -> int:
    """Return the paper's state: load, left, forward and right as a number, 0..127."""
    return _number([ant.carries, *codes_in_view(world, ant)], 4)


def codes_seen(world: WorldState, ant: Ant, turns: tuple[int, ...] = AHEAD) -> list[int]:
    """Return the code of each cell as the ant sees it, which may be misread."""
    codes = codes_in_view(world, ant, turns)
    return [ant.misread.get(turn, code) for turn, code in zip(turns, codes, strict=True)]


def ants_in_view(world: WorldState, ant: Ant, turns: tuple[int, ...] = AHEAD) -> list[Ant | None]:
    """Return the nestmate that the ant sees on each cell, but not on cells it misreads."""
    return [
        None if turn in ant.misread else nestmate(world, ant, cell)
        for turn, cell in zip(turns, cells_in_view(ant, turns), strict=True)
    ]


def more_cells(turns: tuple[int, ...], world: WorldState, ant: Ant) -> int:
    """Return the state index of the load and the paper's codes of the cells at these turns."""
    return _number([ant.carries, *codes_seen(world, ant, turns)], 4)


def ants_seen(world: WorldState, ant: Ant) -> int:
    """Return the state index of the load and the cells ahead; other ants have their own code."""
    codes = [
        code if there is None else ANOTHER_ANT
        for there, code in zip(ants_in_view(world, ant), codes_seen(world, ant), strict=True)
    ]
    return _number([ant.carries, *codes], 5)


def ways(
    world: WorldState, ant: Ant, codes: Sequence[int], traffic: Traffic
) -> tuple[list[bool], list[bool]]:
    """Return which cells ahead an ant can enter, and which are better.

    The latter are those of a cue that is not a pheromone. `codes` are those of the cells as the ant
    sees them.
    """
    senses = sense(world, ant) is not None
    is_open = [code in (SEES_EMPTY, SEES_CUE) for code in codes]
    nearer = [code == SEES_CUE and senses for code in codes]
    for side, cell in enumerate(cells_in_view(ant)):
        if cell in world.ants and side - 1 not in ant.misread:
            nearer[side] = senses and is_better(world, ant, cell)
            if traffic.shared and nestmate(world, ant, cell):
                is_open[side] = ant.carries or traffic.follow
    return is_open, nearer


def trail_levels(world: WorldState, ant: Ant) -> int:
    """Return the state index of load and cells ahead; trails have three codes, by strength."""
    strongest = strongest_in_view(world, ant)
    codes = []
    for turn, code, cell in zip(AHEAD, codes_seen(world, ant), cells_in_view(ant), strict=True):
        if code == SEES_GOAL:
            codes.append(GOAL)
        elif code == SEES_OBSTACLE:
            codes.append(OBSTACLE)
        elif ant.carries:
            codes.append(STRONG if code == SEES_CUE else NOTHING)
        else:
            # Ants do not see trails under food or the queen, or on cells that they misread.
            sees = turn not in ant.misread and world.content(cell) == EMPTY
            level = world.cue(ant).level(cell) if sees else 0
            codes.append(_share(level, strongest))
    return _number([ant.carries, *codes], 6)


def crowd(queue: bool, world: WorldState, ant: Ant) -> int:
    """Return the state index of the load and the cells ahead; ants with the other load have codes.

    If `queue`, ants with the same load on a better cell have a code, too.
    """
    codes = codes_seen(world, ant)
    for side, there in enumerate(ants_in_view(world, ant)):
        if there is None:
            continue
        better = is_better(world, ant, there.cell)
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


def yours(observation: Observation, world: WorldState, ant: Ant) -> int:
    """Return the state index of your own observation, from the view of the ant.

    A misread cell has no ant, no level, and is not nearer.
    """
    turns, cells = observation.cells, cells_in_view(ant, observation.cells)
    seen = [turn not in ant.misread for turn in turns]
    others = [world.ants.get(cell) if s else None for cell, s in zip(cells, seen, strict=True)]
    # All levels of cues are float32 if those of one cue are.
    followed = {name for pair in world.cues for name in pair} & world.pheromones.keys()
    dense = any(world.pheromones[name].rule.dense for name in followed)

    def levels(trail: Trail, dense: bool) -> tuple[Vector, Any]:
        kind: type = np.float32 if dense else np.int32
        in_view = levels_in_view(world, ant, trail, turns, ant.misread)
        return Vector(map(kind, in_view)), kind(trail.level(ant.cell))

    ahead, own_level = levels(world.cue(ant), dense)
    if better := homing_sense(world, ant):
        nearer = [better(world, ant, cell) for cell in cells]
    else:
        nearer = [bool(level > own_level) for level in ahead]
    view: dict[str, Any] = {
        "carries": int(ant.carries),
        "paper_state": more_cells(AHEAD, world, ant),
        "codes": Vector(codes_seen(world, ant, turns)),
        "levels": ahead,
        "ants": Vector(1 + o.carries if o and o.nest == ant.nest else 0 for o in others),
        "other_nest_ants": Vector(int(o is not None and o.nest != ant.nest) for o in others),
        "nearer": Vector(int(near and s) for near, s in zip(nearer, seen, strict=True)),
        "strongest": type(own_level)(strongest_in_view(world, ant)),
        "own_level": own_level,
    }
    for name in observation.reads:
        trail = world.pheromones[name]
        view[name], view[f"own_{name}"] = levels(trail, trail.rule.dense)
    return int(observation.encode(SimpleNamespace(**view)))


OBSERVATIONS: dict[str, Callable[[WorldState, Ant], int]] = {
    "paper": partial(more_cells, AHEAD),
    "five_cells": partial(more_cells, FIVE),
    "six_cells": partial(more_cells, SIX),
    "trail_levels": trail_levels,
    "ants_seen": ants_seen,
    "ants": partial(crowd, False),
    "queues": partial(crowd, True),
}
