"""Made-up studies of the colony: what each condition delivers is given, seeds add noise."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from taichi_ants.analysis.colony.study import RULES, WAYS, Condition, Measured

SIZES = (1, 2, 4, 8)


# (rules, way, ants) -> deliveries per 1000 ticks of the whole colony.
Truth = Callable[[str, str, int], float]


def proportional(rules: str, way: str, ants: int) -> float:
    """Every ant delivers 20, whatever it shares and smells."""
    return 20.0 * ants


def build(
    truth: Truth = proportional,
    *,
    seeds: int = 12,
    noise: float = 1.0,
    sizes: Sequence[int] = SIZES,
    ways: Sequence[str] = tuple(WAYS),
    rules: Sequence[str] = tuple(RULES),
    first: Callable[[int], int] = lambda ants: 40,
    reward: Truth = lambda rules, way, ants: 500.0,
    arenas: Sequence[str] = ("paper",),
) -> Measured:
    """A study in which all is as the truth says, but for noise of the given standard deviation.

    No colony delivers more than 25 for each ant.

    Args:
        truth: Deliveries per 1000 ticks.
        seeds, sizes, ways, rules, arenas: The conditions.
        noise: Standard deviation over seeds, as a share of the truth in percent.
        first: Ticks to the first delivery by number of ants.
        reward: Reward per ant and 1000 ticks.
    """
    random = np.random.default_rng(0)
    measured = {}
    for arena in arenas:
        for one in rules:
            for way in ways:
                for ants in sizes:
                    spread = 1 + noise / 100 * random.standard_normal(seeds)
                    deliveries = truth(one, way, ants) * spread
                    measured[Condition(arena, one, way, ants)] = {
                        "deliveries": deliveries,
                        "greedy": 1.5 * deliveries,
                        "bound": np.full(seeds, 25.0 * ants),
                        "of_bound": deliveries / (25.0 * ants),
                        "per_ant": deliveries / ants,
                        "first_delivery": np.full(seeds, float(first(ants))),
                        "fruitless": np.zeros(seeds),
                        "blocked": np.full(seeds, ants / 100),
                        "reward": reward(one, way, ants) * spread,
                    }
    return measured
