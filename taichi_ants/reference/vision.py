"""What an ant sees of the cells around it."""

from __future__ import annotations

from taichi_ants.reference.ants import Ant
from taichi_ants.reference.geometry import Cell, distance, neighbour
from taichi_ants.reference.trail import Level
from taichi_ants.reference.world_state import WorldState
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


def cells_in_view(ant: Ant, turns: tuple[int, ...] = AHEAD) -> list[Cell]:
    """The cells at these headings relative to the ant's."""
    return [neighbour(ant.cell, ant.heading + turn) for turn in turns]


def levels_in_view(world: WorldState, ant: Ant, turns: tuple[int, ...] = AHEAD) -> list[Level]:
    """The trail that can be seen of each cell: that of empty cells; 0 of all others."""
    # A trail on food, or on the queen's cell, is not seen and does not count for the strongest.
    return [
        world.level(cell) if world.content(cell) == EMPTY else 0
        for cell in cells_in_view(ant, turns)
    ]


def codes_in_view(world: WorldState, ant: Ant, turns: tuple[int, ...] = AHEAD) -> list[int]:
    """What each cell looks like, SEES_EMPTY, SEES_OBSTACLE, SEES_LURE or SEES_GOAL."""
    strongest = 0 if ant.carries else max(levels_in_view(world, ant))  # of the cells ahead, always
    return [_code(world, ant, cell, strongest) for cell in cells_in_view(ant, turns)]


def _code(world: WorldState, ant: Ant, cell: Cell, strongest: Level) -> int:
    content = world.content(cell)
    if content == (QUEEN if ant.carries else FOOD):
        return SEES_GOAL
    if content != EMPTY:  # without food the queen too, with food other food
        return SEES_OBSTACLE
    if ant.carries:
        lures = distance(cell, world.queen) < distance(ant.cell, world.queen)
    else:
        level = world.level(cell)
        lures = bool(level >= 1 and 2 * level >= strongest)
    return SEES_LURE if lures else SEES_EMPTY


def observe(world: WorldState, ant: Ant) -> int:
    """The percept, the paper's state: load, left, forward, right as a number, 0..127."""
    left, forward, right = codes_in_view(world, ant)
    return 64 * ant.carries + 16 * left + 4 * forward + right
