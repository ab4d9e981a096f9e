"""What the colony of the reference holds and returns: ants, transitions, episodes, snapshots."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from taichi_ants.reference.ant import Ant
from taichi_ants.reference.geometry import Cell
from taichi_ants.reference.random_stream import RandomStream
from taichi_ants.reference.records import Outcome, Pair


@dataclass(slots=True, kw_only=True)
class ColonyAnt(Ant):
    """An ant of a colony.

    Attributes:
        slot: Its place, 0 .. slots - 1; free again after its death.
        number: The initial ants are 0 .. n - 1, those born in an episode n, n + 1, ...
        stream: Its random stream.
        age: Ticks that it has lived, where there is a lifespan, else 0.
        state: What it sees, the index of a state.
        action: What it did last, 0..4; -1 before its first tick.
        reward: What that gave; 0 before its first tick.
        chosen: The action that it has drawn already for its next tick, if any.
    """

    slot: int
    number: int
    stream: RandomStream
    age: int = 0
    state: int = 0
    action: int = -1
    reward: int = 0
    chosen: int | None = None


@dataclass(frozen=True)
class Transition:
    """What one ant did in one tick, and what it learns from.

    Attributes:
        slot, number: Of the ant.
        state, action, reward, next_state: As it saw and did.
        terminated: Whether it gave its food and this counts as a terminal state.
        next_action: a', if it was drawn.
        died: Whether this was its last tick (the update bootstraps all the same).
    """

    slot: int
    number: int
    state: int
    action: int
    reward: int
    next_state: int
    terminated: bool
    next_action: int | None
    died: bool

    @property
    def pair(self) -> Pair:
        """State and action."""
        return self.state, self.action

    @property
    def outcome(self) -> Outcome:
        """Reward, next state, whether it terminated."""
        return self.reward, self.next_state, self.terminated


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


@dataclass(frozen=True)
class AntSnapshot:
    """A living ant between two ticks; see `ColonyAnt`."""

    number: int
    cell: Cell
    heading: int
    carries: bool
    age: int
    state: int
    action: int
    reward: int
    rng_state: int


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
        q_values: float32 (128, 5), or (slots, 128, 5) with a table for each slot.
        models: The visited pairs in the order of first visit, with what was seen last: (state,
            action, reward, next state, terminated); one list, or one for each slot.
        epsilon: Of the present episode.
        record: What happened in the episode.
    """

    ants: dict[int, AntSnapshot]
    ground: dict[Cell, int]
    levels: dict[Cell, int | np.float32]
    homes: list[tuple[Cell, int | None]]
    store: int
    queen_rng_state: int
    q_values: np.ndarray
    models: list[list[tuple[int, int, int, int, bool]]]
    epsilon: float
    record: EpisodeRecord
