"""The paper's table 2, beside ours.

Three answers to each of its rows, for each delivery setting: the same configuration over all our
seeds; what the paper's way of reporting (train each configuration once, report the best by
return) would have given had it been repeated with other seeds; and the configuration that is
best on half of our seeds, reported on the other half.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from taichi_ants.analysis.behaviour import MIXED, mixture
from taichi_ants.analysis.paper.best_of import (
    DRAWS,
    FIGURES,
    Choice,
    Chosen,
    best_of,
    choices,
    held_out,
    paper_position,
    percentile_of,
)
from taichi_ants.analysis.paper.comparison import Comparison, Variant
from taichi_ants.analysis.paper.measures import MEASURES
from taichi_ants.analysis.paper.published import TABLE_2, VARIANTS
from taichi_ants.analysis.statistics import centres
from taichi_ants.analysis.tables import MISSING, Block, Table, interval, markdown, number, percent
from taichi_ants.errors import count

# Below, a note warns that means have too few seeds; what intervals cover is measured in
# docs/statistics.md.
FEW_SEEDS = 50
APART = "!"  # marks a mean that the interval of the IQM excludes


def table2(comparison: Comparison, draws: int = DRAWS) -> list[dict]:
    """The rows of table2.csv: the paper's four and any other learner, per delivery setting.

    In another world than the paper's only the learners that there are, and nothing of the paper.
    What is missing is nan (or "" for a configuration): the paper's figures of a learner that it
    does not have, ours of a configuration that the comparison does not have, and intervals and
    held-out figures where there are too few seeds. Return is in reward per episode (last 50),
    steps are the length of an episode (all, and last 50: the paper does not say which it means),
    deliveries are per episode (last 50). Means and interquartile means ("iqm") have intervals at
    95 %, the best run has ranges from 2.5 % to 97.5 %.
    """
    of_paper = VARIANTS if comparison.in_paper_world else ()
    others = [variant for variant in comparison.variants if variant not in of_paper]
    lines = []
    for delivery in comparison.delivery_settings:
        for variant in (*of_paper, *others):
            line = {"learner": variant.learner, "planning_steps": variant.planning_steps}
            line["delivery"] = delivery
            line |= _paper(comparison, variant)
            line |= _same_configuration(comparison, delivery, variant)
            line |= _best_run(comparison, delivery, variant, draws)
            line |= _held_out(comparison, delivery, variant)
            lines.append(line)
    return lines


def _paper(comparison: Comparison, variant: Variant) -> dict:
    row = TABLE_2.get(variant) if comparison.in_paper_world else None
    figures = (row.return_last50, row.steps_all, row.deliveries_last50) if row else [math.nan] * 3
    return {
        "configuration": row.hyperparameters.label if row else "",
        **{f"paper_{name}": figures[k] for k, name in enumerate(("return", "steps", "deliveries"))},
    }


def _same_configuration(comparison: Comparison, delivery: str, variant: Variant) -> dict:
    position = paper_position(comparison, delivery, variant)
    seeds = 0 if position is None else len(comparison.seeds)
    return {"seeds": seeds, **means(comparison, "same", position, slice(None))}


def _held_out(comparison: Comparison, delivery: str, variant: Variant) -> dict:
    chosen = held_out(comparison, comparison.positions(delivery, variant))
    if chosen is None:
        return {
            "held_out_configuration": "",
            "held_out_seeds": 0,
            **means(comparison, "held_out", None, slice(None)),
        }
    return {
        "held_out_configuration": chosen.hyperparameters.label,
        "held_out_seeds": len(comparison.seeds[chosen.seeds]),
        **means(comparison, "held_out", chosen.position, chosen.seeds),
    }


def means(comparison: Comparison, stem: str, position: int | None, seeds: slice) -> dict:
    """Centres over seeds with 95 % intervals of one row of the comparison; nan without a row.

    Where its policies do different things, `behaviours` says how many do what, else it is "".
    """
    mixed = "" if position is None else mixture(comparison.behaviours[position, seeds])
    columns: dict[str, float | str] = {f"{stem}_behaviours": mixed}
    for name, measure in FIGURES.items():
        values = np.full((1, 1), np.nan)
        if position is not None:
            values = comparison.measure(measure)[[position], seeds]
        for column, numbers in centres(values, MEASURES[measure].typical).items():
            columns[f"{stem}_{name}_{column}"] = float(numbers[0])
    return columns


def _best_run(comparison: Comparison, delivery: str, variant: Variant, draws: int) -> dict:
    best = best_of(comparison, delivery, variant, draws)
    paper = _paper(comparison, variant)
    columns: dict[str, float] = {"best_run_of": len(comparison.positions(delivery, variant))}
    for name in FIGURES:
        figure, values = paper[f"paper_{name.partition('_')[0]}"], best.get(name)
        low = median = high = percentile = math.nan
        if values is not None and len(comparison.seeds) == 1:  # nothing to draw from
            median = float(values[0])
        elif values is not None:
            low, median, high = np.percentile(values, (2.5, 50, 97.5)).tolist()
            percentile = math.nan if math.isnan(figure) else percentile_of(figure, values)
        numbers = {"median": median, "low": low, "high": high, "paper_percentile": percentile}
        columns |= {f"best_run_{name}_{column}": value for column, value in numbers.items()}
    return columns


def apart(line: Mapping, stem: str = "") -> bool:
    """Whether the mean lies outside of the interval of the IQM, in the columns that begin so."""
    mean, low, high = (line[f"{stem}{name}"] for name in ("mean", "iqm_ci_low", "iqm_ci_high"))
    return mean < low or mean > high


def spread(line: Mapping, stem: str, *names: str) -> str:
    """A centre and below it its interval, of which one seed has none."""
    middle, low, high = (line[f"{stem}_{name}"] for name in names)
    large = max(abs(middle), abs(high)) >= 100
    digits = 2 if stem.endswith("deliveries") else 0 if large else 1
    text = number(middle, digits)
    return text if math.isnan(low) or low == high else f"{text}\n{interval(low, high, digits)}"


def mean_and_iqm(line: Mapping, stem: str) -> list[str]:
    """Both centres, the mean marked where the IQM's interval excludes it; no IQM of deliveries."""
    mean = spread(line, stem, "mean", "ci_low", "ci_high")
    if f"{stem}_iqm" not in line:
        return [mean, MISSING]
    first, *rest = mean.split("\n")
    marked = "\n".join([f"{first} {APART}" if apart(line, f"{stem}_") else first, *rest])
    return [marked, spread(line, stem, "iqm", "iqm_ci_low", "iqm_ci_high")]


def label(comparison: Comparison, variant: Variant, chosen: Choice) -> str:
    """The learner's name, with a star if it is not shown at the paper's, a + if it is mixed."""
    star = chosen.why is not Chosen.PAPER
    mixed = mixture(comparison.behaviours[chosen.position, chosen.seeds])
    return variant.label + (" *" if star else "") + (" +" if mixed else "")


def figure_tables(lines: Sequence[Mapping], comparison: Comparison) -> list[Table]:
    """A table for each figure of a run, beside the paper's in its world; explained below the last.

    Learners are shown at what `best_of.choices` takes for them.
    """
    of_paper, late = comparison.in_paper_world, f"{comparison.late} episodes"
    titles = (f"return, {late}", "steps, all episodes", f"steps, {late}", f"deliveries, {late}")
    by_learner = {(one["delivery"], one["learner"], one["planning_steps"]): one for one in lines}
    shown = choices(comparison) if lines else {}
    rows: dict[str, list[list[str]]] = {name: [] for name in FIGURES}
    for (setting, variant), chosen in shown.items():
        line = by_learner[(setting, *variant)]
        ours = means(comparison, "ours", chosen.position, chosen.seeds)
        for name in FIGURES:
            best = f"best_run_{name}"
            paper = number(
                line[f"paper_{name.partition('_')[0]}"], 2 if name == "deliveries" else 1
            )
            below = percent(line[f"{best}_paper_percentile"] / 100)
            cells = [
                *mean_and_iqm(ours, f"ours_{name}"),
                spread(line, best, "median", "low", "high"),
            ]
            cells = [paper, *cells, below] if of_paper else cells
            rows[name].append([label(comparison, variant, chosen), setting, *cells])
    headers = ["Learner", "Delivery", "Mean", "IQM", "Best run"]
    headers = [*headers[:2], "Paper", *headers[2:], "Below"] if of_paper else headers
    name = "Table 2" if of_paper else "Training"
    tables = [
        Table(f"{name}: {title}", headers, cells, text_columns=2)
        for title, cells in zip(titles, rows.values(), strict=True)
    ]
    return [*tables[:-1], replace(tables[-1], notes=_notes(lines, comparison, shown))]


def _notes(
    lines: Sequence[Mapping], comparison: Comparison, shown: Mapping[tuple[str, Variant], Choice]
) -> list[str]:
    of_paper, seeds = comparison.in_paper_world, len(comparison.seeds)
    whose = "at the paper's configuration, " if of_paper else ""
    notes = [
        f"mean, IQM: over {count(seeds, 'seed')}, {whose}intervals at 95 %",
        "IQM: interquartile mean, of the middle half of the runs: the typical run",
        f"{APART} the mean lies outside of the IQM's interval: a few far runs have moved it",
        "best run: best by return of all configurations, one run each: median [95 %]",
    ]
    if of_paper:
        notes += [
            "below: percentage of these below the paper's figure",
            f"steps: {nearer_steps(lines)}",
        ]
    if 1 < seeds < FEW_SEEDS:
        notes += [
            f"Few seeds ({seeds}): where one run in a hundred is far off, the interval of the mean",
            "misses it more often than not. The IQM's holds from 10 seeds on (docs/statistics.md).",
        ]
    for why in (Chosen.HELD_OUT, Chosen.BEST):
        starred = [
            f"  {variant.label}, {setting}: {chosen.hyperparameters.label}"
            for (setting, variant), chosen in shown.items()
            if chosen.why is why
        ]
        if starred:
            notes += [f"* {why.value}", "  (learning rate / discount / epsilon / decay):", *starred]
    mixed = [
        f"  {variant.label}, {setting}: {words}"
        for (setting, variant), chosen in shown.items()
        if (words := mixture(comparison.behaviours[chosen.position, chosen.seeds]))
    ]
    return [*notes, f"+ {MIXED}:", *mixed] if mixed else notes


def nearer_steps(lines: Sequence[Mapping]) -> str:
    """How the paper's steps can be read, and which reading comes nearer to them here."""
    words = "the paper leaves open whether it means all episodes or the last 50"
    off = {
        name: np.array([line["paper_steps"] - line[f"same_steps_{key}_iqm"] for line in lines])
        for name, key in (("all", "all"), ("the last 50", "last50"))
    }
    if np.isnan(list(off.values())).any():
        return words
    return f"{words}; ours come nearer over {min(off, key=lambda name: np.abs(off[name]).sum())}"


def table2_markdown(lines: list[dict], comparison: Comparison) -> str:
    """The tables of `figure_tables`, and what is best on half of the seeds on the other half."""
    blocks: list[Block] = [f"World: {comparison.world}.", comparison.conditions]
    blocks += figure_tables(lines, comparison)
    rows = []
    for line in lines:
        if line["held_out_seeds"]:
            variant = Variant(line["learner"], line["planning_steps"])
            cells = [cell for name in FIGURES for cell in mean_and_iqm(line, f"held_out_{name}")]
            chosen = [variant.label, line["delivery"], line["held_out_configuration"]]
            rows.append([*chosen, *cells[:-1]])  # deliveries have no IQM
    if rows:
        names = ("Return", "Steps, all", f"Steps, {comparison.late}", "Deliveries")
        headers = [f"{name}, {centre}" for name in names for centre in ("mean", "IQM")]
        title = "The best by mean return on half of the seeds, reported on the other half"
        notes = ["Intervals at 95 %: what choosing the best is worth without its luck."]
        headers = ["Learner", "Delivery", "Configuration", *headers[:-1]]
        blocks.append(Table(title, headers, rows, notes, text_columns=3))
    return markdown(blocks)
