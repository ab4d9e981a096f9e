"""The comparison in a terminal: the paper's table 2 beside ours, and what became of its claims.

A learner without the paper's configuration, or in another world, is shown at its best one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import IO, Any

import numpy as np

from taichi_ants.analysis.behaviour import BEHAVIOURS, DEFINITIONS, counts
from taichi_ants.analysis.paper.audit import OTHER_WORLD, Audited, claims_table
from taichi_ants.analysis.paper.best_of import choices
from taichi_ants.analysis.paper.comparison import Comparison, Variant
from taichi_ants.analysis.paper.measures import MEASURES
from taichi_ants.analysis.paper.published import GREEDY_RETURN, GREEDY_STEPS
from taichi_ants.analysis.paper.summary import mean_returns
from taichi_ants.analysis.paper.table2 import APART, apart, figure_tables, label
from taichi_ants.analysis.statistics import centres
from taichi_ants.analysis.tables import (
    MISSING,
    Block,
    Table,
    baseline_name,
    number,
    plain_text,
    print_blocks,
)
from taichi_ants.errors import count

# Columns where the output is no terminal: what the narrowest common terminal shows.
WIDTH = 79


def print_report(*data: Any, file: IO[str] | None = None) -> None:
    """Prints the report: in colours and as wide as the terminal, or as `render` has it elsewhere.

    Args:
        data: The arguments of `report`.
        file: Where to; standard output by default.
    """
    from rich.console import Console

    console = Console(file=file, highlight=False, markup=False)
    if console.is_terminal:
        console.width = max(console.width, WIDTH)  # a narrower one breaks lines, but no number
        print_blocks(report(*data), console)
    else:
        print(render(*data), end="", file=file)


def render(*data: Any) -> str:
    """The report as plain text of at most `WIDTH` columns; arguments as for `report`."""
    return plain_text(report(*data), WIDTH)


def report(
    comparison: Comparison,
    lines: Sequence[Mapping],
    audit: Sequence[Audited],
    baselines: Sequence[Mapping] = (),
    costs: Sequence[Mapping] = (),
) -> list[Block]:
    """The report as data.

    Args:
        comparison: The comparison.
        lines: Its table 2, from `table2.table2`.
        audit: Its claims, from `audit.assess`.
        baselines: Rows of baselines.csv, see `baselines.baseline_rows`.
        costs: Time per step of learners, each with "learner", "planning_steps" and
            "nanoseconds_per_step".
    """
    sizes = (
        f"{count(len(comparison.rows), 'configuration')}, {count(len(comparison.seeds), 'seed')}, "
        f"{count(comparison.episodes, 'episode')} of at most {comparison.max_steps} steps, "
        f"{count(comparison.rollouts, 'greedy rollout')} a run."
    )
    claims: Block = claims_table(audit)
    if not comparison.in_paper_world:
        claims = f"The paper's claims: not tested, {OTHER_WORLD}."
    return [
        f"World: {comparison.world}.\n{sizes}\n{comparison.conditions}",
        *figure_tables(lines, comparison),
        _greedy(comparison),
        _behaviours(comparison),
        claims,
        _costs(costs),
        _baselines(baselines),
    ]


def _greedy(comparison: Comparison) -> Table:
    """Greedy rollouts, of what the tables above show."""
    headers = ("Learner", "Delivery", "Return\nmean", "IQM", "Steps\nmean", "IQM", "Food\nmean")
    rows = []
    for (setting, variant), chosen in choices(comparison).items() if comparison.rollouts else ():
        rows.append([label(comparison, variant, chosen), setting])
        for measure, digits in (
            ("greedy_return", 1),
            ("greedy_steps", 1),
            ("greedy_deliveries", 2),
        ):
            values = comparison.measure(measure)[[chosen.position], chosen.seeds]
            typical = MEASURES[measure].typical
            line = {name: float(column[0]) for name, column in centres(values, typical).items()}
            off = typical and apart(line)
            rows[-1].append(number(line["mean"], digits) + (f" {APART}" if off else ""))
            rows[-1] += [number(line["iqm"], digits)] if typical else []
    notes = ["Configurations and seeds as in the tables above."] if rows else []
    if rows and comparison.in_paper_world:
        low, high = GREEDY_STEPS
        notes.append(f"The paper: about {GREEDY_RETURN:g} reward in {low:g} to {high:g} steps.")
    return Table("Greedy evaluation", headers, rows, notes, text_columns=2)


def _behaviours(comparison: Comparison) -> Table:
    """What the final policies do: of the runs that the tables above show, and of all."""
    headers = ("Learner", "Delivery", "Behaviour", "Runs", "Return\ntraining", "followed", "greedy")
    rows = []
    for (setting, variant), chosen in choices(comparison).items():
        names = [label(comparison, variant, chosen), setting]
        shown = np.arange(len(comparison.seeds))[chosen.seeds]
        positions = comparison.positions(setting, variant)
        for code, number_of in counts(comparison.behaviours[positions]).items():
            alike = shown[comparison.behaviours[chosen.position, shown] == code]
            cells = [MISSING] * 3
            if alike.size:
                means = mean_returns(comparison, chosen.position, alike)
                which = ("return_last50_mean", "policy_return_mean", "greedy_return_mean")
                cells = [number(means[name]) for name in which]
            rows.append([*names, BEHAVIOURS[code], str(alike.size), *cells, str(number_of)])
            names = ["", ""]
    notes = (
        f"Each policy is followed greedily once, {comparison.as_trained}.",
        *(f"{BEHAVIOURS[code]}: {DEFINITIONS[code]}" for code in counts(comparison.behaviours)),
        "An episode without delivery is told by its second half.",
        "runs and their mean returns: configurations and seeds as in the tables above",
        f"training: {comparison.late} episodes; followed: the episode that tells the behaviour",
        "greedy: the greedy evaluation above; all: runs in all configurations",
    )
    return Table("What the ants do", (*headers, "All"), rows, notes, text_columns=3)


def _costs(costs: Sequence[Mapping]) -> Table:
    times = [cost["nanoseconds_per_step"] for cost in costs]
    fastest = min((time for time in times if time > 0), default=math.nan)
    rows = [
        [
            Variant(cost["learner"], cost["planning_steps"]).label,
            number(time),
            number(time / fastest, 2),
        ]
        for cost, time in zip(costs, times, strict=True)
    ]
    return Table("Cost per step", ("Learner", "Nanoseconds", "Relative"), rows)


def _baselines(baselines: Sequence[Mapping]) -> Table:
    headers = ("Behaviour", "Setting", "Return", "Steps", "Deliveries")
    rows, notes = [], []
    for row in baselines:
        figures = {"return_mean": 1, "steps_mean": 1, "deliveries_mean": 2}
        cells = [
            MISSING if row[name] is None else number(row[name], digits)
            for name, digits in figures.items()
        ]
        rows.append([baseline_name(row), row["setting"], *cells])
        if row["return_mean"] is None and row.get("note"):
            notes.append(f"{baseline_name(row)}: {row['note']}")
    return Table("Baselines", headers, rows, notes, text_columns=2)
