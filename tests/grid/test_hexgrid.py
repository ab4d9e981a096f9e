"""The geometry of the grid against values worked by hand, and its laws."""

import math

import numpy as np
import pytest
from hexagons import neighbours
from hypothesis import given
from hypothesis import strategies as st

from taichi_ants.errors import AntsError
from taichi_ants.grid import hexgrid
from taichi_ants.grid.constants import HEADING_STEPS
from taichi_ants.grid.hexgrid import AxialGrid


def test_existing_cells_are_those_of_the_definition() -> None:
    ranges = (3, 2, 4)
    expected = {
        (x, y, z)
        for x in range(3)
        for y in range(2)
        for z in range(4)
        if min(x, y, z) == 0  # normal forms within the ranges
    }
    grid = AxialGrid(ranges)
    found = grid.cells(np.flatnonzero(grid.exists))
    assert set(map(tuple, found.tolist())) == expected
    assert len(found) == len(expected)


def test_flat_index_by_hand() -> None:
    grid = AxialGrid((3, 2, 4))
    assert (grid.width, grid.height, grid.size) == (8, 7, 56)
    # The origin is at q = r = 0: row Z = 4, column Z = 4.
    assert grid.index((0, 0, 0)) == 4 * 8 + 4
    assert grid.index((2, 0, 0)) == 4 * 8 + 6
    assert grid.index((1, 1, 4)) == 1 * 8 + 1
    # Up is one to the right in the array, down-right one row on.
    assert grid.offsets.tolist() == [1, 9, 8, -1, -9, -8]
    assert grid.cells(4 * 8 + 6).tolist() == [2, 0, 0]
    assert grid.index([(0, 0, 0)]).dtype == grid.cells([36]).dtype == grid.offsets.dtype == np.int32


@pytest.mark.parametrize("size", [1.0, 7.5])
def test_pixels_of_headings(size: float) -> None:
    height = math.sqrt(3.0) * size
    centres = hexgrid.centre_of(HEADING_STEPS, size)
    # y grows downwards: heading 0 is straight up, heading 1 up and to the right.
    expected = [
        (0, -height),
        (1.5 * size, -height / 2),
        (1.5 * size, height / 2),
        (0, height),
        (-1.5 * size, height / 2),
        (-1.5 * size, -height / 2),
    ]
    np.testing.assert_allclose(centres, expected, atol=1e-12)
    np.testing.assert_allclose(hexgrid.centre_of((0, 0, 0), size), (0, 0))


@pytest.mark.parametrize(
    "cells", [(1.0, 2, 3), ("1", "2", "3"), (1, 2), 5, [], [[1, 2, 3, 4]], np.zeros((2, 3))]
)
def test_cells_must_be_three_whole_numbers(cells: object) -> None:
    for function in (hexgrid.normal_form, hexgrid.axial):
        with pytest.raises(AntsError, match="whole numbers"):
            function(cells)


def test_cells_beyond_the_array_are_refused() -> None:
    grid = AxialGrid((3, 3, 1))
    grid.index((0, 0, 1))  # a void border cell has an index
    with pytest.raises(AntsError, match=r"\(9, 0, 0\).*\(3, 3, 1\)"):
        grid.index([(0, 0, 0), (9, 0, 0)])
    for index in (-1, grid.size, 1.0):
        with pytest.raises(AntsError, match=r"^index .*; (all must lie betw|it must be an array)"):
            grid.cells([index])


coordinates = st.integers(-1000, 1000)
cells = st.tuples(coordinates, coordinates, coordinates)
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
    assert grid.number(grid.index(cells_there)).tolist() == list(range(grid.count))
