"""The paths of ants with food: their length, and its ratio to the shortest path."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.task.constants import FOOD, OBSTACLE, QUEEN

if TYPE_CHECKING:
    from taichi_ants.engines.records import Snapshot
    from taichi_ants.worlds.world import World


def path_length(snapshot: Snapshot) -> float:
    """Return the mean ticks from pick-up to delivery, of all loads delivered in the episode.

    An ant that walks straight to the queen from a pick-up k moves away from her needs k + 1 ticks.
    The value is nan before the first delivery.
    """
    counts = snapshot.counts
    return counts["carried"] / counts["deliveries"] if counts["deliveries"] else math.nan


def path_ratio(snapshot: Snapshot) -> float:
    """Return `path_length` divided by the fewest ticks that a load of this world needs, at least 1.

    The fewest ticks are those of `shortest_path`. The value is nan before the first delivery.
    """
    shortest = math.nan if snapshot.world is None else shortest_path(snapshot.world)
    return path_length(snapshot) / shortest


@lru_cache(maxsize=256)
def shortest_path(world: World) -> float:
    """Return the fewest ticks from pick-up to delivery for the nearest food item of a world.

    It is d - 1, at least 1, where d is the number of steps from the food to the queen around
    obstacles, through cells that are empty or hold food. An ant picks up food from a neighbour
    cell and delivers it to a neighbour cell. Turns and other ants can make the path longer. The
    value is nan if the queen has no path to food.
    """
    ground = world.ground()
    steps = steps_to(world, np.flatnonzero(ground == QUEEN))
    reached = steps[(ground == FOOD) & (steps > 0)]
    return max(1.0, float(reached.min()) - 1) if len(reached) else math.nan


def steps_to(world: World, goals: np.ndarray) -> np.ndarray:
    """Return the steps from each cell to the nearest goal around obstacles, -1 if there is no way.

    `goals` are flat indices; the result is int32 (grid.size,).
    """
    offsets = world.grid.offsets.astype(np.int64)
    steps = np.full(world.grid.size, -1, np.int32)
    closed = world.ground() == OBSTACLE
    reached, distance = np.asarray(goals, np.int64), 0
    while len(reached):
        steps[reached] = distance
        reached = np.unique(reached[:, None] + offsets)
        reached = reached[(steps[reached] < 0) & ~closed[reached]]
        distance += 1
    return steps
