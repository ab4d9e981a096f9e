"""Colonies on the double bridge: training, evaluation, and counts of crossings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.analysis.bridge import LATE, LOADS, WINDOWS, Design, bridges, length
from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.studies.blocks import kept
from taichi_ants.studies.colony_study import scheduled
from taichi_ants.studies.points import ColonyPoint, settings_of
from taichi_ants.task import Life, Task, foraging, queueing
from taichi_ants.task.constants import EMPTY, OBSTACLE
from taichi_ants.worlds import double_bridge
from taichi_ants.worlds.double_bridge import ROOM_RADIUS, branch_cells, junction_cells

if TYPE_CHECKING:
    from taichi_ants.engines.colony.colony import Colony

REACH = 50  # number of ticks for which an ant lays a trail
_LOOK_EVERY = 4  # ticks; all branches are longer, so no crossing is missed
_RULES = {"queueing": queueing, "foraging": foraging}
_QUEEN_ROOM, _FOOD_ROOM, _SHORT, _LONG = range(4)


def task(design: Design) -> Task:
    """Return the rules of a design; food grows back at once."""
    rules, kind = _RULES[design.rules](), design.evaporation
    evaporation: dict[str, Any] = {"evaporation": kind}
    if kind.isdecimal():
        evaporation = {"evaporation": "exponential", "half_life": float(kind)}
    trail = replace(rules.pheromone, level=REACH * design.slope, slope=design.slope, **evaporation)
    return replace(rules, pheromone=trail, life=Life(regrowth=0))


def point(design: Design, episodes: int, ticks: int) -> ColonyPoint:
    """Return the training of colonies of a design.

    The short branch is on the right in about half of the episodes and on the left in the others, so
    colonies cannot learn its side.
    """
    right, left, *_ = bridges(design).values()
    pool = double_bridge(**right), double_bridge(**left)
    training = scheduled(TrainingConfig("sarsa", 0.1, 0.9, 0.3, 1.0), episodes)
    several = pool[0], task(design), training, pool, design.ants
    return ColonyPoint(*several, episodes=episodes, ticks=ticks, rollouts=1)


def followed(
    path: Path,
    design: Design,
    learned: ColonyPoint,
    seeds: Sequence[int],
    q_values: np.ndarray,
    ticks: int,
    where: Mapping[str, Any],
) -> dict[str, np.ndarray]:
    """Return the `crossings` of trained colonies on each bridge; save them in `path` or read them.

    Training in the point `learned` gave the tables `q_values`, float32 (seeds, n_states, 5). An
    episode has `ticks`, twice as many on `LATE`; `where` has the arguments `threads` and `arch`.
    """

    def counted() -> dict[str, np.ndarray]:
        found = {}
        for name, bridge in bridges(design).items():
            late, parts, world = name == LATE, [], double_bridge(**bridge)
            # Interventions need a colony with a single world.
            each = [slice(s, s + 1) for s in range(len(seeds))] if late else [slice(None)]
            for some in each:
                given = world, seeds[some], q_values[some], False
                colony = learned.colony(*given, schedule="by_world", **where)
                parts.append(crossings(colony, bridge, length(name, ticks), ticks if late else 0))
            found[name] = np.concatenate(parts, axis=-1)
        return found

    about = {**settings_of([learned], seeds), "design": asdict(design), "ticks": ticks}
    return kept(path, about, counted)


def crossings(colony: Colony, bridge: dict[str, Any], ticks: int, opens: int = 0) -> np.ndarray:
    """Run an episode, and count the crossings of the bridge by branch.

    An ant crosses when it enters one room and was in the other before; its branch is the last one
    that it was in. Only foragers that enter the food room and carriers that enter the queen's room
    count. Rock closes the short branch until tick `opens`, which must be 0 if there are several
    worlds. The colony has the schedule "by_world", in which ants keep their slots; `bridge` has the
    arguments of `double_bridge`.

    Returns:
        int64 (WINDOWS, loads, branches, worlds): foragers then carriers, short branch then long.
    """
    zone, n_worlds = _zones(bridge), len(colony.seeds)
    world = np.repeat(np.arange(n_worlds), colony.capacity)
    counts = np.zeros((WINDOWS, len(LOADS), 2, n_worlds), np.int64)
    room, branch = np.full(len(world), _QUEEN_ROOM), np.full(len(world), _SHORT)
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
        carries, inside = colony.carrying.ravel(), now <= _FOOD_ROOM
        useful = inside & (now != room) & (carries == (now == _QUEEN_ROOM))
        where = carries[useful].astype(int), branch[useful] - _SHORT, world[useful]
        np.add.at(counts[window], where, 1)
        room = np.where(inside, now, room)
        branch = np.where(inside, branch, now)
    return counts


def _zones(bridge: dict[str, Any]) -> np.ndarray:
    """Return the room or branch of each cell; a junction belongs to its room."""
    grid, junctions = double_bridge(**bridge).grid, junction_cells(**bridge)
    zone = np.full(grid.size, _QUEEN_ROOM)
    pile = junctions[1] + junctions[0]
    zone[grid.distances(tuple(pile.tolist())) <= ROOM_RADIUS + 1] = _FOOD_ROOM
    for number, cells in zip((_SHORT, _LONG), branch_cells(**bridge), strict=True):
        zone[grid.index(cells)] = number
    return zone
