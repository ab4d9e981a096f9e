"""The page of the paper's comparison, and its figures and recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from policy_sheet import policy_sheet

from paper import comparison as paper
from paper import report
from paper.claims import headlines
from paper.comparison import Comparison
from paper.figures import draw_all
from paper.report import Results
from paper.table2 import example_name, examples
from taichi_ants.analysis.behaviour import BEHAVIOURS, DEFINITIONS, DELIVERS, counts
from taichi_ants.analysis.bounds.baselines import Baseline
from taichi_ants.analysis.drawings import Drawing, drawings
from taichi_ants.analysis.tables import sentence, thousands
from taichi_ants.errors import count
from taichi_ants.learners.policies import load_policy
from taichi_ants.rendering import Episode
from taichi_ants.report.page import Picture, Player, Shown, Statement, Statements, fill
from taichi_ants.studies.points import RunPoint
from taichi_ants.studies.runner import Study
from taichi_ants.task import Task
from taichi_ants.viewer import record_episode

STEPS = 80  # the longest recording; a delivery takes 34 steps, walking to and fro on the trail 38

Begin = Callable[..., Callable[[], Any]]  # begins a call and returns a function that waits for it


class Seen(NamedTuple):
    """The figures, a recording of each behaviour, and the sheet of a policy that delivers."""

    drawings: Sequence[Drawing] = ()
    players: Sequence[Player] = ()
    sheet: Picture | None = None


def as_in_training(task: Task) -> Task:
    """Return the task with the evaporation of training also in evaluation."""
    return replace(task, evaporation_in_evaluation=task.evaporation_in_training)


def played(point: RunPoint, q_values: np.ndarray, seed: int) -> Episode:
    """Return the first steps of the episode by which the behaviour of a policy was classified.

    It has the evaporation of training, not that of the greedy evaluation.
    """
    steps, task = min(point.max_steps, STEPS), as_in_training(point.task)
    return Episode.play(point.world, q_values, seed=seed, max_steps=steps, task=task)


def what_is_seen(
    policies: Path,
    study: Study[RunPoint],
    comparison: Comparison,
    baselines: Sequence[Baseline],
    play: Begin = partial,
    draw: Begin = partial,
) -> Callable[[], Seen]:
    """Return a function that waits for the figures, recordings and policy sheet of the page.

    Examples whose policies are not in the folder are skipped. This process follows the policies,
    because it has compiled the kernel. `play` and `draw` start the work of making recordings and
    figures, for example in a worker process (`WorkerProcess.begin`).
    """
    first: dict[int, tuple[int, int, Path]] = {}
    for row, run in examples(comparison):
        path = policies / f"{example_name(comparison, row, run)}.npz"
        if path.exists():
            first.setdefault(int(comparison.behaviours[row, run]), (row, run, path))
    done, recorded, sheets = counts(comparison.behaviours), [], []
    for code, (row, run, path) in sorted(first.items()):
        point, seed, (_, variant, grid) = study.points[row], study.seeds[run], comparison.rows[row]
        policy = load_policy(path)
        whose = (
            f"{variant.label}, delivery {point.task.delivery}, seed {seed}, {grid.label} (learning "
            "rate / discount / epsilon / decay)"
        )
        share = f"{thousands(done[code])} of {thousands(comparison.behaviours.size)}"
        words = f"{sentence(DEFINITIONS[code])}: {share} final policies. Shown: {whose}."
        recording = play(record_episode, played(point, policy.q_values, seed), BEHAVIOURS[code])
        recorded.append((sentence(BEHAVIOURS[code]), words, recording))
        if code == DELIVERS:
            title = f"{variant.label}: policy"
            sheet = play(policy_sheet, policy.q_values, title, task=point.task)
            sheets.append((f"The policy of an ant: {whose}", sheet))
    drawn = draw(drawings_of, comparison, baselines)
    return lambda: Seen(
        drawn(),
        [Player(title, words, one()) for title, words, one in recorded],
        next((Picture(words, one()) for words, one in sheets), None),
    )


def drawings_of(comparison: Comparison, baselines: Sequence[Baseline]) -> list[Drawing]:
    """Return new figures for the page, because saving a figure as a file changes its layout."""
    return drawings(draw_all(comparison, baselines))


def comparison_page(
    results: Results, seen: Seen, *, facts: Mapping[str, str], files: Sequence[str]
) -> str:
    """Return the page as HTML; `facts` describe the method, and `files` are links to results."""
    comparison = results.comparison
    first, *others, notes = report.figure_tables(results.lines, comparison)
    greedy, baselines = report.greedy_table(results.lines), report.baseline_table(results.baselines)
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
        headlines=headlines(results.audit),
        claims=_claims(results),
        first_table=first,
        table_notes=notes,
        more_tables=[*others, greedy, baselines],
        behaviours=report.behaviour_table(results.lines, results.behaviours),
        **seen._asdict(),
        facts=facts,
        files=files,
    )


def _claims(results: Results) -> Statements:
    lines = []
    for claim, findings in results.audit.items():
        told = [
            Shown(f"delivery {setting}", one, one.contrast.label, claim.quantity.unit)
            for setting, one in findings.items()
        ]
        facts = {"Tested on": claim.tested_on, "Criterion": claim.asked}
        verdicts = [one.verdict for one in findings.values()]
        lines.append(Statement(claim.statement, claim.section, verdicts, facts, told))
    settings = map(sentence, results.comparison.delivery_settings)
    return Statements(("The paper, in our words", "Section", *settings), lines, "claims")
