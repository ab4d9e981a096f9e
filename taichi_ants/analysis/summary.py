"""One line per configuration: the honest figures, over all seeds."""

from __future__ import annotations

import numpy as np

from taichi_ants.analysis.comparison import Comparison
from taichi_ants.analysis.statistics import bootstrap_interval

SUMMARY_COLUMNS: tuple[str, ...] = (
    "learner",
    "planning_steps",
    "learning_rate",
    "discount",
    "epsilon",
    "epsilon_decay",
    "delivery",
    "seeds",
    "return_last50_mean",
    "return_last50_ci_low",
    "return_last50_ci_high",
    "return_last50_sd",
    "steps_last50_mean",
    "steps_all_mean",
    "deliveries_last50_mean",
    "greedy_return_mean",
    "greedy_steps_mean",
    "greedy_deliveries_mean",
)

_MEANS = (
    "return_last50",
    "steps_last50",
    "steps_all",
    "deliveries_last50",
    "greedy_return",
    "greedy_steps",
    "greedy_deliveries",
)


def summarise(comparison: Comparison) -> list[dict]:
    """The rows of summary.csv, with the keys of `SUMMARY_COLUMNS`.

    Means, 95 % intervals (see `statistics.bootstrap_interval`) and standard deviations (n - 1)
    over seeds. What cannot exist is nan: interval and deviation of one seed, greedy figures
    without rollouts.
    """
    returns = comparison.measure("return_last50")
    seeds = len(comparison.seeds)
    low, high = bootstrap_interval(returns)
    sd = returns.std(axis=1, ddof=1) if seeds > 1 else np.full(len(returns), np.nan)
    columns = {
        "return_last50_ci_low": low,
        "return_last50_ci_high": high,
        "return_last50_sd": sd,
        **{f"{name}_mean": comparison.measure(name).mean(axis=1) for name in _MEANS},
    }
    lines = []
    for number, row in enumerate(comparison.rows):
        line = {**vars(row), "seeds": seeds}
        line.update((name, float(values[number])) for name, values in columns.items())
        lines.append({name: line[name] for name in SUMMARY_COLUMNS})
    return lines
