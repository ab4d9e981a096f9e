"""Made-up studies of the colony: what each condition delivers is given, seeds add noise."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from taichi_ants.analysis.bounds.limits import Limits
from taichi_ants.analysis.colony.study import (
    PHEROMONES,
    WAYS,
    Arena,
    ColonyStudy,
    Condition,
    Record,
)

TICKS = 1000
SIZES = (1, 2, 4, 8)
LIMITS = Limits(first=30.0, cycle=40.0, crowd_cycle=40.0, food=1000.0, queen=1000.0)

# (pheromone, way, ants) -> deliveries per 1000 ticks of the whole colony.
Truth = Callable[[str, str, int], float]


def proportional(pheromone: str, way: str, ants: int) -> float:
    """Every ant delivers 20, whatever it shares and smells."""
    return 20.0 * ants


def build(
    truth: Truth = proportional,
    *,
    seeds: int = 12,
    noise: float = 1.0,
    sizes: Sequence[int] = SIZES,
    ways: Sequence[str] = tuple(WAYS),
    pheromones: Sequence[str] = tuple(PHEROMONES),
    first: Callable[[int], int] = lambda ants: 40,
    reward: Truth = lambda pheromone, way, ants: 500.0,
    limits: Limits | None = LIMITS,
    arenas: Sequence[str] = ("paper",),
    rollouts: int = 2,
) -> ColonyStudy:
    """A study in which all is as the truth says, but for noise of the given standard deviation.

    Args:
        truth: Deliveries per 1000 ticks.
        seeds, sizes, ways, pheromones, arenas, rollouts: The conditions.
        noise: Standard deviation over seeds, as a share of the truth in percent.
        first: Ticks to the first delivery by number of ants; -1 for none.
        reward: Reward per ant and 1000 ticks.
        limits: Those of every world, None for none.
    """
    random = np.random.default_rng(0)
    records = {}
    for arena in arenas:
        for pheromone in pheromones:
            for way in ways:
                for ants in sizes:
                    shape = (seeds, rollouts)
                    spread = 1 + noise / 100 * random.standard_normal(shape)
                    # Steps of one delivery in 1000 ticks are coarse: count in 1000 times as many.
                    deliveries = np.round(1000 * truth(pheromone, way, ants) * spread).astype(int)
                    moves = np.full(shape, 1_000_000)
                    records[Condition(arena, pheromone, way, ants)] = Record(
                        deliveries=deliveries,
                        first_delivery=np.full(shape, first(ants)),
                        moves=moves,
                        blocked=moves * ants // 100,
                        returns=np.round(
                            1000 * reward(pheromone, way, ants) * ants * spread
                        ).astype(int),
                    )
    return ColonyStudy(
        tuple(
            Arena(
                name=arena,
                words=f"the {arena} world",
                sizes=tuple(sizes),
                episodes=50,
                ticks=1000 * TICKS,
                rollouts=rollouts,
                seeds=seeds,
                long_factor=64,
                limits=(limits,) * seeds if limits else (),
            )
            for arena in arenas
        ),
        records,
    )
