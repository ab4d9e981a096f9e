"""What the study of the colony compares, and what it measures.

A condition is so many ants of a design (rules and a training regime) in one kind of world. A seed
gives all conditions of a kind of world the same world, and so pairs them; except in the paper's,
no ant has seen it before.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

# Kinds of world in which ants are trained and evaluated, with the words of tables and figures.
WORLD_KINDS: dict[str, str] = {
    "paper": "the paper's world",
    "open": "open worlds (30, 30, 30)",
    "piles": "three far piles (30, 30, 30)",
}
# Kinds of world in which ants are evaluated that were trained in open ones.
ELSEWHERES: dict[str, str] = {
    "rocks": "twice the rocks",
    "one_pile": "one far pile",
    "moving": "piles that move every 100 ticks",
    "slow": "food that grows back after 100 ticks",
    "small": "small worlds (15, 15, 15)",
    "wide": "wide worlds (60, 60, 60)",
    "large": "large worlds (100, 100, 100), 1000 ants",
}
WORLDS = {**WORLD_KINDS, **ELSEWHERES}

# Rules of the game: A, trails that rise towards food; B, right of way; C, ants in view.
PAPER, SILENT, A, BC, ABC, ABC_SILENT, QUEUES = (
    *("paper", "paper_no_trails", "direction", "right_of_way"),
    *("foraging", "foraging_no_trails", "queueing"),
)
RULES: dict[str, str] = {
    PAPER: "paper's rules",
    SILENT: "paper's rules, no trails laid",
    A: "A",
    BC: "B + C",
    ABC: "A + B + C",
    ABC_SILENT: "B + C, no trails laid",
    QUEUES: "queues",
}
# Ways to come to a policy.
JOINT, ALONE, FEW, SOME, ABROAD = "joint", "alone", "with_4", "with_16", "open"
REGIMES: dict[str, str] = {
    JOINT: "trained jointly",
    ALONE: "trained alone, copied",
    FEW: "trained with 4",
    SOME: "trained with 16",
    ABROAD: "trained in open worlds",
}


class Design(NamedTuple):
    """Names in `RULES` and `REGIMES`."""

    rules: str
    regime: str = JOINT

    @property
    def words(self) -> str:
        """What tables call it."""
        rules = RULES[self.rules]
        return rules if self.regime == JOINT else f"{rules}, {REGIMES[self.regime]}"


class Condition(NamedTuple):
    """What was evaluated: a name in `WORLDS`, a design, and how many ants."""

    world_kind: str
    rules: str
    regime: str
    ants: int


EVALUATION_EPSILON = 0.01  # the exploration rate of the evaluation
# Measures of a colony, with their names in tables.
MEASURES: dict[str, str] = {
    "deliveries": "deliveries per 1000 ticks",
    "per_ant": "deliveries per ant and 1000 ticks",
    "first_delivery": "ticks to the first delivery",
    "no_delivery_rate": "share of episodes without a delivery",
    "blocked": "share of blocked moves",
    "reward": "reward per ant and 1000 ticks",
}
# Those of the study, which also evaluates without exploration and knows bounds of its worlds.
OF_STUDY: dict[str, str] = {
    **MEASURES,
    "greedy": "deliveries per 1000 ticks without exploration",
    "bound": "most deliveries per 1000 ticks that are possible in the world of the seed",
    "of_bound": "deliveries as a share of that bound",
}
# Measures of each seed, float64 (seeds,), by their names in `OF_STUDY`.
Measured = Mapping[Condition, Mapping[str, np.ndarray]]


def measures_of(outcome: Mapping[str, np.ndarray], ants: int, ticks: int) -> dict[str, np.ndarray]:
    """Return the `MEASURES` of each seed, float64 (seeds,), from the outcome of a `ColonyPoint`.

    An episode without a delivery counts with all its ticks for `first_delivery`: the mean is that
    of the time to the first delivery or the end, whichever comes first (the restricted mean of
    survival analysis), and never too large. `no_delivery_rate` tells how often this was so.
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
        "no_delivery_rate": (first < 0).mean(axis=1),
        "blocked": outcome["blocked"].sum(axis=1) / np.maximum(moves, 1.0),
        "reward": rewards / ants,
    }
