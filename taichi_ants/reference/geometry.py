"""Cells of the hexagonal grid as plain tuples (x, y, z) of cube coordinates.

(x, y, z) and (x + c, y + c, z + c) are the same cell. Functions return its normal form, in which
the smallest coordinate is 0. The keys of dictionaries are normal forms, too.
"""

from __future__ import annotations

import numpy as np

from taichi_ants.grid.constants import HEADING_STEPS, N_HEADINGS
from taichi_ants.worlds.world import World

Cell = tuple[int, int, int]


def normal_form(x: int, y: int, z: int) -> Cell:
    """Return the coordinates of the cell (x, y, z) of which the smallest is 0."""
    low = min(x, y, z)
    return (x - low, y - low, z - low)


def neighbour(cell: Cell, heading: int) -> Cell:
    """Return the cell one step from `cell`; a heading outside 0..5 is taken modulo 6."""
    x, y, z = cell
    dx, dy, dz = HEADING_STEPS[heading % N_HEADINGS]
    return normal_form(x + dx, y + dy, z + dz)


def distance(a: Cell, b: Cell) -> int:
    """Return the number of steps from `a` to `b` on a grid without obstacles."""
    # Each step along one axis, or along two at once, lowers the largest coordinate by one.
    return max(normal_form(a[0] - b[0], a[1] - b[1], a[2] - b[2]))


def existing_cells(ranges: tuple[int, int, int]) -> list[Cell]:
    """Return all cells of a world of these ranges in lexicographic order of (x, y, z)."""
    size_x, size_y, size_z = ranges
    cells = {(0, y, z) for y in range(size_y) for z in range(size_z)}
    cells |= {(x, 0, z) for x in range(size_x) for z in range(size_z)}
    cells |= {(x, y, 0) for x in range(size_x) for y in range(size_y)}
    return sorted(cells)


def listed_cells(rows: np.ndarray) -> list[Cell]:
    """Return cells that a world lists, int (n, 3) with each row in normal form, as tuples."""
    return [(x, y, z) for x, y, z in rows.tolist()]


def queens_of(world: World) -> list[Cell]:
    return [world.queen, *listed_cells(world.other_queens)]


def kinds_of_food(world: World) -> dict[Cell, int]:
    """Return the kind of the food in each cell with food at the start."""
    cells = listed_cells(world.foods)
    return dict(zip(cells, world.food_kinds.tolist() or [0] * len(cells), strict=True))
