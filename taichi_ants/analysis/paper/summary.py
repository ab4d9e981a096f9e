"""Lines per configuration: the honest figures, over all seeds and over those that act alike."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from taichi_ants.analysis.behaviour import BEHAVIOURS, NAMES, counts
from taichi_ants.analysis.paper.comparison import Comparison, Row
from taichi_ants.analysis.paper.measures import MEASURES
from taichi_ants.analysis.statistics import centres

_MEASURES = (
    "return_last50",
    "steps_last50",
    "steps_all",
    "deliveries_last50",
    "greedy_return",
    "greedy_steps",
    "greedy_deliveries",
)
_TYPICAL = ("iqm", "iqm_ci_low", "iqm_ci_high")
SUMMARY_COLUMNS: tuple[str, ...] = (
    *(field.name for field in fields(Row)),
    "seeds",
    "return_last50_sd",
    *(
        f"{name}_{column}"
        for name in _MEASURES
        for column in ("mean", "ci_low", "ci_high", *(_TYPICAL if MEASURES[name].typical else ()))
    ),
    *(f"runs_{name}" for name in NAMES),
)
BEHAVIOUR_COLUMNS: tuple[str, ...] = (
    *(field.name for field in fields(Row)),
    "behaviour",
    "runs",
    "return_last50_mean",
    "policy_return_mean",
    "greedy_return_mean",
    "greedy_steps_mean",
    "greedy_deliveries_mean",
)


def summarise(comparison: Comparison) -> list[dict]:
    """The rows of summary.csv, with the keys of `SUMMARY_COLUMNS`.

    Means and interquartile means over seeds with 95 % intervals (see `statistics`), and the
    standard deviation (n - 1) of returns; then how many final policies behave so. What cannot
    exist is nan: intervals and deviation of one seed, greedy figures without rollouts.
    """
    returns, seeds = comparison.measure("return_last50"), len(comparison.seeds)
    columns = {
        f"{name}_{column}": values
        for name in _MEASURES
        for column, values in centres(comparison.measure(name), MEASURES[name].typical).items()
    }
    columns["return_last50_sd"] = (
        returns.std(axis=1, ddof=1) if seeds > 1 else np.full(len(returns), np.nan)
    )
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
