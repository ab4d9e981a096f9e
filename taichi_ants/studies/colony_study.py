"""The scaling study of the colony as data: its arenas, and what is done for each condition."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from taichi_ants import files
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
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.studies.runner import ColonyPoint, Outcome, Study
from taichi_ants.task import Life, Pheromone, Task
from taichi_ants.worlds.world import World

_PHEROMONES = {
    ON: Pheromone(),
    OFF: Pheromone(deposit="none"),
    LASTING: Pheromone(evaporation="none"),
}
# Trails fall in training too, food grows back at once, and an ant goes on after a delivery.
TASKS = {
    name: Task(
        pheromone=pheromone,
        delivery="continuing",
        evaporation_in_training=True,
        life=Life(regrowth=0),
    )
    for name, pheromone in _PHEROMONES.items()
}
_EXPLORING = 0.7  # of the training episodes, until epsilon has fallen to what evaluation uses
_ARRAYS = tuple(Record.__dataclass_fields__)


@dataclass(frozen=True)
class ArenaPlan:
    """What to do in one kind of world.

    Attributes:
        name, words: As in `analysis.colony.study.Arena`.
        world: The world, or one for each seed, all of the same ranges.
        sizes: Numbers of ants, ascending, 1 first.
        ways: The ways of sharing to train, by pheromone.
        training: The learner; its epsilon is that of the first episode, its `min_epsilon` that of
            the last 30 % and of the evaluation. The decay follows from these.
        episodes: Training episodes, all of `ticks` ticks.
        ticks: Ticks of each episode.
        rollouts: Evaluation episodes.
        long_factor: How many times as many episodes the way `COPIED_LONG` trains.
    """

    name: str
    words: str
    world: World | tuple[World, ...]
    sizes: tuple[int, ...]
    ways: Mapping[str, tuple[str, ...]]
    training: TrainingConfig
    episodes: int
    ticks: int
    rollouts: int
    long_factor: int

    def conditions(self) -> Iterator[tuple[Condition, ColonyPoint]]:
        """All of them, with what is done for each; some have a point in common."""
        for pheromone, ways in self.ways.items():
            for way in ways:
                for ants in self.sizes:
                    condition = Condition(self.name, pheromone, way, ants)
                    yield condition, self._point(condition)

    def _point(self, condition: Condition) -> ColonyPoint:
        ants, way = condition.ants, condition.way
        alone = self._trained(condition.pheromone, self.episodes)
        if way == COPIED_LONG:
            alone = self._trained(condition.pheromone, self.episodes * self.long_factor)
        if way == THEN_JOINT:
            return replace(alone, ants=ants, after=alone)
        if ants == 1:  # learning jointly, or with a table of its own, is learning alone
            return alone
        if way == OWN:
            return replace(alone, ants=ants, sharing="own")
        if way == JOINT:
            return replace(alone, ants=ants)
        return replace(alone, ants=ants, episodes=0, after=alone)

    def _trained(self, pheromone: str, episodes: int) -> ColonyPoint:
        """One ant that learns for so many episodes."""
        exploring, least = max(1, round(_EXPLORING * episodes)), self.training.min_epsilon
        low = max(least, 1e-6)
        decay = min(1.0, (low / max(self.training.epsilon, low)) ** (1 / exploring))
        return ColonyPoint(
            *(self.world, TASKS[pheromone], replace(self.training, epsilon_decay=decay)),
            episodes=episodes,
            ticks=self.ticks,
            rollouts=self.rollouts,
        )


@dataclass(frozen=True)
class StudyPlan:
    """What to do: the kinds of world, and the seeds of each."""

    arenas: tuple[ArenaPlan, ...]
    seeds: tuple[int, ...]

    def conditions(self) -> Iterator[tuple[Condition, ColonyPoint]]:
        """Those of all arenas."""
        for arena in self.arenas:
            yield from arena.conditions()

    def study(self) -> Study:
        """The work."""
        return Study(tuple(point for _, point in self.conditions()), self.seeds)

    def found(self, outcomes: Mapping[Any, Outcome]) -> ColonyStudy:
        """What the analysis reads, from what the points gave."""
        return self._joined({one: outcomes[point] for one, point in self.conditions()})

    def read(self, arrays: Mapping[str, np.ndarray]) -> ColonyStudy:
        """The same from what `to_arrays` gave."""
        return self._joined(
            {
                one: {name: arrays[f"{_name(one)}.{name}"] for name in _ARRAYS}
                for one, _ in self.conditions()
            }
        )

    def _joined(self, outcomes: Mapping[Condition, Outcome]) -> ColonyStudy:
        records = {
            condition: Record(**{name: outcome[name].astype(np.int64) for name in _ARRAYS})
            for condition, outcome in outcomes.items()
        }
        return ColonyStudy(tuple(_arena(one, self.seeds) for one in self.arenas), records)

    def median_policies(
        self, study: ColonyStudy, outcomes: Mapping[Any, Outcome]
    ) -> Iterator[tuple[str, np.ndarray, dict[str, Any]]]:
        """Policies worth keeping: those of median seeds, trained alone and jointly, with trails.

        Yields:
            A name, the action values float32 (n_states, 5), and what made them.
        """
        arenas = {arena.name: arena for arena in study.arenas}
        for condition, point in self.conditions():
            way, ants = condition.way, condition.ants
            wanted = (way == COPIED and ants == 1) or (way == JOINT and ants > 1)
            if condition.pheromone != ON or not wanted:
                continue
            values = study.values(arenas[condition.arena], ON, way, ants)
            run = int(np.argsort(values, kind="stable")[(len(self.seeds) - 1) // 2])
            metadata = {
                **vars(condition),
                "task": point.task.as_dict(),
                "training": point.training.as_dict(),
                "seed": self.seeds[run],
                "episodes": point.episodes,
                "ticks": point.ticks,
                "deliveries_per_1000_ticks": values[run],
            }
            trained = "alone" if way == COPIED else f"joint_{ants}"
            yield f"{condition.arena}_{trained}", outcomes[point]["q_values"][run], metadata


def to_arrays(study: ColonyStudy) -> dict[str, np.ndarray]:
    """What the conditions gave under names for a file, "arena.pheromone.way.ants.what"."""
    return {
        f"{_name(condition)}.{name}": files.smallest(array)
        for condition, record in study.records.items()
        for name, array in vars(record).items()
    }


def _name(condition: Condition) -> str:
    return ".".join(map(str, vars(condition).values()))


def _arena(plan: ArenaPlan, seeds: tuple[int, ...]) -> Arena:
    """What the analysis needs to know of an arena, with the limits of its worlds."""
    worlds = plan.world if isinstance(plan.world, tuple) else (plan.world,) * len(seeds)
    limits: dict[World, Limits] = {}
    for world, seed in zip(worlds, seeds, strict=True):
        if world not in limits:
            limits[world] = limits_of(world, seed)
    return Arena(
        name=plan.name,
        words=plan.words,
        sizes=plan.sizes,
        episodes=plan.episodes,
        ticks=plan.ticks,
        rollouts=plan.rollouts,
        seeds=len(seeds),
        long_factor=plan.long_factor,
        limits=tuple(limits[world] for world in worlds),
    )
