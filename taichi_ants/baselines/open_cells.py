"""The open cells of a world as a graph, and the shortest path to food, for published models."""

from __future__ import annotations

import numpy as np

from taichi_ants.arguments import checked_world
from taichi_ants.errors import AntsError
from taichi_ants.task.constants import EMPTY, FOOD, QUEEN
from taichi_ants.worlds.world import World


def open_cells(world: World) -> tuple[np.ndarray, np.ndarray, np.ndarray, int, int]:
    """Return the graph of cells without rock, which include the queen and food.

    Returns:
        Flat indices of the cells, int64 (n,); the numbers of their neighbours, int32 (n, 6), -1 if
        missing; 1 for cells with food, int32 (n,); the queen's number; steps to the nearest food.

    Raises:
        AntsError: `world` is not a World, or no food is reachable.
    """
    ground = checked_world(world, True, "a published model", ()).ground()
    cells = np.flatnonzero(np.isin(ground, (EMPTY, FOOD, QUEEN)))
    number = np.full(ground.size, -1, np.int32)
    number[cells] = np.arange(len(cells), dtype=np.int32)
    neighbours = number[cells[:, None] + world.grid.offsets]
    is_food = (ground[cells] == FOOD).astype(np.int32)
    start = int(number[world.grid.index(world.queen)])

    seen = np.zeros(len(cells) + 1, bool)  # the last element is for the missing neighbour, -1
    seen[-1] = True
    layer, steps = np.array([start]), 0
    while not is_food[layer].any():
        seen[layer] = True
        around = np.unique(neighbours[layer])
        layer, steps = around[~seen[around]], steps + 1
        if not len(layer):
            raise AntsError("no food can be reached from the queen; use a world with a free path.")
    return cells, neighbours, is_food, start, steps
