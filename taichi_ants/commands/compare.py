"""The paper's comparison of Q-learning, SARSA and Dyna-Q, over many seeds, with honest statistics.

Trains every configuration with every seed, follows the final policies greedily, holds the outcome
against the paper and against exact bounds, and writes tables, figures and policies to a folder.
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from taichi_ants.settings import all_of
from taichi_ants.studies.command_line import (
    WORLDS,
    Parser,
    add_common,
    add_results,
    add_settings,
    given_settings,
    given_world,
    load_plugin,
    progress_bar,
    run_command,
    whole_number,
    with_folder,
)
from taichi_ants.task import Task

if TYPE_CHECKING:
    import numpy as np

    from taichi_ants import World
    from taichi_ants.analysis.bounds.baselines import Baseline
    from taichi_ants.analysis.paper.comparison import Comparison
    from taichi_ants.analysis.paper.report import Results
    from taichi_ants.rendering import Episode
    from taichi_ants.report.players import Seen
    from taichi_ants.studies.blocks import Outcome
    from taichi_ants.studies.runner import RunPoint, Study
    from taichi_ants.studies.worker_process import WorkerProcess

# Begins a call, and gives what waits for its end.
Begin = Callable[..., Callable[[], Any]]

DELIVERIES = ("truncates", "terminates")
ROLLOUTS = 50
QUICK_SEEDS = 10
SIZE = 720, 480  # of animations
MOST_SEEDS = 10_000
RUNS, BASELINES = "runs.npz", "baselines.csv"
FIGURES, POLICIES, RENDERS = "figures", "policies", "renders"
# Of these, bounds and behaviours know no other values.
_FIXED = [one.path for one in all_of(Task) if "evaporation_in" not in one.path]
_DEPTH = "planning_steps"  # the one hyperparameter that the paper varies
_CURVE = "curve_"  # begins the names of learning curves in RUNS


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """The settings of the command line; the defaults are the paper's."""
    parser = Parser(__doc__)
    add = parser.add_argument
    seeds: dict[str, Any] = {"type": whole_number(1, MOST_SEEDS), "metavar": "N"}
    add("--seeds", **seeds, default=100, help=f"how many, at most {MOST_SEEDS}")
    add("--seed", type=whole_number(), default=0, metavar="BASE", help="the first of them")
    counts: dict[str, Any] = {"type": whole_number(1), "metavar": "N"}
    add("--episodes", **counts, default=500, help="training episodes of a run")
    add("--max-steps", **counts, default=600, help="step limit")
    add("--delivery", choices=(*DELIVERIES, "both"), default="both", help="what delivery means")
    names = ("q_learning", "sarsa", "dyna_q")
    add("--learners", nargs="+", default=names, metavar="NAME", help="one or more")
    few: dict[str, Any] = {"nargs": "+", "type": float, "metavar": "X", "help": "one or more"}
    add("--learning-rates", **few, default=(0.001, 0.01))
    add("--discounts", **few, default=(0.9, 0.99))
    add("--epsilons", **few, default=(0.3, 0.5))
    add("--epsilon-decays", **few, default=(0.99, 0.995))
    several: dict[str, Any] = {"nargs": "+", "type": whole_number(1), "metavar": "N"}
    add("--planning-steps", **several, default=(3, 5), help="one or more, for learners that plan")
    add("--world", default="paper", help=WORLDS)
    add_common(parser)
    add("--quick", action="store_true", help=f"at most {QUICK_SEEDS} seeds, no animations")
    add_results(parser, "compare")
    parser.open_settings, parser.own_settings = ("world", "training"), _FIXED
    add_settings(parser, Task())
    settings = parser.parse_args(arguments)
    if settings.quick:
        settings.seeds = min(settings.seeds, QUICK_SEEDS)
    return with_folder(settings, "compare")


def variants(settings: argparse.Namespace) -> list[tuple[str, dict[str, Any]]]:
    """The learners, each with what it has of the hyperparameters, once for each planning depth."""
    from taichi_ants import AntsError, learners

    given = given_settings(settings).get("training", {})
    if _DEPTH in given:
        raise AntsError(f"training.{_DEPTH} has its own option; write --planning-steps.")
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
    """The grid: tasks, learners and planning steps, times rates, discounts and exploration."""
    from taichi_ants import TrainingConfig
    from taichi_ants.studies.runner import RunPoint

    deliveries = DELIVERIES if settings.delivery == "both" else (settings.delivery,)
    given = given_settings(settings).get("task", {})
    tasks = [Task().but(delivery=delivery, **given) for delivery in deliveries]
    numbers = itertools.product(
        settings.learning_rates, settings.discounts, settings.epsilons, settings.epsilon_decays
    )
    grid = itertools.product(tasks, variants(settings), tuple(numbers))
    lengths = settings.episodes, settings.max_steps, ROLLOUTS
    every = (
        RunPoint(world, task, TrainingConfig(name, *four, **more), *lengths)
        for task, (name, more), four in grid
    )
    return tuple(dict.fromkeys(every))  # some may be asked for twice


def build_study(settings: argparse.Namespace) -> Study[RunPoint]:
    """The work, checked as a whole before any of it is done."""
    from taichi_ants import AntsError
    from taichi_ants.studies.runner import Study

    load_plugin(settings.plugin)
    world = given_world(settings)
    grid = points(settings, world)
    if not world.reachable_foods().any():
        raise AntsError(
            f"no food of the world {settings.world!r} can be reached from the queen; "
            "open a way or choose another world."
        )
    return Study(grid, tuple(range(settings.seed, settings.seed + settings.seeds)))


def world_name(settings: argparse.Namespace, study: Study[RunPoint]) -> str:
    """The world for readers: a registered name with its seed, or the name of a map file."""
    from taichi_ants import worlds
    from taichi_ants.analysis.paper.comparison import PAPER_WORLD

    if study.points[0].world == worlds.paper():
        return PAPER_WORLD
    if settings.world in worlds.names():
        of_world = {"seed": 0, **given_settings(settings).get("world", {})}
        return ", ".join([settings.world, *(f"world {n} {value}" for n, value in of_world.items())])
    return Path(settings.world).name


def what_policies_do(
    point: RunPoint, seeds: Sequence[int], q_values: np.ndarray
) -> dict[str, np.ndarray]:
    """Return behaviours and returns of ants that follow final policies; integer (C, S) both.

    The policies (C, S, n_states, 5) are of points that differ from this one in their learners.
    """
    import numpy as np

    from taichi_ants.analysis.behaviour import classify
    from taichi_ants.engines.runs.traces import MAX_ROLLOUT_STEPS, trace_policies
    from taichi_ants.report.players import as_in_training

    tables = q_values.reshape(-1, *q_values.shape[2:])
    max_steps = min(point.max_steps, MAX_ROLLOUT_STEPS)
    task, several = as_in_training(point.task), [*seeds] * len(q_values)
    traces = trace_policies(point.world, tables, several, max_steps, task)
    behaviours, returns = zip(*(classify(trace, max_steps) for trace in traces), strict=True)
    arrays = {"behaviours": behaviours, "policy_returns": returns}
    return {n: np.concatenate(parts).reshape(q_values.shape[:2]) for n, parts in arrays.items()}


def compile_kernels(points: Sequence[RunPoint], where: Mapping[str, Any]) -> None:
    """Compile all kernels first, on one thread, while the other process compiles its own."""
    for point in {point.training.learner: point for point in points}.values():
        short = replace(point, episodes=1, max_steps=1, rollouts=1)
        outcome = short.do((short,), (0,), None, lambda share: None, where)
        what_policies_do(short, (0,), outcome["q_values"])


def measured(
    study: Study[RunPoint], folder: Path, threads: int | None, arch: str | None
) -> dict[str, np.ndarray]:
    """Return all measures of the runs, and what the final policies do: arrays (points, seeds)."""
    from taichi_ants.analysis.paper.measures import measures_of_runs

    def reduce(
        points: Sequence[RunPoint], seeds: Sequence[int], outcome: Outcome
    ) -> dict[str, np.ndarray]:
        followed = what_policies_do(points[0], seeds, outcome["q_values"])
        return {**measures_of_runs(outcome), **followed}

    with progress_bar("training") as progress:
        compile_kernels(study.points, {"threads": threads, "arch": arch})
        return study.reduced(folder, reduce, threads, arch, progress)


def write_tables(folder: Path, results: Results) -> None:
    """Write all tables and the report."""
    from taichi_ants import files
    from taichi_ants.analysis.paper.audit import claims_markdown, claims_rows
    from taichi_ants.analysis.paper.report import report, table2_markdown
    from taichi_ants.files.results import REPORT

    comparison, lines, audit = results.comparison, results.lines, results.audit
    tables = {
        "summary": [one.columns() for one in results.summaries],
        "behaviours": [one.columns() for one in results.behaviours],
        "table2": [one.columns() for one in lines],
        "claims": claims_rows(audit),
    }
    for name, rows in tables.items():
        files.write_csv(folder / f"{name}.csv", rows, list(rows[0]))
    files.write_text(folder / "table2.md", table2_markdown(comparison, lines))
    files.write_text(folder / "claims.md", claims_markdown(audit, comparison.world))
    files.write_text(folder / REPORT, report(comparison, lines, audit))


def write_policies(
    settings: argparse.Namespace,
    folder: Path,
    study: Study[RunPoint],
    comparison: Comparison,
    tables: Mapping[tuple[int, int], np.ndarray],
    worker: WorkerProcess,
) -> list[Callable[[], None]]:
    """Write the final Q-tables of the examples, with what an ant that follows them does.

    Returns what waits for each animation that the worker draws.
    """
    from taichi_ants import files, save_policy
    from taichi_ants.analysis.behaviour import BEHAVIOURS
    from taichi_ants.analysis.paper.best_of import example_name, examples
    from taichi_ants.report.players import played

    animates = not (settings.no_figures or settings.quick)
    for place in (POLICIES, RENDERS) if animates else (POLICIES,):
        files.check_writable_folder(folder / place)
    drawn = []
    for row, run in examples(comparison):
        point, variant = study.points[row], comparison.rows[row].variant
        behaviour = comparison.behaviours[row, run]
        metadata = {
            "task": point.task.as_dict(),
            "config": point.training.as_dict(),
            "seed": study.seeds[run],
            "episodes": point.episodes,
            "max_steps": point.max_steps,
            "return_last50": comparison.measures["return_last50"][row, run],
            "behaviour": BEHAVIOURS[behaviour],
        }
        path = folder / POLICIES / f"{example_name(comparison, row, run)}.npz"
        save_policy(path, tables[row, run], metadata)
        if animates:
            title = f"{variant.label}, {point.task.delivery}"
            shown = folder / RENDERS / f"{path.stem}.gif"
            # The first of the lines beside the world says in words what the policy does.
            episode = played(point, tables[row, run], study.seeds[run])
            episode = replace(episode, name=metadata["behaviour"])
            drawn.append(worker.begin(render_policy, shown, episode, title))
    return drawn


def render_policy(path: Path, episode: Episode, title: str) -> None:
    """Show what a policy does."""
    from taichi_ants.rendering import PAUSE, frames, save_animation

    save_animation(path, frames(episode.snapshots(), SIZE, title=title), pause=PAUSE)


def compare(settings: argparse.Namespace) -> None:
    """Run the comparison, or show the finished one."""
    from taichi_ants.files.results import MANIFEST
    from taichi_ants.studies.result_folder import work_or_show
    from taichi_ants.studies.worker_process import WorkerProcess

    shows = not settings.no_figures
    # Who asks for one thread wants the other processors for something else.
    with WorkerProcess(shows and settings.threads != 1) as worker:
        if not (settings.out / MANIFEST).exists():
            worker.begin(import_module, "taichi_ants.report.players")  # this takes a while
        study = build_study(settings)
        work = partial(do_comparison, settings, study, worker)
        page = partial(make_page, settings, study)
        work_or_show(settings, study.settings(), work, page=page)


def comparison_of(
    settings: argparse.Namespace, study: Study[RunPoint], arrays: Mapping[str, np.ndarray]
) -> Comparison:
    """Return the comparison of arrays from `measured`, with its curves if they are among them."""
    from taichi_ants.analysis.paper.comparison import Comparison, Row
    from taichi_ants.analysis.paper.curves import CURVES
    from taichi_ants.analysis.paper.measures import MEASURES

    first = study.points[0]
    return Comparison(
        rows=tuple(Row.of(point.task, point.training) for point in study.points),
        seeds=study.seeds,
        measures={name: arrays[name] for name in MEASURES},
        behaviours=arrays["behaviours"],
        policy_returns=arrays["policy_returns"],
        episodes=first.episodes,
        rollouts=first.rollouts,
        max_steps=first.max_steps,
        curves={name: arrays[_CURVE + name] for name in CURVES if _CURVE + name in arrays},
        task=first.task,
        world=world_name(settings, study),
    )


def with_curves(
    study: Study[RunPoint], blocks: Path, comparison: Comparison
) -> tuple[Comparison, dict[tuple[int, int], np.ndarray]]:
    """Read curves and the examples' tables, by row and place of the seed, from finished blocks."""
    from taichi_ants.analysis.paper.best_of import examples
    from taichi_ants.analysis.paper.curves import curve_row, learning_curves

    shown, tables = examples(comparison), {}
    rows = [row for row, _ in shown] + [curve_row(comparison, *one) for one in comparison.learners]

    def outcomes() -> Iterator[tuple[int, Outcome]]:
        for row, outcome in study.read(blocks, rows):
            for run in (run for one, run in shown if one == row):
                tables[row, run] = outcome["q_values"][run].copy()
            yield row, outcome

    return replace(comparison, curves=learning_curves(comparison, outcomes())), tables


def rehearse(point: RunPoint, plugin: str | None, where: Mapping[str, Any], draws: bool) -> None:
    """Prepare a process for what it will show, and draw, while there is nothing to show yet."""
    import io

    import numpy as np

    from taichi_ants import runtime
    from taichi_ants.analysis import style
    from taichi_ants.engines.runs.traces import Made
    from taichi_ants.rendering import colony_snapshots, frames
    from taichi_ants.rendering.snapshots import colony_of_rollout
    from taichi_ants.task.constants import N_ACTIONS
    from taichi_ants.viewer import record_colony

    load_plugin(plugin)
    runtime.start(**where)
    nothing = np.zeros((point.task.n_states, N_ACTIONS), np.float32)
    colony = colony_of_rollout(Made(point.world, point.task, 0, 1, q_values=nothing))
    next(frames(colony_snapshots(colony), SIZE))
    record_colony(colony, 1)
    for kind in ("png", "svg") if draws else ():
        style.new_figure(1.0).savefig(io.BytesIO(), format=kind)


def draw_figures(comparison: Comparison, baselines: Sequence[Baseline], folder: Path) -> None:
    """Write the figures as files."""
    from taichi_ants.analysis import style
    from taichi_ants.analysis.paper.figures import draw_all

    style.save_all(draw_all(comparison, baselines), folder)


def do_comparison(
    settings: argparse.Namespace,
    study: Study[RunPoint],
    worker: WorkerProcess,
    blocks: Path,
    ready: Path,
) -> tuple[Results, Seen]:
    """Do what is not done yet, and write all results."""
    from taichi_ants import files
    from taichi_ants.analysis.bounds.baselines import bound_rows, policy_rows
    from taichi_ants.analysis.paper.report import Results
    from taichi_ants.engines.runs.training import evaluate
    from taichi_ants.files import archives

    where, first = {"threads": settings.threads, "arch": settings.arch}, study.points[0]
    world, task, steps, shows = first.world, first.task, first.max_steps, not settings.no_figures
    discounts = tuple(dict.fromkeys(settings.discounts))
    worker.begin(rehearse, first, settings.plugin, where, settings.quick)
    bounds = worker.begin(bound_rows, world, task, discounts, steps)
    arrays = measured(study, blocks, **where)
    comparison, tables = with_curves(study, blocks, comparison_of(settings, study, arrays))
    arrays |= {_CURVE + name: curve for name, curve in comparison.curves.items()}
    archives.write(ready / RUNS, arrays)
    follow = partial(evaluate, **where)
    baselines = bounds() + policy_rows(world, task, follow, study.seeds, ROLLOUTS, steps)
    animated = write_policies(settings, ready, study, comparison, tables, worker)
    # Beside this process there is time for the figures, unless there are animations.
    draw = worker.begin if settings.quick else partial
    drawn = [draw(draw_figures, comparison, baselines, ready / FIGURES)] if shows else []
    seen = see(settings, ready, study, comparison, baselines, worker.begin, draw)
    worker.finish()
    rows = [one._asdict() for one in baselines]
    files.write_csv(ready / BASELINES, rows, list(rows[0]))
    with progress_bar("statistics and pictures") as progress:
        results = Results.of(comparison, baselines)
        write_tables(ready, results)
        waits: list[Callable[[], Any]] = [*drawn, *animated]
        for number, wait in enumerate(waits, start=1):
            progress(number / (len(waits) + 1))
            wait()
        return results, seen()


def see(
    settings: argparse.Namespace,
    folder: Path,
    study: Study[RunPoint],
    comparison: Comparison,
    baselines: Sequence[Baseline],
    play: Begin = partial,
    draw: Begin = partial,
) -> Callable[[], Seen]:
    """Return what waits for the pictures of the page, of which there are none without figures.

    `play` and `draw` begin players and figures, as `WorkerProcess.begin`.
    """
    from taichi_ants.report.players import Seen, draw_all_for_page, what_is_seen

    if settings.no_figures:
        return Seen
    players = what_is_seen(folder / POLICIES, study, comparison, play)
    drawings = draw(draw_all_for_page, comparison, baselines)
    return lambda: Seen(drawings(), *players())


def make_page(
    settings: argparse.Namespace,
    study: Study[RunPoint],
    folder: Path,
    found: tuple[Results, Seen] | None,
    made: Mapping[str, Any],
) -> str:
    """Return the page of the results in a folder, which are read from there if not given."""
    from taichi_ants import files
    from taichi_ants.analysis.bounds.baselines import Baseline
    from taichi_ants.analysis.paper.report import Results
    from taichi_ants.files import archives
    from taichi_ants.files.results import MANIFEST
    from taichi_ants.report.comparison import comparison_page
    from taichi_ants.report.page import made_facts, setting_facts

    if found is None:
        told = comparison_of(settings, study, archives.read(folder / RUNS))
        rows = files.read_csv(folder / BASELINES)
        results = Results.of(told, [Baseline(**row) for row in rows])
        found = results, see(settings, folder, study, told, results.baselines)()
    return comparison_page(
        *found,
        facts={
            "World": world_name(settings, study),
            **setting_facts(study.settings()),
            **made_facts(made),
        },
        files=[path.name for path in folder.iterdir()] + [MANIFEST],
    )


def main(arguments: list[str] | None = None) -> None:
    """The command line."""
    again = "Stopped; finished runs are kept, and the same command goes on from there."
    run_command(lambda: compare(parse_arguments(arguments)), again)
