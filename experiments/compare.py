"""Repeat the paper's comparison of Q-learning, SARSA and Dyna-Q with many seeds.

The script trains ants with each learner and combination of hyperparameters (or others), compares
the results with the paper and with exact bounds, and writes tables, figures and policies to a
folder. See docs/results/paper.md.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read by NumPy; the training uses all cores

from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    import gc

    gc.set_threshold(1_000_000)  # with Python's default, collections take a tenth of the time
    from collections.abc import Mapping, Sequence
    from dataclasses import dataclass, fields, replace
    from functools import partial
    from itertools import product
    from pathlib import Path
    from typing import Any

    import numpy as np
    import published
    from paper import baselines as bounds
    from paper import figures, page, process
    from paper.claims import ON_PAGE, assess, claims_rows, headlines, verdict_table
    from paper.comparison import PAPER_WORLD, Comparison, Row
    from paper.page import Example, Seen
    from paper.report import behaviour_table, figure_tables, report
    from paper.table2 import example_name, examples, summarise, summarise_behaviours, table2

    from taichi_ants import AntsError, Task, TrainingConfig, files, learners, train, worlds
    from taichi_ants.analysis.behaviour import BEHAVIOURS, classify
    from taichi_ants.engines.runs.engine import MAX_ROLLOUT_STEPS, Runs
    from taichi_ants.engines.runs.training import evaluate, followed
    from taichi_ants.files import archives
    from taichi_ants.learners.policies import save_policy
    from taichi_ants.measures.finished import LONE, Run, values_of
    from taichi_ants.report.page import made_facts, setting_facts
    from taichi_ants.settings import all_of, nested
    from taichi_ants.studies import command_line
    from taichi_ants.studies.command import planned, run_study
    from taichi_ants.studies.command_line import whole_number
    from taichi_ants.studies.folder import MANIFEST, PAGE, REPORT, Results
    from taichi_ants.studies.points import RunPoint, settings_of
    from taichi_ants.studies.study import Study

VERSION = 1  # of the arrays that are kept of each run
DELIVERIES = ("truncates", "terminates")
ROLLOUTS = 50
QUICK_SEEDS, MOST_SEEDS = 10, 10_000
# Bounds and behaviours assume the defaults of these settings.
_FIXED = [one.path for one in all_of(Task) if "evaporation_in" not in one.path]
_DEPTH = "planning_steps"  # the one hyperparameter that the paper varies


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
    quick = (
        f"use at most {QUICK_SEEDS} seeds: a first look at the results, whose intervals are wide"
    )
    command_line.add_study(parser, "compare", quick)
    parser.open_settings, parser.own_settings = ("world", "training"), _FIXED
    command_line.add_settings(parser, Task())
    settings = parser.parse_args(arguments)
    if settings.quick:
        settings.seeds = min(settings.seeds, QUICK_SEEDS)
    return command_line.with_folder(settings, "compare")


# Points: tasks and learners with all combinations of hyperparameters.


@dataclass(frozen=True)
class Plan:
    """The study of a comparison: the points of the grid."""

    study: Study
    world_name: str  # for readers
    exact: process.Begun  # waits for the exact bounds


def plan(options: Mapping[str, Any]) -> Plan:
    """Return the study, after checking all options."""
    given = nested({path: value for path, value in options.items() if "." in path})
    of_world = given.get("world", {})
    if "seed" in of_world:
        worlds.registry.check_seed_counts(options["world"])
    world = worlds.build(options["world"], **of_world)
    deliveries = DELIVERIES if options["delivery"] == "both" else (options["delivery"],)
    tasks = [Task().replace(delivery=delivery, **given.get("task", {})) for delivery in deliveries]
    names = "learning_rates", "discounts", "epsilons", "epsilon_decays"
    numbers = tuple(product(*(options[name] for name in names)))
    lengths = options["episodes"], options["max_steps"], ROLLOUTS
    kinds = variants(options["learners"], options["planning_steps"], given.get("training", {}))
    points = [
        RunPoint(world, task, TrainingConfig(learner, *four, **own), *lengths)
        for task, (learner, own), four in product(tasks, kinds, numbers)
    ]
    if not world.reachable_foods().any():
        raise AntsError(
            f"ants cannot reach any food of the world {options['world']!r} from the queen; open a "
            "way or choose another world."
        )
    name = Path(options["world"]).name
    if world == worlds.paper():
        name = PAPER_WORLD
    elif options["world"] in worlds.names():
        settings = {"seed": 0, **of_world}
        name = ", ".join([name, *(f"world {one} {value}" for one, value in settings.items())])
    seeds = tuple(range(options["seed"], options["seed"] + options["seeds"]))
    arrays = *LONE, "behaviours", "policy_returns", *map(figures.sums, figures.CURVES)
    study = Study(tuple(points), seeds, arrays, measured)
    discounts = tuple(dict.fromkeys(options["discounts"]))
    exact = process.begin(bounds.bound_rows, world, points[0].task, discounts, points[0].max_steps)
    process.begin(page.get_ready, world, points[0].task)
    return Plan(study, name, exact)


def variants(
    names: Sequence[str], depths: Sequence[int], given: Mapping[str, Any]
) -> list[tuple[str, dict[str, Any]]]:
    """Return pairs of a learner and its hyperparameters, one for each number of planning steps."""
    if _DEPTH in given:
        raise AntsError(f"training.{_DEPTH} has its own option; use --planning-steps instead.")
    kinds = {name: fields(learners.get(name).hyperparameters) for name in names}
    own = {name: [field.name for field in kind] for name, kind in kinds.items()}
    for one in given:
        if not any(one in several for several in own.values()):
            raise AntsError(f"`training.{one}` is not a hyperparameter of {', '.join(own)}.")
    return [
        (name, {one: value for one, value in {**given, _DEPTH: n}.items() if one in several})
        for name, several in own.items()
        for n in (depths if _DEPTH in several else [0])
    ]


# Training and measures: what is kept of each run.


def measured(
    points: Sequence[RunPoint], seeds: Sequence[int], outcome: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """Return measures of runs, what their policies do, and sums for learning curves.

    Arrays are (points, seeds) and, for curves, (points, seeds, spans); the points differ only in
    training.
    """
    edges = figures.spans(points[0].episodes)[:-1]
    curves = {
        figures.sums(name): files.small(
            np.add.reduceat(outcome[name], edges, axis=2, dtype=np.int64)
        )
        for name in figures.CURVES
    }
    return {
        **values_of(Run.of_lone_ant(outcome)),
        **what_policies_do(points[0], seeds, outcome["q_values"]),
        **curves,
    }


def what_policies_do(
    point: RunPoint, seeds: Sequence[int], q_values: np.ndarray
) -> dict[str, np.ndarray]:
    """Return behaviours and returns of ants that follow final policies, integer (C, S) each.

    `q_values` (C, S, n_states, 5) are those of C points that differ from `point` only in training.
    """
    tables = q_values.reshape(-1, *q_values.shape[2:])
    max_steps = min(point.max_steps, MAX_ROLLOUT_STEPS)
    task, several = page.as_in_training(point.task), [*seeds] * len(q_values)
    runs = Runs.following(point.world, task, max_steps, tables, several, [0], epsilon=0.0)
    found = [classify(trace, max_steps) for trace in followed(runs)]
    behaviours, returns = zip(*found, strict=True)
    arrays = {"behaviours": behaviours, "policy_returns": returns}
    return {n: np.concatenate(parts).reshape(q_values.shape[:2]) for n, parts in arrays.items()}


# Results: table 2, claims, figures, policies, and the page.


def tables(plan: Plan, results: Results) -> str:
    """Return the report, after writing all results; while runs are missing, of whole rows."""
    folder, arch = results.folder, results.arch
    rows = np.flatnonzero(results.present.all(axis=1)).tolist()
    if not rows:
        raise AntsError("no configuration has all of its runs yet; wait for the first ones.")
    study = replace(results.study, points=tuple(results.study.points[row] for row in rows))
    first: Any = study.points[0]
    arrays = results.read(study.keys, arrays=study.arrays)
    comparison = Comparison(
        rows=tuple(Row.of(point.task, point.training) for point in study.points),
        seeds=study.seeds,
        measures={name: arrays[name] for name in LONE},
        behaviours=arrays["behaviours"],
        policy_returns=arrays["policy_returns"],
        episodes=first.episodes,
        rollouts=first.rollouts,
        max_steps=first.max_steps,
        task=first.task,
        world=plan.world_name,
    )
    comparison = replace(comparison, curves=figures.curves_of(comparison, arrays))
    follow, runs = partial(evaluate, arch=arch), (study.seeds, first.rollouts, first.max_steps)
    baselines = plan.exact() + bounds.policy_rows(first.world, first.task, follow, *runs)
    drawn = process.begin(figures.save_all, comparison, baselines, folder / "figures")
    chosen = [trained(study, row, run, arch) for row, run in examples(comparison)]
    seen = page.begin(comparison, chosen, drawn) if results.figures else Seen

    summaries = summarise(comparison)
    lines, audit = table2(comparison, summaries), assess(comparison)
    for name, table in {
        "summary": [summary.columns() for summary in summaries],
        "behaviours": summarise_behaviours(comparison),
        "table2": [line.columns() for line in lines],
        "claims": claims_rows(audit),
        "baselines": [baseline._asdict() for baseline in baselines],
    }.items():
        files.write_csv(folder / f"{name}.csv", table, list(table[0]))
    of_runs = {name: arrays[name] for name in (*LONE, "behaviours", "policy_returns")}
    curves = {f"curve_{name}": curve for name, curve in comparison.curves.items()}
    archives.write(folder / "runs.npz", {**of_runs, **curves})
    save_policies(folder / "policies", comparison, chosen)
    facts = {"World": comparison.world, **setting_facts(settings_of(study.points, study.seeds))}
    facts |= made_facts(results.made)
    titles, told = ("return", "steps", "late_steps"), report(comparison, lines, audit)
    to_publish: dict[str, Any] = {
        **dict(zip(titles, figure_tables(lines, comparison), strict=False)),
        "policies": behaviour_table(lines, summarise_behaviours(comparison)),
        "claims": headlines(audit, ON_PAGE),
        "verdicts": verdict_table(audit),
    }
    shown = seen()  # after all else, as the second process has most to do
    links = [path.name for path in folder.iterdir()] + [MANIFEST, REPORT]
    for name, one in to_publish.items():
        published.write(folder / "tables" / f"paper_{name}.json", [one])
    html = page.comparison_page(comparison, baselines, lines, audit, shown, facts, links)
    files.write_text(folder / PAGE, html)
    return told


def trained(study: Study, row: int, run: int, arch: str) -> Example:
    """Return an example with the table of its run, which is trained again."""
    point: Any = study.points[row]
    seed = study.seeds[run]
    lengths = point.episodes, point.max_steps
    result = train(point.world, point.training, seed, *lengths, point.task, arch=arch)
    return Example(row, run, point, seed, result.q_values[0, 0])


def save_policies(folder: Path, comparison: Comparison, chosen: Sequence[Example]) -> None:
    """Write the policies of the examples."""
    for row, run, point, seed, q_values in chosen:
        metadata = {
            "task": point.task.as_dict(),
            "config": point.training.as_dict(),
            "seed": seed,
            "episodes": point.episodes,
            "max_steps": point.max_steps,
            "return_last50": comparison.measures["return_last50"][row, run],
            "behaviour": BEHAVIOURS[comparison.behaviours[row, run]],
        }
        save_policy(folder / f"{example_name(comparison, row, run)}.npz", q_values, metadata)


def main(arguments: list[str] | None = None) -> None:
    """Run the comparison, or show its results if it is finished."""
    with command_line.reporting(command_line.AGAIN):
        settings = parse_arguments(arguments)
        is_new = settings.force or not (settings.out / MANIFEST).exists()
        # --threads 1 also means that no second process starts.
        draws = is_new and not settings.no_figures and settings.threads != 1
        with process.second(draws):
            run_study(settings, planned(__file__, settings))


if __name__ == "__main__":
    main()
