"""The page of the comparison, with its recordings, animations and policy sheet."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from policy_sheet import policy_sheet

from paper import comparison as paper
from paper import process, report
from paper.baselines import Baseline
from paper.claims import Audit, headlines
from paper.comparison import DEFINITIONS, Comparison, counts
from paper.table2 import Line, summarise_behaviours
from taichi_ants.analysis import style
from taichi_ants.analysis.behaviour import BEHAVIOURS, DELIVERS
from taichi_ants.analysis.drawings import Drawing
from taichi_ants.analysis.tables import sentence, thousands
from taichi_ants.engines.runs.results import RolloutArguments
from taichi_ants.engines.runs.training import rollout
from taichi_ants.errors import count
from taichi_ants.rendering.snapshots import colony_of_rollout
from taichi_ants.report.page import Picture, Player, ShownFinding, Statement, Statements, fill
from taichi_ants.studies.command_line import progress_bar
from taichi_ants.studies.points import RunPoint
from taichi_ants.task import Task
from taichi_ants.task.constants import N_ACTIONS
from taichi_ants.viewer import record_colony, record_trace
from taichi_ants.worlds.world import World

STEPS = 80  # the longest recording; a delivery takes 34 steps, walking to and fro on the trail 38


class Example(NamedTuple):
    """A run that shows a behaviour: its place in the comparison, its point and final policy."""

    row: int
    run: int
    point: RunPoint
    seed: int
    q_values: np.ndarray


class Seen(NamedTuple):
    """The figures, a recording of each behaviour, and the sheet of a policy that delivers."""

    drawings: Sequence[Drawing] = ()
    players: Sequence[Player] = ()
    sheet: Picture | None = None


def as_in_training(task: Task) -> Task:
    """Return the task with the evaporation of training also in evaluation."""
    return replace(task, evaporation_in_evaluation=task.evaporation_in_training)


def get_ready(world: World, task: Task) -> None:
    """Import what draws figures and prepare the kernels of recordings, while others train."""
    from matplotlib import artist

    vars(artist)["kwdoc"] = lambda _: ""  # for help texts, which take a third of the import
    style.new_figure(1)
    table = np.zeros((task.n_states, N_ACTIONS), np.float32)
    arguments = RolloutArguments(world, as_in_training(task), 0, 1, 0, table)
    record_colony(colony_of_rollout(arguments), 1)


def begin(
    comparison: Comparison, examples: list[Example], drawn: process.Begun
) -> Callable[[], Seen]:
    """Return a function that waits until figures are `drawn`, and for all that the page shows.

    This process follows the policies, because it has compiled the kernel.
    """
    first = {int(comparison.behaviours[one[:2]]): one for one in reversed(examples)}
    calls: dict[Any, process.Begun] = {"figures": drawn}
    done, captions = counts(comparison.behaviours), dict[int, tuple[str, str]]()
    sheet = None
    for code, (row, _, point, seed, q_values) in sorted(first.items()):
        _, variant, grid = comparison.rows[row]
        whose = (
            f"{variant.label}, delivery {point.task.delivery}, seed {seed}, "
            f"{grid.label} (learning rate / discount / epsilon / decay)"
        )
        share = f"{thousands(done[code])} of {thousands(comparison.behaviours.size)}"
        words = f"{sentence(DEFINITIONS[code])}: {share} final policies. Shown: {whose}."
        captions[code] = sentence(BEHAVIOURS[code]), words
        # The first steps of the episode by which the behaviour was classified.
        how: Any = seed, 0, min(point.max_steps, STEPS), as_in_training(point.task)
        trace = rollout(point.world, q_values, *how)
        calls[code] = process.begin(record_trace, trace, BEHAVIOURS[code])
        if code == DELIVERS:
            image = policy_sheet(q_values, f"{variant.label}: policy", task=point.task)
            sheet = Picture.of(f"The policy of an ant: {whose}", image)

    def wait() -> Seen:
        with progress_bar("pictures") as progress:
            results = process.results_of(calls, progress)
        players = [Player(*captions[code], results[code]) for code in sorted(first)]
        return Seen(results["figures"], players, sheet)

    return wait


def comparison_page(
    comparison: Comparison,
    baselines: Sequence[Baseline],
    lines: Sequence[Line],
    audit: Audit,
    seen: Seen,
    facts: Mapping[str, str],
    files: Sequence[str],
) -> str:
    """Return the page as HTML; `facts` describe the method, and `files` are links to results."""
    first, *others, notes = report.figure_tables(lines, comparison)
    seeds = len(comparison.seeds)
    return fill(
        Path(__file__).with_name("page.html"),
        title="Which learner trains the best ant?",
        byline=f"{count(seeds, 'seed')}, {count(len(comparison.rows), 'configuration')}, "
        f"{thousands(comparison.behaviours.size * comparison.episodes)} episodes of training, "
        f"world: {comparison.world}",
        seeds=f"{seeds} runs" if seeds > 1 else "a run",
        paper=paper,
        deliveries=comparison.delivery_settings,
        world=comparison.world,
        in_paper_world=comparison.in_paper_world,
        headlines=headlines(audit),
        claims=_claims(comparison, audit),
        first_table=first,
        table_notes=notes,
        more_tables=[*others, report.greedy_table(lines), report.baseline_table(baselines)],
        behaviours=report.behaviour_table(lines, summarise_behaviours(comparison)),
        **seen._asdict(),
        facts=facts,
        files=files,
    )


def _claims(comparison: Comparison, audit: Audit) -> Statements:
    lines = []
    for claim, findings in audit.items():
        told = [
            ShownFinding(f"delivery {setting}", one, one.contrast.label, claim.quantity.unit)
            for setting, one in findings.items()
        ]
        facts = {"Tested on": claim.tested_on, "Criterion": claim.asked}
        verdicts = [one.verdict for one in findings.values()]
        lines.append(Statement(claim.statement, claim.section, verdicts, facts, told))
    settings = map(sentence, comparison.delivery_settings)
    return Statements(("The paper, in our words", "Section", *settings), lines, "claims")
