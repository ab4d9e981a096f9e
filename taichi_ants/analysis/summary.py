"""Lines per configuration: the honest figures, over all seeds and over those that act alike."""

from __future__ import annotations

import numpy as np

from taichi_ants.analysis.behaviour import BEHAVIOURS, NAMES, counts
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
    *(f"runs_{name}" for name in NAMES),
)
BEHAVIOUR_COLUMNS: tuple[str, ...] = (
    *SUMMARY_COLUMNS[:7],
    "behaviour",
    "runs",
    "return_last50_mean",
    "policy_return_mean",
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
    over seeds, and the number of runs whose final policy behaves so. What cannot exist is nan:
    interval and deviation of one seed, greedy figures without rollouts.
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
        done = counts(comparison.behaviours[number])
        line.update((f"runs_{name}", done.get(code, 0)) for code, name in enumerate(NAMES))
        lines.append({name: line[name] for name in SUMMARY_COLUMNS})
    return lines


def summarise_behaviours(comparison: Comparison) -> list[dict]:
    """The rows of behaviours.csv: means over the runs of a configuration that do the same.

    A row for each configuration and behaviour that occurs in it, with the keys of
    `BEHAVIOUR_COLUMNS`. `policy_return` is what the episode returned that told the behaviour.
    """
    lines = []
    for number, row in enumerate(comparison.rows):
        behaviours = comparison.behaviours[number]
        for code, runs in counts(behaviours).items():
            alike = np.flatnonzero(behaviours == code)
            line = {**vars(row), "behaviour": BEHAVIOURS[code], "runs": runs}
            lines.append({**line, **mean_returns(comparison, number, alike)})
    return [{name: line[name] for name in BEHAVIOUR_COLUMNS} for line in lines]


def mean_returns(comparison: Comparison, position: int, runs: np.ndarray) -> dict[str, float]:
    """Means over some runs of a configuration, named as in `BEHAVIOUR_COLUMNS`."""
    names = ("return_last50", "greedy_return", "greedy_steps", "greedy_deliveries")
    values = {name: comparison.measure(name) for name in names}
    values["policy_return"] = comparison.policy_returns
    return {f"{name}_mean": float(array[position, runs].mean()) for name, array in values.items()}
