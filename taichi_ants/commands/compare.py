"""Repeat the paper's comparison of Q-learning, SARSA and Dyna-Q with many seeds.

A configuration combines a learner with one value of each option that takes several. The command
trains every configuration with every seed and evaluates the final policies without exploration. It
compares the results with the paper and with exact bounds, and writes tables, figures and policies
to a folder. See docs/paper.md.
"""

from __future__ import annotations

import argparse
import itertools
from dataclasses import fields
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from taichi_ants.errors import AntsError
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.settings import all_of
from taichi_ants.studies.command_line import (
    WORLDS,
    Parser,
    add_common,
    add_machines,
    add_results,
    add_settings,
    given_settings,
    given_world,
    load_plugin,
    run_command,
    whole_number,
    with_folder,
)
from taichi_ants.task import Task

if TYPE_CHECKING:
    from taichi_ants import World
    from taichi_ants.studies.points import RunPoint
    from taichi_ants.studies.runner import Study

DELIVERIES = ("truncates", "terminates")
ROLLOUTS = 50
QUICK_SEEDS = 10
MOST_SEEDS = 10_000
# Bounds and behaviours assume the defaults of these settings.
_FIXED = [one.path for one in all_of(Task) if "evaporation_in" not in one.path]
_DEPTH = "planning_steps"  # the one hyperparameter that the paper varies


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line; the defaults are the paper's."""
    parser = Parser(__doc__)
    add = parser.add_argument
    seeds: dict[str, Any] = {"type": whole_number(1, MOST_SEEDS), "metavar": "N"}
    add("--seeds", **seeds, default=100, help=f"number of seeds, at most {MOST_SEEDS}")
    add("--seed", type=whole_number(), default=0, metavar="N", help="first seed")
    counts: dict[str, Any] = {"type": whole_number(1), "metavar": "N"}
    add("--episodes", **counts, default=500, help="training episodes per run")
    add("--max-steps", **counts, default=600, help="step limit of an episode")
    delivery = "bootstrap at a delivery (truncates), do not bootstrap (terminates), or run both"
    add("--delivery", choices=(*DELIVERIES, "both"), default="both", help=delivery)
    names = ("q_learning", "sarsa", "dyna_q")
    add("--learners", nargs="+", default=names, metavar="NAME", help="learners to compare")
    few: dict[str, Any] = {"nargs": "+", "type": float, "metavar": "X"}
    add("--learning-rates", **few, default=(0.001, 0.01), help="learning rates to combine")
    add("--discounts", **few, default=(0.9, 0.99), help="discount factors to combine")
    add("--epsilons", **few, default=(0.3, 0.5), help="initial exploration rates to combine")
    decays = "factors to combine, which multiply epsilon after each episode"
    add("--epsilon-decays", **few, default=(0.99, 0.995), help=decays)
    several: dict[str, Any] = {"nargs": "+", "type": whole_number(1), "metavar": "N"}
    planning = "planning updates after each step, to combine for learners that plan, such as dyna_q"
    add("--planning-steps", **several, default=(3, 5), help=planning)
    add("--world", default="paper", metavar="WORLD", help=WORLDS)
    add_common(parser)
    add_machines(parser)
    quick = (
        f"use at most {QUICK_SEEDS} seeds and draw no animations: a first look at the results, "
        "whose intervals are wide"
    )
    add("--quick", action="store_true", help=quick)
    add_results(parser, "compare")
    parser.open_settings, parser.own_settings = ("world", "training"), _FIXED
    add_settings(parser, Task())
    settings = parser.parse_args(arguments)
    settings.command = "compare"
    if settings.quick:
        settings.seeds = min(settings.seeds, QUICK_SEEDS)
    return with_folder(settings, "compare")


def variants(settings: argparse.Namespace) -> list[tuple[str, dict[str, Any]]]:
    """Return pairs of a learner and its hyperparameters, one for each number of planning steps."""
    from taichi_ants import learners

    given = given_settings(settings).get("training", {})
    if _DEPTH in given:
        raise AntsError(f"training.{_DEPTH} has its own option; use --planning-steps instead.")
    kinds = {name: fields(learners.get(name).hyperparameters) for name in settings.learners}
    own = {name: [field.name for field in kind] for name, kind in kinds.items()}
    for one in given:
        if not any(one in names for names in own.values()):
            raise AntsError(f"`training.{one}` is not a hyperparameter of {', '.join(own)}.")
    return [
        (name, {one: value for one, value in {**given, _DEPTH: n}.items() if one in names})
        for name, names in own.items()
        for n in (settings.planning_steps if _DEPTH in names else [0])
    ]


def points(settings: argparse.Namespace, world: World) -> tuple[RunPoint, ...]:
    """Return the points of the grid: tasks and learners with all combinations of settings."""
    from taichi_ants.studies.points import RunPoint

    deliveries = DELIVERIES if settings.delivery == "both" else (settings.delivery,)
    given = given_settings(settings).get("task", {})
    tasks = [Task().replace(delivery=delivery, **given) for delivery in deliveries]
    numbers = itertools.product(
        settings.learning_rates, settings.discounts, settings.epsilons, settings.epsilon_decays
    )
    grid = itertools.product(tasks, variants(settings), tuple(numbers))
    lengths = settings.episodes, settings.max_steps, ROLLOUTS
    every = (
        RunPoint(world, task, TrainingConfig(name, *four, **more), *lengths)
        for task, (name, more), four in grid
    )
    return tuple(dict.fromkeys(every))  # without repetitions


def build_study(settings: argparse.Namespace) -> Study[RunPoint]:
    """Return the study, after checking all settings."""
    from taichi_ants.studies.runner import Study

    load_plugin(settings.plugin)
    world = given_world(settings)
    grid = points(settings, world)
    if not world.reachable_foods().any():
        raise AntsError(
            f"ants cannot reach any food of the world {settings.world!r} from the queen; open a "
            "way or choose another world."
        )
    return Study(grid, tuple(range(settings.seed, settings.seed + settings.seeds)))


def compare(settings: argparse.Namespace) -> None:
    """Run the comparison, or show its results if it is finished."""
    from taichi_ants.files.inputs import recorded
    from taichi_ants.files.results import MANIFEST
    from taichi_ants.studies.result_folder import work_or_show
    from taichi_ants.studies.worker_process import WorkerProcess

    def work(*folders: Path) -> Any:
        from taichi_ants.report.results import do_comparison

        return do_comparison(settings, study, worker, *folders)

    def take(*given: Any) -> None:
        from taichi_ants.report.results import take_results

        take_results(*given)

    def page(*found: Any) -> str:
        from taichi_ants.report.results import make_page

        return make_page(settings, study, *found)

    # With --threads 1, there is no worker process either.
    with WorkerProcess(not settings.no_figures and settings.threads != 1) as worker:
        if not (settings.out / MANIFEST).exists():
            worker.begin(import_module, "taichi_ants.report.results")  # slow, so start early
        with recorded() as inputs:
            study = build_study(settings)
        how: dict[str, Any] = {"page": page, "study": study, "take": take, "inputs": inputs}
        work_or_show(settings, study.settings(), work, **how)


def main(arguments: list[str] | None = None) -> None:
    """Run the command."""
    again = "Stopped; finished runs are saved. Run the same command again to resume."
    run_command(lambda: compare(parse_arguments(arguments)), again)
