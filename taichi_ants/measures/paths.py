"""The shortest path of ants with food."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.task.constants import FOOD, OBSTACLE, QUEEN

if TYPE_CHECKING:
    from taichi_ants.worlds.world import World


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
