"""The comparison as text: on one screen, and all of its tables.

It shows what the other tables hold, and computes nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from taichi_ants.analysis.behaviour import BEHAVIOURS, DEFINITIONS
from taichi_ants.analysis.paper.audit import Audit, claims_tallies
from taichi_ants.analysis.paper.comparison import Comparison, GridPoint
from taichi_ants.analysis.paper.published import GREEDY_RETURN, GREEDY_STEPS
from taichi_ants.analysis.paper.table2 import APART, apart, figure_tables, label, mixed
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
MOST_LINES = 12  # of the table on one screen


def table2_markdown(comparison: Comparison, lines: Sequence[Mapping]) -> str:
    """The paper's table 2 beside ours, as Markdown."""
    return markdown([*heading(comparison), *figure_tables(lines, comparison), _greedy(lines)])


def report(
    comparison: Comparison, lines: Sequence[Mapping], answer: Sequence[str], audit: Audit
) -> str:
    """What fits on one screen, as plain text of at most `WIDTH` columns.

    Its lines are from `table2.table2`, the rest from `answer.answer` and `audit.assess`.
    """
    return plain_text(
        [*heading(comparison), "\n".join(answer), _glance(lines), claims_tallies(audit)], WIDTH
    )


def all_tables(
    comparison: Comparison,
    lines: Sequence[Mapping],
    behaviours: Sequence[Mapping],
    baselines: Sequence[Mapping] = (),
) -> list[Table]:
    """All tables, but those of the claims, each with its notes.

    What is given is from `table2.table2`, `summary.summarise_behaviours` and `bounds.baselines`.
    """
    return [
        *figure_tables(lines, comparison),
        _greedy(lines),
        behaviour_table(lines, behaviours),
        _baselines(baselines),
    ]


def _glance(lines: Sequence[Mapping]) -> Table:
    """Return and steps of the learners beside the paper's."""
    shown = lines[:MOST_LINES]
    columns = {
        "return_last50_mean": "Return\nmean",
        "return_last50_iqm": "IQM",
        "best_run_return_last50_median": "best\nrun",
        "paper_return": "paper",
        "steps_all_mean": "Steps\nmean",
        "best_run_steps_all_median": "best\nrun",
        "paper_steps": "paper",
    }
    if all(math.isnan(line["paper_return"]) for line in lines):
        del columns["paper_return"], columns["paper_steps"]
    rows = []
    for line in shown:
        cells = [number(line[name]) for name in columns]
        cells[0] += f" {APART}" if apart(line, "return_last50") else ""
        deliveries = number(line["deliveries_last50_mean"], 2)
        rows.append([label(line), line["delivery"], *cells, deliveries])
    headers = ("Learner", "Delivery", *columns.values(), "Food\nmean")
    notes = [
        "Return and food of the last 50 episodes, steps of all. IQM: interquartile mean, the "
        "typical run. Best run: best by return of all configurations, one run each.",
    ]
    if any(apart(line, "return_last50") for line in shown):
        notes.append(f"{APART} a few far runs have moved the mean away from the typical run.")
    if any(map(mixed, shown)):
        notes.append("+ the runs do different things, and no run has their mean.")
    if any(not line["paper_configuration"] for line in shown):
        notes.append("* its best configuration by the IQM of the return, which flatters it.")
    if len(lines) > len(shown):
        notes.append(f"table2.csv has {len(lines) - len(shown)} more.")
    return Table("", headers, rows, notes, text_columns=2)


def heading(comparison: Comparison) -> list[Block]:
    """The world, the sizes, and whether trails evaporate."""
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


def behaviour_table(lines: Sequence[Mapping], behaviours: Sequence[Mapping]) -> Table:
    """What the final policies do, in the configurations that the tables above show."""
    returns = ("Return\nin training", "Return\nfollowed", "Return\ngreedy")
    headers = ("Learner", "Delivery", "Behaviour", "Runs", *returns)
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
        *(f"{one}: {means}." for one, means in zip(BEHAVIOURS, DEFINITIONS, strict=True)),
        "An episode without delivery is told by its second half.",
        "Return: mean of the last 50 training episodes, of the episode that tells the behaviour, "
        "of the greedy evaluation. summary.csv counts all configurations.",
    )
    return Table("What they do, in the configurations above", headers, rows, notes, text_columns=3)


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
