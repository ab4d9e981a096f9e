"""What the kernels draw, against a slow picture made of many samples, and a stored one."""

from __future__ import annotations

import dataclasses
import time
from pathlib import Path

import numpy as np
import pytest
from hexagons import neighbours
from PIL import Image

from taichi_ants import runtime
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.rendering import Scene, Snapshot, Viewport, at_start, colours
from taichi_ants.rendering.rasteriser import Rasteriser
from taichi_ants.worlds import World, paper

GOLDEN = Path(__file__).parent / "golden" / "world.png"


def sampled(grid: AxialGrid, view: Viewport, of_cells: np.ndarray, samples: int) -> np.ndarray:
    """The picture as the mean of samples * samples points of each pixel, float (h, w, 3)."""
    places = (np.arange(samples) + 0.5) / samples
    total = np.zeros((view.height, view.width, 3))
    columns, rows = np.meshgrid(np.arange(view.width), np.arange(view.height))
    for dy in places:
        for dx in places:
            index = view.index_at(grid, np.stack([columns + dx, rows + dy], axis=-1))
            words = np.where(index >= 0, of_cells[np.maximum(index, 0)], colours.PAGE)
            total += colours.channels(words)
    return total / samples**2


def drawn(grid: AxialGrid, view: Viewport, of_cells: np.ndarray) -> np.ndarray:
    return Rasteriser(grid, view).draw_cells(of_cells)


def random_colours(grid: AxialGrid, seed: int = 0) -> np.ndarray:
    of_cells = np.random.default_rng(seed).integers(0, 1 << 24, grid.size).astype(np.uint32)
    of_cells[~grid.exists] = colours.PAGE
    return of_cells


def test_edges_are_smooth() -> None:
    # At this size there are no lines between cells, so the picture is the plain mean.
    grid = AxialGrid((9, 12, 7))
    view = Viewport(90, 80, 2.7, (40.3, 45.1))
    of_cells = random_colours(grid)
    error = np.abs(drawn(grid, view, of_cells) - sampled(grid, view, of_cells, 8))
    # Where three cells meet in a pixel only two of them count.
    assert error.mean() < 4.0
    assert np.percentile(error, 95) < 25.0


def test_a_straight_edge_is_exact() -> None:
    # Two cells, one above the other, of 30 pixels: the edge between them is covered by a line of
    # 0.09 * 30 - 0.25 = 2.45 pixels, so the rows above and below show how much of them it covers.
    grid = AxialGrid((2, 1, 1))
    view = Viewport(80, 120, 30.0, (40.0, 80.25))
    of_cells = np.zeros(grid.size, dtype=np.uint32)
    of_cells[~grid.exists] = colours.PAGE
    column = drawn(grid, view, of_cells)[:, 40, 0] / 255
    edge = 80.25 - 15 * np.sqrt(3)
    rows = np.arange(120)
    line = np.clip(np.minimum(rows + 1, edge + 1.225) - np.maximum(rows, edge - 1.225), 0, 1)
    near = slice(40, 70)
    assert column[near] == pytest.approx(line[near], abs=0.01)


@pytest.mark.parametrize("hexagon", [0.15, 0.4, 1.0, 2.2])
def test_small_cells_are_averaged(hexagon) -> None:
    side = round(60 / hexagon)
    grid = AxialGrid((side, side, 1))
    view = Viewport(40, 36, hexagon, (0.2, 40.0))
    of_cells = random_colours(grid)
    error = np.abs(drawn(grid, view, of_cells) - sampled(grid, view, of_cells, 12))
    # Bricks stand for hexagons, which shifts a little colour between neighbours.
    assert error.mean() < (5.0 if hexagon < 0.5 else 9.0)


def test_a_fine_pattern_does_not_turn_into_noise() -> None:
    """Black and white rows of cells far smaller than a pixel are grey, without a beat."""
    grid = AxialGrid((500, 500, 1))
    view = Viewport.fit(grid, 128, 128)
    assert view.hexagon < 0.15
    of_cells = np.where(np.arange(grid.size) % grid.width % 2, 0xFFFFFF, 0).astype(np.uint32)
    of_cells[~grid.exists] = colours.PAGE
    middle = drawn(grid, view, of_cells)[40:88, 50:78].astype(float)
    assert abs(middle.mean() - 127.5) < 2
    assert middle.std() < 8


def test_one_colour_stays_that_colour() -> None:
    for hexagon in (0.3, 1.7):
        grid = AxialGrid((200, 200, 1))
        view = Viewport(40, 40, hexagon, (-10.0, 60.0))
        frame = drawn(grid, view, np.full(grid.size, 0x336699, dtype=np.uint32))
        inside = view.index_at(grid, np.stack(np.meshgrid(np.arange(41), np.arange(41)), -1)) >= 0
        whole = inside[1:, 1:] & inside[:-1, 1:] & inside[1:, :-1] & inside[:-1, :-1]
        assert whole.sum() > 300
        assert (frame[whole] == (0x33, 0x66, 0x99)).all()


def crowd(grid: AxialGrid, cells: np.ndarray, carries: bool = False) -> Snapshot:
    n = len(cells)
    return Snapshot(
        grid=grid,
        ground=np.where(grid.exists, 0, 5).astype(np.uint8),
        trail=np.zeros(grid.size, dtype=np.int32),
        ant_cells=cells.astype(np.int32),
        ant_headings=np.zeros(n, dtype=np.int32),
        ant_carries=np.full(n, carries),
    )


def test_ants_stay_visible_in_a_world_of_millions() -> None:
    grid = AxialGrid((2000, 2000, 1))
    cell = grid.index((1000, 1000, 0))
    scene = Scene(grid, (1920, 1080), hud=False, legend=False)
    x, y = scene.viewport.centres((1000, 1000, 0)).tolist()
    frame = scene.draw(crowd(grid, np.array([cell])))
    around = frame[int(y) - 3 : int(y) + 4, int(x) - 3 : int(x) + 4].astype(float)
    background = float(colours.channels(colours.CELL_EMPTY)[0])
    darkness = (background - around[..., 0]).sum() / background
    # A disc of 0.9 pixels covers 2.5 of them, more than a square of 1.5 by 1.5.
    assert 2.0 < darkness < 3.0


def test_a_crowd_is_a_shade_that_grows_with_it() -> None:
    grid = AxialGrid((600, 600, 1))
    cells = np.flatnonzero(grid.exists)
    scene = Scene(grid, (128, 128), hud=False, legend=False)
    light = []
    for share in (0.0, 0.02, 0.2, 1.0):
        chosen = np.random.default_rng(1).choice(cells, int(share * len(cells)), replace=False)
        frame = scene.draw(crowd(grid, chosen))
        light.append(float(frame[54:74, 54:74].mean()))
    assert light[0] > light[1] + 20 > light[2] + 20
    assert light[2] > light[3]


def test_a_crowd_does_not_hide_the_queen() -> None:
    world = World(ranges=(300, 300, 1), queen=(150, 150, 0))
    scene = Scene(world.grid, (100, 100), hud=False, legend=False)
    x, y = scene.viewport.centres(world.queen).astype(int).tolist()
    frame = scene.draw(at_start(world, n=20_000))
    ring = (frame == colours.channels(colours.CELL_QUEEN)).all(axis=2)
    assert ring[y - 7 : y + 8, x - 7 : x + 8].sum() >= 20
    assert frame[y, x + 10].max() < 130


def test_the_queen_does_not_hide_the_ants_beside_her() -> None:
    """A picture of 20 ants, all of them within a pixel of her."""
    world = World(ranges=(2000, 2000, 1), queen=(1000, 1000, 0))
    scene = Scene(world.grid, (1280, 720), hud=False, legend=False)
    x, y = scene.viewport.centres(world.queen).astype(int).tolist()
    frame = scene.draw(at_start(world, n=20))
    near = frame[y - 1 : y + 2, x - 1 : x + 2]
    assert near.max(axis=2).min() < 60  # as dark as an ant
    ring = (frame == colours.channels(colours.CELL_QUEEN)).all(axis=2)
    assert ring[y - 7 : y + 8, x - 7 : x + 8].sum() >= 20


@pytest.mark.parametrize("hexagon", [4, 9, 20, 50])
def test_an_ant_points_where_it_is_heading(hexagon) -> None:
    """Its tip is on the side of the heading, and a crumb there."""
    grid = AxialGrid((3, 3, 3))
    side = 12 * hexagon
    view = Viewport.fit(grid, side, side)
    cell = grid.index((0, 0, 0))
    ahead = view.centres(neighbours((0, 0, 0)))
    middle = view.centres((0, 0, 0))
    for heading, target in enumerate(ahead):
        snapshot = dataclasses.replace(
            crowd(grid, np.array([cell]), carries=True),
            ant_headings=np.array([heading], dtype=np.int32),
        )
        frame = Rasteriser(grid, view).draw(snapshot)
        orange = (frame[..., 0].astype(int) - frame[..., 2] > 60).nonzero()
        crumb = np.array([orange[1].mean(), orange[0].mean()]) + 0.5 - middle
        direction = (target - middle) / np.linalg.norm(target - middle)
        assert crumb @ direction > 0.4 * view.hexagon
        assert np.linalg.norm(crumb - (crumb @ direction) * direction) < 0.15 * view.hexagon + 0.5


@pytest.mark.parametrize("hexagon", [0.8, 3.0, 5.0, 9.0])
def test_the_marks_of_the_view_leave_the_ant_free(hexagon) -> None:
    """What marks the view changes pixels near the ant, but none where it stands."""
    world = World(ranges=(11, 11, 11), queen=(10, 0, 0), ants=[((0, 0, 0), 0)])
    view = Viewport(200, 200, hexagon, (100.0, 100.0))
    snapshot = at_start(world)
    rasteriser = Rasteriser(world.grid, view)
    in_view = snapshot.ant_cells + world.grid.offsets[[5, 0, 1]]
    plain, marked = rasteriser.draw(snapshot), rasteriser.draw(snapshot, in_view)
    rows, columns = np.nonzero((plain != marked).any(axis=2))
    away = np.hypot(rows + 0.5 - 100, columns + 0.5 - 100)
    assert len(away) > 30
    assert away.min() > max(0.8 * hexagon, 1.8)
    assert away.max() < max(2.9 * hexagon, 9.0)


def test_nothing_is_drawn_outside_the_world() -> None:
    grid = AxialGrid((4, 9, 2))
    scene = Scene(grid, (500, 260), hud=False, legend=False)
    frame = scene.draw(crowd(grid, np.flatnonzero(grid.exists)[:7]))
    places = np.stack(np.meshgrid(np.arange(500), np.arange(260)), axis=-1) + 0.5
    index = scene.viewport.index_at(grid, places)
    centres = scene.viewport.centres(grid.cells(np.flatnonzero(grid.exists)))
    away = np.linalg.norm(places[:, :, None] - centres, axis=3).min(axis=2)
    outside = (index < 0) & (away > scene.viewport.hexagon + 1)
    assert outside.sum() > 5000
    assert (frame[outside] == 255).all()


def golden_scene() -> np.ndarray:
    """A small world that has everything and no symmetry, without text."""
    world = World(
        ranges=(4, 6, 3),
        queen=(0, 0, 0),
        foods=[(3, 0, 0), (0, 5, 1)],
        obstacles=[(0, 2, 0), (1, 2, 0), (0, 0, 2)],
        trails=[((1, 0, 0), 250), ((2, 0, 0), 120), ((0, 3, 1), 25), ((0, 4, 1), 1)],
        ants=[((1, 0, 0), 1), ((0, 3, 1), 4), ((3, 4, 0), 2)],
    )
    snapshot = dataclasses.replace(at_start(world, n=3), ant_carries=np.array([True, False, False]))
    return Scene(world.grid, (320, 200), hud=False, legend=False).draw(snapshot)


def difference(picture: np.ndarray, golden: np.ndarray) -> float:
    return float(np.abs(picture.astype(int) - golden).mean())


def test_the_golden_picture() -> None:
    golden = np.asarray(Image.open(GOLDEN).convert("RGB"))
    picture = golden_scene()
    assert picture.shape == golden.shape
    # The last bits of sines may differ between processors, nothing else may.
    assert difference(picture, golden) < 0.05
    assert np.abs(picture.astype(int) - golden).max() <= 16
    for wrong in (golden[::-1], golden[:, ::-1], golden[::-1, ::-1], np.roll(golden, 1, axis=1)):
        assert difference(wrong, golden) > 1.0


def test_text_changes_nothing_of_the_world() -> None:
    """The world's part of a picture with text is the world alone, wherever fonts put the text."""
    world = paper()
    snapshot = at_start(world)
    with_text = Scene(world.grid, (640, 400), title="some title")
    frame = with_text.draw(snapshot)
    view = with_text.viewport
    alone = Rasteriser(world.grid, view).draw(snapshot)
    assert (frame[:, : view.width] == alone).all()
    assert (frame[:, view.width :] != 255).any()


def test_the_number_of_threads_changes_nothing() -> None:
    before = runtime.start()
    try:
        pictures = []
        for threads in (1, 2):
            runtime.start(threads=threads)
            pictures.append(golden_scene())
        assert (pictures[0] == pictures[1]).all()
    finally:
        runtime.start(before.threads, before.arch)


@pytest.mark.parametrize("size", [(64, 64), (3840, 2160), (4096, 64)])
def test_all_sizes(size) -> None:
    world = paper()
    frame = Scene(world.grid, size).draw(at_start(world))
    assert frame.shape == (size[1], size[0], 3)
    assert frame.dtype == np.uint8
    # The queen is there, whatever the size.
    least, most = frame.min(axis=2).astype(int), frame.max(axis=2)
    assert ((frame[..., 1] == least) & (most - least > 120) & (frame[..., 2] == most)).sum() >= 3


def test_rasterising_takes_less_than_8_ms() -> None:
    world = paper()
    snapshot = at_start(world)
    rasteriser = Rasteriser(world.grid, Viewport.fit(world.grid, 1280, 720))
    took = []
    for _ in range(40):
        began = time.perf_counter()
        rasteriser.draw(snapshot)
        took.append(time.perf_counter() - began)
    assert min(took) < 0.008
