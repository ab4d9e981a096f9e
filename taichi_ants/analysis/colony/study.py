"""What the scaling study of the colony compares, and what it measures.

A condition is so many ants of a design in one kind of world. A design is the rules of the game and
a way to come to a policy. Seeds are the unit of all statistics; they pair the conditions of an
arena, since a seed gives all of them the same world.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

# Kinds of world, with the words of tables and figures.
ARENAS: dict[str, str] = {
    "paper": "the paper's world",
    "open": "open worlds (30, 30, 30)",
    "large": "large worlds (100, 100, 100)",
}
# Rules of the game: here what becomes of the trails that ants lay.
ON, OFF, LASTING = "on", "off", "lasting"
RULES: dict[str, str] = {
    ON: "evaporating trails",
    OFF: "no trails laid",
    LASTING: "lasting trails",
}
# Ways to come to a policy.
COPIED, COPIED_LONG, JOINT, THEN_JOINT, OWN = "copied", "copied_long", "joint", "then_joint", "own"
WAYS: dict[str, str] = {
    COPIED: "trained alone, copied",
    COPIED_LONG: "trained alone for long, copied",
    JOINT: "trained jointly",
    THEN_JOINT: "trained alone, then jointly",
    OWN: "a table per ant",
}


class Design(NamedTuple):
    """Names in `RULES` and `WAYS`."""

    rules: str
    way: str

    @property
    def words(self) -> str:
        """What tables call it."""
        return f"{WAYS[self.way]} ({RULES[self.rules]})"


class Condition(NamedTuple):
    """What was evaluated: a name in `ARENAS`, a design, and how many ants."""

    arena: str
    rules: str
    way: str
    ants: int


# Measures of each seed, float64 (seeds,), by their names in `MEASURES`.
Measured = Mapping[Condition, Mapping[str, np.ndarray]]


@dataclass(frozen=True)
class Measure:
    """A number of a seed under a condition.

    Attributes:
        words: What it is, for readers.
        compute: From the outcome of a `ColonyPoint`, integer arrays (seeds, episodes) by name, how
            many ants there are, and the ticks of an episode: float64 (seeds,).
    """

    words: str
    compute: Callable[[Mapping[str, np.ndarray], int, int], np.ndarray]


def _per_1000(counts: np.ndarray, ticks: int) -> np.ndarray:
    return counts.mean(axis=1, dtype=float) * 1000 / ticks


def _first_delivery(outcome: Mapping[str, np.ndarray], ants: int, ticks: int) -> np.ndarray:
    """An episode without a delivery counts with all its ticks.

    So the mean is that of the time to the first delivery or the end, whichever comes first (the
    restricted mean of survival analysis), and never too large.
    """
    first = outcome["first_delivery"].astype(int)
    return np.where(first < 0, ticks, first).mean(axis=1)


def _blocked(outcome: Mapping[str, np.ndarray], ants: int, ticks: int) -> np.ndarray:
    moves = outcome["moves"].sum(axis=1, dtype=float)
    return outcome["blocked"].sum(axis=1) / np.maximum(moves, 1.0)


MEASURES: dict[str, Measure] = {
    "deliveries": Measure(
        "deliveries per 1000 ticks",
        lambda outcome, ants, ticks: _per_1000(outcome["deliveries"], ticks),
    ),
    "per_ant": Measure(
        "deliveries per ant and 1000 ticks",
        lambda outcome, ants, ticks: _per_1000(outcome["deliveries"], ticks) / ants,
    ),
    "first_delivery": Measure("ticks to the first delivery", _first_delivery),
    "fruitless": Measure(
        "share of episodes without a delivery",
        lambda outcome, ants, ticks: (outcome["first_delivery"] < 0).mean(axis=1),
    ),
    "blocked": Measure("share of blocked moves", _blocked),
    "reward": Measure(
        "reward per ant and 1000 ticks",
        lambda outcome, ants, ticks: _per_1000(outcome["returns"], ticks) / ants,
    ),
}
