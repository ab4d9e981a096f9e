"""Building blocks of the claims: who is compared with whom, and what counts as much."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from taichi_ants.analysis.claims.model import Contrast
from taichi_ants.analysis.claims.slice import Slice
from taichi_ants.analysis.paper.comparison import Variant
from taichi_ants.analysis.paper.published import DYNA_P3, DYNA_P5, Q_LEARNING, SARSA

# What is too small to matter. An episode along the shortest path returns 45 reward in 34 steps:
# one reward is one step on a trail, and two steps is the spread that the paper itself calls alike
# ("34-36 steps").
REWARD_MARGIN = 1.0
STEPS_MARGIN = 2.0
FLUCTUATION_MARGIN = 0.5  # reward
# "Substantially", "strongly" in steps: a tenth of the paper's 101 steps of Q-learning.
MANY_STEPS = 10.0

# What effects cannot leave: an episode ends with a delivery, so that deliveries are a share too.
SHARE, DIFFERENCE = (0.0, 1.0), (-1.0, 1.0)

REWARD, STEPS, DELIVERIES = "reward", "steps", "deliveries per episode"

# What must be positive for Dyna-Q to lie between the two others.
Q_OVER_DYNA_OVER_SARSA = tuple(
    pair for dyna in (DYNA_P3, DYNA_P5) for pair in ((Q_LEARNING, dyna), (dyna, SARSA))
)

# Slice method, such as `Slice.table2`: (slice, measure, learner) -> float64 (seeds,).
Read = Callable[[Slice, str, Variant], np.ndarray]


def minus(read: Read, measure: str, first: Variant, second: Variant) -> Contrast:
    """First minus second learner, seed by seed."""
    return Contrast(
        f"{first.label} minus {second.label}",
        lambda part: read(part, measure, first) - read(part, measure, second),
    )


def differences(
    read: Read, measure: str, pairs: Iterable[tuple[Variant, Variant]]
) -> tuple[Contrast, ...]:
    """`minus` for several pairs."""
    return tuple(minus(read, measure, first, second) for first, second in pairs)


def each(read: Read, measure: str, variants: Iterable[Variant]) -> tuple[Contrast, ...]:
    """The measure itself, for each learner."""

    def values(variant: Variant) -> Contrast:
        return Contrast(variant.label, lambda part: read(part, measure, variant))

    return tuple(values(variant) for variant in variants)


def share_above(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """In which share of matched configurations the first is above the second; ties count half.

    Args:
        first, second: Float (..., seeds).

    Returns:
        Float64 (seeds,).
    """
    above = (first > second) + 0.5 * (first == second)
    return above.reshape(-1, above.shape[-1]).mean(axis=0)
