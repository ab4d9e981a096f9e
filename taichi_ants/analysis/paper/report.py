"""The comparison as text: on one screen, and all of its tables.

It shows what the other tables hold, and computes nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from taichi_ants.analysis.behaviour import BEHAVIOURS, DEFINITIONS, counts
from taichi_ants.analysis.bounds.baselines import Baseline
from taichi_ants.analysis.paper.audit import Audit, assess, claims_tallies, headlines
from taichi_ants.analysis.paper.comparison import Comparison
from taichi_ants.analysis.paper.published import GREEDY_RETURN, GREEDY_STEPS
from taichi_ants.analysis.paper.summary import (
    BehaviourMeans,
    Summary,
    summarise,
    summarise_behaviours,
)
from taichi_ants.analysis.paper.table2 import APART, Line, figure_tables, table2
from taichi_ants.analysis.tables import Block, Table, markdown, number, plain_text, thousands
from taichi_ants.errors import count

WIDTH = 79  # columns: what the narrowest common terminal shows
MOST_LINES = 12  # of the table on one screen


def table2_markdown(comparison: Comparison, lines: Sequence[Line]) -> str:
    """The paper's table 2 beside ours, as Markdown."""
    return markdown([*heading(comparison), *figure_tables(lines, comparison), _greedy(lines)])


def report(comparison: Comparison, lines: Sequence[Line], audit: Audit) -> str:
    """Return what fits on one screen, as plain text of at most `WIDTH` columns."""
    tables = _glance(lines), headlines(audit), behaviour_counts(comparison)
    return plain_text([*heading(comparison), *tables, claims_tallies(audit)], WIDTH)


def behaviour_counts(comparison: Comparison) -> Table:
    """Return a table of how many final policies do what, by delivery setting."""
    settings = comparison.delivery_settings
    by_setting = []
    for setting in settings:
        here = [row.delivery == setting for row in comparison.rows]
        by_setting.append(counts(comparison.behaviours[here]))
    rows = [
        [name, *(thousands(done.get(code, 0)) for done in by_setting)]
        for code, name in enumerate(BEHAVIOURS)
        if any(code in done for done in by_setting)
    ]
    return Table("", ("What the final policies do", *settings), rows)


def all_tables(
    comparison: Comparison,
    lines: Sequence[Line],
    behaviours: Sequence[BehaviourMeans],
    baselines: Sequence[Baseline] = (),
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


def _glance(lines: Sequence[Line]) -> Table:
    """Return the returns and steps of the learners beside the paper's."""
    shown = lines[:MOST_LINES]
    beside = any(line.paper for line in lines)
    paper = ("paper",) if beside else ()
    returns = ("Return\nmean", "IQM", "best\nrun", *paper)
    headers = ("Learner", "Delivery", *returns, "Steps\nmean", "best\nrun", *paper, "Food\nmean")
    rows = []
    for line in shown:
        estimates, best = line.summary.estimates, line.best_run
        gains = estimates["return_last50"]
        rows.append(
            [
                *(line.label, line.delivery),
                number(gains.mean) + (f" {APART}" if gains.apart else ""),
                number(gains.iqm),
                number(best["return_last50"].median),
                *([number(line.of_paper("return"))] if beside else []),
                number(estimates["steps_all"].mean),
                number(best["steps_all"].median),
                *([number(line.of_paper("steps"))] if beside else []),
                number(estimates["deliveries_last50"].mean, 2),
            ]
        )
    notes = [
        "Return and food of the last 50 episodes, steps of all. IQM: interquartile mean, the "
        "IQM. Best run: best by return of all configurations, one run each."
    ]
    if any(line.summary.estimates["return_last50"].apart for line in shown):
        notes.append(f"{APART} a few far runs have moved the mean away from the IQM.")
    if any(line.summary.mixed for line in shown):
        notes.append("+ the runs do different things, and no run has their mean.")
    if not all(line.paper_configuration for line in shown):
        notes.append("* its best configuration by the IQM of the return, which flatters it.")
    if len(lines) > len(shown):
        notes.append(f"table2.csv has {len(lines) - len(shown)} more.")
    return Table("", headers, rows, notes, text_columns=2)


def heading(comparison: Comparison) -> list[Block]:
    """The world, the sizes, and whether trails evaporate."""
    sizes = (
        f"{count(len(comparison.rows), 'configuration')}, {count(len(comparison.seeds), 'seed')}, "
        f"{count(comparison.episodes, 'episode')} of at most {comparison.max_steps} steps, "
        f"{count(comparison.rollouts, 'greedy rollout')} a run."
    )
    task = comparison.task
    training, greedy = (
        "with" if falls else "without"
        for falls in (task.evaporation_in_training, task.evaporation_in_evaluation)
    )
    trails = f"Training {training} evaporation of trails, greedy evaluation {greedy} it."
    return [f"World: {comparison.world}.\n{sizes}\n{trails}"]


def _greedy(lines: Sequence[Line]) -> Table:
    """Return a table of the greedy rollouts of the final policies."""
    headers = ("Learner", "Delivery", "Return\nmean", "IQM", "Steps\nmean", "IQM", "Food\nmean")
    rows = []
    for line in lines:
        cells = [line.label, line.delivery]
        for name in ("greedy_return", "greedy_steps"):
            one = line.summary.estimates[name]
            cells += [number(one.mean) + (f" {APART}" if one.apart else ""), number(one.iqm)]
        food = line.summary.estimates["greedy_deliveries"].mean
        rows.append([*cells, number(food, 2)])
    low, high = GREEDY_STEPS
    note = f"The paper, in its world: about {GREEDY_RETURN:g} reward in {low:g} to {high:g} steps."
    return Table("Greedy evaluation, configurations as above", headers, rows, [note], 2)


def behaviour_table(lines: Sequence[Line], behaviours: Sequence[BehaviourMeans]) -> Table:
    """Return what the final policies do, in the configurations that the tables above show."""
    returns = ("Return\nin training", "Return\nfollowed", "Return\ngreedy")
    headers = ("Learner", "Delivery", "Behaviour", "Runs", *returns)
    rows = []
    for line in lines:
        for one in behaviours:
            if one.row == line.summary.row:
                means = one.return_last50_mean, one.policy_return_mean, one.greedy_return_mean
                cells = [line.label, line.delivery, BEHAVIOURS[one.behaviour], str(one.runs)]
                rows.append([*cells, *map(number, means)])
    notes = (
        "Each policy is followed greedily once, with evaporation as in training.",
        *(f"{one}: {words}." for one, words in zip(BEHAVIOURS, DEFINITIONS, strict=True)),
        "An episode without delivery is told by its second half.",
        "Return: mean of the last 50 training episodes, of the episode that tells the behaviour, "
        "of the greedy evaluation. summary.csv counts all configurations.",
    )
    return Table("What they do, in the configurations above", headers, rows, notes, text_columns=3)


def _baselines(baselines: Sequence[Baseline]) -> Table:
    rows, notes = [], []
    for one in baselines:
        if one.return_mean is None:
            notes.append(f"{one.label}: {one.note}")
        else:
            lengths = number(one.return_mean), number(one.steps_mean)
            rows.append([one.label, *lengths, number(one.deliveries_mean, 2)])
    headers = ("Behaviour", "Return", "Steps", "Deliveries")
    return Table("Baselines, with evaporation as in training", headers, rows, notes)


class Results(NamedTuple):
    """A comparison, the rows of `bounds.baselines`, and the tables that follow from them."""

    comparison: Comparison
    baselines: Sequence[Baseline]
    summaries: Sequence[Summary]
    behaviours: Sequence[BehaviourMeans]
    lines: Sequence[Line]
    audit: Audit

    @classmethod
    def of(cls, comparison: Comparison, baselines: Sequence[Baseline]) -> Results:
        """Return the results of a comparison."""
        summaries = summarise(comparison)
        lines, behaviours = table2(comparison, summaries), summarise_behaviours(comparison)
        return cls(comparison, baselines, summaries, behaviours, lines, assess(comparison))
