"""Our version of the paper's table 2, and summaries of all configurations.

The paper trains each configuration once, and reports for each algorithm the one of 16 with the
highest return. `best_of` repeats that with other seeds, which shows the effect of luck.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from paper.comparison import NAMES, TABLE_2, Comparison, PaperRow, Row, Variant, counts
from taichi_ants.analysis.behaviour import BEHAVIOURS
from taichi_ants.analysis.statistics import RANDOM_SEED, Estimator, interquartile_mean
from taichi_ants.analysis.sweeps import centre_columns, centres_of
from taichi_ants.measures.finished import LONE

DRAWS = 20_000
# Measures in table 2. The paper has one number of steps, which can be read in two ways.
FIGURES = ("return_last50", "steps_all", "steps_last50", "deliveries_last50")
_GREEDY = ("greedy_return", "greedy_steps", "greedy_deliveries")
_MEASURES = ("return_last50", "steps_last50", "steps_all", "deliveries_last50", *_GREEDY)


class SummaryRow(NamedTuple):
    """A row of summary.csv: a configuration over all seeds."""

    row: Row
    seeds: int
    estimates: Mapping[str, Estimator]
    runs: Mapping[int, int]  # number of runs by index into `BEHAVIOURS`

    @property
    def mixed(self) -> bool:
        """Whether the runs have different behaviours."""
        return len(self.runs) > 1

    def columns(self) -> dict[str, Any]:
        """Return the columns of summary.csv."""
        return {
            **self.row.columns(),
            "seeds": self.seeds,
            **centre_columns(self.estimates),
            **{f"runs_{name}": self.runs.get(code, 0) for code, name in enumerate(NAMES)},
        }


def summarise(comparison: Comparison) -> list[SummaryRow]:
    """Return a summary of each configuration, in the order of the rows."""
    values = {name: comparison.measures[name] for name in _MEASURES}
    estimates = centres_of(values, [name for name in values if LONE[name].uses_iqm])
    rows = zip(comparison.rows, estimates, comparison.behaviours, strict=True)
    return [SummaryRow(row, len(done), found, counts(done)) for row, found, done in rows]


def summarise_behaviours(comparison: Comparison) -> list[dict[str, Any]]:
    """Return the rows of behaviours.csv: means over the runs of a configuration with one behaviour.

    "policy_return" is the return of the episode that shows the behaviour.
    """
    names = ("return_last50", "policy_return", *_GREEDY)
    values = {"policy_return": comparison.policy_returns, **comparison.measures}
    return [
        {
            **row.columns(),
            **{"behaviour": BEHAVIOURS[code], "runs": runs},
            **{f"{name}_mean": float(values[name][place, done == code].mean()) for name in names},
        }
        for place, (row, done) in enumerate(
            zip(comparison.rows, comparison.behaviours, strict=True)
        )
        for code, runs in counts(done).items()
    ]


def shown_position(comparison: Comparison, delivery: str, variant: Variant) -> int:
    """Return the index of the row with the paper's configuration of a learner.

    Without one, return its best row by the IQM of the return, which outliers do not decide. That
    row is chosen and reported on the same seeds, which flatters the learner.
    """
    paper = TABLE_2.get(variant) if comparison.in_paper_world else None
    same = comparison.position(delivery, variant, paper.point) if paper else None
    if same is not None:
        return same
    positions = comparison.positions(delivery, variant)
    returns = interquartile_mean(comparison.measures["return_last50"][positions])
    return positions[int(returns.argmax())]


def best_of(
    comparison: Comparison, delivery: str, variant: Variant, draws: int = DRAWS
) -> dict[str, np.ndarray]:
    """Return `FIGURES` of the best run if each configuration runs once, float64 (draws,) by name.

    Each draw takes a random seed for each configuration.
    """
    rows = np.array(comparison.positions(delivery, variant))
    random = np.random.default_rng(RANDOM_SEED)
    seeds = random.integers(0, len(comparison.seeds), size=(draws, len(rows)))
    winner = comparison.measures["return_last50"][rows, seeds].argmax(axis=1)
    won = rows[winner], seeds[np.arange(draws), winner]
    return {name: comparison.measures[name][won] for name in FIGURES}


def best_run(values: np.ndarray, paper: float = math.nan) -> dict[str, float]:
    """Return the columns of a measure of the best run, from values of repetitions.

    They are the median, the percentiles 2.5 and 97.5, and the percentile of the paper's number,
    with which ties count by half.
    """
    low, median, high = np.percentile(values, (2.5, 50, 97.5)).tolist()
    below = float(50 * ((values < paper).mean() + (values <= paper).mean()))
    below = math.nan if math.isnan(paper) else below
    return {"median": median, "low": low, "high": high, "paper_percentile": below}


class Line(NamedTuple):
    """A row of table2.csv: a learner in one delivery setting."""

    summary: SummaryRow  # of the configuration that `shown_position` chooses
    paper: PaperRow | None  # None without one, and in other worlds
    best_run_of: int  # number of configurations
    best_run: Mapping[str, Mapping[str, float]]  # by the names of `FIGURES`, see `best_run`

    @property
    def delivery(self) -> str:
        """The delivery setting."""
        return self.summary.row.delivery

    @property
    def paper_configuration(self) -> bool:
        """Whether the configuration is the paper's."""
        return self.paper is not None and self.paper.point == self.summary.row.point

    @property
    def label(self) -> str:
        """The learner, with * if its configuration is not the paper's, and + if its runs differ."""
        star = "" if self.paper_configuration else " *"
        return self.summary.row.variant.label + star + (" +" if self.summary.mixed else "")

    def of_paper(self, measure: str) -> float:
        """Return the paper's number for a measure, nan if it has none."""
        return self.paper.figure(measure) if self.paper else math.nan

    def columns(self) -> dict[str, Any]:
        """Return the columns of table2.csv."""
        return {
            **self.summary.columns(),
            "paper_configuration": self.paper_configuration,
            **{f"paper_{name}": self.of_paper(name) for name in ("return", "steps", "deliveries")},
            "best_run_of": self.best_run_of,
            **{
                f"best_run_{name}_{field}": value
                for name, best in self.best_run.items()
                for field, value in best.items()
            },
        }


def table2(
    comparison: Comparison, summaries: Sequence[SummaryRow], draws: int = DRAWS
) -> list[Line]:
    """Return a line for each delivery setting and learner, from `summarise`."""
    lines = []
    for learner in comparison.learners:
        paper = TABLE_2.get(learner[1]) if comparison.in_paper_world else None
        best = {
            name: best_run(values, paper.figure(name) if paper else math.nan)
            for name, values in best_of(comparison, *learner, draws).items()
        }
        shown = summaries[shown_position(comparison, *learner)]
        lines.append(Line(shown, paper, len(comparison.positions(*learner)), best))
    return lines


def examples(comparison: Comparison) -> list[tuple[int, int]]:
    """Return an example of each behaviour of each learner, as indices of row and seed.

    It is the run of median return in the configuration of `shown_position`. For behaviours that do
    not occur there, it is from the configuration in which they are most frequent.
    """
    codes = comparison.behaviours
    shown = [shown_position(comparison, *learner) for learner in comparison.learners]
    kinds = [(row, code) for row in shown for code in counts(codes[row])]
    others = counts(codes).keys() - {code for _, code in kinds}
    kinds += [(int((codes == code).sum(axis=1).argmax()), code) for code in sorted(others)]
    chosen = []
    for row, code in kinds:
        runs = np.flatnonzero(codes[row] == code)
        order = np.argsort(comparison.measures["return_last50"][row, runs], kind="stable")
        chosen.append((row, int(runs[order[(len(runs) - 1) // 2]])))
    return chosen


def example_name(comparison: Comparison, row: int, run: int) -> str:
    """Return the name of an example's files: delivery setting, learner and behaviour."""
    delivery, variant, _ = comparison.rows[row]
    own = "".join(f"_{part}" for part in variant.short)
    return f"{delivery}_{variant.learner}{own}_{NAMES[comparison.behaviours[row, run]]}"
