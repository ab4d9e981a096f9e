"""Pixels and cells: the way there and back, and what a picture shows where."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taichi_ants.errors import AntsError
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.rendering import Viewport
from taichi_ants.rendering.rasteriser import Rasteriser

RANGES = st.tuples(*[st.integers(1, 9)] * 3)


def existing(grid: AxialGrid) -> np.ndarray:
    return np.flatnonzero(grid.exists).astype(np.int32)


@settings(max_examples=60, deadline=None)
@given(RANGES, st.integers(64, 900), st.integers(64, 900))
def test_the_middle_of_a_cell_shows_that_cell(ranges, width, height) -> None:
    grid = AxialGrid(ranges)
    view = Viewport.fit(grid, width, height, margin=3)
    index = existing(grid)
    centres = view.centres(grid.cells(index))
    assert (view.index_at(grid, centres) == index).all()
    # Everything lies within the margin, and touches it on two opposite sides.
    reach = np.array([view.hexagon, np.sqrt(3) / 2 * view.hexagon])
    low, high = (centres - reach).min(axis=0), (centres + reach).max(axis=0)
    free = np.concatenate([low, (width, height) - high])
    assert free.min() == pytest.approx(3)
    assert free[0] == pytest.approx(free[2])
    assert free[1] == pytest.approx(free[3])


@settings(max_examples=60, deadline=None)
@given(RANGES, st.integers(0, 2**32 - 1))
def test_a_pixel_shows_the_cell_whose_middle_is_nearest(ranges, seed) -> None:
    grid = AxialGrid(ranges)
    view = Viewport.fit(grid, 300, 200)
    pixels = np.random.default_rng(seed).uniform((0, 0), (300, 200), (200, 2))
    index = existing(grid)
    centres = view.centres(grid.cells(index))
    away = np.linalg.norm(pixels[:, None] - centres, axis=2)
    found = view.index_at(grid, pixels)
    inside = found >= 0
    assert (away.min(axis=1)[~inside] > 0.8 * view.hexagon).all()
    own = away[np.arange(200)[inside], np.searchsorted(index, found[inside])]
    assert own == pytest.approx(away.min(axis=1)[inside])


def test_headings_on_the_page() -> None:
    """Worked by hand: heading 0 is straight up, and they run clockwise."""
    view = Viewport(400, 400, 20.0, (200.0, 200.0))
    half, side = 10 * np.sqrt(3), 30.0
    assert view.centres((0, 0, 0)).tolist() == [200, 200]
    around = [(1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), (1, 0, 1)]
    expected = [
        (200, 200 - 2 * half),
        (200 + side, 200 - half),
        (200 + side, 200 + half),
        (200, 200 + 2 * half),
        (200 - side, 200 + half),
        (200 - side, 200 - half),
    ]
    assert view.centres(around) == pytest.approx(np.array(expected))


@pytest.mark.parametrize(("ranges", "size"), [((3, 5, 2), (400, 300)), ((7, 2, 4), (130, 90))])
def test_the_picture_agrees_with_the_mapping(ranges, size) -> None:
    """Each pixel well inside a cell has the colour of the cell that the mapping names.

    The world is not symmetric, so a picture that is mirrored, turned or transposed disagrees.
    """
    grid = AxialGrid(ranges)
    width, height = size
    view = Viewport.fit(grid, width, height, margin=2)
    of_cells = np.full(grid.size, 0xFFFFFF, dtype=np.uint32)
    of_cells[existing(grid)] = 0x010000 * np.arange(1, grid.count + 1)
    frame = Rasteriser(grid, view).draw_cells(of_cells)

    def share_that_agrees(picture: np.ndarray) -> float:
        places = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1) + 0.5
        index = view.index_at(grid, places)
        away = np.linalg.norm(places - view.centres(grid.cells(np.maximum(index, 0))), axis=2)
        clear = (index >= 0) & (away < 0.6 * view.hexagon)
        expected = of_cells[index[clear]] >> 16
        return float((picture[clear][:, 0] == expected).mean())

    assert share_that_agrees(frame) == 1.0
    assert share_that_agrees(frame[::-1]) < 0.6
    assert share_that_agrees(frame[:, ::-1]) < 0.6
    assert share_that_agrees(frame[::-1, ::-1]) < 0.6


@pytest.mark.parametrize("pixels", ["x", (1,), None, [["a", "b"]]])
def test_what_are_no_coordinates_is_refused(pixels):
    with pytest.raises(AntsError, match=r"pixels is .*give coordinates"):
        Viewport.fit(AxialGrid((4, 4, 4)), 90, 90).cell_at(pixels)
