"""Arrays that follow from where the queen, the food and the obstacles are."""

from __future__ import annotations

import numpy as np

from taichi_ants.grid.constants import HEADING_STEPS
from taichi_ants.grid.hexgrid import AxialGrid, axial
from taichi_ants.task.constants import EMPTY

# Which cells of a 3 x 3 window (rows r, columns q) are neighbours on the hexagonal grid.
_NEIGHBOURS = np.array([[1, 1, 0], [1, 1, 1], [0, 1, 1]])


def distances(grid: AxialGrid, cell: tuple[int, int, int]) -> np.ndarray:
    """int32 (grid.size,): steps from each cell of the world to `cell`; 0 outside."""
    everywhere = _distances_with_border(grid, cell)
    everywhere[~grid.exists.reshape(everywhere.shape)] = 0
    return everywhere.reshape(-1)


def closer(grid: AxialGrid, cell: tuple[int, int, int]) -> np.ndarray:
    """uint8 (grid.size,): bit h is set if the neighbour at heading h is nearer to `cell`."""
    everywhere = _distances_with_border(grid, cell)
    inner = everywhere[1:-1, 1:-1]
    bits = np.zeros((grid.height, grid.width), dtype=np.uint8)
    for heading, (x, y, z) in enumerate(HEADING_STEPS):
        q, r = x - z, y - z
        neighbour = everywhere[1 + r : grid.height - 1 + r, 1 + q : grid.width - 1 + q]
        bits[1:-1, 1:-1] |= (neighbour < inner).astype(np.uint8) << np.uint8(heading)
    bits[~grid.exists.reshape(bits.shape)] = 0
    return bits.reshape(-1)


def walkable(grid: AxialGrid, ground: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """bool (grid.size,): empty cells to which a way over empty cells leads.

    Args:
        grid: The world's grid.
        ground: uint8 (grid.size,), what the cells hold.
        starts: Flat indices of cells; the way begins on any of them that is empty.
    """
    # Importing scipy.ndimage takes longer than all else here, and most worlds never need it.
    from scipy.ndimage import label

    regions, _ = label(ground.reshape(grid.height, grid.width) == EMPTY, structure=_NEIGHBOURS)
    regions = regions.reshape(-1)
    home = regions[starts]
    return np.isin(regions, home[home > 0])


def reachable(
    grid: AxialGrid, ground: np.ndarray, start: tuple[int, int, int], targets: np.ndarray
) -> np.ndarray:
    """bool (n,): which targets, cells int32 (n, 3), have a neighbour to which a way leads.

    The way leads over empty cells and begins on any empty neighbour of the cell `start`.
    """
    found = walkable(grid, ground, grid.index(start) + grid.offsets)
    return np.any(found[grid.index(targets)[:, None] + grid.offsets], axis=1)


def _distances_with_border(grid: AxialGrid, cell: tuple[int, int, int]) -> np.ndarray:
    """int32 (height, width): steps to `cell` from every place of the array, void ones too."""
    q, r = grid.axes()
    cell_q, cell_r = axial(cell).astype(np.int32)
    q, r = q - cell_q, r - cell_r
    # The coordinates of the difference are (q, r, 0) up to a shift.
    high = np.maximum(np.maximum(q, r), np.int32(0))
    high -= np.minimum(np.minimum(q, r), np.int32(0))
    return high
