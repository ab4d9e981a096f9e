"""What the scaling study of the colony compares, and what it measures.

A condition is so many ants of a design in one kind of world. A design is the rules of the game and
a way to come to a policy. Seeds are the unit of all statistics; they pair the conditions of an
arena, since a seed gives all of them the same world.
"""

from __future__ import annotations

from collections.abc import Mapping
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


# What is measured, with the words of tables.
MEASURES: dict[str, str] = {
    "deliveries": "deliveries per 1000 ticks",
    "per_ant": "deliveries per ant at the start and 1000 ticks",
    "first_delivery": "ticks to the first delivery",
    "fruitless": "share of episodes without a delivery",
    "blocked": "share of blocked moves",
    "reward": "reward per ant at the start and 1000 ticks",
}
# Measures of each seed, float64 (seeds,), by their names in `MEASURES`.
Measured = Mapping[Condition, Mapping[str, np.ndarray]]


def measures_of(outcome: Mapping[str, np.ndarray], ants: int, ticks: int) -> dict[str, np.ndarray]:
    """All measures of each seed, float64 (seeds,).

    An episode without a delivery counts with all its ticks for `first_delivery`: the mean is that
    of the time to the first delivery or the end, whichever comes first (the restricted mean of
    survival analysis), and never too large. `fruitless` tells how often this was so.

    Args:
        outcome: That of a `ColonyPoint`, integer arrays (seeds, episodes) by name.
        ants: How many there are.
        ticks: Ticks of each episode.
    """
    deliveries, rewards = (
        outcome[name].mean(axis=1, dtype=float) * 1000 / ticks for name in ("deliveries", "returns")
    )
    first = outcome["first_delivery"].astype(int)
    moves = outcome["moves"].sum(axis=1, dtype=float)
    return {
        "deliveries": deliveries,
        "per_ant": deliveries / ants,
        "first_delivery": np.where(first < 0, ticks, first).mean(axis=1),
        "fruitless": (first < 0).mean(axis=1),
        "blocked": outcome["blocked"].sum(axis=1) / np.maximum(moves, 1.0),
        "reward": rewards / ants,
    }
