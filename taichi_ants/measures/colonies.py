"""Measures of the evaluation of a colony: one number for each seed."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

# Measures of a colony, with their names in tables.
MEASURES: dict[str, str] = {
    "deliveries": "deliveries per 1000 ticks",
    "per_ant": "deliveries per ant and 1000 ticks",
    "first_delivery": "ticks to the first delivery",
    "no_delivery_rate": "share of episodes without a delivery",
    "blocked": "share of blocked moves",
    "reward": "reward per ant and 1000 ticks",
}
# Those of the study of colonies, which also evaluates without exploration and computes bounds.
OF_STUDY: dict[str, str] = {
    **MEASURES,
    "greedy": "deliveries per 1000 ticks without exploration",
    "bound": "most deliveries per 1000 ticks that are possible in the world of the seed",
    "bound_share": "deliveries as a share of that bound",
}


def measures_of(outcome: Mapping[str, np.ndarray], ants: int, ticks: int) -> dict[str, np.ndarray]:
    """Return the `MEASURES` of each seed, float64 (seeds,), from the outcome of a `ColonyPoint`.

    For `first_delivery`, an episode without a delivery counts with all its ticks. This restricted
    mean (of survival analysis) is at most the true one; `no_delivery_rate` is the share of such
    episodes. `blocked` is nan if no ant tried to move.
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
        "blocked": outcome["blocked"].sum(axis=1) / np.where(moves > 0, moves, np.nan),
        "reward": rewards / ants,
    }
