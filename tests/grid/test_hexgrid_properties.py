"""Laws of the hexagonal grid, over random cells and ranges."""

import numpy as np
from hexagons import neighbours
from hypothesis import given
from hypothesis import strategies as st

from taichi_ants.grid import hexgrid
from taichi_ants.grid.hexgrid import AxialGrid

coordinates = st.integers(-1000, 1000)
cells = st.tuples(coordinates, coordinates, coordinates)
headings = st.integers(0, 5)
ranges = st.tuples(*[st.integers(1, 12)] * 3)


@given(cells, coordinates)
def test_normal_form_is_idempotent_and_blind_to_shifts(cell: tuple, shift: int) -> None:
    normal = hexgrid.normal_form(cell)
    assert normal.min() == 0
    assert (hexgrid.normal_form(normal) == normal).all()
    assert (hexgrid.normal_form(np.array(cell) + shift) == normal).all()
    assert (hexgrid.cube(hexgrid.axial(cell)) == normal).all()


@given(ranges)
def test_flat_indices_and_back(world_ranges: tuple) -> None:
    grid = AxialGrid(world_ranges)
    every = np.arange(grid.size)
    assert (grid.index(grid.cells(every)) == every).all()
    assert ((grid.cells(every) < world_ranges).all(axis=1) == grid.exists).all()
    assert grid.exists.sum() == grid.count


@given(ranges)
def test_offsets_are_steps_and_the_border_is_void(world_ranges: tuple) -> None:
    grid = AxialGrid(world_ranges)
    page = grid.exists.reshape(grid.height, grid.width)
    assert not page[[0, -1]].any()
    assert not page[:, [0, -1]].any()
    assert page[1:-1].any(axis=1).all()  # no row and no column is wasted
    assert page[:, 1:-1].any(axis=0).all()
    index = np.flatnonzero(grid.exists)
    stepped = grid.index(neighbours(grid.cells(index)))
    assert (stepped == index[:, None] + grid.offsets).all()


@given(ranges)
def test_numbers_count_the_cells_in_lexicographic_order(world_ranges: tuple) -> None:
    grid = AxialGrid(world_ranges)
    cells_there = sorted(map(tuple, grid.cells(np.flatnonzero(grid.exists)).tolist()))
    assert grid.number(cells_there).tolist() == list(range(grid.count))
