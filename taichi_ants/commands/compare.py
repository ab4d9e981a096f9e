"""The paper's comparison of Q-learning, SARSA and Dyna-Q, over many seeds, with honest statistics.

Trains every configuration with every seed, follows the final policies greedily, holds the outcome
against the paper and against exact bounds, and writes tables, figures and policies to a folder.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from taichi_ants.studies.command_line import (
    ListAction,
    Parser,
    default_folder,
    load_plugin,
    notice,
    number,
    process_beside,
    progress_bar,
    run_command,
    whole_number,
)

if TYPE_CHECKING:
    from taichi_ants.analysis.paper.comparison import Comparison
    from taichi_ants.learners.config import TrainingConfig
    from taichi_ants.studies.result_folder import ResultFolder
    from taichi_ants.studies.sweeps import Sweep, SweepResult

DELIVERIES = ("continuing", "absorbing")
ROLLOUTS = 50
QUICK_SEEDS = 10
MOST_SEEDS = 10_000
REPORT, EPISODES, BASELINES = "report.txt", "episodes.npz", "baselines.csv"
FIGURES, POLICIES, RENDERS = "figures", "policies", "renders"
RENDERED_STEPS = 80  # at most; a delivery takes 34, to and fro on the trail 38


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """The settings of the command line; the defaults are the paper's."""
    parser = Parser(__doc__.split("\n", 1)[0])
    add = parser.add_argument
    add(
        "--seeds", type=whole_number(1, MOST_SEEDS), default=100, metavar="N", help="how many seeds"
    )
    add("--seed", type=whole_number(), default=0, metavar="BASE", help="the first of them")
    add(
        "--episodes",
        type=whole_number(1),
        default=500,
        metavar="N",
        help="training episodes of a run",
    )
    add("--max-steps", type=whole_number(1), default=600, metavar="N", help="step limit")
    add("--delivery", choices=(*DELIVERIES, "both"), default="both", help="what delivery means")
    names = ("q_learning", "sarsa", "dyna_q")
    add("--learners", action=ListAction, default=names, metavar="NAME", help="one or more")
    lists = {
        "--learning-rates": (0.001, 0.01),
        "--discounts": (0.9, 0.99),
        "--epsilons": (0.3, 0.5),
        "--epsilon-decays": (0.99, 0.995),
    }
    for flag, values in lists.items():
        add(flag, action=ListAction, item=number, default=values, metavar="X", help="one or more")
    add(
        "--planning-steps",
        action=ListAction,
        item=whole_number(1),
        default=(3, 5),
        metavar="N",
        help="one or more, for learners that plan",
    )
    switch: dict[str, Any] = {"choices": ("on", "off"), "metavar": "on|off"}
    words = "evaporation of trails in training; off in the paper"
    add("--train-evaporation", default="off", help=words, **switch)
    words = "evaporation in the greedy evaluation; on in the paper"
    add("--greedy-evaporation", default="on", help=words, **switch)
    add("--world", default="paper", help="paper, open, or the path of a map file")
    add("--world-seed", type=whole_number(), default=0, metavar="N", help="seed of an open world")
    add("--plugin", metavar="FILE", help="a Python file that registers learners or worlds")
    add("--threads", type=whole_number(1, 1024), metavar="N", help="CPU threads (default: all)")
    add("--arch", choices=("cpu", "cuda"), default="cpu", help="where kernels run")
    out = (
        "for the results (default: results/compare, and behind it what differs from the defaults, "
        "as in results/compare-garden-quick)"
    )
    add("--out", type=Path, metavar="FOLDER", help=out)
    add("--quick", action="store_true", help=f"at most {QUICK_SEEDS} seeds")
    add("--force", action="store_true", help="replace what FOLDER holds")
    add("--no-figures", action="store_true", help="draw no figures")
    add("--no-render", action="store_true", help="show no episodes of the learned policies")
    settings, given = parser.parse_given(arguments)
    settings.given = given
    usual = {}
    if settings.quick:
        settings.seeds = min(settings.seeds, QUICK_SEEDS)
        usual = {"seeds": QUICK_SEEDS}
    if settings.out is None:
        settings.out = default_folder(parser, "compare", settings, **usual)
    return settings


def configurations(settings: argparse.Namespace) -> tuple[TrainingConfig, ...]:
    """The grid: learners and planning steps, times rates, discounts and exploration."""
    from taichi_ants import TrainingConfig, learners

    deliveries = DELIVERIES if settings.delivery == "both" else (settings.delivery,)
    variants = [
        (name, planning_steps)
        for name in settings.learners
        for planning_steps in (settings.planning_steps if learners.get(name).plans else (0,))
    ]
    grid = itertools.product(
        settings.learning_rates, settings.discounts, settings.epsilons, settings.epsilon_decays
    )
    return tuple(
        TrainingConfig(
            *(name, rate, discount, epsilon, decay),
            planning_steps=planning_steps,
            delivery=delivery,
        )
        for delivery, (name, planning_steps), (rate, discount, epsilon, decay) in itertools.product(
            deliveries, variants, tuple(grid)
        )
    )


def build_sweep(settings: argparse.Namespace) -> Sweep:
    """The work, checked as a whole before any of it is done."""
    from taichi_ants import AntsError, worlds
    from taichi_ants.analysis.paper.comparison import Row
    from taichi_ants.studies.sweeps import Sweep

    if settings.plugin:
        load_plugin(settings.plugin)
    _refuse_what_changes_nothing(settings)
    configs = configurations(settings)
    # The tables find configurations by six digits of their numbers.
    rows = [Row.of(config) for config in configs]
    if len({(row.delivery, row.variant, row.hyperparameters.key()) for row in rows}) < len(rows):
        raise AntsError("two values of a list agree in six digits; leave one of them out.")
    world = worlds.build(settings.world, settings.world_seed)
    if not world.reachable_foods().any():
        raise AntsError(
            f"no food of the world {settings.world!r} can be reached from the queen; "
            "open a way or choose another world."
        )
    seeds = tuple(range(settings.seed, settings.seed + settings.seeds))
    return Sweep(
        world,
        configs,
        seeds,
        settings.episodes,
        settings.max_steps,
        ROLLOUTS,
        settings.train_evaporation == "on",
        settings.greedy_evaporation == "on",
    )


def _refuse_what_changes_nothing(settings: argparse.Namespace) -> None:
    from taichi_ants import AntsError, learners, worlds

    if "world_seed" in settings.given:
        worlds.check_seed_counts(settings.world)
    plan = [name for name in settings.learners if learners.get(name).plans]
    if "planning_steps" in settings.given and not plan:
        raise AntsError(
            "--planning-steps is for learners that plan, and none of "
            f"{', '.join(settings.learners)} does; leave it out, or add dyna_q to --learners."
        )


def world_name(settings: argparse.Namespace) -> str:
    """The world for readers: a registered name with its seed, or the name of a map file."""
    from taichi_ants import worlds

    if settings.world in worlds.names():
        return f"{settings.world}, world seed {settings.world_seed}"
    return Path(settings.world).name


def to_comparison(
    sweep: Sweep, result: SweepResult, behaviours: Any, policy_returns: Any, world: str
) -> Comparison:
    """What the analysis reads; the world's name counts where it is not the paper's."""
    from taichi_ants import worlds
    from taichi_ants.analysis.paper.comparison import PAPER_WORLD, Comparison, Row

    return Comparison(
        rows=tuple(Row.of(config) for config in sweep.configs),
        seeds=sweep.seeds,
        returns=result.returns,
        steps=result.steps,
        deliveries=result.deliveries,
        greedy_returns=result.greedy_returns,
        greedy_steps=result.greedy_steps,
        greedy_deliveries=result.greedy_deliveries,
        max_steps=sweep.max_steps,
        behaviours=behaviours,
        policy_returns=policy_returns,
        train_evaporation=sweep.train_evaporation,
        greedy_evaporation=sweep.greedy_evaporation,
        world=PAPER_WORLD if sweep.world == worlds.paper() else world,
    )


def what_policies_do(sweep: Sweep, q_values: Any) -> tuple[Any, Any]:
    """What an ant does that follows each final policy, and what it earns; integer (C, S) both."""
    import numpy as np

    from taichi_ants.analysis.behaviour import classify
    from taichi_ants.engines.runs.traces import MAX_ROLLOUT_STEPS, trace_policies

    runs = q_values.shape[:2]
    tables = q_values.reshape(-1, *q_values.shape[2:])
    max_steps = min(sweep.max_steps, MAX_ROLLOUT_STEPS)
    pieces = [
        classify(trace, max_steps)
        for trace in trace_policies(
            sweep.world, tables, sweep.seeds * runs[0], max_steps, sweep.train_evaporation
        )
    ]
    behaviours, returns = zip(*pieces, strict=True)
    return np.concatenate(behaviours).reshape(runs), np.concatenate(returns).reshape(runs)


def write_tables(
    folder: Path, comparison: Comparison, baselines: list[dict[str, Any]], costs: list[dict]
) -> tuple[Any, ...]:
    """Write all tables and the report; what `report.print_report` needs to show it."""
    from taichi_ants import files
    from taichi_ants.analysis.paper import report, summary, table2
    from taichi_ants.analysis.paper.audit import assess, claims_markdown, claims_rows

    lines = summary.summarise(comparison)
    files.write_csv(folder / "summary.csv", lines, summary.SUMMARY_COLUMNS)
    lines = summary.summarise_behaviours(comparison)
    files.write_csv(folder / "behaviours.csv", lines, summary.BEHAVIOUR_COLUMNS)
    table = table2.table2(comparison)
    files.write_csv(folder / "table2.csv", table, list(table[0]))
    files.write_text(folder / "table2.md", table2.table2_markdown(table, comparison))
    findings = assess(comparison)
    rows = claims_rows(findings)
    files.write_csv(folder / "claims.csv", rows, list(rows[0]))
    files.write_text(folder / "claims.md", claims_markdown(findings, comparison.world))
    shown = (comparison, table, findings, baselines, costs)
    files.write_text(folder / REPORT, report.render(*shown))
    return shown


def write_episodes(folder: Path, comparison: Comparison) -> None:
    """Write what each episode and rollout gave, and what each policy does, as in summary.csv."""
    from taichi_ants import files

    names: tuple[str, ...] = ("returns", "steps", "deliveries", "greedy_returns", "greedy_steps")
    names += ("greedy_deliveries", "behaviours", "policy_returns")
    arrays = {name: getattr(comparison, name) for name in names}
    files.write_npz(
        folder / EPISODES, {name: files.smallest(array) for name, array in arrays.items()}
    )


def write_policies(folder: Path, sweep: Sweep, comparison: Comparison, tables: Any) -> None:
    """Write the final Q-tables of some runs, with what an ant that follows them does."""
    from dataclasses import asdict

    from taichi_ants import save_policy
    from taichi_ants.analysis.behaviour import BEHAVIOURS, NAMES
    from taichi_ants.analysis.paper.best_of import examples

    for row, run in examples(comparison):
        config, behaviour = sweep.configs[row], comparison.behaviours[row, run]
        depth = f"_p{config.planning_steps}" if config.planning_steps else ""
        name = f"{config.delivery}_{config.learner}{depth}_{NAMES[behaviour]}"
        metadata = {
            "config": asdict(config),
            "seed": sweep.seeds[run],
            "episodes": sweep.episodes,
            "max_steps": sweep.max_steps,
            "evaporation": sweep.train_evaporation,
            "return_last50": comparison.measure("return_last50")[row, run],
            "behaviour": BEHAVIOURS[behaviour],
        }
        save_policy(folder / f"{name}.npz", tables[row, run], metadata)


def compare(settings: argparse.Namespace) -> None:
    """Run the comparison, or show the finished one."""
    from taichi_ants.analysis.paper.report import print_report
    from taichi_ants.files import file_hash
    from taichi_ants.studies.provenance import provenance, sweep_settings
    from taichi_ants.studies.result_folder import ResultFolder

    sweep = build_sweep(settings)
    plugin = file_hash(settings.plugin) if settings.plugin else None
    facts = {**sweep_settings(sweep), "arch": settings.arch, "plugin": plugin}
    folder = ResultFolder(settings.out, facts)
    if folder.is_finished() and not settings.force:
        show_finished(settings, sweep, folder)
        return
    began = time.perf_counter()
    with folder.work(settings.force) as (blocks, ready):
        manifest, shown = do_comparison(settings, sweep, blocks, ready)
        manifest["seconds"]["total"] = time.perf_counter() - began
        folder.publish({**provenance(sys.argv), **manifest})
    print_report(*shown)
    print(f"\n{manifest['seconds']['total']:.1f} s; everything is in {settings.out}/")


def do_comparison(
    settings: argparse.Namespace, sweep: Sweep, blocks: Path, ready: Path
) -> tuple[dict[str, Any], tuple[Any, ...]]:
    """All the work; what the manifest says of it, and what the report shows."""
    from functools import partial

    from taichi_ants import files
    from taichi_ants.analysis.bounds.baselines import BASELINE_COLUMNS, baseline_rows
    from taichi_ants.engines.runs.training import evaluate
    from taichi_ants.studies.sweeps import run_sweep

    laps = {"start": time.perf_counter()}
    with progress_bar("training") as report_progress:
        result = run_sweep(sweep, blocks, settings.threads, settings.arch, report_progress, notice)
    laps["training and evaluation"] = time.perf_counter()
    behaviours = what_policies_do(sweep, result.q_values)
    comparison = to_comparison(sweep, result, *behaviours, world_name(settings))
    laps["behaviours"] = time.perf_counter()
    baselines = baseline_rows(
        sweep.world,
        partial(evaluate, threads=settings.threads, arch=settings.arch),
        sweep.seeds,
        ROLLOUTS,
        settings.discounts,
        sweep.max_steps,
        sweep.train_evaporation,
        sweep.greedy_evaporation,
    )
    laps["baselines"] = time.perf_counter()
    costs = [cost.as_row() for cost in result.costs]
    write_episodes(ready, comparison)
    files.write_csv(ready / BASELINES, baselines, BASELINE_COLUMNS)
    with ExitStack() as beside:  # figures take one core and need no more than these two files
        if not settings.no_figures:
            beside.enter_context(process_beside(draw_figures, sweep, ready, ready))
        shown = write_tables(ready, comparison, baselines, costs)
        policies = files.check_writable_folder(ready / POLICIES)
        write_policies(policies, sweep, comparison, result.q_values)
        laps["tables"] = time.perf_counter()
        if not settings.no_render:
            render_policies(sweep, policies, ready)
    laps["figures and renders"] = time.perf_counter()
    marks = list(laps.items())
    seconds = {name: end - marks[i][1] for i, (name, end) in enumerate(marks[1:])}
    return {"cost_per_step": costs, "seconds": seconds}, shown


def draw_figures(sweep: Sweep, results: Path, folder: Path) -> None:
    """Draw the figures of the comparison in one folder into the folder `figures` of another."""
    from taichi_ants.analysis.paper.figures import save_all

    save_all(*read_back(results, sweep), folder / FIGURES)


def render_policies(sweep: Sweep, policies: Path, folder: Path) -> None:
    """Show what each policy that was written does, in the folder `renders`.

    Each picture is the beginning of the episode that told the behaviour: with evaporation as in
    training, not as in the greedy evaluation. The title names learner and delivery, the first of
    the head-up lines what the ant does.
    """
    from dataclasses import replace

    from taichi_ants import files, load_policy
    from taichi_ants.analysis.paper.comparison import Variant
    from taichi_ants.rendering import Episode, episode_frames, save_animation
    from taichi_ants.rendering.episodes import DEFAULT_FPS, with_pause

    place = files.check_writable_folder(folder / RENDERS)
    with progress_bar("rendering") as report_progress:
        paths = sorted(policies.glob("*.npz"))
        for done, path in enumerate(paths):
            q_values, metadata = load_policy(path)
            config = metadata["config"]
            learner = Variant(config["learner"], config["planning_steps"]).label
            episode = Episode.play(
                sweep.world,
                q_values,
                seed=metadata["seed"],
                max_steps=min(sweep.max_steps, RENDERED_STEPS),
                evaporation=sweep.train_evaporation,
            )
            whole = episode.delivered or len(episode.trace) == sweep.max_steps
            episode = replace(episode, name=metadata["behaviour"], whole=whole)
            title = f"{learner}, {config['delivery']}"
            frames = with_pause(
                episode_frames(episode, (720, 480), title=title), len(episode), DEFAULT_FPS
            )
            save_animation(place / f"{path.stem}.gif", frames, DEFAULT_FPS)
            report_progress((done + 1) / len(paths))


def show_finished(settings: argparse.Namespace, sweep: Sweep, folder: ResultFolder) -> None:
    """Print the summary of a finished comparison; add figures and episodes that were left out."""
    from taichi_ants import files

    folder.check_whole(apart_from=(FIGURES, RENDERS))
    if sys.stdout is not None and sys.stdout.isatty():  # as wide as it is now
        show_report(settings, sweep)
    else:
        print(files.read_text(settings.out / REPORT))
    if not settings.no_render and folder.lacks(RENDERS):
        with folder.addition() as place:
            render_policies(sweep, settings.out / POLICIES, place)
    if not settings.no_figures and folder.lacks(FIGURES):
        with folder.addition() as place:
            draw_figures(sweep, settings.out, place)
    print(f"{settings.out}/ holds this comparison already; --force runs it again.")


def show_report(settings: argparse.Namespace, sweep: Sweep) -> None:
    """Print the report of a finished comparison for the terminal that there is now."""
    import json
    from dataclasses import replace

    from taichi_ants import files
    from taichi_ants.analysis.paper import report, table2
    from taichi_ants.analysis.paper.audit import assess
    from taichi_ants.studies.result_folder import MANIFEST

    comparison, baselines = read_back(settings.out, sweep)
    if not comparison.in_paper_world:
        comparison = replace(comparison, world=world_name(settings))
    costs = json.loads(files.read_text(settings.out / MANIFEST))["cost_per_step"]
    lines, findings = table2.table2(comparison), assess(comparison)
    report.print_report(comparison, lines, findings, baselines, costs)


def read_back(folder: Path, sweep: Sweep) -> tuple[Comparison, list[dict[str, Any]]]:
    """The comparison and the baselines that a folder holds."""
    from taichi_ants import AntsError, files
    from taichi_ants.analysis.bounds.baselines import BASELINE_COLUMNS
    from taichi_ants.studies.sweeps import SweepResult

    try:
        arrays = files.read_npz(folder / EPISODES)
        arrays = {name: array.astype(int) for name, array in arrays.items()}
        done = arrays.pop("behaviours"), arrays.pop("policy_returns")
        result = SweepResult(**arrays, q_values=None, costs=())
        comparison = to_comparison(sweep, result, *done, "another")
        with open(folder / BASELINES, newline="", encoding="utf-8") as file:
            lines = csv.DictReader(file)
            baselines = [read_baseline(line) for line in lines]
        if lines.fieldnames != list(BASELINE_COLUMNS):
            raise ValueError("other columns")
    except (AntsError, OSError, TypeError, ValueError, KeyError) as error:
        raise AntsError(f"the results in {str(folder)!r} are damaged; give --force.") from error
    return comparison, baselines


def read_baseline(row: dict[str, str]) -> dict[str, Any]:
    """A row of baselines.csv, with numbers and None for empty fields."""
    words = ("baseline", "setting", "note")
    return {
        name: text if name in words else float(text) if text else None for name, text in row.items()
    }


def main(arguments: list[str] | None = None) -> None:
    """The command line."""
    again = "Stopped; finished runs are kept, and the same command goes on from there."
    run_command(lambda: compare(parse_arguments(arguments)), again)
