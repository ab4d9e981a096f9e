"""The cells of a world that models of others walk over, numbered, and the shortest way on them."""

from __future__ import annotations

import numpy as np

from taichi_ants.errors import AntsError
from taichi_ants.task.constants import EMPTY, FOOD, QUEEN
from taichi_ants.worlds.world import World


def open_cells(world: World) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """All cells that are no rock, those of the queen and of food among them.

    Returns:
        Flat indices int64 (n,); the numbers of their neighbours int32 (n, 6), -1 where there is
        none; which hold food, int32 (n,); the number of the queen's cell.
    """
    ground = world.ground()
    cells = np.flatnonzero(np.isin(ground, (EMPTY, FOOD, QUEEN)))
    number = np.full(ground.size, -1, np.int32)
    number[cells] = np.arange(len(cells), dtype=np.int32)
    neighbours = number[cells[:, None] + world.grid.offsets]
    is_food = (ground[cells] == FOOD).astype(np.int32)
    return cells, neighbours, is_food, int(number[world.grid.index(world.queen)])


def shortest_way(neighbours: np.ndarray, is_food: np.ndarray, start: int) -> int:
    """Steps to the nearest food, breadth first; AntsError if there is no way."""
    seen = np.zeros(len(neighbours) + 1, bool)
    seen[-1] = True  # no neighbour
    layer, steps = np.array([start]), 0
    while len(layer):
        if is_food[layer].any():
            return steps
        seen[layer] = True
        around = np.unique(neighbours[layer])
        layer, steps = around[~seen[around]], steps + 1
    raise AntsError("no food can be reached from the queen; give the world a way.")
