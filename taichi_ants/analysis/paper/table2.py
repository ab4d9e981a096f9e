"""The paper's table 2, beside ours.

Two answers to each of its rows, for each delivery setting: the same configuration over all our
seeds, and what the paper's way of reporting (train each configuration once, report the best by
return) would have given had it been repeated with other seeds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from taichi_ants.analysis.behaviour import NAMES
from taichi_ants.analysis.paper.best_of import (
    DRAWS,
    FIGURES,
    best_of,
    paper_row,
    percentile_of,
    shown_position,
)
from taichi_ants.analysis.paper.comparison import Comparison, GridPoint, Variant
from taichi_ants.analysis.paper.measures import WINDOW
from taichi_ants.analysis.tables import MISSING, Table, interval, number, percent
from taichi_ants.errors import count

# Below, a note warns that means have too few seeds; what intervals cover is measured in
# docs/statistics.md.
FEW_SEEDS = 50
APART = "!"  # marks a mean that the interval of the IQM excludes


def table2(comparison: Comparison, summary: Sequence[Mapping], draws: int = DRAWS) -> list[dict]:
    """The rows of table2.csv, one for each delivery setting and learner.

    Each is the row of `summary.summarise` that stands for the learner (`best_of.shown_position`),
    with what the best run reports beside it (ranges from 2.5 % to 97.5 %), and what the paper does:
    nan of a learner that it does not have, and in another world.
    """
    lines = []
    for delivery, variant in comparison.learners:
        position = shown_position(comparison, delivery, variant)
        paper = paper_row(comparison, variant)
        best = best_of(comparison, delivery, variant, draws)
        of_paper = paper is not None and paper.point == comparison.rows[position].point
        line = {**summary[position], "paper_configuration": of_paper}
        for name in ("return", "steps", "deliveries"):
            line[f"paper_{name}"] = paper.figure(name) if paper else math.nan
        line["best_run_of"] = len(comparison.positions(delivery, variant))
        for name, values in best.items():
            low, median, high = np.percentile(values, (2.5, 50, 97.5)).tolist()
            line |= {
                f"best_run_{name}_median": median,
                f"best_run_{name}_low": low,
                f"best_run_{name}_high": high,
                f"best_run_{name}_paper_percentile": (
                    percentile_of(paper.figure(name), values) if paper else math.nan
                ),
            }
        lines.append(line)
    return lines


def mixed(line: Mapping) -> bool:
    """Whether the runs of a configuration do different things."""
    return sum(line[f"runs_{name}"] > 0 for name in NAMES) > 1


def label(line: Mapping) -> str:
    """The learner's name, with a star if it is not shown at the paper's, a + if it is mixed."""
    star = "" if line["paper_configuration"] else " *"
    name = Variant(line["learner"], line["hyperparameters"]).label
    return name + star + (" +" if mixed(line) else "")


def apart(line: Mapping, measure: str) -> bool:
    """Whether the mean of a measure lies outside of the interval of its IQM."""
    mean, low, high = (line[f"{measure}_{name}"] for name in ("mean", "iqm_ci_low", "iqm_ci_high"))
    return mean < low or mean > high


def _moved(line: Mapping, measure: str) -> bool:
    """Whether it is so, of a measure that may have no IQM."""
    return f"{measure}_iqm" in line and apart(line, measure)


def _spread(line: Mapping, stem: str, *names: str, mark: str = "") -> str:
    """A centre and below it its interval, of which one seed has none; "-" where it has none."""
    if f"{stem}_{names[0]}" not in line:
        return MISSING
    middle, low, high = (line[f"{stem}_{name}"] for name in names)
    large = max(abs(middle), abs(high)) >= 100
    digits = 2 if stem.startswith(("deliveries", "best_run_deliveries")) else 0 if large else 1
    text = number(middle, digits) + mark
    return text if math.isnan(low) or low == high else f"{text}\n{interval(low, high, digits)}"


def figure_tables(lines: Sequence[Mapping], comparison: Comparison) -> list[Table]:
    """A table for each figure of a run, beside the paper's in its world, and what they mean."""
    runs = comparison.episodes
    late = f"last {WINDOW} episodes" if runs > WINDOW else f"all {count(runs, 'episode')}"
    titles = (f"Return, {late}", "Steps, all episodes", f"Steps, {late}", f"Deliveries, {late}")
    headers = ("Learner", "Delivery", "Mean", "IQM", "Best run", "Paper", "Below")
    beside = not all(math.isnan(line["paper_return"]) for line in lines)
    width = len(headers) if beside else len(headers) - 2
    tables = []
    for name, title in zip(FIGURES, titles, strict=True):
        best = f"best_run_{name}"
        rows = [
            [
                label(line),
                line["delivery"],
                _spread(
                    *(line, name, "mean", "ci_low", "ci_high"),
                    mark=f" {APART}" if _moved(line, name) else "",
                ),
                _spread(line, name, "iqm", "iqm_ci_low", "iqm_ci_high"),
                _spread(line, best, "median", "low", "high"),
                number(line[f"paper_{name.partition('_')[0]}"], 2 if "deliver" in name else 1),
                percent(line[f"{best}_paper_percentile"] / 100),
            ][:width]
            for line in lines
        ]
        tables.append(Table(title, headers[:width], rows, text_columns=2))
    return [*tables, Table("", (), (), _notes(lines, len(comparison.seeds), beside))]


def _notes(lines: Sequence[Mapping], seeds: int, beside: bool) -> list[str]:
    notes = [
        f"Mean, IQM: over {seeds} seeds, with intervals at 95 %."
        if seeds > 1
        else "Mean, IQM: of one seed, which has no interval.",
        "IQM: interquartile mean, of the middle half of the runs: the typical run.",
        "Best run: best by return of all configurations, one run each: median, [95 % range].",
    ]
    if any(_moved(line, name) for line in lines for name in FIGURES):
        notes.append(f"{APART} the mean is outside of the IQM's interval: far runs have moved it.")
    if beside:
        notes += [
            "Paper: its table 2. Its steps may be of all episodes or of the last 50.",
            "Below: percentage of the best runs below the paper's figure.",
        ]
    if 1 < seeds < FEW_SEEDS:
        notes += [
            f"Few seeds ({seeds}): where one run in a hundred is far off, the interval of the mean "
            "misses it more often than not. The IQM's holds from 10 seeds on (docs/statistics.md).",
        ]
    starred = [
        f"  {label(line)}, {line['delivery']}: "
        + GridPoint(*(line[name] for name in GridPoint._fields)).label
        for line in lines
        if not line["paper_configuration"]
    ]
    if starred:
        best = "* its best by the IQM of the return, on these seeds, which flatters it"
        notes += [f"{best} (learning rate / discount / epsilon / decay):", *starred]
    if any(map(mixed, lines)):
        notes.append("+ the runs do different things, and no run has their mean.")
    return notes
