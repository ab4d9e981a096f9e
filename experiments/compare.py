"""Repeat the paper's comparison of Q-learning, SARSA and Dyna-Q with many seeds.

The script trains ants with each learner and combination of hyperparameters (or others), compares
the results with the paper and with exact bounds, and writes tables, figures and policies to a
folder. See docs/paper.md.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read by NumPy; the training uses all cores

from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    import contextlib
    import io
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from dataclasses import fields, replace
    from functools import partial
    from itertools import product
    from pathlib import Path
    from typing import Any

    import numpy as np
    from paper.claims import claims_markdown, claims_rows
    from paper.comparison import PAPER_WORLD, Comparison, Row
    from paper.figures import CURVES, curve_row, curves_of, draw_all
    from paper.page import Seen, as_in_training, comparison_page, played, what_is_seen
    from paper.report import Results, report, table2_markdown
    from paper.table2 import example_name, examples

    from taichi_ants import AntsError, Task, TrainingConfig, World, files, learners, runtime, worlds
    from taichi_ants.analysis import style
    from taichi_ants.analysis.behaviour import BEHAVIOURS, classify
    from taichi_ants.analysis.bounds import baselines as bounds
    from taichi_ants.analysis.bounds.baselines import Baseline
    from taichi_ants.engines.runs.traces import MAX_ROLLOUT_STEPS, RolloutArguments, trace_policies
    from taichi_ants.engines.runs.training import evaluate
    from taichi_ants.files import archives
    from taichi_ants.files.inputs import recorded
    from taichi_ants.files.results import MANIFEST, REPORT
    from taichi_ants.learners.policies import save_policy
    from taichi_ants.measures.finished import LONE, Run, values_of
    from taichi_ants.rendering import PAUSE, Episode, colony_snapshots, frames, save_animation
    from taichi_ants.rendering.snapshots import colony_of_rollout
    from taichi_ants.report.page import made_facts, setting_facts
    from taichi_ants.settings import all_of
    from taichi_ants.studies import command_line
    from taichi_ants.studies.blocks import Blocks, Outcome
    from taichi_ants.studies.command_line import given_settings, whole_number
    from taichi_ants.studies.executors import LocalWorkers, Work
    from taichi_ants.studies.machines import chosen
    from taichi_ants.studies.points import RunPoint
    from taichi_ants.studies.result_folder import work_or_show
    from taichi_ants.studies.runner import VALUE, Study
    from taichi_ants.task.constants import N_ACTIONS
    from taichi_ants.viewer import record_colony

DELIVERIES = ("truncates", "terminates")
ROLLOUTS = 50
QUICK_SEEDS, MOST_SEEDS = 10, 10_000
SIZE = 720, 480  # of animations
RUNS, BASELINES = "runs.npz", "baselines.csv"
FIGURES, POLICIES, RENDERS = "figures", "policies", "renders"
# Bounds and behaviours assume the defaults of these settings.
_FIXED = [one.path for one in all_of(Task) if "evaporation_in" not in one.path]
_DEPTH = "planning_steps"  # the one hyperparameter that the paper varies
_CURVE = "curve_"  # prefix of the names of learning curves in RUNS

# (call, *arguments) -> a function that waits for the result
Begin = Callable[..., Callable[[], Any]]


# Options. The defaults are the paper's.


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = command_line.Parser(__doc__)
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
    add("--world", default="paper", metavar="WORLD", help=command_line.WORLDS)
    command_line.add_common(parser)
    command_line.add_machines(parser)
    quick = (
        f"use at most {QUICK_SEEDS} seeds and draw no animations: a first look at the results, "
        "whose intervals are wide"
    )
    add("--quick", action="store_true", help=quick)
    command_line.add_results(parser, "compare")
    parser.open_settings, parser.own_settings = ("world", "training"), _FIXED
    command_line.add_settings(parser, Task())
    settings = parser.parse_args(arguments)
    settings.command = "compare"
    if settings.quick:
        settings.seeds = min(settings.seeds, QUICK_SEEDS)
    return command_line.with_folder(settings, "compare")


# Points: tasks and learners with all combinations of hyperparameters.


def variants(settings: argparse.Namespace) -> list[tuple[str, dict[str, Any]]]:
    """Return pairs of a learner and its hyperparameters, one for each number of planning steps."""
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
    """Return the points of the grid, each once."""
    deliveries = DELIVERIES if settings.delivery == "both" else (settings.delivery,)
    given = given_settings(settings).get("task", {})
    tasks = [Task().replace(delivery=delivery, **given) for delivery in deliveries]
    numbers = product(
        settings.learning_rates, settings.discounts, settings.epsilons, settings.epsilon_decays
    )
    lengths = settings.episodes, settings.max_steps, ROLLOUTS
    every = (
        RunPoint(world, task, TrainingConfig(name, *four, **more), *lengths)
        for task, (name, more), four in product(tasks, variants(settings), tuple(numbers))
    )
    return tuple(dict.fromkeys(every))


def build_study(settings: argparse.Namespace) -> Study[RunPoint]:
    """Return the study, after checking all settings."""
    command_line.load_plugin(settings.plugin)
    world = command_line.given_world(settings)
    grid = points(settings, world)
    if not world.reachable_foods().any():
        raise AntsError(
            f"ants cannot reach any food of the world {settings.world!r} from the queen; open a "
            "way or choose another world."
        )
    return Study(grid, tuple(range(settings.seed, settings.seed + settings.seeds)))


# Training and measures.


def measured(
    study: Study[RunPoint], folder: Path, where: Mapping[str, Any], **how: Any
) -> dict[str, np.ndarray]:
    """Return measures of the runs and behaviours of the final policies: arrays (points, seeds).

    `how` has further arguments of `Study.in_blocks`.
    """
    with command_line.progress_bar("training", how.get("executor")) as progress:
        # Compile all kernels first; this needs one thread, and the worker process uses another.
        for point in {point.training.learner: point for point in study.points}.values():
            short = replace(point, episodes=1, max_steps=1, rollouts=1)
            Work((short,), (0,), None, with_measures, where).do()
        return study.reduced(folder, with_measures, progress, **{**where, **how})


def with_measures(points: Sequence[RunPoint], seeds: Sequence[int], outcome: Outcome) -> Outcome:
    """Return an outcome with the measures of its runs, and with what their policies do."""
    followed = what_policies_do(points[0], seeds, outcome["q_values"])
    values = {**values_of(Run.of_lone_ant(outcome)), **followed}
    return {**outcome, **{f"{VALUE}{name}": array for name, array in values.items()}}


def what_policies_do(point: RunPoint, seeds: Sequence[int], q_values: np.ndarray) -> Outcome:
    """Return behaviours and returns of ants that follow final policies, integer (C, S) each.

    `q_values` (C, S, n_states, 5) are those of C points that differ from `point` only in training.
    """
    tables = q_values.reshape(-1, *q_values.shape[2:])
    max_steps = min(point.max_steps, MAX_ROLLOUT_STEPS)
    task, several = as_in_training(point.task), [*seeds] * len(q_values)
    traces = trace_policies(point.world, tables, several, max_steps, task)
    behaviours, returns = zip(*(classify(trace, max_steps) for trace in traces), strict=True)
    arrays = {"behaviours": behaviours, "policy_returns": returns}
    return {n: np.concatenate(parts).reshape(q_values.shape[:2]) for n, parts in arrays.items()}


def take_results(folder: Path, runs: Mapping[str, Any], blocks: Blocks) -> None:
    """Add finished results, whose `Study.runs` were `runs`, to the blocks."""
    arrays = archives.read(folder / RUNS)
    for row, place in enumerate(runs["rows"]):
        values = {
            f"{VALUE}{name}": array[None, row]
            for name, array in arrays.items()
            if not name.startswith(_CURVE)
        }
        seeds = runs["seeds"][runs["seeds_of"][place]]
        blocks.add([runs["points"][place]], seeds, values)


def comparison_of(
    settings: argparse.Namespace, study: Study[RunPoint], arrays: Mapping[str, np.ndarray]
) -> Comparison:
    """Return the comparison of arrays from `measured`, with learning curves if they have them."""
    first = study.points[0]
    return Comparison(
        rows=tuple(Row.of(point.task, point.training) for point in study.points),
        seeds=study.seeds,
        measures={name: arrays[name] for name in LONE},
        behaviours=arrays["behaviours"],
        policy_returns=arrays["policy_returns"],
        episodes=first.episodes,
        rollouts=first.rollouts,
        max_steps=first.max_steps,
        curves={name: arrays[_CURVE + name] for name in CURVES if _CURVE + name in arrays},
        task=first.task,
        world=world_name(settings, first.world),
    )


def world_name(settings: argparse.Namespace, world: World) -> str:
    """Return the world's name for readers: its registered name and seed, or its map file."""
    if world == worlds.paper():
        return PAPER_WORLD
    if settings.world in worlds.names():
        of_world = {"seed": 0, **given_settings(settings).get("world", {})}
        return ", ".join([settings.world, *(f"world {n} {value}" for n, value in of_world.items())])
    return Path(settings.world).name


def with_curves(
    study: Study[RunPoint], blocks: Path, comparison: Comparison, **how: Any
) -> tuple[Comparison, dict[tuple[int, int], np.ndarray]]:
    """Read learning curves and the examples' tables of action values from finished blocks.

    Results that were taken over have only measures, so these runs are done again; `how` has the
    arguments of `Study.in_blocks`.

    Returns:
        The comparison with curves, and the tables by indices of row and seed.
    """
    shown, tables = examples(comparison), {}
    rows = [row for row, _ in shown] + [curve_row(comparison, *one) for one in comparison.learners]
    runs = np.isin(np.arange(len(study.in_order)), rows)[:, None] & study.share(1, 1)
    study.complete(blocks, runs, "q_values", reduce=with_measures, **how)

    def outcomes() -> Iterator[tuple[int, Outcome]]:
        for row, outcome in study.read(blocks, rows, "q_values"):
            for run in (run for one, run in shown if one == row):
                tables[row, run] = outcome["q_values"][run].copy()
            yield row, outcome

    return replace(comparison, curves=curves_of(comparison, outcomes())), tables


# Results: tables, policies, figures, animations, and the page.


def do_comparison(
    settings: argparse.Namespace, study: Study[RunPoint], begin: Begin, blocks: Path, ready: Path
) -> tuple[Results, Seen] | None:
    """Do the blocks of a study that are missing in `blocks`, and write all results to `ready`.

    `begin` starts calls, in a worker process if there is one.

    Returns:
        The results, and the figures and recordings of the page; None for a shard, which has no
        results.
    """
    where, first = {"threads": settings.threads, "arch": settings.arch}, study.points[0]
    world, task, steps = first.world, first.task, first.max_steps
    begin(warm_up, first, settings.plugin, where, settings.quick)
    discounts = tuple(dict.fromkeys(settings.discounts))
    exact = begin(bounds.bound_rows, world, task, discounts, steps)
    with chosen(settings) as how:
        arrays = measured(study, blocks, where, **how)
        if settings.shard:
            return None
        comparison = comparison_of(settings, study, arrays)
        comparison, tables = with_curves(study, blocks, comparison, **how)
    arrays |= {_CURVE + name: curve for name, curve in comparison.curves.items()}
    archives.write(ready / RUNS, arrays)
    follow = partial(evaluate, **where)
    simple = bounds.policy_rows(world, task, follow, study.seeds, first.rollouts, steps)
    baselines = exact() + simple
    shows = not settings.no_figures
    renders = shows and not settings.quick
    waits = write_policies(ready, study, comparison, tables, begin if renders else None)
    seen: Callable[[], Seen] = Seen
    if shows:  # the worker process draws either animations or, with --quick, the figures
        draw = begin if settings.quick else partial
        waits.insert(0, draw(draw_figures, comparison, baselines, ready / FIGURES))
        seen = what_is_seen(ready / POLICIES, study, comparison, baselines, begin, draw)
    rows = [one._asdict() for one in baselines]
    files.write_csv(ready / BASELINES, rows, list(rows[0]))
    with command_line.progress_bar("statistics and pictures") as progress:
        results = Results.of(comparison, baselines)
        write_tables(ready, results)
        with style.all_or_none(ready / FIGURES, ready / RENDERS):
            for number, wait in enumerate(waits, start=1):
                progress(number / (len(waits) + 1))
                try:
                    wait()
                except Exception:
                    for other in waits[number:]:  # the worker process still writes them
                        with contextlib.suppress(Exception):
                            other()
                    raise
            return results, seen()
    return results, Seen()


def warm_up(point: RunPoint, plugin: str | None, where: Mapping[str, Any], draws: bool) -> None:
    """Compile and import all that a worker process needs to record and draw, in advance."""
    command_line.load_plugin(plugin)
    runtime.start(**where)
    nothing = np.zeros((point.task.n_states, N_ACTIONS), np.float32)
    colony = colony_of_rollout(RolloutArguments(point.world, point.task, 0, 1, q_values=nothing))
    next(frames(colony_snapshots(colony), SIZE))
    record_colony(colony, 1)
    for kind in ("png", "svg") if draws else ():
        style.new_figure(1.0).savefig(io.BytesIO(), format=kind)


def write_policies(
    folder: Path,
    study: Study[RunPoint],
    comparison: Comparison,
    tables: Mapping[tuple[int, int], np.ndarray],
    begin: Begin | None,
) -> list[Callable[[], Any]]:
    """Write the policies of the examples, and with `begin` their animations.

    Returns:
        A function for each animation that waits for it.
    """
    for place in (POLICIES, RENDERS) if begin else (POLICIES,):
        files.check_writable_folder(folder / place)
    drawn = []
    for row, run in examples(comparison):
        point, seed, q_values = study.points[row], study.seeds[run], tables[row, run]
        behaviour = BEHAVIOURS[comparison.behaviours[row, run]]
        metadata = {
            "task": point.task.as_dict(),
            "config": point.training.as_dict(),
            "seed": seed,
            "episodes": point.episodes,
            "max_steps": point.max_steps,
            "return_last50": comparison.measures["return_last50"][row, run],
            "behaviour": behaviour,
        }
        name = example_name(comparison, row, run)
        save_policy(folder / POLICIES / f"{name}.npz", q_values, metadata)
        if begin:
            title = f"{comparison.rows[row].variant.label}, {point.task.delivery}"
            # The animation shows the name of the episode next to the world.
            episode = replace(played(point, q_values, seed), name=behaviour)
            drawn.append(begin(render_policy, folder / RENDERS / f"{name}.gif", episode, title))
    return drawn


def render_policy(path: Path, episode: Episode, title: str) -> None:
    """Write an animation of an episode."""
    save_animation(path, frames(episode.snapshots(), SIZE, title=title), pause=PAUSE)


def draw_figures(comparison: Comparison, baselines: Sequence[Baseline], folder: Path) -> None:
    """Write all figures as files."""
    style.save_all(draw_all(comparison, baselines), folder)


def write_tables(folder: Path, results: Results) -> None:
    """Write all tables and the report."""
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


def make_page(
    settings: argparse.Namespace,
    study: Study[RunPoint],
    folder: Path,
    found: tuple[Results, Seen] | None,
    made: Mapping[str, Any],
) -> str:
    """Return the page of the results in a folder, which are read from it if `found` is None."""
    if found is None:
        comparison = comparison_of(settings, study, archives.read(folder / RUNS))
        baselines = [Baseline(**row) for row in files.read_csv(folder / BASELINES)]
        draws = not settings.no_figures
        seen = what_is_seen(folder / POLICIES, study, comparison, baselines) if draws else Seen
        found = Results.of(comparison, baselines), seen()
    facts = {"World": found[0].comparison.world, **setting_facts(study.settings())}
    links = [path.name for path in folder.iterdir()] + [MANIFEST]
    return comparison_page(*found, facts=facts | made_facts(made), files=links)


def compare(settings: argparse.Namespace) -> None:
    """Run the comparison, or show its results if it is finished."""
    with recorded() as inputs:
        study = build_study(settings)
    # A second process draws, because threads of one process would take turns.
    second = not settings.no_figures and settings.threads != 1 and runtime.available_threads() > 1
    with LocalWorkers(1) if second else contextlib.nullcontext() as beside:

        def begin(call: Callable[..., Any], *given: Any, **named: Any) -> Callable[[], Any]:
            here = partial(call, *given, **named)
            return beside.submit(here).result if beside else here

        def work(*folders: Path) -> Any:
            return do_comparison(settings, study, begin, *folders)

        page = partial(make_page, settings, study)
        how: dict[str, Any] = {"page": page, "study": study, "take": take_results}
        work_or_show(settings, study.settings(), work, **how, inputs=inputs)


def main(arguments: list[str] | None = None) -> None:
    """Run the script."""
    again = "Stopped; finished runs are saved. Run the same command again to resume."
    command_line.run_command(lambda: compare(parse_arguments(arguments)), again)


if __name__ == "__main__":
    from compare import main  # so that worker processes find its functions by their module

    main()
