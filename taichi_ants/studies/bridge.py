"""Colonies on the double bridge: how they train, and how crossings are counted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.analysis.bridge import (
    EQUAL,
    EQUAL_ASIDE,
    LATE,
    LATE_DESIGNS,
    LOADS,
    SHORT_LEFT,
    SHORT_RIGHT,
    WINDOWS,
    Design,
    length,
)
from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.studies.blocks import kept
from taichi_ants.studies.colony_study import scheduled
from taichi_ants.studies.runner import EVALUATION_SEEDS, ColonyPoint, settings_of
from taichi_ants.task import Life, Task, foraging, queueing
from taichi_ants.task.constants import EMPTY, OBSTACLE
from taichi_ants.worlds import double_bridge
from taichi_ants.worlds.double_bridge import ROOM_RADIUS, branch_cells, junction_cells

if TYPE_CHECKING:
    from taichi_ants.engines.colony.colony import Colony

REACH = 50  # ticks for which an ant lays a trail
_LOOK_EVERY = 4  # ticks; all branches are longer, so that no crossing is missed
_RULES = {"queueing": queueing, "foraging": foraging}
_QUEEN_ROOM, _FOOD_ROOM, _SHORT, _LONG = range(4)


def task(design: Design) -> Task:
    """The rules of a design; food grows back at once."""
    rules, kind = _RULES[design.rules](), design.evaporation
    evaporation: dict[str, Any] = {"evaporation": kind}
    if kind.isdecimal():
        evaporation = {"evaporation": "exponential", "half_life": float(kind)}
    trail = replace(rules.pheromone, level=REACH * design.slope, slope=design.slope, **evaporation)
    return replace(rules, pheromone=trail, life=Life(regrowth=0))


def bridges(design: Design) -> dict[str, dict[str, Any]]:
    """Return the bridges on which its colonies are followed: the arguments of `double_bridge`.

    On the bridge `LATE` the short branch is rock for the first half of the time.
    """
    unequal: dict[str, Any] = {"short": 23, "long": 36, "aside": design.aside}
    equal = {"short": 23, "long": 23}
    found = {
        SHORT_RIGHT: unequal,
        SHORT_LEFT: {**unequal, "mirrored": True},
        EQUAL: equal,
        EQUAL_ASIDE: {**equal, "aside": design.aside},
        LATE: unequal,
    }
    if not design.aside:
        del found[EQUAL_ASIDE]
    if design not in LATE_DESIGNS:
        del found[LATE]
    return found


def point(design: Design, episodes: int, ticks: int) -> ColonyPoint:
    """How colonies of a design learn.

    The short branch lies to the right in about half of the episodes and to the left in the others,
    so that no colony can learn on which side it is.
    """
    places = bridges(design)
    pool = tuple(double_bridge(**places[name]) for name in (SHORT_RIGHT, SHORT_LEFT))
    learner = TrainingConfig("sarsa", 0.1, 0.9, epsilon=0.3, epsilon_decay=1.0)
    training = scheduled(learner, episodes)
    return ColonyPoint(
        *(pool[0], task(design), training, pool, design.ants),
        episodes=episodes,
        ticks=ticks,
        rollouts=1,
    )


def followed(
    path: Path,
    design: Design,
    learned: ColonyPoint,
    seeds: Sequence[int],
    q_values: np.ndarray,
    ticks: int,
    where: tuple[int | None, str | None],
) -> dict[str, np.ndarray]:
    """Return what `crossings` counts on each bridge while nobody learns; a file keeps it.

    Args:
        path: Of the file (.npz); if it is there, nothing is left to do.
        design, learned: The design, and the point that gave the tables.
        seeds: Of the training.
        q_values: The tables of these seeds, float32 (seeds, n_states, 5).
        ticks: Length of the episode on each bridge, and its half on `LATE`.
        where: Threads and arch, as of a `Colony`.
    """
    from taichi_ants.engines.colony.colony import Colony

    least = learned.training.least_epsilon
    calm = replace(learned.training, epsilon=least, epsilon_decay=1.0)

    def count(bridge: dict[str, Any], some: slice, n: int, opens: int = 0) -> np.ndarray:
        colony = Colony(
            *(double_bridge(**bridge), learned.task, calm),
            [seed + EVALUATION_SEEDS for seed in seeds[some]],
            ants=design.ants,
            sharing="frozen",
            q_values=q_values[some],
            threads=where[0],
            arch=where[1],
            schedule="by_world",
        )
        return crossings(colony, bridge, n, opens)

    def counted() -> dict[str, np.ndarray]:
        found, each = {}, [slice(s, s + 1) for s in range(len(seeds))]
        for name, bridge in bridges(design).items():
            n = length(name, ticks)
            if name == LATE:  # interventions act on colonies of one world
                late = [count(bridge, one, n, ticks) for one in each]
                found[name] = np.concatenate(late, axis=-1)
            else:
                found[name] = count(bridge, slice(None), n)
        return found

    about = {**settings_of([learned], seeds), "design": asdict(design), "ticks": ticks}
    return kept(path, about, counted)


def crossings(colony: Colony, bridge: dict[str, Any], ticks: int, opens: int = 0) -> np.ndarray:
    """Run an episode, and count who has crossed the bridge by which branch.

    An ant has crossed when it comes to one room from the other; its branch is the one in which it
    was last. Foragers come to the food without food, carriers to the queen with food.

    Args:
        colony: On the bridge in all worlds; schedule "by_world", in which ants keep their slots.
        bridge: The arguments of `double_bridge`.
        ticks: Length of the episode.
        opens: Tick after which the short branch, rock until then, can be entered; 0 if it always
            can. Otherwise the colony must have one world.

    Returns:
        int64 (WINDOWS, loads, branches, worlds): foragers then carriers, short branch then long.
    """
    zone, n_worlds = _zones(bridge), len(colony.seeds)
    world = np.repeat(np.arange(n_worlds), colony.capacity)
    counts = np.zeros((WINDOWS, len(LOADS), 2, n_worlds), np.int64)
    room = np.full(len(world), _QUEEN_ROOM)
    branch = np.full(len(world), _SHORT)
    colony.begin_episode(ticks)
    if opens:
        short, interventions = colony.grid.index(branch_cells(**bridge)[0]), Interventions(colony)
        interventions.put(short, OBSTACLE)
    while colony.ticks < ticks:
        if opens and colony.ticks == opens:
            interventions.put(short, EMPTY)
        window = colony.ticks * WINDOWS // ticks
        until = opens if colony.ticks < opens else ticks
        colony.tick(min(_LOOK_EVERY, until - colony.ticks))
        now = zone[colony.cells.ravel()]
        carries = colony.carrying.ravel()
        inside = now <= _FOOD_ROOM
        crossed = inside & (now != room)
        useful = crossed & (carries == (now == _QUEEN_ROOM))
        np.add.at(
            counts[window], (carries[useful].astype(int), branch[useful] - _SHORT, world[useful]), 1
        )
        room = np.where(inside, now, room)
        branch = np.where(inside, branch, now)
    return counts


def _zones(bridge: dict[str, Any]) -> np.ndarray:
    """In which room or branch each cell lies; a junction belongs to its room."""
    grid, junctions = double_bridge(**bridge).grid, junction_cells(**bridge)
    zone = np.full(grid.size, _QUEEN_ROOM)
    pile = junctions[1] + junctions[0]
    zone[grid.distances(tuple(pile.tolist())) <= ROOM_RADIUS + 1] = _FOOD_ROOM
    for number, cells in zip((_SHORT, _LONG), branch_cells(**bridge), strict=True):
        zone[grid.index(cells)] = number
    return zone
