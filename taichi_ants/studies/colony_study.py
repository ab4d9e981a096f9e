"""The study of the colony: worlds, rules, training and evaluation of each condition.

To add rules, add entries to `RULES` (`analysis.colony.study`) and `TASKS`. To add a kind of world,
add an entry to `WORLDS` there, and extend `place`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants import files, learners, worlds
from taichi_ants.analysis import style
from taichi_ants.analysis.bounds.limits import limits_of
from taichi_ants.analysis.colony import study, tables
from taichi_ants.analysis.colony.figures import draw_all
from taichi_ants.analysis.colony.study import Condition, Measured, measures_of
from taichi_ants.analysis.colony.tables import Results
from taichi_ants.analysis.tables import markdown, plain_text
from taichi_ants.errors import AntsError, check_one_of
from taichi_ants.files.results import REPORT
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.policies import save_policy
from taichi_ants.studies.blocks import Blocks, Outcome
from taichi_ants.studies.points import ColonyPoint, Progress
from taichi_ants.studies.runner import VALUE, Study
from taichi_ants.task import Life, Pheromone, Task, foraging, paper, queueing
from taichi_ants.worlds.world import World

SEEDS, CONDITIONS = "seeds.csv", "conditions.csv"
FIGURES, POLICIES = "figures", "policies"
_WIDTH = 79  # of the report, in columns
_SILENT, _LIVELY = Pheromone(deposit="none"), Life(regrowth=0)
# Trails evaporate also in training, and food grows back at once.
TASKS: dict[str, Task] = {
    rules: replace(task, evaporation_in_training=True, life=_LIVELY)
    for rules, task in {
        study.PAPER: paper(),
        study.SILENT: replace(paper(), pheromone=_SILENT),
        study.A: replace(paper(), pheromone=foraging().pheromone),
        study.BC: replace(foraging(), pheromone=paper().pheromone),
        study.ABC: foraging(),
        study.ABC_SILENT: replace(foraging(), pheromone=_SILENT),
        study.QUEUES: queueing(),
    }.items()
}
# Rules whose policies are also evaluated with more ants, and in other worlds, than in training.
COMPARED = (study.PAPER, study.ABC, study.QUEUES)
TRAINED_WITH = {study.ALONE: 1, study.FEW: 4, study.SOME: 16}
OPEN, LARGE_SIZE = "open", 1000
POOL, FIRST_OF_POOL = 64, 1 << 20  # number of worlds for training, and the first one's seed
EXPLORING = 0.7  # the share of training episodes in which epsilon and the learning rate decrease
OPTIMISM = 10.0  # the initial action value, above most true values

# The point of each condition; conditions can share points.
Plan = dict[Condition, ColonyPoint]


def plan(
    world_kinds: Sequence[str],
    sizes: Sequence[int],
    seeds: Sequence[int],
    training: TrainingConfig,
    episodes: int,
    ticks: int,
    rollouts: int,
) -> Plan:
    """Return the conditions of some kinds of world, which are names in `WORLDS`.

    `sizes` are ascending. Ants that train in one kind of world and act in another have the last
    size. Epsilon decays to `EVALUATION_EPSILON` and the learning rate to a tenth in the first 70 %
    of the training episodes.

    Raises:
        AntsError: A kind of world is unknown, or ants cannot share a table with the learner.
    """
    for world_kind in world_kinds:
        check_one_of("the kind of world", world_kind, tuple(study.WORLDS))
    if learners.get(training.learner).td_error is None:
        able = [name for name in learners.names() if learners.get(name).td_error]
        raise AntsError(
            f"learner {training.learner!r} has no TD error that can be summed over ants, which "
            f"a shared table requires; choose one of {', '.join(able)}."
        )
    training = scheduled(replace(training, min_epsilon=study.EVALUATION_EPSILON), episodes)
    kinds = dict.fromkeys([*world_kinds, OPEN])
    places = {world_kind: _drawn(world_kind, seeds) or worlds.paper() for world_kind in kinds}
    others = range(FIRST_OF_POOL, FIRST_OF_POOL + POOL)
    pools = {one: _drawn(one, others) for one in kinds if one in study.WORLD_KINDS}
    lengths: Any = {"episodes": episodes, "ticks": ticks, "rollouts": rollouts}

    def trained(world_kind: str, rules: str, ants: int) -> ColonyPoint:
        places_of = places[world_kind], TASKS[rules], training, pools[world_kind]
        return ColonyPoint(*places_of, ants, **lengths)

    conditions: Plan = {}
    for world_kind in world_kinds:
        for rules, n in product(TASKS, sizes if world_kind in study.WORLD_KINDS else ()):
            conditions[Condition(world_kind, rules, study.JOINT, n)] = trained(world_kind, rules, n)
        for rules, (regime, few), n in product(COMPARED, TRAINED_WITH.items(), sizes):
            if world_kind in study.WORLD_KINDS and n > few:
                after = trained(world_kind, rules, few)
                copies = replace(after, ants=n, episodes=0, after=after)
                conditions[Condition(world_kind, rules, regime, n)] = copies
        for rules in COMPARED if world_kind != OPEN else ():
            after = trained(OPEN, rules, sizes[-1])
            where: Any = {"world": places[world_kind], "task": task_in(world_kind, after.task)}
            n = LARGE_SIZE if world_kind == "large" else sizes[-1]
            abroad = replace(after, **where, pool=None, ants=n, episodes=0, after=after)
            conditions[Condition(world_kind, rules, study.ABROAD, abroad.ants)] = abroad
    return conditions


# Kinds of world in which food moves or takes time to grow back.
LIVES = {"moving": Life(regrowth=0, pile_move_interval=100), "slow": Life(regrowth=100)}
RANGES = {"small": (15, 15, 15), "wide": (60, 60, 60), "large": (100, 100, 100)}
_PILES = {"piles": 3, "moving": 3, "one_pile": 1}  # number of piles; there is no other food


def task_in(world_kind: str, task: Task) -> Task:
    """Return the task with the food rules of a kind of world."""
    return replace(task, life=LIVES.get(world_kind, _LIVELY))


def place(world_kind: str, seed: int) -> World:
    """Return the world of a kind and a seed; the paper's world ignores the seed."""
    if world_kind == "paper":
        return worlds.paper()
    ranges = RANGES.get(world_kind, (30, 30, 30))
    if world_kind in _PILES:
        return worlds.far_piles(seed, ranges, piles=_PILES[world_kind])
    return worlds.open_world(seed, ranges, rock_share=0.3 if world_kind == "rocks" else 0.15)


def _drawn(world_kind: str, seeds: Iterable[int]) -> tuple[World, ...] | None:
    return None if world_kind == "paper" else tuple(place(world_kind, seed) for seed in seeds)


def scheduled(training: TrainingConfig, episodes: int) -> TrainingConfig:
    """Return the training with geometric decays of epsilon and of the learning rate."""
    exploring = max(1, round(EXPLORING * episodes))
    low = max(training.least_epsilon, 1e-6)
    return replace(
        training,
        epsilon_decay=min(1.0, (low / max(training.epsilon, low)) ** (1 / exploring)),
        learning_rate_decay=0.1 ** (1 / exploring),
        min_learning_rate=training.learning_rate / 10,
        initial_q=OPTIMISM,
    )


def greedy(point: ColonyPoint) -> ColonyPoint:
    """Return the point that evaluates the same ants without exploration."""
    calm = replace(point, evaluation_epsilon=0.0)
    return replace(calm, pool=None, episodes=0, after=point) if point.episodes else calm


def study_of(conditions: Plan, seeds: Sequence[int]) -> Study[ColonyPoint]:
    """Return the study that measures all conditions of a plan."""
    return Study((*conditions.values(), *map(greedy, conditions.values())), tuple(seeds))


def with_measures(points: Sequence[ColonyPoint], seeds: Sequence[int], outcome: Outcome) -> Outcome:
    """Return an outcome of one point with its measures."""
    (point,) = points
    values = measures_of({n: a[0] for n, a in outcome.items()}, point.ants, point.ticks)
    return {**outcome, **{f"{VALUE}{name}": array[None] for name, array in values.items()}}


def take_results(
    conditions: Plan,
    asked: Study[ColonyPoint],
    folder: Path,
    runs: Mapping[str, Any],
    blocks: Blocks,
) -> None:
    """Add finished results, whose `Study.runs` were `runs`, to the blocks of a study."""
    key_of = dict(zip(asked.in_order, asked.keys, strict=True))
    names_of = dict(zip(runs["points"], runs["seeds_of"], strict=True))
    rows: dict[Condition, list[dict[str, str]]] = {}
    for row in files.read_csv(folder / SEEDS):
        where = row["world_kind"], row["rules"], row["regime"], int(row["ants"])
        rows.setdefault(Condition(*where), []).append(row)
    for condition, several in rows.items():
        point = conditions[condition]
        columns = {name: np.array([float(row[name]) for row in several]) for name in study.OF_STUDY}
        own = {name: columns[name] for name in study.MEASURES}
        # Only this measure of ants that do not explore is in the results.
        calm = dict.fromkeys(own, np.full(len(several), np.nan))
        calm["deliveries"] = columns["greedy"]
        for one, values in ((point, own), (greedy(point), calm)):
            seeds = runs["seeds"][names_of[key_of[one]]]
            blocks.add([key_of[one]], seeds, {f"{VALUE}{n}": a[None] for n, a in values.items()})


def measured(
    conditions: Plan, values: Mapping[Any, Mapping[str, np.ndarray]], seeds: Sequence[int]
) -> dict[Condition, dict[str, np.ndarray]]:
    """Return all measures, float64 (seeds,), of all conditions from those of the points."""
    bounds, found = bounds_of(conditions, len(seeds)), {}
    for condition, point in conditions.items():
        bound, of_point = bounds[condition], values[point]
        share = of_point["deliveries"] / np.where(bound > 0, bound, np.nan)
        calm = values[greedy(point)]["deliveries"]
        found[condition] = {**of_point, "greedy": calm, "bound": bound, "bound_share": share}
    return found


def bounds_of(conditions: Plan, seeds: int) -> dict[Condition, np.ndarray]:
    """Return upper bounds on deliveries per 1000 ticks in the world of each seed, float64 (seeds,).

    They are nan if food moves or takes time to grow back, because no bound is known.
    """
    limits: dict[Any, list] = {}
    found = {}
    for condition, point in conditions.items():
        places = point.world if isinstance(point.world, tuple) else (point.world,)
        key = point.world, point.task.traffic, point.task.turns_at_queen
        if key not in limits:
            limits[key] = [limits_of(place, point.task) for place in places]
        known = point.task.life == _LIVELY
        most = [one.deliveries(point.ants) if known else np.nan for one in limits[key]]
        found[condition] = np.broadcast_to(np.array(most), seeds)
    return found


def do_study(
    conditions: Plan,
    asked: Study[ColonyPoint],
    blocks: Path,
    folder: Path,
    draws: bool,
    progress: Progress,
    **how: Any,
) -> Results | None:
    """Return the results of a study, after writing all of their files; None for a shard.

    Computes the blocks that are missing in `blocks`; `how` has further arguments of
    `Study.in_blocks`.
    """
    arrays = asked.reduced(blocks, with_measures, progress, **how)
    if how.get("shard", (1, 1))[1] > 1:
        return None
    of_points = {p: {n: a[row] for n, a in arrays.items()} for row, p in enumerate(asked.points)}
    values, seeds = measured(conditions, of_points, asked.seeds), asked.seeds
    results = Results.of(values)
    for name, table in (
        (SEEDS, tables.rows_of_seeds(values, seeds)),
        (CONDITIONS, [one.columns() for one in results.rows]),
        ("differences.csv", tables.difference_rows(results.judged)),
    ):
        files.write_csv(folder / name, table, list(table[0]))
    files.write_text(folder / "findings.md", markdown(tables.found(*results)))
    files.write_text(folder / REPORT, plain_text(tables.on_one_screen(*results), _WIDTH))
    _save_policies(conditions, asked, values, blocks, folder / POLICIES, **how)
    if draws:
        with style.all_or_none(folder / FIGURES):
            style.save_all(draw_all(results.rows), folder / FIGURES)
    return results


def _save_policies(
    conditions: Plan,
    asked: Study[ColonyPoint],
    values: Measured,
    blocks: Path,
    folder: Path,
    **how: Any,
) -> None:
    """Save the policy of the median seed of each condition with joint training in `COMPARED`.

    Results that were taken over have only measures, so these runs are done again.
    """
    files.check_writable_folder(folder)
    place_of = {point: place for place, point in enumerate(asked.in_order)}
    median: dict[Condition, tuple[int, int]] = {}  # the point and the seed, by their places
    for condition, point in conditions.items():
        if condition.rules in COMPARED and condition.regime == study.JOINT:
            order = np.argsort(values[condition]["deliveries"], kind="stable")
            run = int(order[(len(asked.seeds) - 1) // 2])
            median[condition] = place_of[point], run
    runs = np.zeros((len(asked.in_order), len(asked.seeds)), bool)
    for at in median.values():
        runs[at] = True
    asked.complete(blocks, runs, "q_values", reduce=with_measures, **how)
    saved = Blocks(blocks)
    for condition, (place, run) in median.items():
        point, name = asked.in_order[place], asked.names[place][run]
        metadata = {
            **condition._asdict(),
            **{"task": point.task.as_dict(), "training": point.training.as_dict()},
            **{"seed": asked.seeds[run], "episodes": point.episodes, "ticks": point.ticks},
            "deliveries_per_1000_ticks": values[condition]["deliveries"][run],
        }
        path = folder / f"{condition.world_kind}_{condition.rules}_{condition.ants}.npz"
        (q_values,) = saved.read(asked.keys[place], [name], "q_values")["q_values"]
        save_policy(path, q_values, metadata, point.task.observation)
