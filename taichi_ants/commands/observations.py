"""What ants gain from seeing more: all learners with all observations, at equal steps.

The paper names it as future work: "the effects of increasing this observation space on the
behaviour of the agents using various algorithms". One ant alone, in the paper's world and in open
worlds; then 16 ants that learn into one table. The measure is deliveries per 1000 steps of an ant:
of an ant alone while it trains, in the last quarter of a budget of steps that is the same for all;
of many ants in the evaluation after an equal number of ticks.
"""

from __future__ import annotations

import argparse
import itertools
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from taichi_ants.studies.command_line import (
    Parser,
    add_common,
    add_results,
    load_plugin,
    notice,
    progress_bar,
    run_command,
)

if TYPE_CHECKING:
    import numpy as np

    from taichi_ants.analysis.findings import Contrast
    from taichi_ants.learners.config import TrainingConfig
    from taichi_ants.studies.runner import Outcome, RunPoint, Study

FIGURES, SEEDS_TABLE, SUMMARY, FINDINGS = "figures", "seeds.csv", "summary.csv", "findings.csv"
RATES = (0.1, 0.9, 0.3, 0.99)  # learning rate, discount, epsilon, its decay
RANGES = (20, 20, 20)
BUDGET = {"paper": 60_000, "open": 20_000}  # steps of an ant that is alone
SHORTEST = {"paper": 34, "open": 8}  # steps of an episode, at least
LONGEST = {"paper": 600, "open": 200}  # and at most
LAST = 0.25  # of the budget is what counts
ANTS, EPISODES, TICKS = 16, 40, 500  # of the ants that learn together
MARGIN = 0.5  # deliveries per 1000 steps that do not matter
WORDS = "deliveries per 1000 steps"
PLACES = {
    "alone, paper": "One ant alone, the paper's world",
    "alone, open": "One ant alone, open worlds",
    "together, paper": f"{ANTS} ants with one table, the paper's world",
    "together, open": f"{ANTS} ants with one table, open worlds",
}


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """The settings of the command line."""
    summary, more = __doc__.split("\n", 1)
    parser = Parser(summary, epilog=more)
    parser.add_argument("--quick", action="store_true", help="4 seeds instead of 20")
    add_common(parser)
    add_results(parser, "results/observations, -quick behind it with --quick")
    settings = parser.parse_args(arguments)
    settings.out = settings.out or Path("results", f"observations{'-quick' * settings.quick}")
    settings.seeds = 4 if settings.quick else 20
    return settings


def configs(shared: bool) -> list[TrainingConfig]:
    """A configuration of each learner; of those only whose tables can be shared, if so."""
    from taichi_ants import TrainingConfig, learners

    return [
        TrainingConfig(name, *RATES)
        for name in learners.names()
        if not shared or learners.get(name).td_error is not None
    ]


def studies(seeds: int) -> dict[str, Study]:
    """The work in each place; points by learner, then by observation."""
    from taichi_ants import Life, Task, worlds
    from taichi_ants.studies.runner import ColonyPoint, RunPoint, Study
    from taichi_ants.task import observations

    own = tuple(range(seeds))
    open_worlds = tuple(worlds.open_world(seed, RANGES) for seed in own)
    lasting = Task(delivery="continuing", evaporation_in_training=True, life=Life(regrowth=0))
    made: dict[str, Study] = {}
    for where, each in (("paper", (worlds.paper(),)), ("open", open_worlds)):
        alone = [
            RunPoint(
                world,
                Task(name),
                config,
                episodes=BUDGET[where] // SHORTEST[where] + 1,
                max_steps=LONGEST[where],
                rollouts=1,
            )
            for world, config, name in itertools.product(each, configs(False), observations.names())
        ]
        # Each open world is a draw of its own; in the paper's world the seeds are.
        made[f"alone, {where}"] = Study(tuple(alone), own if where == "paper" else (0,))
        together = [
            ColonyPoint(
                each[0] if where == "paper" else each,
                replace(lasting, observation=name),
                config,
                ants=ANTS,
                episodes=EPISODES,
                ticks=TICKS,
            )
            for config, name in itertools.product(configs(True), observations.names())
        ]
        made[f"together, {where}"] = Study(tuple(together), own)
    return made


def alone_values(point: RunPoint, outcome: Outcome, budget: int) -> np.ndarray:
    """Deliveries per 1000 steps of episodes that end in the last part of the budget, (seeds,)."""
    import numpy as np

    steps = outcome["steps"].astype(np.int64)
    ends = steps.cumsum(axis=1)
    counts = (ends > (1 - LAST) * budget) & (ends <= budget)
    delivered = np.where(counts, outcome["deliveries"], 0).sum(axis=1)
    return 1000 * delivered / np.where(counts, steps, 0).sum(axis=1)


def values_of(study: Study, outcomes: dict[Any, Outcome], where: str) -> np.ndarray:
    """The measure, float64 (learners, observations, replicates): seeds, or worlds."""
    import numpy as np

    from taichi_ants.task import observations

    if where.startswith("together"):
        per_ant = 1000 / (TICKS * ANTS)
        rows = [outcomes[point]["deliveries"].mean(axis=1) * per_ant for point in study.points]
        return np.array(rows).reshape(-1, len(observations.names()), len(study.seeds))
    budget = BUDGET[where.split(", ")[1]]
    rows = [alone_values(point, outcomes[point], budget) for point in study.points]
    array = np.array(rows)
    if where.endswith("open"):  # worlds first, one seed each
        array = array.reshape(-1, len(configs(False)) * len(observations.names())).T
    return array.reshape(-1, len(observations.names()), array.shape[-1])


def contrasts(where: str, values: np.ndarray) -> list[Contrast]:
    """Of each learner each observation minus the paper's."""
    from taichi_ants.analysis.findings import Above, Contrast
    from taichi_ants.task import observations

    names = observations.names()
    return [
        Contrast(
            f"{where}: {config.learner}, {name} minus paper",
            values[row, column] - values[row, names.index("paper")],
            Above(MARGIN),
        )
        for row, config in enumerate(configs(where.startswith("together")))
        for column, name in enumerate(names)
        if name != "paper"
    ]


def settings_of(where: str) -> list[dict[str, str]]:
    """The place, learner and observation of each row of `values_of`, in order."""
    from taichi_ants.task import observations

    return [
        {"place": where, "learner": config.learner, "observation": name}
        for config in configs(where.startswith("together"))
        for name in observations.names()
    ]


def do_study(
    settings: argparse.Namespace, work: dict[str, Study], blocks: Path, ready: Path
) -> None:
    """All but the figure."""
    from taichi_ants import files
    from taichi_ants.analysis import sweeps
    from taichi_ants.analysis.findings import judge
    from taichi_ants.studies.result_folder import REPORT

    found, judged, summary, rows = {}, [], [], []
    for number, (where, study) in enumerate(work.items()):
        folder = files.check_writable_folder(blocks / str(number))
        with progress_bar(where) as progress:
            outcomes = study.run(folder, settings.threads, settings.arch, progress, notice)
        found[where] = values = values_of(study, outcomes, where)
        flat = {"deliveries": values.reshape(-1, values.shape[-1])}
        rows += sweeps.seed_rows(settings_of(where), range(values.shape[-1]), flat)
        summary += sweeps.summary_rows(settings_of(where), flat)
        judged += judge(contrasts(where, values))
    lines = [
        {
            "contrast": one.contrast.label,
            "verdict": one.verdict.value,
            "difference": one.effect,
            "low": one.low,
            "high": one.high,
        }
        for one in judged
    ]
    files.write_csv(ready / SEEDS_TABLE, rows, list(rows[0]))
    files.write_csv(ready / SUMMARY, summary, list(summary[0]))
    files.write_csv(ready / FINDINGS, lines, list(lines[0]))
    files.write_text(ready / REPORT, report(found, lines))


def report(found: dict[str, np.ndarray], findings: list[dict[str, Any]]) -> str:
    """A table for each place, and what the findings come to."""
    from collections import Counter

    from taichi_ants.analysis.statistics import bootstrap_interval
    from taichi_ants.analysis.tables import Table, figure, markdown
    from taichi_ants.task import observations

    verdicts = {line["contrast"]: line["verdict"] for line in findings}
    marks = {"supported": " +", "contradicted": " -", "equivalent": " =", "undecided": ""}
    blocks: list[Any] = []
    for where, values in found.items():
        ends = bootstrap_interval(values.reshape(-1, values.shape[-1]))
        low, high = (end.reshape(values.shape[:2]) for end in ends)
        lines = []
        for row, config in enumerate(configs(where.startswith("together"))):
            cells = [config.learner]
            for column, name in enumerate(observations.names()):
                verdict = verdicts.get(
                    f"{where}: {config.learner}, {name} minus paper", "undecided"
                )
                spread = f"[{figure(low[row, column])}, {figure(high[row, column])}]"
                cells.append(f"{figure(values[row, column].mean())} {spread}{marks[verdict]}")
            lines.append(cells)
        title = f"{PLACES[where]}: {WORDS} of an ant, {values.shape[-1]} replicates"
        blocks.append(Table(title, ["learner", *observations.names()], lines))
    counts = Counter(line["verdict"] for line in findings)
    tally = ", ".join(f"{n} {verdict}" for verdict, n in counts.most_common())
    blocks.append(
        "Means with 95 % bootstrap intervals. Against the paper's observation, with intervals that "
        f"hold at once in each place: + more, - fewer, = equal to within {MARGIN} deliveries; "
        f"without a mark the data leave it open. In all: {tally}."
    )
    return markdown(blocks)


def draw_figure(results: Path, folder: Path) -> None:
    """Draw the means with their intervals from the summary in one folder into `figures`."""
    import csv

    from taichi_ants import files
    from taichi_ants.analysis import style
    from taichi_ants.task import observations

    with open(results / SUMMARY, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    names = observations.names()
    colours = (style.INK, style.BLUE, style.SKY, style.ORANGE, style.RED, style.WINE, style.GREY)
    with style.styled():
        drawn = style.new_figure(8.0)
        every = drawn.subplots(2, 2).ravel()
        for axes, (where, words) in zip(every, PLACES.items(), strict=True):
            here = [row for row in rows if row["place"] == where]
            learners = list(dict.fromkeys(row["learner"] for row in here))
            for place, (name, colour) in enumerate(zip(names, itertools.cycle(colours))):
                own = [row for row in here if row["observation"] == name]
                mean = [float(row["deliveries_mean"]) for row in own]
                ends = [
                    (m - float(row["deliveries_ci_low"]), float(row["deliveries_ci_high"]) - m)
                    for m, row in zip(mean, own, strict=True)
                ]
                x = [n + (place - (len(names) - 1) / 2) * 0.15 for n in range(len(learners))]
                axes.errorbar(
                    x, mean, list(zip(*ends, strict=True)), fmt="o", ms=3, color=colour, label=name
                )
            axes.set_xticks(range(len(learners)), learners, rotation=30, ha="right")
            axes.set_title(words, fontsize="small")
            axes.set_ylabel(WORDS)
            axes.set_ylim(bottom=0)
        entries = style.legend_entries(every)
        caption = "Means with 95 % bootstrap intervals; all observations at equal steps."
        style.frame(drawn, "What ants gain from seeing more", caption, entries)
    style.save(drawn, files.check_writable_folder(folder / FIGURES) / "observations.png")


def observations_study(settings: argparse.Namespace) -> None:
    """Do the study, or show the finished one."""
    from taichi_ants.studies.result_folder import work_or_show

    if settings.plugin:
        load_plugin(settings.plugin)
    work = studies(settings.seeds)
    facts = {where: study.settings() for where, study in work.items()}
    pictures = {} if settings.no_figures else {FIGURES: draw_figure}
    work_or_show(settings, facts, partial(do_study, settings, work), pictures)


def main(arguments: list[str] | None = None) -> None:
    """The command line."""
    again = "Stopped; finished parts are kept, and the same command goes on from there."
    run_command(lambda: observations_study(parse_arguments(arguments)), again)
