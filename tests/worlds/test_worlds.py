"""What a world holds and computes, and where its ants start."""

import numpy as np
import pytest
from hexagons import neighbours
from hypothesis import given
from hypothesis import strategies as st

from taichi_ants import worlds
from taichi_ants.errors import AntsError
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.reference.ants import starts
from taichi_ants.task.constants import EMPTY
from taichi_ants.worlds import World
from taichi_ants.worlds.world import STARTS as WHERE
from taichi_ants.worlds.world import free_cells


def small(**changes: object) -> World:
    """19 cells around the origin, with one of everything."""
    contents = {
        "ranges": (3, 3, 3),
        "queen": (0, 0, 0),
        "foods": [(2, 0, 0)],
        "obstacles": [(0, 2, 0), (0, 0, 2)],
        "trails": [((1, 0, 0), 7), ((1, 1, 0), 7)],
        "ants": [((1, 1, 0), 4), ((0, 0, 1), 2)],
    }
    return World(**{**contents, **changes})


def test_contents_are_stored_in_normal_form() -> None:
    world = World(
        ranges=[np.int64(10), 10, 10],
        queen=(-9, 0, 0),
        foods=np.array([(8, -1, -1)]),
        obstacles=[[3, 1, 2], (0, 0, 0)],
        trails=[((-2, 0, 0), 25), (5, 5, 5 + 1, 3)],
        ants=[((0, 0, 1), 5), ((1, 0, 0), np.uint8(2))],
    )
    assert world.ranges == (10, 10, 10)
    assert world.queen == (0, 9, 9)
    assert all(type(number) is int for number in (*world.ranges, *world.queen))
    assert world.foods.tolist() == [[9, 0, 0]]
    assert world.obstacles.tolist() == [[0, 0, 0], [2, 0, 1]]
    assert world.trails.tolist() == [[0, 0, 1, 3], [0, 2, 2, 25]]
    assert world.ants.tolist() == [[0, 0, 1, 5], [1, 0, 0, 2]]


def test_the_papers_world() -> None:
    world = worlds.paper()
    assert world.grid.count == 271
    assert world.queen == (0, 9, 9)
    assert world.foods.tolist() == [[9, 0, 0]]
    assert len(world.trails) == 17
    assert (world.trails[:, 3] == 25).all()
    assert {(8, 0, 0), (0, 0, 0), (0, 8, 8)} <= set(map(tuple, world.trails[:, :3].tolist()))
    cells, headings = world.start(seed=0)
    assert world.grid.cells(cells).tolist() == [[0, 8, 8]]
    assert headings.tolist() == [0]
    assert world.reachable_foods().tolist() == [True]


@pytest.mark.parametrize("where", WHERE)
@pytest.mark.parametrize("seed", [0, -3, 2**70])
def test_ants_start_where_the_reference_says(seed: int, where: str) -> None:
    """Listed ants first; the others near their queens, or on any free cells."""
    two = World((5, 5, 5), [(0, 0, 0), (4, 0, 0)], ants=[((3, 0, 0), 2)])
    for world in (small(), worlds.open_world(4, (9, 8, 7)), two):
        room = int((world.ground() == EMPTY).sum())
        for n in (1, 2, 9, room):
            cells, headings = world.start(seed, n, where)
            assert cells.dtype == headings.dtype == np.int32
            given = list(zip(world.grid.cells(cells).tolist(), headings.tolist(), strict=True))
            assert given == [([*cell], turn) for cell, turn in starts(world, seed, n, where)]
        with pytest.raises(AntsError, match=f"room for {room}"):
            world.start(seed, room + 1, where)


def test_ants_start_around_the_queen_or_anywhere() -> None:
    world = World((60, 60, 60), (0, 0, 0))
    near, far = (world.distances()[world.start(1, 300, where)[0]] for where in WHERE)
    assert near.max() == 10
    assert far.mean() == pytest.approx(world.distances()[world.grid.exists].mean(), rel=0.1)
    with pytest.raises(AntsError, match="where is 'moon'; it must be one of nest, spread"):
        world.start(1, 2, "moon")


@pytest.mark.parametrize("where", WHERE)
def test_no_ants_need_no_free_cell(where: str) -> None:
    world = small()
    full, none = np.zeros(world.grid.size, bool), np.zeros(0, int)
    assert not len(free_cells(world.grid, full, world.queens, none, 0, where))


@st.composite
def crowded_worlds(draw: st.DrawFn) -> World:
    """Worlds in which rocks and foods block many ways."""
    ranges = draw(st.tuples(*[st.integers(1, 6)] * 3))
    grid = AxialGrid(ranges)
    cells = grid.cells(np.flatnonzero(grid.exists)).tolist()
    kinds = draw(st.lists(st.sampled_from("..##F"), min_size=len(cells), max_size=len(cells)))
    kinds[draw(st.integers(0, len(cells) - 1))] = "Q"
    listed = {kind: [c for c, k in zip(cells, kinds, strict=True) if k == kind] for kind in "#FQ"}
    return World(ranges, listed["Q"][0], foods=listed["F"], obstacles=listed["#"])


@given(crowded_worlds())
def test_foods_are_reachable_where_a_walk_leads(world: World) -> None:
    ground = world.ground()

    def beside(cell: tuple) -> list[tuple]:
        around = [tuple(n) for n in neighbours(cell).tolist()]
        return [n for n in around if (np.array(n) < world.ranges).all()]

    def empty(cell: tuple) -> bool:
        return ground[world.grid.index(cell)] == EMPTY

    reached: set[tuple] = set()
    frontier = [cell for cell in beside(world.queen) if empty(cell)]
    while frontier:
        cell = frontier.pop()
        if cell not in reached:
            reached.add(cell)
            frontier += [other for other in beside(cell) if empty(other)]
    expected = [not reached.isdisjoint(beside(tuple(food))) for food in world.foods.tolist()]
    assert world.reachable_foods().tolist() == expected
