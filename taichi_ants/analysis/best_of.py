"""What choosing the best of several configurations does to a reported figure.

The paper trains each configuration once and reports, for each algorithm, the one of its 16 with
the highest return. `best_of` repeats exactly that with every seed we have: how far would the
reported figures have varied by luck? `held_out` chooses on one half of the seeds and reports on
the other, which removes the luck from the report.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from taichi_ants.analysis.comparison import Comparison, Hyperparameters, Variant
from taichi_ants.analysis.statistics import RANDOM_SEED

DRAWS = 20_000


@dataclass(frozen=True)
class BestOf:
    """The winners of many repetitions of "train each once, report the best by return".

    Attributes:
        configurations: How many compete.
        returns: Reward, mean of the winner's last 50 episodes, float64 (draws,).
        steps: The winner's mean length of all episodes, float64 (draws,).
        deliveries: The winner's mean deliveries in its last 50 episodes, float64 (draws,).
    """

    configurations: int
    returns: np.ndarray
    steps: np.ndarray
    deliveries: np.ndarray


def best_of(
    comparison: Comparison, delivery: str, variant: Variant, draws: int = DRAWS
) -> BestOf | None:
    """Draws an independent random seed for each configuration and reports the best of them.

    Returns None where the comparison has no configuration of the learner.
    """
    positions = comparison.positions(delivery, variant)
    if not positions:
        return None
    random = np.random.default_rng(RANDOM_SEED)
    seeds = random.integers(0, len(comparison.seeds), size=(draws, len(positions)))
    rows = np.array(positions)
    winner = comparison.measure("return_last50")[rows, seeds].argmax(axis=1)
    won = rows[winner], seeds[np.arange(draws), winner]
    return BestOf(
        len(positions),
        comparison.measure("return_last50")[won],
        comparison.measure("steps_all")[won],
        comparison.measure("deliveries_last50")[won],
    )


def percentile_of(figure: float, values: np.ndarray) -> float:
    """The percentage of values below a figure, equal ones counted by half."""
    return float(50 * ((values < figure).mean() + (values <= figure).mean()))


@dataclass(frozen=True)
class HeldOut:
    """The best configuration by one half of the seeds, measured on the other half.

    Attributes:
        hyperparameters: The configuration chosen.
        position: Its row in the comparison.
        seeds: Positions of the seeds on which it is reported.
    """

    hyperparameters: Hyperparameters
    position: int
    seeds: slice


def held_out(comparison: Comparison, positions: Sequence[int]) -> HeldOut | None:
    """Chooses by mean return on the seeds at even positions; those at odd ones are for the report.

    Args:
        positions: Rows of the comparison that compete.

    Returns:
        None where none competes, or there is no second seed.
    """
    if not positions or len(comparison.seeds) < 2:
        return None
    choice = comparison.measure("return_last50")[positions, ::2].mean(axis=1).argmax()
    best = positions[int(choice)]
    return HeldOut(comparison.rows[best].hyperparameters, best, slice(1, None, 2))
