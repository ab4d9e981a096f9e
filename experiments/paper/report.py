"""The comparison as text: a report of one screen, and all tables."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from paper.baselines import Baseline
from paper.claims import Audit, headlines, tallies
from paper.comparison import DEFINITIONS, GREEDY_RETURN, GREEDY_STEPS, Comparison, counts
from paper.table2 import FIGURES, Line
from taichi_ants.analysis import tables as printing
from taichi_ants.analysis.behaviour import BEHAVIOURS
from taichi_ants.analysis.statistics import Estimator
from taichi_ants.analysis.tables import MISSING, Block, Table, interval, number, percent
from taichi_ants.errors import count
from taichi_ants.measures.finished import WINDOW

WIDTH = 79  # columns of the narrowest common terminal
MOST_LINES = 12  # of the table in the report of one screen
# With fewer, a note warns about intervals of means; docs/concepts/statistics.md has their coverage.
FEW_SEEDS = 50
APART = "!"  # marks a mean outside of the interval of the IQM
MIXED = "+ the runs behave in different ways, so their mean describes none of them."


def report(comparison: Comparison, lines: Sequence[Line], audit: Audit) -> str:
    """Return the report of one screen, as plain text of at most `WIDTH` columns."""
    tables = _glance(lines), headlines(audit), behaviour_counts(comparison)
    claims = [f"The paper's {len(audit)} claims", *(f"  {line}" for line in tallies(audit))]
    return printing.plain_text([*heading(comparison), *tables, "\n".join(claims)], WIDTH)


def heading(comparison: Comparison) -> list[Block]:
    """Return text with the world, the numbers of runs, and whether trails evaporate."""
    sizes = (
        f"{count(len(comparison.rows), 'configuration')}, {count(len(comparison.seeds), 'seed')}, "
        f"{count(comparison.episodes, 'episode')} of at most {comparison.max_steps} steps, "
        f"{count(comparison.rollouts, 'greedy rollout')} per run."
    )
    task = comparison.task
    training, greedy = (
        "with" if falls else "without"
        for falls in (task.evaporation_in_training, task.evaporation_in_evaluation)
    )
    trails = f"Training {training} evaporation of trails, greedy evaluation {greedy} it."
    return [f"World: {comparison.world}.\n{sizes}\n{trails}"]


def behaviour_counts(comparison: Comparison) -> Table:
    """Return a table of the number of final policies with each behaviour, by delivery setting."""
    settings = comparison.delivery_settings
    by_setting = []
    for setting in settings:
        here = [row.delivery == setting for row in comparison.rows]
        by_setting.append(counts(comparison.behaviours[here]))
    rows = [
        [name, *(printing.thousands(done.get(code, 0)) for done in by_setting)]
        for code, name in enumerate(BEHAVIOURS)
        if any(code in done for done in by_setting)
    ]
    return Table("", ("Behaviour of final policies", *settings), rows)


def is_apart(one: Estimator) -> bool:
    """Return whether the mean lies outside of the interval of the IQM."""
    return one.mean < one.iqm_ci_low or one.mean > one.iqm_ci_high


def _mean(one: Estimator) -> str:
    return number(one.mean) + (f" {APART}" if is_apart(one) else "")


def _glance(lines: Sequence[Line]) -> Table:
    shown = lines[:MOST_LINES]
    beside = any(line.paper for line in lines)
    paper = ("paper",) if beside else ()
    returns = ("Return\nmean", "IQM", "best\nrun", *paper)
    headers = ("Learner", "Delivery", *returns, "Steps\nmean", "best\nrun", *paper, "Food\nmean")
    rows = []
    for line in shown:
        estimates, best = line.summary.estimates, line.best_run
        gains = estimates["return_last50"]
        cells = [
            *(line.label, line.delivery, _mean(gains), number(gains.iqm)),
            *(number(best["return_last50"]["median"]), number(line.of_paper("return"))),
            *(number(estimates["steps_all"].mean), number(best["steps_all"]["median"])),
            *(number(line.of_paper("steps")), number(estimates["deliveries_last50"].mean, 2)),
        ]
        rows.append(cells if beside else [*cells[:5], *cells[6:8], cells[9]])
    notes = [
        "Return and food: last 50 episodes; steps: all. IQM: interquartile mean. Best run: "
        "highest return of all configurations, one run each."
    ]
    if any(is_apart(line.summary.estimates["return_last50"]) for line in shown):
        notes.append(f"{APART} outliers pull the mean away from the IQM.")
    if any(line.summary.mixed for line in shown):
        notes.append(MIXED)
    if not all(line.paper_configuration for line in shown):
        notes.append("* best configuration by the IQM of the return, which flatters the learner.")
    if len(lines) > len(shown):
        notes.append(f"table2.csv has {len(lines) - len(shown)} more rows.")
    return Table("", headers, rows, notes, text_columns=2)


def figure_tables(lines: Sequence[Line], comparison: Comparison) -> list[Table]:
    """Return a table for each of `FIGURES`, and one with notes only.

    In the paper's world, the tables also have the paper's numbers.
    """
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
                _spread(name, *estimator[:3], mark=f" {APART}" if is_apart(estimator) else ""),
                _spread(name, *estimator[3:6]),
                _spread(name, best["median"], best["low"], best["high"]),
                number(line.of_paper(name), 2 if "deliver" in name else 1),
                percent(best["paper_percentile"] / 100),
            ]
            rows.append(cells[:width])
        tables.append(Table(title, headers[:width], rows, text_columns=2))
    return [*tables, Table("", (), (), _notes(lines, len(comparison.seeds), beside))]


def _spread(measure: str, middle: float | None, low: float, high: float, mark: str = "") -> str:
    """Return an estimate with its interval, if it has one, on the next line; "-" for None."""
    if middle is None:
        return MISSING
    large = max(abs(middle), abs(high)) >= 100
    digits = 2 if measure.startswith("deliveries") else 0 if large else 1
    text = number(middle, digits) + mark
    return text if math.isnan(low) or low == high else f"{text}\n{interval(low, high, digits)}"


def _notes(lines: Sequence[Line], seeds: int, beside: bool) -> list[str]:
    notes = [
        f"Mean, IQM: over {seeds} seeds, with intervals at 95 %."
        if seeds > 1
        else "Mean, IQM: of one seed, which has no interval.",
        "IQM: interquartile mean, the mean of the middle half of the runs.",
        "Best run: highest return of all configurations, one run each: median, [95 % range].",
    ]
    if any(is_apart(line.summary.estimates[name]) for line in lines for name in FIGURES):
        notes.append(f"{APART} outliers pull the mean out of the interval of the IQM.")
    if beside:
        notes += [
            "Paper: its table 2, whose steps may be of all episodes or of the last 50.",
            "Below: percentage of best runs below the paper's number.",
        ]
    if 1 < seeds < FEW_SEEDS:
        notes += [
            f"Few seeds ({seeds}): if one run in a hundred is an outlier, most intervals of the "
            "mean miss the true mean. Intervals of the IQM are valid from 10 seeds on "
            "(docs/concepts/statistics.md)."
        ]
    starred = [
        f"  {line.label}, {line.delivery}: {line.summary.row.point.label}"
        for line in lines
        if not line.paper_configuration
    ]
    if starred:
        best = "* best configuration by the IQM of the return on these seeds, which flatters it"
        notes += [f"{best} (learning rate / discount / epsilon / decay):", *starred]
    return [*notes, MIXED] if any(line.summary.mixed for line in lines) else notes


def greedy_table(lines: Sequence[Line]) -> Table:
    """Return a table of the greedy rollouts of the final policies."""
    means = ("Return\nmean", "IQM", "Steps\nmean", "IQM", "Deliveries\nmean")
    rows = []
    for line in lines:
        gains, steps, food = (
            line.summary.estimates[f"greedy_{name}"] for name in ("return", "steps", "deliveries")
        )
        both = (text for one in (gains, steps) for text in (_mean(one), number(one.iqm)))
        rows.append([line.label, line.delivery, *both, number(food.mean, 2)])
    low, high = GREEDY_STEPS
    note = f"The paper, in its world: a return of about {GREEDY_RETURN} in {low} to {high} steps."
    title = "Greedy evaluation, configurations as above"
    return Table(title, ("Learner", "Delivery", *means), rows, [note], 2)


def behaviour_table(lines: Sequence[Line], behaviours: Sequence[Mapping[str, Any]]) -> Table:
    """Return a table of the behaviours of the final policies of `lines`."""
    returns = ("Return\nin training", "Return\nfollowed", "Return\ngreedy")
    headers = ("Learner", "Delivery", "Behaviour", "Runs", *returns)
    shown = ("return_last50_mean", "policy_return_mean", "greedy_return_mean")
    rows = [
        [
            line.label,
            line.delivery,
            one["behaviour"],
            str(one["runs"]),
            *(number(one[n]) for n in shown),
        ]
        for line in lines
        for one in behaviours
        if one.items() >= line.summary.row.columns().items()
    ]
    notes = (
        "Each policy is followed greedily once, with evaporation as in training.",
        *(f"{one}: {words}." for one, words in zip(BEHAVIOURS, DEFINITIONS, strict=True)),
        "An episode without a delivery is classified by its second half.",
        "Return in training: mean of the last 50 episodes; followed: of the classified episode; "
        "greedy: of the greedy evaluation. summary.csv has the counts of all configurations.",
    )
    title = "Behaviour, in the configurations above"
    return Table(title, headers, rows, notes, text_columns=3)


def baseline_table(baselines: Sequence[Baseline]) -> Table:
    """Return a table of exact bounds and simple policies; notes explain why some are missing."""
    rows = [
        [one.label, number(one.return_mean), number(one.steps_mean), number(one.deliveries_mean, 2)]
        for one in baselines
        if one.return_mean is not None
    ]
    notes = [f"{one.label}: {one.note}" for one in baselines if one.return_mean is None]
    headers = ("Behaviour", "Return", "Steps", "Deliveries")
    return Table("Baselines, with evaporation as in training", headers, rows, notes)
