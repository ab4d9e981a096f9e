"""What moves on the pages: what each behaviour looks like, and colonies at work."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from taichi_ants.analysis.behaviour import BEHAVIOURS, DEFINITIONS, DELIVERS, counts
from taichi_ants.analysis.bounds.baselines import Baseline
from taichi_ants.analysis.colony.study import JOINT, RULES, WORLD_KINDS
from taichi_ants.analysis.drawings import Drawing, drawings
from taichi_ants.analysis.paper.comparison import Comparison
from taichi_ants.analysis.paper.figures import draw_all
from taichi_ants.analysis.paper.table2 import example_name, examples
from taichi_ants.analysis.tables import sentence, thousands
from taichi_ants.engines.colony.colony import Colony
from taichi_ants.errors import count
from taichi_ants.learners.policies import load_policy
from taichi_ants.rendering import Episode, policy_sheet
from taichi_ants.report.page import Picture, Player
from taichi_ants.studies.colony_study import COMPARED, Plan
from taichi_ants.studies.runner import RunPoint, Study
from taichi_ants.task import Task
from taichi_ants.viewer import record_colony, record_episode

STEPS = 80  # of an episode, at most; a delivery takes 34, to and fro on the trail 38
TICKS, MOST_ANTS = 240, 1000  # of a colony: how long, and how many ants are shown at most

Begin = Callable[..., Callable[[], Any]]  # begins a call, and returns what waits for it


class Seen(NamedTuple):
    """Pictures of a comparison's page: figures, a recording of each behaviour, and the sheet of a
    policy that delivers, if one does.
    """

    drawings: Sequence[Drawing] = ()
    players: Sequence[Player] = ()
    sheet: Picture | None = None


def as_in_training(task: Task) -> Task:
    """The task with the evaporation of training in rollouts too."""
    return replace(task, evaporation_in_evaluation=task.evaporation_in_training)


def played(point: RunPoint, q_values: np.ndarray, seed: int) -> Episode:
    """The beginning of the episode that told the behaviour of a policy.

    It has evaporation as in training, not as in the greedy evaluation.
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
    """Return what waits for the figures, a recording of each behaviour and the sheet of a policy.

    Examples whose policies are not in the folder are left out. Ants are followed here, where the
    kernel for that is compiled; `play` and `draw` begin the rest, as `WorkerProcess.begin`.
    """
    first: dict[int, tuple[int, int]] = {}
    for row, run in examples(comparison):
        if (policies / f"{example_name(comparison, row, run)}.npz").exists():
            first.setdefault(int(comparison.behaviours[row, run]), (row, run))
    done, recorded, sheets = counts(comparison.behaviours), [], []
    for code, (row, run) in sorted(first.items()):
        point, seed, (_, variant, grid) = study.points[row], study.seeds[run], comparison.rows[row]
        policy = load_policy(policies / f"{example_name(comparison, row, run)}.npz")
        whose = (
            f"{variant.label}, delivery {point.task.delivery}, seed {seed}, {grid.label} (learning "
            "rate / discount / epsilon / decay)"
        )
        share = f"{thousands(done[code])} of {thousands(comparison.behaviours.size)}"
        words = f"{sentence(DEFINITIONS[code])}: {share} final policies. Here: {whose}."
        recording = play(record_episode, played(point, policy.q_values, seed), BEHAVIOURS[code])
        recorded.append((sentence(BEHAVIOURS[code]), words, recording))
        if code == DELIVERS:
            title = f"{variant.label}: what it does"
            sheet = play(policy_sheet, policy.q_values, title, task=point.task)
            sheets.append((f"What an ant has learned: {whose}", sheet))
    drawn = draw(drawings_of, comparison, baselines)
    return lambda: Seen(
        drawn(),
        [Player(title, words, one()) for title, words, one in recorded],
        next((Picture(words, one()) for words, one in sheets), None),
    )


def drawings_of(comparison: Comparison, baselines: Sequence[Baseline]) -> list[Drawing]:
    """The figures. A figure that has been saved as a file is laid out a little otherwise."""
    return drawings(draw_all(comparison, baselines))


def at_work(policies: Path, conditions: Plan, seeds: Sequence[int], arch: str) -> list[Player]:
    """Recordings of the largest colony under each of the compared rules, all in one world."""
    trained = [one for one in conditions if one.regime == JOINT and one.ants <= MOST_ANTS]
    if not trained:
        return []
    world_kind = max((one.world_kind for one in trained), key=list(WORLD_KINDS).index)
    ants = max(one.ants for one in trained)
    players = []
    for condition in trained:
        _, rules, _, n = condition
        if condition.world_kind != world_kind or rules not in COMPARED or n != ants:
            continue
        point = conditions[condition]
        colony = Colony(
            *(point.world[0] if isinstance(point.world, tuple) else point.world, point.task),
            replace(point.training, epsilon=point.training.least_epsilon),
            *(seeds[0], ants),
            sharing="frozen",
            q_values=load_policy(policies / f"{world_kind}_{rules}_{ants}.npz").q_values,
            arch=arch,
        )
        colony.begin_episode()
        recording = record_colony(colony, TICKS, title=RULES[rules])
        done = count(int(colony.outcome().deliveries.sum()), "delivery")
        words = f"{count(ants, 'ant')} in {WORLD_KINDS[world_kind]}: {done} in {TICKS} ticks."
        players.append(Player(sentence(RULES[rules]), words, recording))
    return players
