"""The paper's table 2, beside ours.

Three answers to each of its rows, for each delivery setting: the same configuration over all our
seeds; what the paper's way of reporting (train each configuration once, report the best by
return) would have given had it been repeated with other seeds; and the configuration that is
best on half of our seeds, reported on the other half.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from taichi_ants.analysis.behaviour import MIXED, mixture
from taichi_ants.analysis.paper.best_of import (
    DRAWS,
    best_of,
    held_out,
    paper_position,
    percentile_of,
)
from taichi_ants.analysis.paper.comparison import Comparison, Variant
from taichi_ants.analysis.paper.measures import MEASURES
from taichi_ants.analysis.paper.published import TABLE_2, VARIANTS
from taichi_ants.analysis.statistics import centres
from taichi_ants.analysis.tables import MISSING, interval, number, table

# Column stem -> measure of a run. The paper has one figure of steps, we have two readings of it.
FIGURES = {
    "return": "return_last50",
    "steps_all": "steps_all",
    "steps_last50": "steps_last50",
    "deliveries": "deliveries_last50",
}
DIGITS = {"return": 1, "steps_all": 1, "steps_last50": 1, "deliveries": 2}
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


def apart(line: Mapping, stem: str = "") -> bool:
    """Whether the mean lies outside of the interval of the IQM, in the columns that begin so."""
    mean, low, high = (line[f"{stem}{name}"] for name in ("mean", "iqm_ci_low", "iqm_ci_high"))
    return mean < low or mean > high


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


def _best_run(comparison: Comparison, delivery: str, variant: Variant, draws: int) -> dict:
    best = best_of(comparison, delivery, variant, draws)
    columns: dict[str, float] = {"best_run_of": best.configurations if best else 0}
    drawn: tuple[np.ndarray | None, ...] = (None,) * len(FIGURES)
    if best:
        drawn = (best.returns, best.steps, best.steps_last50, best.deliveries)
    paper = _paper(comparison, variant)
    for name, values in zip(FIGURES, drawn, strict=True):
        figure = paper[f"paper_{name.partition('_')[0]}"]
        low = median = high = percentile = math.nan
        if values is not None and len(comparison.seeds) == 1:  # nothing to draw from
            median = float(values[0])
        elif values is not None:
            low, median, high = np.percentile(values, (2.5, 50, 97.5)).tolist()
            if not math.isnan(figure):
                percentile = percentile_of(figure, values)
        columns[f"best_run_{name}_median"] = median
        columns[f"best_run_{name}_low"] = low
        columns[f"best_run_{name}_high"] = high
        columns[f"best_run_{name}_paper_percentile"] = percentile
    return columns


def table2_markdown(lines: list[dict], comparison: Comparison) -> str:
    """The list of `table2` of a comparison as Markdown: tables, each explained in a sentence.

    Outside of the paper's world there is no table of its configurations.
    """
    of_paper = comparison.in_paper_world
    late = comparison.late
    parts = [f"{line}\n" for line in (f"World: {comparison.world}.", comparison.conditions) if line]
    if of_paper:
        seeds = max((line["seeds"] for line in lines), default=0)
        ours = (
            f"means and interquartile means (IQM, the typical run) over {seeds} seeds with 95 % "
            f"intervals; {APART} marks a mean outside of the IQM's interval, which a few far runs "
            "have moved"
            if seeds
            else "not in this comparison"
        )
        parts += [
            f"The paper's configurations: returns and deliveries, {late} episodes. Its figures are "
            f"single runs; ours are {ours}.\n",
            _same_table(lines),
            *_mixtures(lines, "same"),
            f"The same for the steps of an episode: {nearer_steps(lines)}.\n",
            _same_steps_table(lines, late),
        ]
    parts += [
        "Training each configuration once and reporting the best by return, repeated with "
        "independent random seeds: median and 95 % range of the reported figures."
        + (
            " In brackets, the percentage of repetitions that fall below the paper's figure.\n"
            if of_paper
            else "\n"
        ),
        _best_table(lines, late),
    ]
    if any(line["held_out_seeds"] for line in lines):
        parts += [
            "The configuration with the highest mean return on half of the seeds, reported on "
            "the other half, with 95 % intervals: what choosing the best is worth without its "
            "luck.\n",
            _held_out_table(lines, late),
            *_mixtures(lines, "held_out"),
        ]
    return "\n".join(parts)


def _name(line: dict) -> list[str]:
    return [Variant(line["learner"], line["planning_steps"]).label, line["delivery"]]


def _centre(line: dict, stem: str, name: str, centre: str = "mean") -> str:
    """A mean (or "iqm") with its interval, marked where mean and IQM are apart."""
    digits = DIGITS[name]
    ends = "iqm_ci" if centre == "iqm" else "ci"
    text = number(line[f"{stem}_{name}_{centre}"], digits)
    span = interval(line[f"{stem}_{name}_{ends}_low"], line[f"{stem}_{name}_{ends}_high"], digits)
    marked = centre == "mean" and name != "deliveries" and apart(line, f"{stem}_{name}_")
    return text if text == MISSING else f"{text}{' ' + APART if marked else ''} {span}"


def _steps_headers(late: str) -> list[str]:
    return [f"Steps, {which}, {centre}" for which in ("all", late) for centre in ("mean", "IQM")]


def _steps(line: dict, stem: str) -> list[str]:
    return [
        _centre(line, stem, name, centre)
        for name in ("steps_all", "steps_last50")
        for centre in ("mean", "iqm")
    ]


def _mixtures(lines: list[dict], stem: str) -> list[str]:
    """A paragraph on the lines whose means are over runs that do different things, if any."""
    mixed = [
        f"{', '.join(_name(line))}: {line[f'{stem}_behaviours']}"
        for line in lines
        if line[f"{stem}_behaviours"]
    ]
    # Two blanks break the line in Markdown.
    return ["  \n".join([f"Here {MIXED}:", *mixed]) + "\n"] if mixed else []


def _same_table(lines: list[dict]) -> str:
    headers = ["Learner", "Delivery", "Configuration", "Return, paper", "mean", "IQM"]
    headers += ["Deliveries, paper", "mean"]
    rows = [
        [
            *_name(line),
            line["configuration"],
            number(line["paper_return"]),
            _centre(line, "same", "return"),
            _centre(line, "same", "return", "iqm"),
            number(line["paper_deliveries"], 2),
            _centre(line, "same", "deliveries"),
        ]
        for line in lines
        if line["configuration"]
    ]
    return table(headers, rows, text_columns=3)


def _same_steps_table(lines: list[dict], late: str) -> str:
    rows = [
        [*_name(line), number(line["paper_steps"]), *_steps(line, "same")]
        for line in lines
        if line["configuration"]
    ]
    headers = ["Learner", "Delivery", "Steps, paper", *_steps_headers(late)]
    return table(headers, rows, text_columns=2)


def _best_table(lines: list[dict], late: str) -> str:
    rows = []
    for line in lines:
        cells = [*_name(line), str(line["best_run_of"])]
        for name, digits in DIGITS.items():
            stem = f"best_run_{name}"
            span = interval(line[f"{stem}_low"], line[f"{stem}_high"], digits)
            below = number(line[f"{stem}_paper_percentile"], 0)
            below = MISSING if below == MISSING else f"({below} %)"
            parts = (number(line[f"{stem}_median"], digits), span, below)
            cells.append(" ".join(part for part in parts if part != MISSING) or MISSING)
        rows.append(cells)
    headers = ["Learner", "Delivery", "Best of", "Return", "Steps, all", f"Steps, {late}"]
    return table([*headers, "Deliveries"], rows, text_columns=2)


def _held_out_table(lines: list[dict], late: str) -> str:
    rows = [
        [
            *_name(line),
            line["held_out_configuration"] or MISSING,
            _centre(line, "held_out", "return"),
            _centre(line, "held_out", "return", "iqm"),
            *_steps(line, "held_out"),
            _centre(line, "held_out", "deliveries"),
        ]
        for line in lines
    ]
    headers = ["Learner", "Delivery", "Chosen configuration", "Return, mean", "Return, IQM"]
    return table([*headers, *_steps_headers(late), "Deliveries"], rows, text_columns=3)
