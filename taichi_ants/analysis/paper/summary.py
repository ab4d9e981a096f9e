"""Lines per configuration: the honest figures, over all seeds and over those that act alike."""

from __future__ import annotations

import numpy as np

from taichi_ants.analysis.behaviour import BEHAVIOURS, NAMES, counts
from taichi_ants.analysis.paper.comparison import Comparison
from taichi_ants.analysis.paper.measures import MEASURES
from taichi_ants.analysis.sweeps import summary_rows

_GREEDY = ("greedy_return", "greedy_steps", "greedy_deliveries")
_MEASURES = ("return_last50", "steps_last50", "steps_all", "deliveries_last50", *_GREEDY)


def summarise(comparison: Comparison) -> list[dict]:
    """The rows of summary.csv, one for each configuration, in their order.

    Means and interquartile means over seeds with 95 % intervals (see `statistics`), then how many
    final policies behave so. What cannot exist is nan: intervals of one seed, greedy figures
    without rollouts.
    """
    values = {name: comparison.measure(name) for name in _MEASURES}
    typical = [name for name in values if MEASURES[name].typical]
    lines = summary_rows([row.columns() for row in comparison.rows], values, typical)
    for line, behaviours in zip(lines, comparison.behaviours, strict=True):
        done = counts(behaviours)
        line |= {f"runs_{name}": done.get(code, 0) for code, name in enumerate(NAMES)}
    return lines


def summarise_behaviours(comparison: Comparison) -> list[dict]:
    """The rows of behaviours.csv: means over the runs of a configuration that do the same.

    A row for each configuration and behaviour that occurs in it. `policy_return` is what the
    episode returned that told the behaviour.
    """
    figures = {"return_last50": comparison.measure("return_last50")}
    figures["policy_return"] = comparison.policy_returns
    figures |= {name: comparison.measure(name) for name in _GREEDY}
    lines = []
    for number, row in enumerate(comparison.rows):
        behaviours = comparison.behaviours[number]
        for code, runs in counts(behaviours).items():
            alike = np.flatnonzero(behaviours == code)
            means = {f"{name}_mean": float(a[number, alike].mean()) for name, a in figures.items()}
            lines.append({**row.columns(), "behaviour": BEHAVIOURS[code], "runs": runs, **means})
    return lines
