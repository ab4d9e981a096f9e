"""Kernels draw the same picture as a slow reference with many samples per pixel."""

import dataclasses

import numpy as np
import pytest
from hexagons import cell_at, exist, neighbours
from hypothesis import given, settings
from hypothesis import strategies as st

from taichi_ants import runtime
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.rendering import Scene, Snapshot, at_start, colours, picture, text
from taichi_ants.rendering.rasteriser import Rasteriser
from taichi_ants.task import Field, Food, Pheromone, Task
from taichi_ants.worlds import World, paper


def index_at(rasteriser: Rasteriser, pixels: np.ndarray) -> np.ndarray:
    """Flat indices (...) of the cells at pixel coordinates (..., 2), -1 where there is none."""
    grid, origin = rasteriser.grid, rasteriser.centres((0, 0, 0))
    cells = cell_at(pixels - origin, rasteriser.hexagon)
    inside = exist(grid, cells)
    return np.where(inside, grid.index(np.where(inside[..., None], cells, 0)), -1)


def pixels(rasteriser: Rasteriser) -> np.ndarray:
    """Coordinates of the upper left corners of all pixels, (height, width, 2)."""
    rows, columns = np.mgrid[: rasteriser.height, : rasteriser.width]
    return np.stack([columns, rows], axis=-1)


def sampled(rasteriser: Rasteriser, of_cells: np.ndarray, samples: int) -> np.ndarray:
    """The picture as the mean of samples * samples points of each pixel, float (h, w, 3)."""
    places = (np.arange(samples) + 0.5) / samples
    total = np.zeros((rasteriser.height, rasteriser.width, 3))
    for dy in places:
        for dx in places:
            index = index_at(rasteriser, pixels(rasteriser) + (dx, dy))
            words = np.where(index >= 0, of_cells[np.maximum(index, 0)], colours.PAGE)
            total += colours.channels(words)
    return total / samples**2


def random_colours(grid: AxialGrid, seed: int = 0) -> np.ndarray:
    of_cells = np.random.default_rng(seed).integers(0, 1 << 24, grid.size).astype(np.uint32)
    of_cells[~grid.exists] = colours.PAGE
    return of_cells


@settings(max_examples=60, deadline=None)
@given(st.tuples(*[st.integers(1, 9)] * 3), st.integers(64, 900), st.integers(64, 900))
def test_a_world_fills_its_picture(ranges, width, height) -> None:
    """Everything lies within the margin, and touches it on two opposite sides."""
    grid = AxialGrid(ranges)
    rasteriser = Rasteriser(grid, width, height, margin=3)
    centres = rasteriser.centres(grid.cells(np.flatnonzero(grid.exists)))
    reach = np.array([rasteriser.hexagon, np.sqrt(3) / 2 * rasteriser.hexagon])
    low, high = (centres - reach).min(axis=0), (centres + reach).max(axis=0)
    free = np.concatenate([low, (width, height) - high])
    assert free.min() == pytest.approx(3)
    assert free[0] == pytest.approx(free[2])
    assert free[1] == pytest.approx(free[3])


@pytest.mark.parametrize(("ranges", "size"), [((3, 5, 2), (400, 300)), ((7, 2, 4), (130, 90))])
def test_each_pixel_has_the_colour_of_its_cell(ranges, size) -> None:
    """The world is not symmetric, so a picture that is mirrored, turned or transposed disagrees."""
    grid = AxialGrid(ranges)
    rasteriser = Rasteriser(grid, *size, margin=2)
    of_cells = random_colours(grid)
    frame = rasteriser.draw_cells(of_cells)
    places = pixels(rasteriser) + 0.5
    index = index_at(rasteriser, places)
    away = np.linalg.norm(places - rasteriser.centres(grid.cells(np.maximum(index, 0))), axis=2)
    clear = (index >= 0) & (away < 0.6 * rasteriser.hexagon)

    def share_that_agrees(picture: np.ndarray) -> float:
        expected = colours.channels(of_cells[index[clear]])
        return float((picture[clear] == expected).all(axis=1).mean())

    assert share_that_agrees(frame) == 1.0
    assert share_that_agrees(frame[::-1]) < 0.6
    assert share_that_agrees(frame[:, ::-1]) < 0.6
    assert share_that_agrees(frame[::-1, ::-1]) < 0.6


@pytest.mark.parametrize("side", [10, 20, 50, 140])
def test_small_cells_are_averaged(side) -> None:
    grid = AxialGrid((side, side, 1))
    rasteriser = Rasteriser(grid, 40, 54)
    assert rasteriser.hexagon < 2.5
    of_cells = random_colours(grid)
    error = np.abs(rasteriser.draw_cells(of_cells) - sampled(rasteriser, of_cells, 12))
    # Bricks stand for hexagons, which shifts a little colour between neighbours.
    assert error.mean() < (5.0 if rasteriser.hexagon < 0.5 else 9.0)


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
    scene = Rasteriser(grid, 1920, 1080)
    x, y = scene.centres((1000, 1000, 0)).tolist()
    frame = scene.draw(crowd(grid, np.array([cell])))
    around = frame[int(y) - 3 : int(y) + 4, int(x) - 3 : int(x) + 4].astype(float)
    background = float(colours.channels(colours.CELL_EMPTY)[0])
    darkness = (background - around[..., 0]).sum() / background
    # A disc of 0.9 pixels covers 2.5 of them, more than a square of 1.5 by 1.5.
    assert 2.0 < darkness < 3.0


@pytest.mark.parametrize("hexagon", ["small", "large"])
def test_nests_and_kinds_of_food_have_colours(hexagon) -> None:
    ranges = (60, 60, 60) if hexagon == "small" else (6, 6, 6)
    foods = [((0, 3, 0), 0), ((0, 0, 3), 1)]
    world = World(ranges, queen=[(0, 0, 0), (3, 0, 0)], foods=foods)
    scene = Rasteriser(world.grid, 600, 600)
    assert (scene.hexagon < 6) == (hexagon == "small")
    start = at_start(world, n=2)
    ants = dataclasses.replace(start, ant_nests=np.int32([0, 1]))
    frame = scene.draw(ants)
    for several in (colours.QUEENS, colours.FOODS, colours.ANTS):
        for colour in several[:2]:
            assert (frame == colours.channels(colour)).all(axis=2).sum() >= 2, hex(colour)
    loaded = dataclasses.replace(
        ants, ant_carries=np.array([True, True]), ant_foods=np.int32([0, 5])
    )
    loads = scene.draw(loaded)
    for colour in colours.FOODS[5:6] if hexagon == "small" else colours.FOODS[[0, 5]]:
        assert (loads == colours.channels(colour)).all(axis=2).any(), hex(colour)
        assert colour == colours.CELL_FOOD or not (frame == colours.channels(colour)).all(2).any()
    shown = [
        (one == colours.channels(colours.ANTS[1])).all(axis=2) for one in (frame, scene.draw(start))
    ]
    assert shown[0].sum() > shown[1].sum()  # the queen of the nest has the colour, too


def test_the_legend_shows_queens_ants_and_foods_in_their_colours(monkeypatch) -> None:
    """And the names of the foods, if the scene has the task."""
    foods = [((0, 3, 0), 0), ((0, 0, 3), 1)]
    start = at_start(World((6, 6, 6), queen=[(0, 0, 0), (3, 0, 0)], foods=foods))
    task = Task(foods={"seed": Food(), "sap": Food()}, delivery="truncates")
    written, write = [], text.write
    monkeypatch.setattr(text, "write", lambda *a, **k: (written.append(a[1]), write(*a, **k)))
    for known, names in ((task, ("seed", "sap")), (None, ("of kind 0", "of kind 1"))):
        frame = Scene(start.grid, (1280, 720), task=known).draw(start)[:, 960:]
        assert {"nest 0", "nest 1", *(f"food {name}" for name in names)} <= set(written)
        assert ("food of kind 0" in written) == (known is None)
        for several in (colours.QUEENS, colours.ANTS, colours.FOODS):
            for colour in several[:2]:
                assert (frame == colours.channels(colour)).all(axis=2).any(), hex(colour)
        written.clear()


def test_fields_have_scales_of_their_own() -> None:
    """A level that is the strongest of its field has the darkest colour, whatever the trail's."""
    world = World((4, 4, 4), (0, 0, 0))
    level = np.zeros(world.grid.size, np.int32)
    level[world.grid.index((2, 0, 0))] = 1000
    task = Task(fields={"home": Field(level=1000), "sum": Field(deposit="add", level=50)})
    levels = {"trail": 0 * level, "home": level, "sum": 0 * level}
    start = dataclasses.replace(at_start(world), fields=levels)
    weak = dataclasses.replace(start, fields={**levels, "home": level // 2})
    most = {name: field.darkest for name, field in task.fields.items()}
    assert most == {"home": 1000, "sum": 500}
    frames = [Scene(world.grid, task=task).draw(one) for one in (start, weak)]
    darkest = colours.channels(int(colours.field_ramp(0)[-1]))
    dark = [(frame[:, :700] == darkest).all(axis=2).sum() for frame in frames]
    assert dark[0] > 100 > dark[1]


@pytest.mark.parametrize(
    ("rules", "told"),
    [
        pytest.param({}, ["250", "250"], marks=pytest.mark.slow),
        ({"diffusion": 0.5}, ["20", "2000"]),
    ],
)
def test_the_scale_fits_fields_whose_levels_rules_do_not_tell(rules, told, monkeypatch) -> None:
    """Far below and above a deposit; the legend has the scale, and levels use all its colours."""
    written, write = [], text.write
    monkeypatch.setattr(text, "write", lambda *a, **k: (written.append(a[1]), write(*a, **k)))
    world, task = World((9, 9, 9), (0, 0, 0)), Task(pheromone=Pheromone(**rules))
    start = at_start(world)
    levels = np.where(start.ground == 0, np.arange(len(start.ground)) % 17, 0)
    for factor, most in zip((1, 100), told, strict=True):
        snapshot = dataclasses.replace(start, trail=(factor * levels).astype(np.float32))
        scene = Scene(world.grid, task=task)
        frame = scene.draw(snapshot)[:, :900]
        assert written[-1] == f"{most} and more"
        strong = colours.channels(colours.TRAIL_RAMP[192:])
        is_strong = (frame[:, :, None] == strong).all(axis=3).any()
        assert is_strong == (rules != {} or factor == 100)
    empty = dataclasses.replace(start, trail=np.zeros(len(levels), np.float32))
    assert Scene(world.grid, task=task).draw(empty).shape == (720, 1280, 3)


def test_the_legend_names_the_homing_cue() -> None:
    grid = World((4, 4, 4), (0, 0, 0)).grid
    tasks = [Task(), Task(fields={"home": Field()}, homing_cue="home"), Task(homing_cue="trail")]
    world = at_start(World((4, 4, 4), (0, 0, 0)))
    legends = [Scene(grid, task=task).draw(world).tobytes() for task in tasks]
    assert len(set(legends)) == 3
    assert legends[0] == Scene(grid).draw(world).tobytes()


def test_a_crowd_does_not_hide_the_queen() -> None:
    world = World(ranges=(300, 300, 1), queen=(150, 150, 0))
    scene = Rasteriser(world.grid, 100, 100)
    x, y = scene.centres(world.queen).astype(int).tolist()
    frame = scene.draw(at_start(world, n=20_000))
    ring = (frame == colours.channels(colours.CELL_QUEEN)).all(axis=2)
    assert ring[y - 7 : y + 8, x - 7 : x + 8].sum() >= 20
    assert frame[y, x + 10].max() < 130


@pytest.mark.parametrize("hexagon", [4, 9, 20, 50])
def test_an_ant_points_where_it_is_heading(hexagon) -> None:
    """Its tip is on the side of the heading, and a crumb there."""
    grid = AxialGrid((3, 3, 3))
    side = 8 * hexagon
    view = Rasteriser(grid, side, side)
    cell = grid.index((0, 0, 0))
    ahead = view.centres(neighbours((0, 0, 0)))
    middle = view.centres((0, 0, 0))
    for heading, target in enumerate(ahead):
        snapshot = dataclasses.replace(
            crowd(grid, np.array([cell]), carries=True),
            ant_headings=np.array([heading], dtype=np.int32),
        )
        frame = view.draw(snapshot)
        orange = (frame[..., 0].astype(int) - frame[..., 2] > 60).nonzero()
        crumb = np.array([orange[1].mean(), orange[0].mean()]) + 0.5 - middle
        direction = (target - middle) / np.linalg.norm(target - middle)
        assert crumb @ direction > 0.4 * view.hexagon
        assert np.linalg.norm(crumb - (crumb @ direction) * direction) < 0.15 * view.hexagon + 0.5


def test_the_number_of_threads_changes_nothing() -> None:
    before = runtime.start()
    try:
        pictures = []
        for threads in (1, 2):
            runtime.start(threads=threads)
            pictures.append(picture(paper(), (320, 200)))
        assert (pictures[0] == pictures[1]).all()
    finally:
        runtime.start(before.threads, before.arch)
