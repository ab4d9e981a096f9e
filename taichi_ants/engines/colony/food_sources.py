"""Arrays of food sources, for worlds in which food grows back or wanders."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from taichi_ants.engines.colony.layout import FoodSourceRow, WorldRow
from taichi_ants.task.constants import FOOD
from taichi_ants.worlds.world import World

_GIVEN = [FoodSourceRow.CELL, FoodSourceRow.TAKEN, FoodSourceRow.PILE, FoodSourceRow.KIND]


def arrays(
    sources: Iterable[np.ndarray], rows: np.ndarray, room: int, size: int
) -> dict[str, np.ndarray]:
    """Return the arrays of food sources and piles of all worlds, with `room` sources in each.

    `sources` has for each world the rows `_GIVEN` of `FoodSourceRow`, (4, n).
    Write the numbers of sources and piles into `rows`, (WorldRow, W). A world has `size` cells.
    """
    n_worlds = rows.shape[1]
    food_sources = np.zeros((len(FoodSourceRow), max(1, n_worlds * room)), np.int32)
    begins = np.zeros((n_worlds, room + 1), np.int32)
    food_sources[FoodSourceRow.TAKEN] = -1
    source_of = np.full(n_worlds * size if room else 1, -1, np.int32)
    for w, given in enumerate(sources):
        cells, taken, piles, _ = given
        n_piles = int(piles.max(initial=-1)) + 1
        of_world = food_sources[:, w * room : w * room + len(cells)]
        of_world[_GIVEN] = given
        of_world[FoodSourceRow.LISTED] = np.argsort(piles, kind="stable")
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
    number_at = np.full(grid.size, -1, np.int64)
    number_at[cells] = np.arange(len(cells))
    neighbours = number_at[cells[:, None] + grid.offsets[None, :]]
    rows, columns = np.nonzero(neighbours >= 0)
    links = (rows, neighbours[rows, columns])
    graph = coo_array((np.ones(len(rows), np.int8), links), shape=(len(cells),) * 2)
    _, labels = connected_components(graph, directed=False)
    _, first, numbers = np.unique(labels, return_index=True, return_inverse=True)
    piles = np.argsort(np.argsort(first))[numbers].astype(np.int32)
    return np.stack([cells, np.full(len(cells), -1), piles, world.kinds_by_cell()[cells]])


def of_world(arrays: Mapping[str, np.ndarray], w: int, room: int) -> np.ndarray:
    """Return the present food sources of a world as `arrays` takes them, int (4, n)."""
    n = arrays["worlds"][WorldRow.FOOD_SOURCES, w]
    return arrays["food_sources"][_GIVEN, w * room : w * room + n]


def changed(
    sources: np.ndarray, cells: np.ndarray, what: int, kind: int, offsets: np.ndarray
) -> np.ndarray:
    """Return sources (4, n) with those of new FOOD on cells, or without those under other things.

    A waiting source of a cell gets its food back. A new source joins the pile of the first adjacent
    source, or forms a new pile. The source of the food takes its kind. `offsets` are the grid's.
    """
    gone = () if what == FOOD else cells
    rows = sources[:, ~np.isin(sources[0], gone)].T.tolist()  # cell, taken, pile, kind
    on: dict[int, list[int]] = {}
    for source, (cell, *_) in enumerate(rows):
        on.setdefault(cell, []).append(source)
    for cell in cells.tolist() if what == FOOD else ():
        here = on.setdefault(cell, [])
        if not here:
            around = [source for step in offsets.tolist() for source in on.get(cell + step, ())]
            new_pile = max((pile for _, _, pile, _ in rows), default=-1) + 1
            here.append(len(rows))
            rows.append([cell, 0, rows[min(around)][2] if around else new_pile, kind])
        (full,) = [source for source in here if rows[source][1] < 0] or here[:1]
        rows[full][1], rows[full][3] = -1, kind
    now = np.array(rows, int).reshape(-1, 4).T
    _, now[2] = np.unique(now[2], return_inverse=True)  # without removed piles
    return now
