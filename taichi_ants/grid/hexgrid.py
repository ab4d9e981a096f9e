"""Geometry of the hexagonal grid, in NumPy alone.

Cube coordinates (x, y, z) and (x + c, y + c, z + c) are the same cell. Its normal form is the one
with minimum 0; its axial form is q = x - z, r = y - z. Arrays of cells have shape (..., 3). The six
headings run clockwise, heading 0 points up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from taichi_ants.errors import AntsError, as_array
from taichi_ants.grid.constants import HEADING_STEPS

# Arrays cover the whole grid; at four bytes a cell, this many cells take one gibibyte.
MAX_ARRAY_CELLS = 1 << 28

# No world has larger coordinates, and differences of larger ones could overflow 64 bits.
FAR = 1 << 40

_SQRT_3 = math.sqrt(3.0)


def _cells(values: object) -> np.ndarray:
    array = as_array("cells", values, "iu", None, -FAR, FAR)
    return as_array("cells", array, "iu", (*array.shape[:-1], 3)).astype(np.int64)


def normal_form(cells: object) -> np.ndarray:
    """Return cube coordinates shifted so that their minimum is 0, int64 (..., 3)."""
    coordinates = _cells(cells)
    return coordinates - coordinates.min(axis=-1, keepdims=True)


def axial(cells: object) -> np.ndarray:
    """Return the axial coordinates (q, r), int64 (..., 2), of cube coordinates (..., 3)."""
    coordinates = _cells(cells)
    return coordinates[..., :2] - coordinates[..., 2:]


def cube(axials: np.ndarray) -> np.ndarray:
    """Return the normal form, int64 (..., 3), of integer axial coordinates (..., 2) = (q, r)."""
    qr = np.asarray(axials, dtype=np.int64)
    low = np.minimum(qr.min(axis=-1, keepdims=True), 0)
    return np.concatenate([qr - low, -low], axis=-1)


def centre_of(cells: object, size: float) -> np.ndarray:
    """Return the pixel coordinates of the centres of flat-topped hexagons, float64 (..., 2).

    x points right and y points down. `size` is the distance from a centre to a corner. The origin
    is at (0, 0), heading 0 points up, and heading 1 up and to the right.
    """
    qr = axial(cells)
    q, r = qr[..., 0], qr[..., 1]
    return np.stack([1.5 * size * r, _SQRT_3 * size * (0.5 * r - q)], axis=-1)


@dataclass(frozen=True)
class AxialGrid:
    """The cells of a world of `ranges` (X, Y, Z) in a flat array.

    The array covers the axial bounding box and a border of void cells, row by row (r). A step to a
    neighbour is therefore an addition without a bounds check: index = (r + Z) * width + (q + Z).
    Raises AntsError if the array would have more than `MAX_ARRAY_CELLS` cells.
    """

    ranges: tuple[int, int, int]

    def __post_init__(self) -> None:
        if self.size > MAX_ARRAY_CELLS:
            raise AntsError(
                f"ranges are {self.ranges}; such a world needs arrays of {self.size} cells, and "
                f"at most {MAX_ARRAY_CELLS} are allowed, so choose smaller ranges."
            )

    @property
    def width(self) -> int:
        """Number of cells in a row: one for each value of q, and a void cell at each end."""
        return self.ranges[0] + self.ranges[2] + 1

    @property
    def height(self) -> int:
        """Number of rows: the values of r, and a void row at each end."""
        return self.ranges[1] + self.ranges[2] + 1

    @property
    def size(self) -> int:
        """Length of the flat array, void cells included."""
        return self.width * self.height

    @property
    def count(self) -> int:
        """Number of existing cells."""
        x, y, z = self.ranges
        return x * y + y * z + z * x - x - y - z + 1

    @cached_property
    def offsets(self) -> np.ndarray:
        """Change of the flat index in a step, by heading: int32 (6,), read-only."""
        steps = axial(HEADING_STEPS)
        offsets = (steps[:, 0] + steps[:, 1] * self.width).astype(np.int32)
        offsets.setflags(write=False)
        return offsets

    @cached_property
    def exists(self) -> np.ndarray:
        """Whether a flat index belongs to a cell of the world: bool (size,), read-only."""
        x, y, z = self.ranges
        q, r = self.axes()
        # In normal form x = max(0, q, q - r), y = max(0, r, r - q), z = max(0, -q, -r).
        difference = q - r
        inside = (difference < x) & (difference > -y)
        inside &= (q > -z) & (q < x)
        inside &= (r > -z) & (r < y)
        inside.setflags(write=False)
        return inside.reshape(-1)

    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Return q of each column, int32 (1, width), and r of each row, int32 (height, 1)."""
        z = self.ranges[2]
        q = np.arange(-z, self.width - z, dtype=np.int32)
        r = np.arange(-z, self.height - z, dtype=np.int32)
        return q[None, :], r[:, None]

    def index(self, cells: object) -> np.ndarray:
        """Return the flat indices, int32 (...), of cells (..., 3) of the world or its border."""
        qr = axial(cells) + self.ranges[2]
        beyond = ((qr < 0) | (qr >= (self.width, self.height))).any(axis=-1)
        if beyond.any():
            cell = tuple(np.asarray(cells)[beyond][0].tolist())
            raise AntsError(
                f"the cell {cell} is outside the world; give a cell within its ranges, "
                f"{self.ranges}."
            )
        return (qr[..., 1] * self.width + qr[..., 0]).astype(np.int32)

    def cells(self, index: object) -> np.ndarray:
        """Return the normal forms, int32 (..., 3), of flat indices (...)."""
        flat = as_array("index", index, "iu", None, 0, self.size - 1)
        # int32 throughout saves memory: worlds often have millions of cells.
        r, q = np.divmod(flat.astype(np.int32), np.int32(self.width))
        r -= self.ranges[2]
        q -= self.ranges[2]
        low = np.minimum(np.minimum(q, r), np.int32(0))
        return np.stack([q - low, r - low, -low], axis=-1)

    def distances(self, cell: tuple[int, int, int]) -> np.ndarray:
        """Return the steps to `cell` from each flat index, void cells included: int32 (size,)."""
        cell_q, cell_r = axial(cell).astype(np.int32)
        q, r = self.axes()
        q, r = q - cell_q, r - cell_r
        # The coordinates of the difference are (q, r, 0) up to a shift.
        high = np.maximum(np.maximum(q, r), np.int32(0))
        high -= np.minimum(np.minimum(q, r), np.int32(0))
        return high.reshape(-1)

    def closer_to(self, cell: tuple[int, int, int]) -> np.ndarray:
        """Return bit h by index, 1 if the neighbour at heading h is nearer to `cell` (uint8)."""
        distances = self.distances(cell).astype(np.uint8)  # modulo 256, as neighbours differ by 1
        bits = np.zeros(self.size, dtype=np.uint8)
        for heading, offset in enumerate(self.offsets.tolist()):
            is_closer = distances - np.roll(distances, -offset) == 1
            bits |= is_closer.astype(np.uint8) << np.uint8(heading)
        return bits * self.exists

    def number(self, index: np.ndarray) -> np.ndarray:
        """Return the ranks, int32 (...), of flat indices (...) in lexicographic order of cells."""
        _, y_range, z_range = self.ranges
        r, q = np.divmod(index.astype(np.int32), np.int32(self.width))
        r -= z_range
        q -= z_range
        # x = 0 leaves y and z free. Each x > 0 has first y = 0 with any z, then z = 0 with y > 0.
        if_x_is_0, per_x = (r - q) * z_range - q, y_range + z_range - 1
        if_y_is_0 = (q - r - 1) * per_x - r
        if_z_is_0 = (q - 1) * per_x + r + z_range - 1
        further = np.where(r <= 0, if_y_is_0, if_z_is_0) + y_range * z_range
        return np.where(q <= np.minimum(r, 0), if_x_is_0, further)
