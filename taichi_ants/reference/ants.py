"""An ant, where ants start, and what one does in a tick."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.errors import AntsError
from taichi_ants.grid.constants import N_HEADINGS, STREAM_START_CELL, STREAM_START_HEADING
from taichi_ants.reference.geometry import Cell, distance, existing_cells, listed_cells
from taichi_ants.reference.random_stream import RandomStream, pick, stream_state
from taichi_ants.task.events import Event

if TYPE_CHECKING:
    from taichi_ants.worlds.world import World

Pair = tuple[int, int]  # state, action


@dataclass(slots=True)
class Ant:
    """An ant.

    Attributes:
        slot: Its place in the colony, 0 .. slots - 1; free again after its death.
        number: The initial ants are 0 .. n - 1, those born in an episode n, n + 1, ...
        age, carried: Ticks that it has lived, if there is a lifespan, and carried its food.
        percept: Load and looks of the three cells ahead, 0 to 127, by which it acts.
        state: The state index, by which it chooses and learns.
        action, reward: The last ones; -1 and 0 before its first tick.
        chosen: The action that it has drawn already for its next tick, if any.
    """

    cell: Cell
    heading: int
    carries: bool = False
    slot: int = 0
    number: int = 0
    stream: RandomStream = field(default_factory=lambda: RandomStream(0))
    age: int = 0
    carried: int = 0
    percept: int = 0
    state: int = 0
    action: int = -1
    reward: int = 0
    chosen: int | None = None


@dataclass(kw_only=True, slots=True)
class Transition:
    """One ant in one tick, from which it learns.

    Attributes:
        episode, step: The episode in the run and the tick in the episode, from 0.
        cell, heading, state: Before the tick.
        next_state, next_action: After it; the action if it was drawn.
        terminated: Whether it delivered and this is a terminal state: the update does not
            bootstrap.
        truncated: Whether this was the ant's last update in the episode all the same: its last
            tick, its death, or a delivery that ends the episode and is not terminal.
        td_error: Of the update from this step (planning is not recorded); None without learning.
    """

    slot: int
    number: int
    episode: int
    step: int
    cell: Cell
    heading: int
    state: int
    action: int
    reward: int
    event: Event
    next_state: int
    next_action: int | None
    terminated: bool
    truncated: bool
    td_error: np.float32 | None = None

    @property
    def pair(self) -> Pair:
        return self.state, self.action


def starts(world: World, seed: int, n: int = 1, where: str = "nest") -> list[tuple[Cell, int]]:
    """Return cell and heading of each of n ants; AntsError if the world has too few free cells.

    The ants that the world lists come first. The others take free cells, those nearest to the
    queen if `where` is "nest", any if it is "spread", otherwise in an order that depends on the
    seed; and a heading that depends on the seed.
    """
    listed = [((x, y, z), heading) for x, y, z, heading in world.ants.tolist()]
    if n <= len(listed):
        return listed[:n]
    taken = {world.queen, *listed_cells(world.foods), *listed_cells(world.obstacles)}
    taken |= {cell for cell, _ in listed}
    order = start_order(world, world.queen, seed, where)
    free = [cell for cell in order if cell not in taken]
    missing = n - len(listed)
    if missing > len(free):
        raise AntsError(
            f"n is {n}; the world lists {len(listed)} ants and has {len(free)} free cells, "
            "so take fewer ants or a larger world."
        )
    return listed + [
        (cell, pick(stream_state(seed, STREAM_START_HEADING, ant) >> 32, N_HEADINGS))
        for ant, cell in enumerate(free[:missing], start=len(listed))
    ]


def start_order(world: World, queen: Cell, seed: int, where: str) -> list[Cell]:
    """Return all cells in the order in which ants take those that are free, see `starts`."""
    numbers = {cell: number for number, cell in enumerate(existing_cells(world.ranges))}

    def key(cell: Cell) -> tuple[int, int]:
        far = distance(cell, queen) if where == "nest" else 0
        return far, stream_state(seed, STREAM_START_CELL, numbers[cell])

    return sorted(numbers, key=key)
