"""What the reference holds and returns: ants, steps, episodes, snapshots."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from taichi_ants.reference.geometry import Cell
from taichi_ants.reference.random_stream import RandomStream

Pair = tuple[int, int]  # state, action
Outcome = tuple[int, int, bool]  # reward, next state, whether it terminated


class Event(Enum):
    """What came of an action."""

    MOVED = "moved"
    BLOCKED = "blocked"  # a move that only turned the ant
    PUSHED = "pushed"  # another ant changed places with it
    PICKED_UP = "picked up"
    DELIVERED = "delivered"
    FAILED = "failed"  # a pick-up or give that could not be done


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
        state: The row of its table that it looks at; what it chooses and learns goes by this.
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


@dataclass(kw_only=True)
class Transition:
    """What one ant did in one tick, and what it learns from.

    Attributes:
        slot, number: Of the ant.
        episode, step: The episode in the run and the tick in the episode, from 0.
        cell, heading, state: Of the ant before the tick.
        action, reward, event: What it did, and what came of it.
        next_cell, next_heading, next_state: Of the ant after the tick.
        next_action: a', if it was drawn.
        terminated: Whether it gave its food and this counts as a terminal state: the update does
            not bootstrap.
        truncated: Whether this was the ant's last update in the episode all the same: its last
            tick, its death, or a delivery that ends the episode and is not terminal.
        td_error: Of the update from this step (planning is not recorded); None if nobody learns.
        rng_state: The state of the ant's random stream after all draws of the tick.
        q_values: The ant's table after the tick, float32 (n_states, 5); if asked for.
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
    next_cell: Cell
    next_heading: int
    next_state: int
    next_action: int | None
    terminated: bool
    truncated: bool
    td_error: np.float32 | None = None
    rng_state: int = 0
    q_values: np.ndarray | None = None

    @property
    def pair(self) -> Pair:
        """State and action."""
        return self.state, self.action

    @property
    def outcome(self) -> Outcome:
        """Reward, next state, whether it terminated."""
        return self.reward, self.next_state, self.terminated

    @property
    def delivered(self) -> bool:
        """Whether the ant gave its food."""
        return self.event is Event.DELIVERED


@dataclass
class EpisodeRecord:
    """What happened in an episode so far.

    Attributes:
        episode_return: Sum of the rewards of all ants.
        ticks: How many have passed.
        deliveries: Foods given to the queen.
        moves: Moves tried, 0..2 among the actions.
        blocked: Moves that only turned the ant.
        first_delivery: Ticks passed when the first food had been given; -1 if none was.
        births, deaths: Of ants.
        regrown: Foods that grew back.
        deliveries_per_tick: Of each tick.
        living_per_tick: Ants alive at the end of each tick.
    """

    episode_return: int = 0
    ticks: int = 0
    deliveries: int = 0
    moves: int = 0
    blocked: int = 0
    first_delivery: int = -1
    births: int = 0
    deaths: int = 0
    regrown: int = 0
    deliveries_per_tick: list[int] = field(default_factory=list)
    living_per_tick: list[int] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class Snapshot:
    """All of a colony between two ticks, in copies.

    Attributes:
        ants: The living ones, by slot.
        ground: Of each existing cell, ants aside: EMPTY, OBSTACLE, FOOD or QUEEN.
        levels: The trail of each existing cell: int, or np.float32 where levels are dense.
        homes: (cell, waiting since) of each food of the start: its place now, and the tick in which
            it was taken, None if it is there.
        store: Foods that wait to be turned into ants.
        queen_rng_state: State of the queen's random stream.
        q_values: float32 (n_states, 5), or (slots, n_states, 5) with a table for each slot.
        models: The visited pairs in the order of first visit, with what was seen last: (state,
            action, reward, next state, terminated); one list, or one for each slot.
        epsilon: Of the present episode.
        record: What happened in the episode.
    """

    ants: dict[int, Ant]
    ground: dict[Cell, int]
    levels: dict[Cell, int | np.float32]
    homes: list[tuple[Cell, int | None]]
    store: int
    queen_rng_state: int
    q_values: np.ndarray
    models: list[list[tuple[int, int, int, int, bool]]]
    epsilon: float
    record: EpisodeRecord
