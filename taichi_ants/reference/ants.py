"""An ant, the start of ants, and the transition of an ant in a tick."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.grid.constants import N_HEADINGS, STREAM_START_CELL, STREAM_START_HEADING
from taichi_ants.reference.geometry import Cell, distance, existing_cells, listed_cells, queens_of
from taichi_ants.reference.random_stream import RandomStream, pick, stream_state
from taichi_ants.task.events import Event

if TYPE_CHECKING:
    from taichi_ants.worlds.world import World

Pair = tuple[int, int]  # state, action


@dataclass(slots=True)
class Ant:
    """An ant.

    Attributes:
        slot: The ant's place in the colony, 0 .. slots - 1; free again after its death.
        number: 0 .. n - 1 for the initial ants; n, n + 1, ... for ants born in the episode.
        carried: Ticks since the ant's last pick-up or delivery, its birth, or the start.
        nest: The number of its nest.
        kind: The kind of the last food that it picked up.
        caste: The number of its caste.
        trait: Its number from 0 to less than 1, which never changes.
        own: Its values of the features of the model by name, see `reference.features`.
        paper_state: Load and codes of the three cells ahead, 0 to 127; decides what an action does.
        state: The state index, by which the ant chooses and learns.
        misread: The codes of cells in view that the ant misreads, by turns from its heading.
        action, event, reward: The last ones; -1, NONE and 0 before the first tick.
        executed: The last action as executed, which differs from `action` if that slipped.
        chosen: The action already drawn for the next tick, if any.
    """

    cell: Cell
    heading: int
    carries: bool = False
    slot: int = 0
    number: int = 0
    stream: RandomStream = field(default_factory=lambda: RandomStream(0))
    carried: int = 0
    paper_state: int = 0
    state: int = 0
    misread: dict[int, int] = field(default_factory=dict)
    action: int = -1
    executed: int = -1
    event: Event = Event.NONE
    reward: int = 0
    chosen: int | None = None
    nest: int = 0
    kind: int = 0
    caste: int = 0
    trait: float = 0.0
    own: dict[str, Any] = field(default_factory=dict)

    def copy(self) -> Ant:
        """Return the ant as it is now; its random stream stays the same."""
        return replace(self, own={**self.own})


@dataclass(kw_only=True, slots=True)
class Transition:
    """The transition of one ant in one tick, from which it learns.

    Attributes:
        episode, step: The episode in the run and the tick in the episode, from 0.
        cell, heading, state: Values before the tick.
        action, executed: The action that the ant chose, and the one that it executed.
        next_state, next_action: Values after the tick; the action is None if none was drawn.
        terminated: Whether the ant delivered into a terminal state: the update does not bootstrap.
        truncated: Whether this is the ant's last update of the episode without `terminated`: the
            last tick, the ant's death, or a delivery that ends the episode but is not terminal.
        td_error: The error of this step's update, without planning; None without learning.
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
    nest: int = 0
    caste: int = 0
    td_error: np.float32 | None = None
    executed: int = -1

    @property
    def pair(self) -> Pair:
        return self.state, self.action


def starts(world: World, seed: int, n: int = 1, where: str = "nest") -> list[tuple[Cell, int]]:
    """Return the start cell and heading of n ants, for which the world has enough free cells.

    The ants listed by the world are first. The seed decides the headings of the others, and the
    order in which they take free cells: those nearest to their queen first if `where` is "nest",
    cells anywhere if it is "spread". Ants take cells in turn, by number.
    """
    listed = [((x, y, z), heading) for x, y, z, heading in world.ants.tolist()]
    if n <= len(listed):
        return listed[:n]
    queens = queens_of(world)
    taken = {*queens, *listed_cells(world.foods), *listed_cells(world.obstacles)}
    taken |= {cell for cell, _ in listed}
    orders = [iter(start_order(world, queen, seed, where)) for queen in queens]
    for number in range(len(listed), n):
        cell = next(cell for cell in orders[nest_of(world, number)] if cell not in taken)
        taken.add(cell)
        heading = pick(stream_state(seed, STREAM_START_HEADING, number) >> 32, N_HEADINGS)
        listed.append((cell, heading))
    return listed


def nest_of(world: World, number: int) -> int:
    """Return the nest of an ant that starts: for a listed ant the nearest queen's, else in turn."""
    queens = queens_of(world)
    if number >= len(world.ants):
        return number % len(queens)
    x, y, z, _ = world.ants[number].tolist()
    return min(range(len(queens)), key=lambda nest: distance((x, y, z), queens[nest]))


def start_order(world: World, queen: Cell, seed: int, where: str) -> list[Cell]:
    """Return all cells, in the order in which ants take the free ones; see `starts`."""
    numbers = {cell: number for number, cell in enumerate(existing_cells(world.ranges))}

    def key(cell: Cell) -> tuple[int, int]:
        far = distance(cell, queen) if where == "nest" else 0
        return far, stream_state(seed, STREAM_START_CELL, numbers[cell])

    return sorted(numbers, key=key)
