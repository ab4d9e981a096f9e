"""Geometry of arrays of cells."""

import numpy as np

from taichi_ants.grid.constants import HEADING_STEPS
from taichi_ants.grid.hexgrid import AxialGrid, cube, normal_form


def neighbours(cells: object) -> np.ndarray:
    """Return the six neighbours (..., 6, 3) of cells (..., 3), in the order of the headings."""
    return normal_form(np.asarray(cells)[..., None, :] + np.array(HEADING_STEPS))


def distance(cells: object, others: object) -> np.ndarray:
    """Return the number of steps between cells (..., 3), without regard to obstacles."""
    return normal_form(np.asarray(cells) - np.asarray(others)).max(axis=-1)


def cell_at(pixels: object, size: float) -> np.ndarray:
    """Return the cells at pixel coordinates (..., 2), int64 (..., 3), in normal form.

    This is the inverse of `centre_of`. A point on a border belongs to either cell.
    """
    points = np.asarray(pixels, dtype=np.float64)
    r = points[..., 0] / (1.5 * size)
    q = 0.5 * r - points[..., 1] / (np.sqrt(3.0) * size)
    # Cube rounding: q, -r and r - q sum to zero. After rounding, the coordinate with the largest
    # rounding error is recomputed from the other two.
    exact = np.stack([q, -r, r - q], axis=-1)
    near = np.rint(exact)
    moved = np.abs(near - exact)
    fixes_q = (moved[..., 0] > moved[..., 1]) & (moved[..., 0] > moved[..., 2])
    fixes_r = ~fixes_q & (moved[..., 1] > moved[..., 2])
    whole_q = np.where(fixes_q, -near[..., 1] - near[..., 2], near[..., 0])
    whole_r = np.where(fixes_r, near[..., 0] + near[..., 2], -near[..., 1])
    return cube(np.stack([whole_q, whole_r], axis=-1).astype(np.int64))


def exist(grid: AxialGrid, cells: object) -> np.ndarray:
    """Return whether cells (..., 3) are in the world, bool (...)."""
    return np.all(normal_form(cells) < np.array(grid.ranges), axis=-1)
