"""The comparison as text: the paper's table 2 beside ours, and what became of its claims.

It shows what the other tables hold, and computes nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from taichi_ants.analysis.behaviour import BEHAVIOURS, DEFINITIONS
from taichi_ants.analysis.paper.audit import Audit, claims_table
from taichi_ants.analysis.paper.comparison import Comparison, GridPoint
from taichi_ants.analysis.paper.published import GREEDY_RETURN, GREEDY_STEPS
from taichi_ants.analysis.paper.table2 import APART, apart, figure_tables, label
from taichi_ants.analysis.tables import (
    Block,
    Table,
    baseline_name,
    markdown,
    number,
    plain_text,
)
from taichi_ants.errors import count

WIDTH = 79  # columns: what the narrowest common terminal shows


def table2_markdown(comparison: Comparison, lines: Sequence[Mapping]) -> str:
    """The paper's table 2 beside ours, as Markdown."""
    return markdown([*_heading(comparison), *figure_tables(lines, comparison), _greedy(lines)])


def report(
    comparison: Comparison,
    lines: Sequence[Mapping],
    behaviours: Sequence[Mapping],
    audit: Audit,
    baselines: Sequence[Mapping] = (),
) -> str:
    """The report as plain text of at most `WIDTH` columns.

    Its lines are from `table2.table2`, the rest from `summary.summarise_behaviours`, `audit.assess`
    and `baselines.baseline_rows`.
    """
    blocks = [
        *_heading(comparison),
        *figure_tables(lines, comparison),
        _greedy(lines),
        _behaviours(lines, behaviours),
        claims_table(audit),
        _baselines(baselines),
    ]
    return plain_text(blocks, WIDTH)


def _heading(comparison: Comparison) -> list[Block]:
    sizes = (
        f"{count(len(comparison.rows), 'configuration')}, {count(len(comparison.seeds), 'seed')}, "
        f"{count(comparison.episodes, 'episode')} of at most {comparison.max_steps} steps, "
        f"{count(comparison.greedy_returns.shape[2], 'greedy rollout')} a run."
    )
    task = comparison.task
    training, greedy = (
        "with" if falls else "without"
        for falls in (task.evaporation_in_training, task.evaporation_in_evaluation)
    )
    trails = f"Training {training} evaporation of trails, greedy evaluation {greedy} it."
    return [f"World: {comparison.world}.\n{sizes}\n{trails}"]


def _greedy(lines: Sequence[Mapping]) -> Table:
    """Greedy rollouts of the final policies."""
    headers = ("Learner", "Delivery", "Return\nmean", "IQM", "Steps\nmean", "IQM", "Food\nmean")
    rows = []
    for line in lines:
        cells = [label(line), line["delivery"]]
        for name in ("greedy_return", "greedy_steps"):
            mark = f" {APART}" if apart(line, name) else ""
            cells += [number(line[f"{name}_mean"]) + mark, number(line[f"{name}_iqm"])]
        rows.append([*cells, number(line["greedy_deliveries_mean"], 2)])
    low, high = GREEDY_STEPS
    note = f"The paper, in its world: about {GREEDY_RETURN:g} reward in {low:g} to {high:g} steps."
    return Table("Greedy evaluation, configurations as above", headers, rows, [note], 2)


def _behaviours(lines: Sequence[Mapping], behaviours: Sequence[Mapping]) -> Table:
    """What the final policies do, in the configurations that the tables above show."""
    headers = ("Learner", "Delivery", "Behaviour", "Runs", "Return\ntraining", "followed", "greedy")
    configuration = ("learner", "hyperparameters", "delivery", *GridPoint._fields)
    means = ("return_last50_mean", "policy_return_mean", "greedy_return_mean")
    rows = [
        [
            *(label(line), line["delivery"], one["behaviour"], str(one["runs"])),
            *(number(one[name]) for name in means),
        ]
        for line in lines
        for one in behaviours
        if all(one[name] == line[name] for name in configuration)
    ]
    notes = (
        "Each policy is followed greedily once, with evaporation as in training.",
        *(f"{one}: {means}" for one, means in zip(BEHAVIOURS, DEFINITIONS, strict=True)),
        "An episode without delivery is told by its second half.",
        "Return: mean of the last 50 training episodes, of the episode that tells the",
        "behaviour, of the greedy evaluation. summary.csv counts all configurations.",
    )
    return Table("What the ants do", headers, rows, notes, text_columns=3)


def _baselines(baselines: Sequence[Mapping]) -> Table:
    digits = {"return_mean": 1, "steps_mean": 1, "deliveries_mean": 2}
    rows, notes = [], []
    for row in baselines:
        if row["return_mean"] is None:
            notes.append(f"{baseline_name(row)}: {row['note']}")
        else:
            figures = (number(row[name], places) for name, places in digits.items())
            rows.append([baseline_name(row), *figures])
    headers = ("Behaviour", "Return", "Steps", "Deliveries")
    return Table("Baselines, with evaporation as in training", headers, rows, notes)
