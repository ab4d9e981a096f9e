"""Synthetic studies of colonies: given deliveries in each condition, with noise over seeds."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from colony_findings import REGIMES, RULES, Condition, Measured

SIZES = (1, 2, 4, 8)


# (rules, regime, ants) -> deliveries per 1000 ticks of the whole colony.
Truth = Callable[[str, str, int], float]


def proportional(rules: str, regime: str, ants: int) -> float:
    """Return deliveries if each ant delivers 20 in all conditions."""
    return 20.0 * ants


def build(
    truth: Truth = proportional,
    *,
    seeds: int = 12,
    noise: float = 1.0,
    sizes: Sequence[int] = SIZES,
    regimes: Sequence[str] = tuple(REGIMES),
    rules: Sequence[str] = tuple(RULES),
    first: Callable[[int], int] = lambda ants: 40,
    reward: Truth = lambda rules, regime, ants: 500.0,
    world_kinds: Sequence[str] = ("paper",),
) -> Measured:
    """Return a study with the given deliveries and noise; the bound is 25 per ant.

    Args:
        truth: Deliveries per 1000 ticks.
        seeds, sizes, regimes, rules, world_kinds: The conditions.
        noise: Standard deviation over seeds, in percent of the truth.
        first: Ticks to the first delivery, by number of ants.
        reward: Reward per ant and 1000 ticks.
    """
    random = np.random.default_rng(0)
    measured = {}
    for world_kind in world_kinds:
        for one in rules:
            for regime in regimes:
                for ants in sizes:
                    spread = 1 + noise / 100 * random.standard_normal(seeds)
                    deliveries = truth(one, regime, ants) * spread
                    measured[Condition(world_kind, one, regime, ants)] = {
                        "deliveries": deliveries,
                        "greedy": 1.5 * deliveries,
                        "bound": np.full(seeds, 25.0 * ants),
                        "bound_share": deliveries / (25.0 * ants),
                        "per_ant": deliveries / ants,
                        "first_delivery": np.full(seeds, float(first(ants))),
                        "no_delivery_rate": np.zeros(seeds),
                        "blocked": np.full(seeds, ants / 100),
                        "reward": reward(one, regime, ants) * spread,
                    }
    return measured
