"""Synthetic studies of colonies: given deliveries in each condition, with noise over seeds."""

from collections.abc import Callable, Sequence
from itertools import product

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
    world_kinds: Sequence[str] = ("paper",),
) -> Measured:
    """Return a study with noise in percent of the truth over seeds; the bound is 25 per ant."""
    random = np.random.default_rng(0)
    measured = {}
    for world_kind, one, regime, ants in product(world_kinds, rules, regimes, sizes):
        spread = 1 + noise / 100 * random.standard_normal(seeds)
        deliveries = truth(one, regime, ants) * spread
        measured[Condition(world_kind, one, regime, ants)] = {
            "deliveries": deliveries,
            "greedy": 1.5 * deliveries,
            "bound": np.full(seeds, 25.0 * ants),
            "bound_share": deliveries / (25.0 * ants),
            "per_ant": deliveries / ants,
            "first_delivery": np.full(seeds, 40.0),
            "no_delivery_rate": np.zeros(seeds),
            "blocked": np.full(seeds, ants / 100),
            "reward": 500.0 * spread,
        }
    return measured
