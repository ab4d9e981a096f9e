"""The work of the command `compare`: training, measures, tables, figures, and the page."""

from __future__ import annotations

import argparse
import contextlib
import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants import files, runtime, worlds
from taichi_ants.analysis import style
from taichi_ants.analysis.behaviour import BEHAVIOURS, classify
from taichi_ants.analysis.bounds import baselines as bounds
from taichi_ants.analysis.bounds.baselines import Baseline
from taichi_ants.analysis.paper.claims import claims_markdown, claims_rows
from taichi_ants.analysis.paper.comparison import PAPER_WORLD, Comparison, Row
from taichi_ants.analysis.paper.figures import CURVES, curve_row, curves_of, draw_all
from taichi_ants.analysis.paper.measures import MEASURES, measures_of_runs
from taichi_ants.analysis.paper.report import Results, report, table2_markdown
from taichi_ants.analysis.paper.table2 import example_name, examples
from taichi_ants.engines.runs.traces import MAX_ROLLOUT_STEPS, RolloutArguments, trace_policies
from taichi_ants.engines.runs.training import evaluate
from taichi_ants.files import archives
from taichi_ants.files.results import MANIFEST, REPORT
from taichi_ants.learners.policies import save_policy
from taichi_ants.rendering import PAUSE, Episode, colony_snapshots, frames, save_animation
from taichi_ants.rendering.snapshots import colony_of_rollout
from taichi_ants.report.comparison import (
    Seen,
    as_in_training,
    comparison_page,
    played,
    what_is_seen,
)
from taichi_ants.report.page import made_facts, setting_facts
from taichi_ants.studies.blocks import Blocks, Outcome
from taichi_ants.studies.command_line import given_settings, load_plugin, progress_bar
from taichi_ants.studies.executors import Work
from taichi_ants.studies.machines import chosen
from taichi_ants.studies.points import RunPoint
from taichi_ants.studies.runner import VALUE, Study
from taichi_ants.studies.worker_process import WorkerProcess
from taichi_ants.task.constants import N_ACTIONS
from taichi_ants.viewer import record_colony

SIZE = 720, 480  # of animations
RUNS, BASELINES = "runs.npz", "baselines.csv"
FIGURES, POLICIES, RENDERS = "figures", "policies", "renders"
_CURVE = "curve_"  # prefix of the names of learning curves in RUNS


def do_comparison(
    settings: argparse.Namespace,
    study: Study[RunPoint],
    worker: WorkerProcess,
    blocks: Path,
    ready: Path,
) -> tuple[Results, Seen] | None:
    """Do the blocks of a study that are missing in `blocks`, and write all results to `ready`.

    Returns:
        The results, and the figures and recordings of the page; None for a shard, which has no
        results.
    """
    where, first = {"threads": settings.threads, "arch": settings.arch}, study.points[0]
    world, task, steps = first.world, first.task, first.max_steps
    shows = not settings.no_figures
    worker.begin(warm_up, first, settings.plugin, where, settings.quick)
    discounts = tuple(dict.fromkeys(settings.discounts))
    exact = worker.begin(bounds.bound_rows, world, task, discounts, steps)
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
    begin = worker.begin if shows and not settings.quick else None
    waits = write_policies(ready, study, comparison, tables, begin)
    # With --quick, the worker process draws the figures; without, it draws animations.
    draw = worker.begin if settings.quick else partial
    if shows:
        waits.insert(0, draw(draw_figures, comparison, baselines, ready / FIGURES))
    shown = comparison, baselines, worker.begin, draw
    seen = what_is_seen(ready / POLICIES, study, *shown) if shows else Seen
    worker.finish()
    rows = [one._asdict() for one in baselines]
    files.write_csv(ready / BASELINES, rows, list(rows[0]))
    with progress_bar("statistics and pictures") as progress:
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
    load_plugin(plugin)
    runtime.start(**where)
    nothing = np.zeros((point.task.n_states, N_ACTIONS), np.float32)
    colony = colony_of_rollout(RolloutArguments(point.world, point.task, 0, 1, q_values=nothing))
    next(frames(colony_snapshots(colony), SIZE))
    record_colony(colony, 1)
    for kind in ("png", "svg") if draws else ():
        style.new_figure(1.0).savefig(io.BytesIO(), format=kind)


def measured(
    study: Study[RunPoint], folder: Path, where: Mapping[str, Any], **how: Any
) -> dict[str, np.ndarray]:
    """Return measures of the runs and behaviours of the final policies: arrays (points, seeds).

    `how` has further arguments of `Study.in_blocks`.
    """
    with progress_bar("training", how.get("executor")) as progress:
        # Compile all kernels first; this needs one thread, and the worker process uses another.
        for point in {point.training.learner: point for point in study.points}.values():
            short = replace(point, episodes=1, max_steps=1, rollouts=1)
            Work((short,), (0,), None, with_measures, where).do()
        return study.reduced(folder, with_measures, progress, **{**where, **how})


def with_measures(points: Sequence[RunPoint], seeds: Sequence[int], outcome: Outcome) -> Outcome:
    """Return an outcome with the measures of its runs, and with what their policies do."""
    followed = what_policies_do(points[0], seeds, outcome["q_values"])
    values = {**measures_of_runs(outcome), **followed}
    return {**outcome, **{f"{VALUE}{name}": array for name, array in values.items()}}


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


def comparison_of(
    settings: argparse.Namespace, study: Study[RunPoint], arrays: Mapping[str, np.ndarray]
) -> Comparison:
    """Return the comparison of arrays from `measured`, with learning curves if they have them."""
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


def world_name(settings: argparse.Namespace, study: Study[RunPoint]) -> str:
    """Return the world's name for readers: its registered name and seed, or its map file."""
    if study.points[0].world == worlds.paper():
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


def write_policies(
    folder: Path,
    study: Study[RunPoint],
    comparison: Comparison,
    tables: Mapping[tuple[int, int], np.ndarray],
    begin: Callable[..., Callable[[], Any]] | None,
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
    return comparison_page(
        *found,
        facts={"World": world_name(settings, study)}
        | setting_facts(study.settings())
        | made_facts(made),
        files=[path.name for path in folder.iterdir()] + [MANIFEST],
    )
