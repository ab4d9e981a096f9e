"""How far cells are from one, and which can be walked to."""

from __future__ import annotations

import numpy as np

from taichi_ants.grid.hexgrid import AxialGrid, axial
from taichi_ants.task.constants import EMPTY

# Which cells of a 3 x 3 window (rows r, columns q) are neighbours on the hexagonal grid.
_NEIGHBOURS = np.array([[1, 1, 0], [1, 1, 1], [0, 1, 1]])


def walkable(grid: AxialGrid, ground: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """bool (grid.size,): empty cells that can be reached from an empty one of `starts`."""
    # Importing scipy.ndimage takes longer than all else here, and most worlds never need it.
    from scipy.ndimage import label

    regions, _ = label(ground.reshape(grid.height, grid.width) == EMPTY, structure=_NEIGHBOURS)
    regions = regions.reshape(-1)
    home = regions[starts]
    return np.isin(regions, home[home > 0])


def distances(grid: AxialGrid, cell: tuple[int, int, int]) -> np.ndarray:
    """int32 (grid.size,): steps to `cell` from every place of the array, void ones too."""
    q, r = grid.axes()
    cell_q, cell_r = axial(cell).astype(np.int32)
    q, r = q - cell_q, r - cell_r
    # The coordinates of the difference are (q, r, 0) up to a shift.
    high = np.maximum(np.maximum(q, r), np.int32(0))
    high -= np.minimum(np.minimum(q, r), np.int32(0))
    return high.reshape(-1)
