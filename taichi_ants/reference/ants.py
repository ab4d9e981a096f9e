"""An ant, the start of ants, and the transition of an ant in a tick."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from taichi_ants.grid.constants import N_HEADINGS, STREAM_START_CELL, STREAM_START_HEADING
from taichi_ants.reference.geometry import Cell, distance, existing_cells, listed_cells, queens_of
from taichi_ants.reference.random_stream import RandomStream, pick, stream_state
from taichi_ants.task.constants import Event
from taichi_ants.worlds.world import World

Pair = tuple[int, int]  # state, action


@dataclass(slots=True)
class Ant:
    """An ant."""

    cell: Cell
    heading: int
    carries: bool = False
    slot: int = 0  # its place in the colony, 0 .. slots - 1; free again after its death
    number: int = 0  # 0 .. n - 1 for the initial ants; n, n + 1, ... for ants born in the episode
    stream: RandomStream = field(default_factory=lambda: RandomStream(0))
    carried: int = 0  # ticks since its last pick-up or delivery, its birth, or the start
    paper_state: int = 0  # load and codes of the cells ahead, 0 to 127; decides what actions do
    state: int = 0  # the state index, by which it chooses and learns
    misread: dict[int, int] = field(default_factory=dict)  # codes it misreads, by relative heading
    action: int = -1  # the last one; -1 before the first tick
    executed: int = -1  # the last action as executed, which differs from `action` if that slipped
    event: Event = Event.NONE  # of the last action
    reward: int = 0  # of the last action
    chosen: int | None = None  # the action already drawn for the next tick
    nest: int = 0
    caste: int = 0
    trait: float = 0.0  # from 0 to less than 1; never changes
    own: dict[str, Any] = field(default_factory=dict)  # values of features of the model by name


@dataclass(kw_only=True, slots=True)
class Transition:
    """The transition of one ant in one tick, from which it learns."""

    slot: int
    number: int
    episode: int
    step: int  # the tick in the episode, from 0
    cell: Cell  # before the tick
    heading: int  # before the tick
    state: int  # before the tick
    action: int
    reward: int
    event: Event
    next_state: int
    next_action: int | None  # None if none was drawn
    terminated: bool  # a delivery into a terminal state, after which the update does not bootstrap
    # The ant's last update of the episode without `terminated`: in the last tick, at its death, or
    # after a delivery that ends the episode but is not terminal.
    truncated: bool
    nest: int = 0
    caste: int = 0
    td_error: np.float32 | None = None  # without planning; None without learning
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
