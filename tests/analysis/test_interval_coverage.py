"""How often the intervals over seeds hold what they are for, on pools of real training runs.

Trains thousands of seeds of a few of the paper's configurations. The mean and the interquartile
mean (IQM) of such a pool are taken for the truth; from it, 10 to 100 seeds are drawn without
replacement, again and again, and the intervals of each draw are held against the truth. With
`pytest -m long -rP` it prints the tables of docs/concepts/statistics.md.
"""

import numpy as np
import pytest
from finished_pages import results

from taichi_ants import Task, TrainingConfig, train, worlds
from taichi_ants.analysis.statistics import (
    RESAMPLES,
    bootstrap_interval,
    cautious_interval,
    interquartile_mean,
)
from taichi_ants.analysis.tables import Table

POOL = 4000  # seeds
SIZES = (10, 20, 50, 100)
DRAWS = 2000  # the standard error of a coverage of 0.95 is 0.005
TABLE_RESAMPLES = 10_000  # an interval at 95 % needs no more
VERDICT_LEVEL = 0.9999  # of each interval of a claim, so that all hold at once with 95 %

SLOW = TrainingConfig("q_learning", 0.001, 0.99, 0.3, 0.99)
FAST = TrainingConfig("q_learning", 0.01, 0.99, 0.3, 0.99)
SARSA = TrainingConfig("sarsa", 0.001, 0.99, 0.3, 0.99)


def pools() -> dict[str, np.ndarray]:
    """Quantities of the analysis, float64 (seeds,) each, over the last 50 of 500 episodes."""
    result = train(
        worlds.paper(), (SLOW, FAST, SARSA), range(POOL), task=Task(delivery="truncates")
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
    """Return the share of draws of so many seeds whose interval holds the pool's value.

    Without a level, the interval is that of tables, at 95 %; else that of verdicts.
    """
    random = np.random.default_rng(seeds)
    values = pool[random.random((draws, len(pool))).argpartition(seeds, axis=1)[:, :seeds]]
    truth = interquartile_mean(pool[None])[0] if iqm else pool.mean()
    if level is None:
        low, high = bootstrap_interval(values, 0.95, TABLE_RESAMPLES, iqm)
    else:
        low, high = cautious_interval(values, level, RESAMPLES, iqm)
    return float(((low <= truth) & (truth <= high)).mean())


def coverage_table(data: dict[str, np.ndarray], level: float | None, draws: int) -> str:
    """Markdown: a line for each pool, its estimates, and the coverage at each number of seeds."""
    kinds = [(iqm, size) for iqm in (False, True) for size in SIZES]
    lines, digits = [], 3 if level is None else 4
    for name, pool in data.items():
        cells = [f"{coverage(pool, size, iqm, level, draws):.{digits}f}" for iqm, size in kinds]
        estimates = (pool.mean(), interquartile_mean(pool[None])[0])
        lines.append([name, *(f"{estimator:.2f}" for estimator in estimates), *cells])
    headers = [f"{'IQM' if iqm else 'mean'}, {size}" for iqm, size in kinds]
    return Table("", ["Of the last 50 episodes", "mean", "IQM", *headers], lines).markdown()


def test_the_level_that_is_tested_is_that_of_the_claims() -> None:
    levels = {one.level for findings in results().audit.values() for one in findings.values()}
    assert [round(level, 4) for level in levels] == [VERDICT_LEVEL]


@pytest.mark.long
def test_intervals_cover_the_values_of_real_runs_as_documented() -> None:
    data = pools()
    print(coverage_table(data, None, DRAWS))
    print(coverage_table(data, VERDICT_LEVEL, DRAWS))
    covered = {
        (name, iqm, seeds): coverage(pool, seeds, iqm, draws=500)
        for name, pool in data.items()
        for iqm in (False, True)
        for seeds in (10, 20, 100)
    }
    for (name, iqm, seeds), share in covered.items():
        if iqm:  # what a reader can rely on from 10 seeds on
            assert share > 0.92, (name, seeds)
            if not name.startswith("deliveries"):  # there the IQM is 1 in every draw
                assert share < 0.98, (name, seeds)
    # Heavy tails: what the documents warn of is so.
    fast = "return, Q-learning at 0.01 / 0.99 / 0.3 / 0.99"
    assert covered[fast, False, 10] < 0.5
    assert covered[fast, False, 20] < 0.5
    assert covered[fast, False, 100] < 0.8
    assert covered["return, Q-learning at 0.001 / 0.99 / 0.3 / 0.99", False, 10] < 0.85
    assert covered["return, Q-learning at 0.001 / 0.99 / 0.3 / 0.99", False, 100] > 0.9
    for name, pool in data.items():  # 0.2 of 2000 draws are expected to miss
        for seeds in SIZES:
            share = coverage(pool, seeds, True, VERDICT_LEVEL)
            assert share >= (0.9985 if seeds == 10 else 0.999), (name, seeds)
