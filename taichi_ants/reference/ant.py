"""One ant: what it sees, and what its actions do."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.reference.geometry import Cell, distance, neighbour
from taichi_ants.reference.random_stream import RandomStream, pick
from taichi_ants.reference.world_state import WorldState
from taichi_ants.task.constants import (
    EMPTY,
    FOOD,
    GIVE,
    N_ACTIONS,
    PICK_UP,
    QUEEN,
    SEES_EMPTY,
    SEES_GOAL,
    SEES_LURE,
    SEES_OBSTACLE,
)


@dataclass(slots=True)
class Ant:
    """An ant's cell (normal form), heading (0..5), and whether it carries food."""

    cell: Cell
    heading: int
    carries: bool = False


class Surroundings(Protocol):
    """What an ant can look at: a world of one ant, or of many.

    Attributes:
        queen: The queen's cell.
    """

    queen: Cell

    def content(self, cell: Cell) -> int:
        """Return EMPTY, OBSTACLE, FOOD or QUEEN; other ants are an OBSTACLE."""

    def level(self, cell: Cell) -> int | np.float32:
        """Return the trail level of a cell."""


class Event(Enum):
    """What came of an action."""

    MOVED = "moved"
    BLOCKED = "blocked"  # a move that only turned the ant
    PICKED_UP = "picked up"
    DELIVERED = "delivered"
    FAILED = "failed"  # a pick-up or give that could not be done


def cells_in_view(ant: Ant) -> tuple[Cell, Cell, Cell]:
    """Return the cells to the left of the heading, ahead, and to the right, in this order."""
    return (
        neighbour(ant.cell, ant.heading - 1),
        neighbour(ant.cell, ant.heading),
        neighbour(ant.cell, ant.heading + 1),
    )


def observe(world: Surroundings, ant: Ant) -> int:
    """Return the index (0..127) of the state that the ant sees."""
    cells = cells_in_view(ant)
    sees = _sees_with_food if ant.carries else _sees_without_food
    left, forward, right = sees(world, ant, cells)
    return 64 * ant.carries + 16 * left + 4 * forward + right


def _sees_without_food(world: Surroundings, ant: Ant, cells: tuple[Cell, ...]) -> list[int]:
    contents = [world.content(cell) for cell in cells]
    # A trail on food, or on the queen's cell, is not seen and does not count for the strongest.
    levels = [
        world.level(cell) if content == EMPTY else 0
        for cell, content in zip(cells, contents, strict=True)
    ]
    strongest = max(levels)
    codes = []
    for content, level in zip(contents, levels, strict=True):
        if content == FOOD:
            codes.append(SEES_GOAL)
        elif content != EMPTY:  # the queen too
            codes.append(SEES_OBSTACLE)
        elif level >= 1 and 2 * level >= strongest:
            codes.append(SEES_LURE)
        else:
            codes.append(SEES_EMPTY)
    return codes


def _sees_with_food(world: Surroundings, ant: Ant, cells: tuple[Cell, ...]) -> list[int]:
    own_distance = distance(ant.cell, world.queen)
    codes = []
    for cell in cells:
        content = world.content(cell)
        if content == QUEEN:
            codes.append(SEES_GOAL)
        elif content != EMPTY:  # food too
            codes.append(SEES_OBSTACLE)
        elif distance(cell, world.queen) < own_distance:
            codes.append(SEES_LURE)
        else:
            codes.append(SEES_EMPTY)
    return codes


def act(
    world: WorldState, ant: Ant, state: int, action: int, stream: RandomStream
) -> tuple[int, Event]:
    """Let the ant do `action` in the world; return the reward and what came of it.

    Args:
        world: Changed by a pick-up and by the deposits of a carrying ant. Its clock stands still.
        ant: Changed: its cell, its heading, whether it carries.
        state: What the ant saw, the index that `observe` returned for this tick.
        action: 0..4.
        stream: Drawn from only where a pick-up has several foods to choose from.
    """
    if not 0 <= action < N_ACTIONS:
        raise AssertionError(f"there is no action {action}")
    codes = (state >> 4 & 3, state >> 2 & 3, state & 3)
    if action == PICK_UP:
        return _pick_up(world, ant, codes, stream)
    if action == GIVE:
        return _give(world, ant, codes)
    return _move(world, ant, codes, action)


def _move(world: WorldState, ant: Ant, codes: tuple[int, ...], action: int) -> tuple[int, Event]:
    target = cells_in_view(ant)[action]
    # The turn is made even if the way is blocked: so an ant gets out of a dead end.
    ant.heading = (ant.heading + action - 1) % N_HEADINGS
    if world.content(target) != EMPTY:
        return world.rewards.failed, Event.BLOCKED
    ant.cell = target
    if ant.carries:
        world.deposit(target)
    table = world.rewards
    return (table.lure if codes[action] == SEES_LURE else table.empty), Event.MOVED


def _pick_up(
    world: WorldState, ant: Ant, codes: tuple[int, ...], stream: RandomStream
) -> tuple[int, Event]:
    foods = [
        cell for cell, code in zip(cells_in_view(ant), codes, strict=True) if code == SEES_GOAL
    ]
    if ant.carries or not foods:
        return world.rewards.failed, Event.FAILED
    chosen = foods[0]
    if len(foods) > 1:
        high, _ = stream.draw()
        chosen = foods[pick(high, len(foods))]
    world.take_food(chosen)
    world.deposit(chosen)
    world.deposit(ant.cell)
    ant.carries = True
    ant.heading = (ant.heading + 3) % N_HEADINGS
    return world.rewards.pick_up, Event.PICKED_UP


def _give(world: WorldState, ant: Ant, codes: tuple[int, ...]) -> tuple[int, Event]:
    if not ant.carries or SEES_GOAL not in codes:
        return world.rewards.failed, Event.FAILED
    ant.carries = False
    return world.rewards.give, Event.DELIVERED
