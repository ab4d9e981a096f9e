"""What the scaling study of the colony measured, as data.

A study has arenas (kinds of world). In each it evaluates conditions: so many ants, a way of
sharing, a pheromone. Seeds are the unit of all statistics; they pair the conditions of an arena,
since a seed gives all of them the same world.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from taichi_ants.analysis.bounds.limits import Limits

# Ways of sharing, with the words of tables and figures.
COPIED, COPIED_LONG, JOINT, THEN_JOINT, OWN = "copied", "copied_long", "joint", "then_joint", "own"
WAYS: dict[str, str] = {
    COPIED: "trained alone, copied",
    COPIED_LONG: "trained alone for long, copied",
    JOINT: "trained jointly",
    THEN_JOINT: "trained alone, then jointly",
    OWN: "a table per ant",
}
# What becomes of the trail that ants lay.
ON, OFF, LASTING = "on", "off", "lasting"
PHEROMONES: dict[str, str] = {
    ON: "evaporating trails",
    OFF: "no trails laid",
    LASTING: "lasting trails",
}


@dataclass(frozen=True, order=True)
class Condition:
    """What was evaluated: names of an arena, of a pheromone and of a way, and how many ants."""

    arena: str
    pheromone: str
    way: str
    ants: int


@dataclass(frozen=True)
class Record:
    """What the evaluation of a condition gave, integer arrays (seeds, episodes).

    Attributes:
        deliveries: Foods given to the queen.
        first_delivery: Ticks until the first of them; -1 if there was none.
        moves: Moves that ants tried.
        blocked: Moves that failed.
        returns: Rewards of all ants.
    """

    deliveries: np.ndarray
    first_delivery: np.ndarray
    moves: np.ndarray
    blocked: np.ndarray
    returns: np.ndarray


@dataclass(frozen=True)
class Arena:
    """A kind of world.

    Attributes:
        name: Its name in tables.
        words: What sentences call it, for example "the paper's world".
        sizes: The numbers of ants, ascending.
        episodes: Training episodes.
        ticks: Ticks of each episode, of training and evaluation.
        rollouts: Evaluation episodes of each seed.
        seeds: How many.
        long_factor: How many times as long those are trained that are trained alone for long.
        limits: What no colony can exceed, one entry for each seed.
    """

    name: str
    words: str
    sizes: tuple[int, ...]
    episodes: int
    ticks: int
    rollouts: int
    seeds: int
    long_factor: int
    limits: tuple[Limits, ...]

    def limit(self, ants: int) -> float | None:
        """The most that so many ants can deliver per 1000 ticks, mean over seeds, if known."""
        each = [limit.deliveries(ants) for limit in self.limits]
        return float(np.mean(each)) if each else None


@dataclass(frozen=True)
class Measure:
    """A number of a seed under a condition.

    Attributes:
        words: What it is, for readers.
        digits: Decimal places in tables.
    """

    words: str
    digits: int


MEASURES: dict[str, Measure] = {
    "deliveries": Measure("deliveries per 1000 ticks", 1),
    "per_ant": Measure("deliveries per ant and 1000 ticks", 2),
    "first_delivery": Measure("ticks to the first delivery", 0),
    "fruitless": Measure("share of episodes without a delivery", 2),
    "blocked": Measure("share of blocked moves", 3),
    "reward": Measure("reward per ant and 1000 ticks", 0),
}


@dataclass(frozen=True)
class ColonyStudy:
    """The whole study.

    Attributes:
        arenas: The kinds of world.
        records: What each condition gave.
    """

    arenas: tuple[Arena, ...]
    records: Mapping[Condition, Record]

    def has(self, arena: Arena, pheromone: str, way: str, sizes: Iterable[int]) -> bool:
        """Whether all these conditions were evaluated."""
        return all(Condition(arena.name, pheromone, way, n) in self.records for n in sizes)

    def sizes(self, arena: Arena, pheromone: str, way: str) -> tuple[int, ...]:
        """The numbers of ants with which a way was evaluated, ascending."""
        return tuple(n for n in arena.sizes if self.has(arena, pheromone, way, [n]))

    def values(
        self, arena: Arena, pheromone: str, way: str, ants: int, measure: str = "deliveries"
    ) -> np.ndarray:
        """A measure of a condition, float64 (seeds,)."""
        record = self.records[Condition(arena.name, pheromone, way, ants)]
        return compute(record, measure, ants, arena.ticks)

    def mean(
        self, arena: Arena, pheromone: str, way: str, ants: int, measure: str = "deliveries"
    ) -> float:
        """Its mean over seeds."""
        return float(self.values(arena, pheromone, way, ants, measure).mean())


def compute(record: Record, measure: str, ants: int, ticks: int) -> np.ndarray:
    """A measure of each seed, float64 (seeds,), from its evaluation episodes of equal length.

    An episode without a delivery counts with all its ticks for `first_delivery`: the mean is that
    of the time to the first delivery or the end, whichever comes first (the restricted mean of
    survival analysis), and never too large. `fruitless` tells how often this was so.
    """
    if measure == "first_delivery":
        none = record.first_delivery < 0
        return np.where(none, ticks, record.first_delivery).mean(axis=1)
    if measure == "fruitless":
        return (record.first_delivery < 0).mean(axis=1)
    if measure == "blocked":
        moves = record.moves.sum(axis=1, dtype=float)
        return record.blocked.sum(axis=1) / np.maximum(moves, 1.0)
    rewarded = record.returns if measure == "reward" else record.deliveries
    per_1000 = rewarded.mean(axis=1, dtype=float) * 1000 / ticks
    return per_1000 if measure == "deliveries" else per_1000 / ants
