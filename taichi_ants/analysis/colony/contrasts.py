"""The paired differences on which the findings of the study rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Protocol

import numpy as np

from taichi_ants.analysis.colony.differences import Difference, judge
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
)

# Numbers of ants: of the condition from which is subtracted, and of the one that is.
Sizes = tuple[int, int]


class Contrast(Protocol):
    """Differences of one kind, for several numbers of ants."""

    @property
    def words(self) -> str:
        """What is subtracted from what."""

    def values(self, study: ColonyStudy, arena: Arena) -> dict[Sizes, np.ndarray]:
        """Differences float64 (seeds,); none where conditions are missing."""


@dataclass(frozen=True)
class Growth:
    """Each number of ants minus every smaller one, of one way and pheromone."""

    way: str
    pheromone: str
    measure: str

    @property
    def words(self) -> str:
        return f"{self.measure}, {self.way}, trail {self.pheromone}: minus a smaller colony"

    def values(self, study: ColonyStudy, arena: Arena) -> dict[Sizes, np.ndarray]:
        sizes = study.sizes(arena, self.pheromone, self.way)
        by_size = {n: study.values(arena, self.pheromone, self.way, n, self.measure) for n in sizes}
        return {(n, less): by_size[n] - by_size[less] for less, n in combinations(sizes, 2)}


@dataclass(frozen=True)
class Pair:
    """One (way, pheromone) minus another, with equally many ants, from `least` ants on."""

    first: tuple[str, str]
    second: tuple[str, str]
    least: int = 2
    measure: str = "deliveries"

    @property
    def words(self) -> str:
        names = [f"{way}, trail {pheromone}" for way, pheromone in (self.first, self.second)]
        return f"{self.measure}: {names[0]} minus {names[1]}"

    def values(self, study: ColonyStudy, arena: Arena) -> dict[Sizes, np.ndarray]:
        (way, pheromone), (other_way, other_pheromone) = self.first, self.second
        return {
            (n, n): study.values(arena, pheromone, way, n, self.measure)
            - study.values(arena, other_pheromone, other_way, n, self.measure)
            for n in study.sizes(arena, pheromone, way)
            if n >= self.least and study.has(arena, other_pheromone, other_way, [n])
        }


@dataclass(frozen=True)
class AgainstOne:
    """The largest colony of a way minus one ant that was trained alone, trails on."""

    way: str
    measure: str

    @property
    def words(self) -> str:
        return f"{self.measure}, trail on: {self.way} minus one ant alone"

    def values(self, study: ColonyStudy, arena: Arena) -> dict[Sizes, np.ndarray]:
        sizes = study.sizes(arena, ON, self.way)
        if not sizes or sizes[-1] == 1 or not study.has(arena, ON, COPIED, [1]):
            return {}
        alone = study.values(arena, ON, COPIED, 1, self.measure)
        return {(sizes[-1], 1): study.values(arena, ON, self.way, sizes[-1], self.measure) - alone}


COPIES = "Do more copies help?"
CROWDING = "Where does crowding begin?"
CURE = "Does joint learning cure it?"
TRAIL = "Does the trail that ants lay themselves help?"
FIRST = "Does a crowd find food sooner?"

# By the question that they answer. For one ant all ways but two trainings in turn are the same, so
# that ways are compared from two ants on.
CONTRASTS: dict[str, dict[str, Contrast]] = {
    COPIES: {
        "copies_total": Growth(COPIED, ON, "deliveries"),
        "joint_total": Growth(JOINT, ON, "deliveries"),
    },
    CROWDING: {
        "copies_each": Growth(COPIED, ON, "per_ant"),
        "copies_each_off": Growth(COPIED, OFF, "per_ant"),
        "joint_each": Growth(JOINT, ON, "per_ant"),
    },
    CURE: {
        "joint_copies": Pair((JOINT, ON), (COPIED, ON)),
        "joint_long": Pair((JOINT, ON), (COPIED_LONG, ON)),
        "own_joint": Pair((OWN, ON), (JOINT, ON)),
        "then_joint": Pair((THEN_JOINT, ON), (JOINT, ON)),
        "joint_against_one": AgainstOne(JOINT, "per_ant"),
    },
    TRAIL: {
        "trail_joint": Pair((JOINT, ON), (JOINT, OFF)),
        "trail_copies": Pair((COPIED, ON), (COPIED, OFF), least=1),
        "evaporation_joint": Pair((JOINT, ON), (JOINT, LASTING)),
        "evaporation_copies": Pair((COPIED, ON), (COPIED, LASTING), least=1),
        "trail_reward": Pair((JOINT, ON), (JOINT, OFF), measure="reward"),
    },
    FIRST: {
        "first_copies": AgainstOne(COPIED, "first_delivery"),
        "first_joint": AgainstOne(JOINT, "first_delivery"),
    },
}

# Verdicts on the contrasts of a question in an arena.
Verdicts = Mapping[str, Mapping[Sizes, Difference]]
# By arena and question.
Judged = dict[tuple[str, str], Verdicts]


def judge_all(study: ColonyStudy) -> Judged:
    """All contrasts; those of one question in one arena are judged together."""
    return {
        (arena.name, question): _judge_question(study, arena, contrasts)
        for arena in study.arenas
        for question, contrasts in CONTRASTS.items()
    }


def _judge_question(
    study: ColonyStudy, arena: Arena, contrasts: Mapping[str, Contrast]
) -> Verdicts:
    values = {
        (name, sizes): differences
        for name, contrast in contrasts.items()
        for sizes, differences in contrast.values(study, arena).items()
    }
    verdicts: dict[str, dict[Sizes, Difference]] = {name: {} for name in contrasts}
    for (name, sizes), difference in judge(values).items():
        verdicts[name][sizes] = difference
    return verdicts


def peak(verdicts: Mapping[Sizes, Difference]) -> int:
    """The smallest number of ants that no larger one exceeds beyond chance."""
    sizes = sorted({n for pair in verdicts for n in pair})
    return next(
        n for n in sizes if not any(verdicts[more, n].sign > 0 for more in sizes if more > n)
    )


def decline(verdicts: Mapping[Sizes, Difference]) -> Sizes | None:
    """The smallest number of ants that stays below a smaller one beyond chance, and that one.

    It stays below if no larger number exceeds it again. Of several smaller ones the one with the
    greatest difference; None if there is none.
    """
    sizes = sorted({n for pair in verdicts for n in pair})
    for n in sizes:
        below = [less for less in sizes if less < n and verdicts[n, less].sign < 0]
        if below and not any(verdicts[more, n].sign > 0 for more in sizes if more > n):
            return n, min(below, key=lambda less: verdicts[n, less].mean)
    return None
