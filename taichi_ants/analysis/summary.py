"""One line per configuration: the honest figures, over all seeds."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from taichi_ants.analysis.comparison import Comparison, Row
from taichi_ants.analysis.measures import MEASURES
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
)


def summarise(comparison: Comparison) -> list[dict]:
    """The rows of summary.csv, with the keys of `SUMMARY_COLUMNS`.

    Means and interquartile means over seeds with 95 % intervals (see `statistics`), and the
    standard deviation (n - 1) of returns. What cannot exist is nan: intervals and deviation of one
    seed, greedy figures without rollouts.
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
        lines.append({name: line[name] for name in SUMMARY_COLUMNS})
    return lines
