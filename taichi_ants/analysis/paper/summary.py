"""Summaries of configurations: over all seeds, and over those whose policies do the same."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from taichi_ants.analysis.behaviour import BEHAVIOURS, NAMES, counts
from taichi_ants.analysis.paper.comparison import Comparison, Row
from taichi_ants.analysis.paper.measures import MEASURES
from taichi_ants.analysis.sweeps import Estimator, centre_columns, centres_of

_GREEDY = ("greedy_return", "greedy_steps", "greedy_deliveries")
_MEASURES = ("return_last50", "steps_last50", "steps_all", "deliveries_last50", *_GREEDY)


class Summary(NamedTuple):
    """A configuration over all seeds, a row of summary.csv.

    `estimates` are measures over seeds; `runs` the number of runs by place in `BEHAVIOURS`.
    """

    row: Row
    seeds: int
    estimates: Mapping[str, Estimator]
    runs: Mapping[int, int]

    @property
    def mixed(self) -> bool:
        """Whether the runs do different things."""
        return len(self.runs) > 1

    def columns(self) -> dict[str, Any]:
        """Return the columns of summary.csv."""
        return {
            **self.row.columns(),
            "seeds": self.seeds,
            **centre_columns(self.estimates),
            **{f"runs_{name}": self.runs.get(code, 0) for code, name in enumerate(NAMES)},
        }


class BehaviourMeans(NamedTuple):
    """The runs of a configuration with one behaviour, a row of behaviours.csv.

    Means: of the last 50 training episodes, of the episode that told the behaviour, of rollouts.
    """

    row: Row
    behaviour: int
    runs: int
    return_last50_mean: float
    policy_return_mean: float
    greedy_return_mean: float
    greedy_steps_mean: float
    greedy_deliveries_mean: float

    def columns(self) -> dict[str, Any]:
        """Return the columns of behaviours.csv."""
        names = self._fields[2:]
        numbers = dict(zip(names, self[2:], strict=True))
        return {**self.row.columns(), "behaviour": BEHAVIOURS[self.behaviour], **numbers}


def summarise(comparison: Comparison) -> list[Summary]:
    """Return a summary of each configuration, in their order."""
    values = {name: comparison.measures[name] for name in _MEASURES}
    estimates = centres_of(values, [name for name in values if MEASURES[name].uses_iqm])
    done = map(counts, comparison.behaviours)
    seeds = len(comparison.seeds)
    return [
        Summary(row, seeds, found, runs)
        for row, found, runs in zip(comparison.rows, estimates, done, strict=True)
    ]


def summarise_behaviours(comparison: Comparison) -> list[BehaviourMeans]:
    """Return means for each configuration and behaviour that occurs in it."""
    figures = [
        comparison.measures["return_last50"],
        comparison.policy_returns,
        *(comparison.measures[name] for name in _GREEDY),
    ]
    lines = []
    for row, behaviours, *values in zip(
        comparison.rows, comparison.behaviours, *figures, strict=True
    ):
        for code, runs in counts(behaviours).items():
            alike = np.flatnonzero(behaviours == code)
            means = (float(array[alike].mean()) for array in values)
            lines.append(BehaviourMeans(row, code, runs, *means))
    return lines
