"""Arrays of food sources, for worlds in which food grows back or wanders."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from taichi_ants.engines.colony.layout import FoodSourceRow, WorldRow
from taichi_ants.worlds.world import World


def arrays(
    sources: Iterable[np.ndarray], rows: np.ndarray, room: int, size: int
) -> dict[str, np.ndarray]:
    """Return the arrays of food sources and piles of all worlds, with `room` sources in each.

    `sources` has for each world the rows CELL, TAKEN, PILE and KIND of `FoodSourceRow`, (4, n).
    Write the numbers of sources and piles into `rows`, (WorldRow, W). A world has `size` cells.
    """
    n_worlds = rows.shape[1]
    food_sources = np.zeros((len(FoodSourceRow), max(1, n_worlds * room)), np.int32)
    begins = np.zeros((n_worlds, room + 1), np.int32)
    food_sources[FoodSourceRow.TAKEN] = -1
    source_of = np.full(n_worlds * size if room else 1, -1, np.int32)
    for w, (cells, taken, piles, kinds) in enumerate(sources):
        n_piles = int(piles.max(initial=-1)) + 1
        of_world = food_sources[:, w * room : w * room + len(cells)]
        of_world[FoodSourceRow.CELL], of_world[FoodSourceRow.TAKEN] = cells, taken
        of_world[FoodSourceRow.KIND] = kinds
        of_world[FoodSourceRow.PILE], of_world[FoodSourceRow.LISTED] = (
            piles,
            np.argsort(piles, kind="stable"),
        )
        begins[w, 1 : n_piles + 1] = np.cumsum(np.bincount(piles, minlength=n_piles))
        rows[WorldRow.FOOD_SOURCES, w], rows[WorldRow.PILES, w] = len(cells), n_piles
        (full,) = np.nonzero(taken < 0)
        source_of[w * size + cells[full]] = w * room + full
    return {
        "food_sources": food_sources,
        # By world: the first place of each pile in the row FoodSourceRow.LISTED.
        "piles": begins.reshape(-1),
        # By cell: the column in `food_sources` of the food in it, or -1.
        "source_of": source_of,
    }


def at_start(world: World) -> np.ndarray:
    """Return the food sources of a world for `arrays`, int (4, n), one per food item.

    A pile consists of connected cells. Piles are numbered in the order of their first cells.
    """
    from scipy.sparse import coo_array  # takes a while to import
    from scipy.sparse.csgraph import connected_components

    grid, cells = world.grid, world.grid.index(world.foods)
    place = np.full(grid.size, -1, np.int64)
    place[cells] = np.arange(len(cells))
    neighbours = place[cells[:, None] + grid.offsets[None, :]]
    rows, columns = np.nonzero(neighbours >= 0)
    links = (rows, neighbours[rows, columns])
    graph = coo_array((np.ones(len(rows), np.int8), links), shape=(len(cells),) * 2)
    _, labels = connected_components(graph, directed=False)
    _, first, numbers = np.unique(labels, return_index=True, return_inverse=True)
    piles = np.argsort(np.argsort(first))[numbers].astype(np.int32)
    return np.stack([cells, np.full(len(cells), -1), piles, world.kinds_by_cell()[cells]])
