"""The paper's table 2, beside ours.

Each row twice, for each delivery setting: the same configuration over all our seeds, and the
paper's way (train each configuration once, report the best by return) with other seeds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from taichi_ants.analysis.paper.best_of import (
    DRAWS,
    FIGURES,
    best_of,
    paper_row,
    percentile_of,
    shown_position,
)
from taichi_ants.analysis.paper.comparison import Comparison
from taichi_ants.analysis.paper.measures import WINDOW
from taichi_ants.analysis.paper.published import PaperRow
from taichi_ants.analysis.paper.summary import Summary
from taichi_ants.analysis.tables import MISSING, Table, interval, number, percent
from taichi_ants.errors import count

# Below, a note warns that means have too few seeds; what intervals cover is measured in
# docs/statistics.md.
FEW_SEEDS = 50
APART = "!"  # marks a mean that the interval of the IQM excludes


class BestRun(NamedTuple):
    """A figure of the best run of all configurations, had each been trained once.

    Over repetitions with other seeds: median, range from 2.5 % to 97.5 %, and the percentage below
    the paper's figure, nan without one.
    """

    median: float
    low: float
    high: float
    paper_percentile: float


class Line(NamedTuple):
    """A learner in one delivery setting, a row of table2.csv.

    Attributes:
        summary: The configuration that stands for it, see `best_of.shown_position`.
        paper: The paper's row; None for a learner that it does not have, and in other worlds.
        best_run_of: From how many configurations the best run is chosen.
        best_run: By the names of `FIGURES`.
    """

    summary: Summary
    paper: PaperRow | None
    best_run_of: int
    best_run: Mapping[str, BestRun]

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
        """The learner, with * if its configuration is not the paper's, + if its runs differ."""
        star = "" if self.paper_configuration else " *"
        return self.summary.row.variant.label + star + (" +" if self.summary.mixed else "")

    def of_paper(self, measure: str) -> float:
        """Return the paper's figure of a measure, nan if it has none."""
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
                for field, value in best._asdict().items()
            },
        }


def table2(comparison: Comparison, summaries: Sequence[Summary], draws: int = DRAWS) -> list[Line]:
    """Return a line for each delivery setting and learner, from `summary.summarise`."""
    lines = []
    for delivery, variant in comparison.learners:
        paper = paper_row(comparison, variant)
        best = {}
        for name, values in best_of(comparison, delivery, variant, draws).items():
            low, median, high = np.percentile(values, (2.5, 50, 97.5)).tolist()
            percentile = percentile_of(paper.figure(name), values) if paper else math.nan
            best[name] = BestRun(median, low, high, percentile)
        shown = summaries[shown_position(comparison, delivery, variant)]
        several = len(comparison.positions(delivery, variant))
        lines.append(Line(shown, paper, several, best))
    return lines


def _spread(measure: str, middle: float | None, low: float, high: float, mark: str = "") -> str:
    """Return an estimator and below it its interval, if it has one; "-" if there is none."""
    if middle is None:
        return MISSING
    large = max(abs(middle), abs(high)) >= 100
    digits = 2 if measure.startswith("deliveries") else 0 if large else 1
    text = number(middle, digits) + mark
    return text if math.isnan(low) or low == high else f"{text}\n{interval(low, high, digits)}"


def figure_tables(lines: Sequence[Line], comparison: Comparison) -> list[Table]:
    """A table for each figure of a run, beside the paper's in its world, and what they mean."""
    runs = comparison.episodes
    late = f"last {WINDOW} episodes" if runs > WINDOW else f"all {count(runs, 'episode')}"
    titles = (f"Return, {late}", "Steps, all episodes", f"Steps, {late}", f"Deliveries, {late}")
    headers = ("Learner", "Delivery", "Mean", "IQM", "Best run", "Paper", "Below")
    beside = any(line.paper for line in lines)
    width = len(headers) if beside else len(headers) - 2
    tables = []
    for name, title in zip(FIGURES, titles, strict=True):
        rows = []
        for line in lines:
            estimator, best = line.summary.estimates[name], line.best_run[name]
            cells = [
                *(line.label, line.delivery),
                _spread(name, *estimator[:3], mark=f" {APART}" if estimator.apart else ""),
                _spread(name, *estimator[3:]),
                _spread(name, *best[:3]),
                number(line.of_paper(name), 2 if "deliver" in name else 1),
                percent(best.paper_percentile / 100),
            ]
            rows.append(cells[:width])
        tables.append(Table(title, headers[:width], rows, text_columns=2))
    return [*tables, Table("", (), (), _notes(lines, len(comparison.seeds), beside))]


def _notes(lines: Sequence[Line], seeds: int, beside: bool) -> list[str]:
    notes = [
        f"Mean, IQM: over {seeds} seeds, with intervals at 95 %."
        if seeds > 1
        else "Mean, IQM: of one seed, which has no interval.",
        "IQM: interquartile mean, of the middle half of the runs.",
        "Best run: best by return of all configurations, one run each: median, [95 % range].",
    ]
    if any(line.summary.estimates[name].apart for line in lines for name in FIGURES):
        notes.append(f"{APART} the mean is outside of the IQM's interval: far runs have moved it.")
    if beside:
        notes += [
            "Paper: its table 2. Its steps may be of all episodes or of the last 50.",
            "Below: percentage of the best runs below the paper's figure.",
        ]
    if 1 < seeds < FEW_SEEDS:
        notes += [
            f"Few seeds ({seeds}): where one run in a hundred is far off, the interval of the mean "
            "misses it more often than not. The IQM's holds from 10 seeds on (docs/statistics.md)."
        ]
    starred = [
        f"  {line.label}, {line.delivery}: {line.summary.row.point.label}"
        for line in lines
        if not line.paper_configuration
    ]
    if starred:
        best = "* its best by the IQM of the return, on these seeds, which flatters it"
        notes += [f"{best} (learning rate / discount / epsilon / decay):", *starred]
    if any(line.summary.mixed for line in lines):
        notes.append("+ the runs do different things, and no run has their mean.")
    return notes
