"""The paper's table 2, beside ours.

Three answers to each of its rows, for each delivery setting: the same configuration over all our
seeds; what the paper's way of reporting (train each configuration once, report the best by
return) would have given had it been repeated with other seeds; and the configuration that is
best on half of our seeds, reported on the other half.
"""

from __future__ import annotations

import math

import numpy as np

from taichi_ants.analysis.best_of import DRAWS, best_of, held_out, paper_position, percentile_of
from taichi_ants.analysis.comparison import PAPER_WORLD, Comparison, Variant
from taichi_ants.analysis.markdown import MISSING, interval, number, table
from taichi_ants.analysis.paper import TABLE_2, VARIANTS
from taichi_ants.analysis.statistics import bootstrap_interval

# Column stem -> measure of a run; the paper's "train avg steps" is over all episodes.
FIGURES = {"return": "return_last50", "steps": "steps_all", "deliveries": "deliveries_last50"}
_DIGITS = {"return": 1, "steps": 1, "deliveries": 2}


def table2(comparison: Comparison, draws: int = DRAWS) -> list[dict]:
    """The rows of table2.csv: the paper's four and any other learner, per delivery setting.

    In another world than the paper's only the learners that there are, and nothing of the paper.
    What is missing is nan (or "" for a configuration): the paper's figures of a learner that it
    does not have, ours of a configuration that the comparison does not have, and intervals and
    held-out figures where there are too few seeds. Return is in reward per episode (mean of the
    last 50), steps is the mean length of all episodes, deliveries are per episode (last 50);
    intervals are at 95 %, ranges of the best run from 2.5 % to 97.5 %.
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
    if row is None:
        return {"configuration": "", **{f"paper_{name}": math.nan for name in FIGURES}}
    figures = (row.return_last50, row.steps_all, row.deliveries_last50)
    return {
        "configuration": row.hyperparameters.label,
        **{f"paper_{name}": figure for name, figure in zip(FIGURES, figures, strict=True)},
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
    """Means over seeds with 95 % intervals of one row of the comparison."""
    middle = low = high = np.full(len(FIGURES), np.nan)
    if position is not None:
        rows = [comparison.measure(measure)[position, seeds] for measure in FIGURES.values()]
        middle = np.mean(rows, axis=1)
        low, high = bootstrap_interval(np.array(rows))
    columns = {}
    for place, name in enumerate(FIGURES):
        columns[f"{stem}_{name}_mean"] = float(middle[place])
        columns[f"{stem}_{name}_ci_low"] = float(low[place])
        columns[f"{stem}_{name}_ci_high"] = float(high[place])
    return columns


def _best_run(comparison: Comparison, delivery: str, variant: Variant, draws: int) -> dict:
    best = best_of(comparison, delivery, variant, draws)
    columns: dict[str, float] = {"best_run_of": best.configurations if best else 0}
    drawn = (best.returns, best.steps, best.deliveries) if best else (None,) * 3
    for (name, figure), values in zip(_paper_figures(comparison, variant), drawn, strict=True):
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


def _paper_figures(comparison: Comparison, variant: Variant) -> list[tuple[str, float]]:
    figures = _paper(comparison, variant)
    return [(name, figures[f"paper_{name}"]) for name in FIGURES]


def table2_markdown(lines: list[dict], world: str = PAPER_WORLD) -> str:
    """The list of `table2` as Markdown: tables, each with a sentence that explains it.

    Args:
        lines: The list.
        world: The world's name; outside of the paper's there is no table of its configurations.
    """
    of_paper = world == PAPER_WORLD
    parts = [f"World: {world}.\n"]
    if of_paper:
        seeds = max((line["seeds"] for line in lines), default=0)
        ours = (
            f"means over {seeds} seeds with 95 % intervals" if seeds else "not in this comparison"
        )
        parts += [
            f"The paper's configurations. Its figures are single runs; ours are {ours}.\n",
            _same_table(lines),
        ]
    parts += [
        "Training each configuration once and reporting the best by return, repeated with "
        "independent random seeds: median and 95 % range of the reported figures."
        + (
            " In brackets, the percentage of repetitions that fall below the paper's figure.\n"
            if of_paper
            else "\n"
        ),
        _best_table(lines),
    ]
    if any(line["held_out_seeds"] for line in lines):
        parts += [
            "The configuration with the highest mean return on half of the seeds, reported on "
            "the other half, with 95 % intervals: what choosing the best is worth without its "
            "luck.\n",
            _held_out_table(lines),
        ]
    return "\n".join(parts)


def _name(line: dict) -> list[str]:
    return [Variant(line["learner"], line["planning_steps"]).label, line["delivery"]]


def _cell(line: dict, stem: str) -> list[str]:
    cells = []
    for name, digits in _DIGITS.items():
        low, high = line[f"{stem}_{name}_ci_low"], line[f"{stem}_{name}_ci_high"]
        mean = number(line[f"{stem}_{name}_mean"], digits)
        cells.append(f"{mean} {interval(low, high, digits)}" if mean != MISSING else MISSING)
    return cells


def _same_table(lines: list[dict]) -> str:
    headers = ["Learner", "Delivery", "Configuration", "Return, paper", "Return, ours"]
    headers += ["Steps, paper", "Steps, ours", "Deliveries, paper", "Deliveries, ours"]
    rows = []
    for line in lines:
        if not line["configuration"]:
            continue
        cells = [*_name(line), line["configuration"]]
        for (name, digits), ours in zip(_DIGITS.items(), _cell(line, "same"), strict=True):
            cells += [number(line[f"paper_{name}"], digits), ours]
        rows.append(cells)
    return table(headers, rows, text_columns=3)


def _best_table(lines: list[dict]) -> str:
    rows = []
    for line in lines:
        cells = [*_name(line), str(line["best_run_of"])]
        for name, digits in _DIGITS.items():
            stem = f"best_run_{name}"
            span = interval(line[f"{stem}_low"], line[f"{stem}_high"], digits)
            below = number(line[f"{stem}_paper_percentile"], 0)
            below = MISSING if below == MISSING else f"({below} %)"
            parts = (number(line[f"{stem}_median"], digits), span, below)
            cells.append(" ".join(part for part in parts if part != MISSING) or MISSING)
        rows.append(cells)
    headers = ["Learner", "Delivery", "Best of", "Return", "Steps", "Deliveries"]
    return table(headers, rows, text_columns=2)


def _held_out_table(lines: list[dict]) -> str:
    rows = [
        [*_name(line), line["held_out_configuration"] or MISSING, *_cell(line, "held_out")]
        for line in lines
    ]
    headers = ["Learner", "Delivery", "Chosen configuration", "Return", "Steps", "Deliveries"]
    return table(headers, rows, text_columns=3)
