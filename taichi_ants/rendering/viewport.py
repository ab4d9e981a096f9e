"""Where the cells of a world lie in a picture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from taichi_ants.grid import hexgrid
from taichi_ants.grid.hexgrid import AxialGrid

_SQRT_3 = math.sqrt(3.0)


@dataclass(frozen=True)
class Viewport:
    """Where a picture shows the cells of a world.

    Pixel coordinates are x to the right and y downwards; the pixel in column i and row j has its
    centre at (i + 0.5, j + 0.5).

    Attributes:
        width, height: Of the picture, in pixels.
        hexagon: Pixels from a hexagon's centre to its corners.
        origin: Pixel coordinates of the centre of the cell (0, 0, 0).
    """

    width: int
    height: int
    hexagon: float
    origin: tuple[float, float]

    @classmethod
    def fit(cls, grid: AxialGrid, width: int, height: int, margin: float = 0.0) -> Viewport:
        """The viewport that shows the world whole, centred, and as large as possible.

        Args:
            grid: The world's grid.
            width, height: Of the picture, in pixels.
            margin: Pixels to leave free at each side.
        """
        x_range, y_range, z_range = grid.ranges
        # The lowest and the highest (x, y), in sizes of a hexagon from the origin. By
        # `hexgrid.centre_of`, x grows with y and falls with z, y falls with x.
        low = np.array([-1.5 * (z_range - 1) - 1, -_SQRT_3 * (x_range - 0.5)])
        high = np.array([1.5 * (y_range - 1) + 1, _SQRT_3 * (y_range + z_range - 1) / 2])
        room = np.array([max(width - 2 * margin, 1.0), max(height - 2 * margin, 1.0)])
        hexagon = float((room / (high - low)).min())
        x, y = (np.array([width, height]) / 2 - hexagon * (low + high) / 2).tolist()
        return cls(width, height, hexagon, (x, y))

    def centres(self, cells: object) -> np.ndarray:
        """Pixel coordinates, float64 (..., 2), of the centres of cells (..., 3) in any form."""
        return hexgrid.centre_of(cells, self.hexagon) + np.array(self.origin)
