"""The scaling study of the colony: its arenas, its designs, and what is done for each condition.

Other rules of the game are an entry in `RULES` (`analysis.colony.study`) and one in `TASKS`, other
ways to come to a policy one in `WAYS` and a case in `_point`; then they can stand in `DESIGNS`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from taichi_ants import worlds
from taichi_ants.analysis.bounds.limits import Limits, limits_of
from taichi_ants.analysis.colony.study import (
    ARENAS,
    COPIED,
    COPIED_LONG,
    JOINT,
    LASTING,
    OFF,
    ON,
    OWN,
    THEN_JOINT,
    Condition,
    Design,
    Measured,
    measures_of,
)
from taichi_ants.errors import check_one_of
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.studies.runner import ColonyPoint, Outcome
from taichi_ants.task import Life, Pheromone, Task

_PHEROMONES = {
    ON: Pheromone(),
    OFF: Pheromone(deposit="none"),
    LASTING: Pheromone(evaporation="none"),
}
# Trails fall in training too, food grows back at once, and an ant goes on after a delivery.
TASKS = {
    rules: Task(
        pheromone=pheromone,
        delivery="continuing",
        evaporation_in_training=True,
        life=Life(regrowth=0),
    )
    for rules, pheromone in _PHEROMONES.items()
}
_TRAINED = (JOINT, THEN_JOINT, OWN)
DESIGNS = (
    *(Design(ON, way) for way in (COPIED, COPIED_LONG, *_TRAINED)),
    *(Design(rules, way) for rules in (OFF, LASTING) for way in (COPIED, *_TRAINED)),
)
# The large worlds get fewer designs, other numbers of ants, and shorter training.
LARGE_DESIGNS = (
    *(Design(ON, way) for way in (COPIED, *_TRAINED)),
    *(Design(OFF, way) for way in (COPIED, JOINT)),
)
LARGE_SIZES, LARGE_EPISODES, LARGE_ROLLOUTS = (1, 10, 100, 1000), 10, 2
RANGES = {"open": (30, 30, 30), "large": (100, 100, 100)}
_EXPLORING = 0.7  # of the training episodes, until epsilon has fallen to what evaluation uses

# What is done for each condition; some have a point in common.
Plan = dict[Condition, ColonyPoint]


def plan(
    arenas: Sequence[str],
    sizes: Sequence[int],
    seeds: Sequence[int],
    training: TrainingConfig,
    episodes: int,
    ticks: int,
    rollouts: int,
) -> Plan:
    """The conditions of some arenas.

    Args:
        arenas: Names in `ARENAS`.
        sizes: Numbers of ants, ascending; the large worlds have their own. The way `COPIED_LONG`
            trains as many times as long as there are ants in the largest colony.
        seeds: A seed gives its open world to all conditions.
        training: The learner; its epsilon is that of the first episode, its `min_epsilon` that of
            the last 30 % and of the evaluation. The decay follows from these.
        episodes, ticks, rollouts: As of a `ColonyPoint`; `episodes` and `rollouts` are at most so
            many in large worlds.
    """
    conditions = {}
    for arena in arenas:
        check_one_of("the arena", arena, tuple(ARENAS))
        large = arena == "large"
        ranges = RANGES.get(arena)
        alone = ColonyPoint(
            tuple(worlds.open_world(s, ranges) for s in seeds) if ranges else worlds.paper(),
            Task(),
            training,
            episodes=min(LARGE_EPISODES, episodes) if large else episodes,
            ticks=ticks,
            rollouts=min(LARGE_ROLLOUTS, rollouts) if large else rollouts,
        )
        for design in LARGE_DESIGNS if large else DESIGNS:
            for ants in LARGE_SIZES if large else sizes:
                ruled = replace(alone, task=TASKS[design.rules])
                condition = Condition(arena, *design, ants)
                conditions[condition] = _point(ruled, design.way, ants, sizes[-1])
    return conditions


def _point(alone: ColonyPoint, way: str, ants: int, long: int) -> ColonyPoint:
    """What is done for so many ants that come to their policy in a way.

    Args:
        alone: What is done for one ant; its epsilon need not decay yet.
        way: A name in `WAYS`.
        ants: How many.
        long: How many times as long the way `COPIED_LONG` trains.
    """
    alone = _exploring(
        replace(alone, episodes=alone.episodes * (long if way == COPIED_LONG else 1))
    )
    many = replace(alone, ants=ants)
    if way == THEN_JOINT:
        return replace(many, after=alone)
    if ants == 1 or way == JOINT:  # learning jointly, or with a table of its own, is learning alone
        return many
    if way == OWN:
        return replace(many, sharing="own")
    return replace(many, episodes=0, after=alone)


def _exploring(point: ColonyPoint) -> ColonyPoint:
    """The same with an epsilon that falls while the ants explore."""
    training, exploring = point.training, max(1, round(_EXPLORING * point.episodes))
    low = max(training.min_epsilon, 1e-6)
    decay = min(1.0, (low / max(training.epsilon, low)) ** (1 / exploring))
    return replace(point, training=replace(training, epsilon_decay=decay))


def measured(conditions: Plan, outcomes: Mapping[Any, Outcome]) -> Measured:
    """All measures of all conditions, from what their points gave."""
    return {
        condition: measures_of(outcomes[point], point.ants, point.ticks)
        for condition, point in conditions.items()
    }


def limits_by_arena(conditions: Plan) -> dict[str, list[Limits]]:
    """The limits of the world of each arena, or of each of its worlds."""
    by_arena = {condition.arena: point.world for condition, point in conditions.items()}
    return {
        arena: [limits_of(one) for one in (world if isinstance(world, tuple) else (world,))]
        for arena, world in by_arena.items()
    }


def median_policies(
    conditions: Plan, seeds: Sequence[int], found: Measured, outcomes: Mapping[Any, Outcome]
) -> Iterator[tuple[str, np.ndarray, dict[str, Any]]]:
    """Policies worth keeping: those of median seeds, trained alone and jointly, with trails.

    Yields:
        A name, the action values float32 (n_states, 5), and what made them.
    """
    for condition, point in conditions.items():
        arena, rules, way, ants = condition
        wanted = (way == COPIED and ants == 1) or (way == JOINT and ants > 1)
        if rules != ON or not wanted:
            continue
        deliveries = found[condition]["deliveries"]
        run = int(np.argsort(deliveries, kind="stable")[(len(seeds) - 1) // 2])
        metadata = {
            **condition._asdict(),
            "task": point.task.as_dict(),
            "training": point.training.as_dict(),
            "seed": seeds[run],
            "episodes": point.episodes,
            "ticks": point.ticks,
            "deliveries_per_1000_ticks": deliveries[run],
        }
        trained = "alone" if way == COPIED else f"joint_{ants}"
        yield f"{arena}_{trained}", outcomes[point]["q_values"][run], metadata
