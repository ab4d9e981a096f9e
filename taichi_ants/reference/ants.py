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
        cell, heading, carries: Where it is (normal form), where it looks (0..5), whether it
            carries food.
        slot: Its place in the colony, 0 .. slots - 1; free again after its death.
        number: The initial ants are 0 .. n - 1, those born in an episode n, n + 1, ...
        stream: Its random stream.
        age: Ticks that it has lived, where there is a lifespan, else 0.
        carried: Ticks that it has carried its food, 0 without food.
        percept: What lies in the three cells ahead, 0..127; what it does goes by this.
        state: The index of its state; what it chooses and learns goes by this.
        action: What it did last, 0..4; -1 before its first tick.
        reward: What that gave; 0 before its first tick.
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
    """What one ant did in one tick, and what it learns from.

    Attributes:
        slot, number: Of the ant.
        episode, step: The episode in the run and the tick in the episode, from 0.
        cell, heading, state: Of the ant before the tick.
        action, reward, event: What it did, and what came of it.
        next_state: Of the ant after the tick.
        next_action: a', if it was drawn.
        terminated: Whether it gave its food and this counts as a terminal state: the update does
            not bootstrap.
        truncated: Whether this was the ant's last update in the episode all the same: its last
            tick, its death, or a delivery that ends the episode and is not terminal.
        td_error: Of the update from this step (planning is not recorded); None if nobody learns.
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
        """State and action."""
        return self.state, self.action


def starts(world: World, seed: int, n: int = 1, where: str = "nest") -> list[tuple[Cell, int]]:
    """Cell and heading of each of n ants.

    The ants that the world lists come first. The others take free cells, those nearest to the
    queen if `where` is "nest", any if it is "spread", otherwise in an order that depends on the
    seed; and a heading that depends on the seed.

    Raises:
        AntsError: The world has too few free cells.
    """
    listed = [((x, y, z), heading) for x, y, z, heading in world.ants.tolist()]
    if n <= len(listed):
        return listed[:n]
    taken = {world.queen, *listed_cells(world.foods), *listed_cells(world.obstacles)}
    taken |= {cell for cell, _ in listed}
    free = [
        (
            distance(cell, world.queen) if where == "nest" else 0,
            stream_state(seed, STREAM_START_CELL, number),
            cell,
        )
        for number, cell in enumerate(existing_cells(world.ranges))
        if cell not in taken
    ]
    missing = n - len(listed)
    if missing > len(free):
        raise AntsError(
            f"n is {n}; the world lists {len(listed)} ants and has {len(free)} free cells, "
            "so take fewer ants or a larger world."
        )
    first = [cell for _, _, cell in sorted(free)[:missing]]
    return listed + [
        (cell, pick(stream_state(seed, STREAM_START_HEADING, ant) >> 32, N_HEADINGS))
        for ant, cell in enumerate(first, start=len(listed))
    ]
