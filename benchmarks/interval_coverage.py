"""How often the intervals over seeds hold what they are for, on pools of real training runs.

Trains thousands of seeds of a few of the paper's configurations. The mean and the interquartile
mean (IQM) of such a pool are taken for the truth; from it, 10 to 100 seeds are drawn without
replacement, again and again, and the intervals of each draw are held against the truth. Prints the
tables of docs/statistics.md:

    python benchmarks/interval_coverage.py
"""

from __future__ import annotations

import argparse

import numpy as np

from taichi_ants import Task, TrainingConfig, train, worlds
from taichi_ants.analysis.statistics import (
    bootstrap_interval,
    cautious_interval,
    interquartile_mean,
)
from taichi_ants.analysis.tables import table

POOL = 4000  # seeds
SIZES = (10, 20, 50, 100)
DRAWS = 2000
RESAMPLES = 10_000
VERDICT_LEVEL = 0.999

SLOW = TrainingConfig("q_learning", 0.001, 0.99, 0.3, 0.99)
FAST = TrainingConfig("q_learning", 0.01, 0.99, 0.3, 0.99)
SARSA = TrainingConfig("sarsa", 0.001, 0.99, 0.3, 0.99)


def pools(seeds: int = POOL) -> dict[str, np.ndarray]:
    """Quantities of the analysis, float64 (seeds,) each, over the last 50 of 500 episodes."""
    result = train(
        worlds.paper(), (SLOW, FAST, SARSA), range(seeds), task=Task(delivery="continuing")
    )
    late = slice(-50, None)
    slow, fast, sarsa = result.returns[..., late].mean(axis=2)
    return {
        "return, Q-learning at 0.001 / 0.99 / 0.3 / 0.99": slow,
        "return, Q-learning at 0.01 / 0.99 / 0.3 / 0.99": fast,
        "return, SARSA at 0.001 / 0.99 / 0.3 / 0.99": sarsa,
        "return, Q-learning minus SARSA at 0.001": slow - sarsa,
        "return, Q-learning at 0.01 minus 0.001": fast - slow,
        "steps, Q-learning at 0.001": result.steps[0][:, late].mean(axis=1),
        "deliveries, Q-learning at 0.001": result.deliveries[0][:, late].mean(axis=1),
    }


def coverage(
    pool: np.ndarray, seeds: int, iqm: bool, level: float | None = None, draws: int = DRAWS
) -> float:
    """The share of draws whose interval holds the pool's centre.

    Args:
        pool: Values of runs, float (runs,).
        seeds: How many of them a draw has, each at most once.
        iqm: Whether the centre is the interquartile mean, else the mean.
        level: None for the interval of tables, at 95 %; else the level of the interval of verdicts.
        draws: How many draws.
    """
    random = np.random.default_rng(seeds)
    values = pool[random.random((draws, len(pool))).argpartition(seeds, axis=1)[:, :seeds]]
    truth = interquartile_mean(pool[None])[0] if iqm else pool.mean()
    if level is None:
        low, high = bootstrap_interval(values, 0.95, RESAMPLES, iqm)
    else:
        low, high = cautious_interval(values, level, RESAMPLES, iqm)
    return float(((low <= truth) & (truth <= high)).mean())


def coverage_table(data: dict[str, np.ndarray], level: float | None, draws: int) -> str:
    """Markdown: a line for each pool, its centres, and the coverage at each number of seeds."""
    kinds = [(iqm, size) for iqm in (False, True) for size in SIZES]
    lines = []
    for name, pool in data.items():
        cells = [f"{coverage(pool, size, iqm, level, draws):.3f}" for iqm, size in kinds]
        centres = (pool.mean(), interquartile_mean(pool[None])[0])
        lines.append([name, *(f"{centre:.2f}" for centre in centres), *cells])
    headers = [f"{'IQM' if iqm else 'mean'}, {size}" for iqm, size in kinds]
    return table(["Of 50 episodes", "mean", "IQM", *headers], lines)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--pool", type=int, default=POOL, help="training runs of a configuration")
    parser.add_argument("--draws", type=int, default=DRAWS, help="draws of each number of seeds")
    settings = parser.parse_args()
    data = pools(settings.pool)
    print("95 % intervals of tables and figures:\n")
    print(coverage_table(data, None, settings.draws))
    print(f"{100 * VERDICT_LEVEL:g} % intervals of verdicts:\n")
    print(coverage_table(data, VERDICT_LEVEL, settings.draws))


if __name__ == "__main__":
    main()
