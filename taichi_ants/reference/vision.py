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


def strongest_in_view(world: WorldState, ant: Ant) -> Level:
    """The largest trail level of the three cells ahead that count, 0 where none does."""
    counting = [cell for cell in cells_in_view(ant) if world.content(cell) == EMPTY]
    if world.pheromone.view == "strongest_under_carriers":
        others = [world.ants.get(cell) for cell in cells_in_view(ant)]
        counting += [other.cell for other in others if other is not None and other.carries]
    return max((world.level(cell) for cell in counting), default=0)


def is_better(world: WorldState, ant: Ant, cell: Cell) -> bool:
    """Whether a cell is better than the ant's own for what the ant is about.

    With food that is nearer to the queen, without food a stronger trail.
    """
    if ant.carries:
        return distance(cell, world.queen) < distance(ant.cell, world.queen)
    return bool(world.level(cell) > world.level(ant.cell))


def codes_in_view(world: WorldState, ant: Ant, turns: tuple[int, ...] = AHEAD) -> list[int]:
    """What each cell looks like, SEES_EMPTY, SEES_OBSTACLE, SEES_LURE or SEES_GOAL."""
    strongest = 0 if ant.carries else strongest_in_view(world, ant)
    return [_code(world, ant, cell, strongest) for cell in cells_in_view(ant, turns)]


def _code(world: WorldState, ant: Ant, cell: Cell, strongest: Level) -> int:
    content = world.content(cell)
    if content == (QUEEN if ant.carries else FOOD):
        return SEES_GOAL
    if content != EMPTY:  # without food the queen too, with food other food
        return SEES_OBSTACLE
    if ant.carries:
        lures = is_better(world, ant, cell)
    else:
        level = world.level(cell)
        enough = 2 * level if world.pheromone.view == "half" else level
        lures = bool(level >= 1 and enough >= strongest)
    return SEES_LURE if lures else SEES_EMPTY


def observe(world: WorldState, ant: Ant) -> int:
    """The percept, the paper's state: load, left, forward, right as a number, 0..127."""
    left, forward, right = codes_in_view(world, ant)
    return 64 * ant.carries + 16 * left + 4 * forward + right
