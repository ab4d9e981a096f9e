"""The scaling study of the colony: conditions, trained and evaluated, kept on disk as they finish.

The work is cut into blocks, one for each condition (arena, pheromone, way of sharing, number of
ants), with all seeds in it. Each finished block is a file, so that a study that was stopped goes on
where it was.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants import __version__, files
from taichi_ants.analysis.bounds.limits import Limits, limits_of
from taichi_ants.analysis.colony.study import (
    COPIED,
    COPIED_LONG,
    JOINT,
    LASTING,
    OFF,
    ON,
    OWN,
    THEN_JOINT,
    Arena,
    ColonyStudy,
    Condition,
    Record,
)
from taichi_ants.errors import AntsError
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.studies.provenance import world_facts
from taichi_ants.studies.sweeps import read_block
from taichi_ants.task.colony import ColonyConfig, Pheromone
from taichi_ants.worlds.world import World

PHEROMONES: dict[str, Pheromone] = {
    ON: Pheromone(),
    OFF: Pheromone(deposit="none"),
    LASTING: Pheromone(evaporation="none"),
}
REGROWTH = 0  # food grows back at once
# Seeds of the evaluation are those of the training plus this, so that no random number serves both.
EVALUATION_SEEDS = 1 << 32
_EXPLORING = 0.7  # of the training episodes, until epsilon has fallen to what evaluation uses
_ARRAYS = tuple(Record.__dataclass_fields__)

Progress = Callable[[float], None]


@dataclass(frozen=True)
class ArenaPlan:
    """What to do in one kind of world.

    Attributes:
        name, words: As in `analysis.colony.study.Arena`.
        worlds: One world for each seed, all of the same ranges.
        seeds: The seeds; they also pair conditions.
        sizes: Numbers of ants, ascending, 1 first.
        ways: The ways of sharing to train, by pheromone.
        episodes: Training episodes, all of `ticks` ticks.
        ticks: Ticks of each episode.
        rollouts: Evaluation episodes.
        long_factor: How many times as many episodes the way `COPIED_LONG` trains.
    """

    name: str
    words: str
    worlds: tuple[World, ...]
    seeds: tuple[int, ...]
    sizes: tuple[int, ...]
    ways: Mapping[str, tuple[str, ...]]
    episodes: int
    ticks: int
    rollouts: int
    long_factor: int

    def __post_init__(self) -> None:
        room = min(int((world.ground() == 0).sum()) for world in self.worlds)
        if max(self.sizes) > room:
            raise AntsError(
                f"{max(self.sizes)} ants do not fit into {self.words}, where there is room for "
                f"{room}; ask for fewer."
            )

    def conditions(self) -> Iterator[Condition]:
        """All of them; those that start from others' tables come after these.

        For a single ant, learning jointly and with a table of its own is learning alone.
        """
        for pheromone, ways in self.ways.items():
            for way in ways:
                for ants in self.sizes:
                    if ants > 1 or way not in (JOINT, OWN):
                        yield Condition(self.name, pheromone, way, ants)


@dataclass(frozen=True)
class StudyPlan:
    """What to do.

    Attributes:
        arenas: The kinds of world.
        training: The learner; its epsilon is that of the first episode, its `min_epsilon` that of
            the last 30 % and of the evaluation. The decay follows from these.
    """

    arenas: tuple[ArenaPlan, ...]
    training: TrainingConfig


def run_study(
    plan: StudyPlan,
    folder: Path,
    threads: int | None = None,
    arch: str | None = None,
    progress: Progress = lambda share: None,
    notice: Callable[[str], None] = lambda text: None,
) -> tuple[ColonyStudy, dict[Condition, np.ndarray]]:
    """Do the blocks that the folder does not hold yet, and join all.

    Args:
        plan: What to do.
        folder: Where finished blocks are kept; it must belong to this plan alone.
        threads, arch: As in `Colony`.
        progress: Called now and then with the share of the work that is done.
        notice: As in `run_sweep`.

    Returns:
        The study, and the tables float32 (seeds, 128, 5) of the ways that share one.

    Raises:
        AntsError: A block cannot be written, or an argument is not allowed.
    """
    work = [(arena, condition) for arena in plan.arenas for condition in arena.conditions()]
    weights = [_weight(plan, *item) for item in work]
    total, done = sum(weights), 0.0
    records: dict[Condition, Record] = {}
    tables: dict[Condition, np.ndarray] = {}
    for (arena, condition), weight in zip(work, weights, strict=True):
        path = folder / f"{_name(condition)}.npz"
        block = read_block(path, notice)
        if block is None:
            runner = _Runner(plan, arena, condition, threads, arch)
            block = runner.run(tables, _part(progress, done / total, weight / total))
            files.write_sealed_npz(path, block)
        records[condition] = Record(**{name: block[name].astype(np.int64) for name in _ARRAYS})
        if "q_values" in block:
            tables[condition] = block["q_values"]
        done += weight
        progress(done / total)
    return _joined(plan, records), tables


def _part(progress: Progress, begin: float, share: float) -> Progress:
    """The progress of a part of the work, as that of all."""
    return lambda done: progress(begin + share * done)


def settings_of(plan: StudyPlan) -> dict[str, Any]:
    """All that determines the numbers of a study; equal settings give equal results."""
    return {
        "version": __version__,
        "training": asdict(plan.training),
        "pheromones": {name: asdict(one) for name, one in PHEROMONES.items()},
        "regrowth": REGROWTH,
        "arenas": [
            {
                **{field.name: getattr(arena, field.name) for field in fields(arena)},
                "worlds": [world_facts(world) for world in dict.fromkeys(arena.worlds)],
            }
            for arena in plan.arenas
        ],
    }


def to_arrays(records: Mapping[Condition, Record]) -> dict[str, np.ndarray]:
    """What the conditions gave under names for a file, "arena.pheromone.way.ants.what"."""
    return {
        f"{_name(condition)}.{name}": files.smallest(array)
        for condition, record in records.items()
        for name, array in vars(record).items()
    }


def from_arrays(plan: StudyPlan, arrays: Mapping[str, np.ndarray]) -> ColonyStudy:
    """The study of a plan from what `to_arrays` gave.

    Raises:
        AntsError: Something is missing.
    """
    records: dict[Condition, Record] = {}
    try:
        for condition in (one for arena in plan.arenas for one in arena.conditions()):
            parts = {name: arrays[f"{_name(condition)}.{name}"] for name in _ARRAYS}
            records[condition] = Record(**{n: part.astype(np.int64) for n, part in parts.items()})
    except KeyError as error:
        raise AntsError(f"the results hold no {error}; give --force to make them anew.") from error
    return _joined(plan, records)


def median_policies(
    plan: StudyPlan, study: ColonyStudy, tables: Mapping[Condition, np.ndarray]
) -> Iterator[tuple[str, np.ndarray, dict[str, Any]]]:
    """Policies worth keeping: those of median seeds, trained alone and jointly, with trails.

    Yields:
        A name, the action values float32 (128, 5), and what made them.
    """
    by_name = {arena.name: (arena, place) for place, arena in enumerate(study.arenas)}
    for condition, q_values in tables.items():
        if condition.pheromone == ON and condition.way in (COPIED, JOINT):
            arena, place = by_name[condition.arena]
            values = study.values(arena, ON, condition.way, condition.ants)
            run = int(np.argsort(values, kind="stable")[(arena.seeds - 1) // 2])
            metadata = {
                **vars(condition),
                "training": asdict(plan.training),
                "seed": plan.arenas[place].seeds[run],
                "episodes": arena.episodes,
                "ticks": arena.ticks,
                "deliveries_per_1000_ticks": values[run],
            }
            trained = "alone" if condition.way == COPIED else f"joint_{condition.ants}"
            yield f"{arena.name}_{trained}", q_values[run], metadata


def _name(condition: Condition) -> str:
    return ".".join(map(str, vars(condition).values()))


def _joined(plan: StudyPlan, records: dict[Condition, Record]) -> ColonyStudy:
    for arena in plan.arenas:
        _copy_single_ants(arena, records)
    return ColonyStudy(tuple(_arena(arena) for arena in plan.arenas), records)


class _Runner:
    """Trains and evaluates one condition."""

    def __init__(
        self,
        plan: StudyPlan,
        arena: ArenaPlan,
        condition: Condition,
        threads: int | None,
        arch: str | None,
    ) -> None:
        self._plan, self._arena, self._condition = plan, arena, condition
        self._where: dict[str, Any] = {"threads": threads, "arch": arch}
        self._life = ColonyConfig(
            ants=condition.ants, pheromone=PHEROMONES[condition.pheromone], regrowth=REGROWTH
        )

    def run(
        self, tables: Mapping[Condition, np.ndarray], progress: Progress
    ) -> dict[str, np.ndarray]:
        """The block: what the evaluation gave, and the shared table where it was trained here."""
        training, evaluating = _ant_ticks(self._arena, self._condition)
        share = training / (training + evaluating)
        way, alone = self._condition.way, self._trained_alone()
        if training:
            start = tables[alone] if way == THEN_JOINT else None
            q_values = self._train(start, lambda part: progress(share * part))
        else:
            q_values = tables[alone]
        block = self._evaluate(q_values, lambda part: progress(share + (1 - share) * part))
        return block | ({"q_values": q_values} if training and way != OWN else {})

    def _trained_alone(self) -> Condition:
        """The condition in which the ant was trained whose table is copied, or trained on."""
        long = self._condition.way == COPIED_LONG
        return replace(self._condition, way=COPIED_LONG if long else COPIED, ants=1)

    def _train(self, start: np.ndarray | None, progress: Progress) -> np.ndarray:
        from taichi_ants.engines.colony.colony import Colony

        arena, training = self._arena, self._plan.training
        episodes = _episodes(arena, self._condition)
        exploring = max(1, round(_EXPLORING * episodes))
        least = max(training.min_epsilon, 1e-6)
        decay = min(1.0, (least / max(training.epsilon, least)) ** (1 / exploring))
        colony = Colony(
            arena.worlds,
            self._life,
            replace(training, epsilon_decay=decay),
            arena.seeds,
            sharing="own" if self._condition.way == OWN else "shared",
            q_values=start,
            **self._where,
        )
        colony.run(episodes, arena.ticks, progress)
        return colony.q_values

    def _evaluate(self, q_values: np.ndarray, progress: Progress) -> dict[str, np.ndarray]:
        from taichi_ants.engines.colony.colony import Colony

        arena = self._arena
        least = self._plan.training.min_epsilon
        colony = Colony(
            arena.worlds,
            self._life,
            replace(self._plan.training, epsilon=least, epsilon_decay=1.0),
            [seed + EVALUATION_SEEDS for seed in arena.seeds],
            sharing="fixed",
            q_values=q_values,
            **self._where,
        )
        outcome = colony.run(arena.rollouts, arena.ticks, progress)
        return {name: files.smallest(getattr(outcome, name).T) for name in _ARRAYS}


def _episodes(arena: ArenaPlan, condition: Condition) -> int:
    """Training episodes of a condition, 0 where it uses the tables of another."""
    if condition.way == COPIED_LONG:
        return arena.episodes * arena.long_factor if condition.ants == 1 else 0
    return 0 if condition.way == COPIED and condition.ants > 1 else arena.episodes


def _ant_ticks(arena: ArenaPlan, condition: Condition) -> tuple[int, int]:
    """Ticks of training and of evaluation, of all ants and seeds."""
    ticks = arena.ticks * condition.ants * len(arena.seeds)
    return _episodes(arena, condition) * ticks, arena.rollouts * ticks


def _weight(plan: StudyPlan, arena: ArenaPlan, condition: Condition) -> float:
    training, evaluating = _ant_ticks(arena, condition)
    return training * (1 + plan.training.planning_steps) + evaluating


def _copy_single_ants(arena: ArenaPlan, records: dict[Condition, Record]) -> None:
    """Fill in the conditions of one ant that are no different from being trained alone."""
    for pheromone, ways in arena.ways.items():
        alone = Condition(arena.name, pheromone, COPIED, 1)
        for way in ways:
            if alone in records:
                records.setdefault(replace(alone, way=way), records[alone])


def _arena(plan: ArenaPlan) -> Arena:
    """What the analysis needs to know of an arena, with the limits of its worlds."""
    limits: dict[World, Limits] = {}
    for world, seed in zip(plan.worlds, plan.seeds, strict=True):
        if world not in limits:
            limits[world] = limits_of(world, seed)
    return Arena(
        name=plan.name,
        words=plan.words,
        sizes=plan.sizes,
        episodes=plan.episodes,
        ticks=plan.ticks,
        rollouts=plan.rollouts,
        seeds=len(plan.seeds),
        long_factor=plan.long_factor,
        limits=tuple(limits[world] for world in plan.worlds),
    )
