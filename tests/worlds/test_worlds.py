"""What a world holds, its arrays, and where its ants start."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest
from hexagons import distance, neighbours

from taichi_ants import worlds
from taichi_ants.errors import AntsError
from taichi_ants.grid.constants import STREAM_START_CELL, STREAM_START_HEADING
from taichi_ants.grid.randomness import stream_state
from taichi_ants.reference.ants import starts
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN
from taichi_ants.worlds import World
from taichi_ants.worlds.world import STARTS as WHERE

ARRAYS = ("foods", "obstacles", "trails", "ants")


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


def test_arrays_are_read_only_copies() -> None:
    foods = np.array([(1, 0, 0)], dtype=np.int32)
    world = World((3, 3, 3), (0, 0, 0), foods=foods)
    foods[0] = 2
    assert world.foods.tolist() == [[1, 0, 0]]
    for name in ARRAYS:
        array = getattr(world, name)
        assert array.dtype == np.int32
        assert not array.flags.writeable
    with pytest.raises(dataclasses.FrozenInstanceError):
        world.queen = (1, 0, 0)


def test_nothing_but_a_queen() -> None:
    world = World((1, 1, 1), (5, 5, 5))
    assert world.queen == (0, 0, 0)
    assert [getattr(world, name).shape for name in ARRAYS] == [(0, 3), (0, 3), (0, 4), (0, 4)]
    assert world.ground().tolist().count(OBSTACLE) == world.grid.size - 1
    with pytest.raises(AntsError, match="the number of ants is 1;"):
        world.start(0)


def test_equality_and_hash_follow_the_contents() -> None:
    assert small() == small()
    assert hash(small()) == hash(small())
    assert len({small(), small(), worlds.paper()}) == 2
    reordered = small(obstacles=[(0, 0, 2), (1, 3, 1)], trails=small().trails[::-1])
    assert reordered == small()
    assert small(trails=[*small().trails.tolist(), (0, 1, 0, 0)]) == small()
    for change in (
        {"ranges": (3, 3, 4)},
        {"queen": (0, 1, 1)},
        {"foods": ()},
        {"obstacles": [(0, 2, 0)]},
        {"trails": [((1, 0, 0), 7), ((1, 1, 0), 8)]},
        {"ants": small().ants[::-1]},  # ants are numbered, so their order counts
    ):
        assert small(**change) != small()
    assert small() != "world"


def test_copies_and_pickles_are_worlds_too() -> None:
    world = small()
    for twin in (pickle.loads(pickle.dumps(world)), copy.deepcopy(world)):
        assert twin == world
        assert not twin.foods.flags.writeable
    assert dataclasses.replace(world, foods=()).obstacles.tolist() == world.obstacles.tolist()


def test_repr_is_short() -> None:
    assert repr(small()) == (
        "World(ranges=(3, 3, 3), queen=(0, 0, 0), foods: 1, obstacles: 2, trails: 2, ants: 2)"
    )


def test_ground_and_trail_levels() -> None:
    world = small()
    index = world.grid.index
    ground, levels = world.ground(), world.trail_levels()
    assert ground.dtype == np.uint8
    assert levels.dtype == np.int32
    assert ground[index((0, 0, 0))] == QUEEN
    assert ground[index((2, 0, 0))] == FOOD
    assert (ground[index([(0, 2, 0), (0, 0, 2)])] == OBSTACLE).all()
    assert (ground[~world.grid.exists] == OBSTACLE).all()
    assert (ground == EMPTY).sum() == 19 - 4
    assert levels[index([(1, 0, 0), (1, 1, 0)])].tolist() == [7, 7]
    assert levels.sum() == 14


def test_distances_and_closer_by_hand() -> None:
    world = World((10, 10, 10), (0, 9, 9))
    distances, closer = world.distances(), world.closer()
    assert distances.dtype == np.int32
    assert closer.dtype == np.uint8
    index = world.grid.index
    assert distances[index([(0, 9, 9), (0, 8, 8), (9, 0, 0), (0, 0, 9)])].tolist() == [0, 1, 18, 9]
    assert (distances[~world.grid.exists] == 0).all()
    assert (closer[~world.grid.exists] == 0).all()
    # Straight above the queen only the way down is nearer; elsewhere two ways can be.
    assert closer[index((0, 8, 8))] == 1 << 3
    assert closer[index((9, 0, 0))] == 1 << 3
    assert closer[index((0, 0, 9))] == 1 << 2
    assert closer[index((0, 0, 0))] == 1 << 3
    assert closer[index((1, 1, 0))] == 1 << 3 | 1 << 4
    assert closer[index((0, 9, 9))] == 0


def test_closer_agrees_with_distances() -> None:
    world = World((5, 4, 6), (2, 0, 1))
    index = np.flatnonzero(world.grid.exists)
    cells = world.grid.cells(index)
    own = distance(cells, world.queen)
    assert (world.distances()[index] == own).all()
    nearer = distance(neighbours(cells), world.queen) < own[:, None]
    assert (world.closer()[index] == (nearer << np.arange(6)).sum(axis=1)).all()


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


def test_listed_ants_start_first_and_where_listed() -> None:
    world = small()
    for n in (1, 2):
        cells, headings = world.start(9, n)
        assert world.grid.cells(cells).tolist() == [[1, 1, 0], [0, 0, 1]][:n]
        assert headings.tolist() == [4, 2][:n]
        assert cells.dtype == headings.dtype == np.int32


@pytest.mark.parametrize("seed", [0, 1, -5, 2**70])
def test_further_ants_start_nearest_to_the_queen_ties_by_the_stream(seed: int) -> None:
    world = small(queen=(1, 0, 1), ants=[((1, 1, 0), 4)])
    every = sorted(map(tuple, world.grid.cells(np.flatnonzero(world.grid.exists)).tolist()))
    taken = {world.queen, (1, 1, 0), (2, 0, 0), (0, 2, 0), (0, 0, 2)}
    order = sorted(
        (int(distance(cell, world.queen)), stream_state(seed, STREAM_START_CELL, i), cell)
        for i, cell in enumerate(every)
        if cell not in taken
    )
    for n in (2, 5, 1 + len(order)):
        cells, headings = world.start(seed, n)
        assert world.grid.cells(cells[1:]).tolist() == [list(cell) for *_, cell in order[: n - 1]]
        expected = [(stream_state(seed, STREAM_START_HEADING, i) >> 32) * 6 >> 32 for i in range(n)]
        assert headings.tolist() == [4, *expected[1:]]
    with pytest.raises(AntsError, match=f"room for {1 + len(order)}"):
        world.start(seed, 2 + len(order))


def test_starts_depend_on_the_seed_alone() -> None:
    world = worlds.paper()
    first, again, other = (world.start(seed, 50) for seed in (1, 1, 2))
    assert (first[0] == again[0]).all()
    assert (first[1] == again[1]).all()
    assert (first[0] != other[0]).any()
    assert (first[1] != other[1]).any()
    # Fewer ants are the first of more ants.
    assert (world.start(1, 20)[0] == first[0][:20]).all()


@pytest.mark.parametrize("seed", [0, -3, 2**70])
def test_ants_that_are_spread_start_on_any_free_cells_by_the_seed(seed: int) -> None:
    for world in (worlds.open_world(4, (9, 8, 7)), worlds.paper()):
        free = int((world.ground() == EMPTY).sum())
        for n in (1, 2, 40, free):
            cells, headings = world.start(seed, n, "spread")
            plain = starts(world, seed, n, "spread")
            assert world.grid.cells(cells).tolist() == [list(cell) for cell, _ in plain]
            assert headings.tolist() == [heading for _, heading in plain]
            assert len(set(cells.tolist())) == n
            assert (world.ground()[cells] == EMPTY).all()
        with pytest.raises(AntsError, match=f"room for {free}"):
            world.start(seed, free + 1, "spread")
    world = World((60, 60, 60), (0, 0, 0))
    near, far = (world.distances()[world.start(seed, 300, where)[0]] for where in WHERE)
    assert near.max() == 10
    assert far.mean() == pytest.approx(world.distances()[world.grid.exists].mean(), rel=0.1)
    with pytest.raises(AntsError, match="where is 'moon'; it must be one of nest, spread"):
        world.start(seed, 2, "moon")


def test_reachable_foods() -> None:
    # A corridor: queen, empty, food, food, empty, food.
    corridor = World((8, 1, 1), (0, 0, 0), foods=[(2, 0, 0), (3, 0, 0), (5, 0, 0)])
    assert corridor.reachable_foods().tolist() == [True, False, False]
    assert dataclasses.replace(corridor, foods=[(1, 0, 0)]).reachable_foods().tolist() == [False]
    assert World((8, 1, 1), (0, 0, 0)).reachable_foods().shape == (0,)


def test_a_wall_is_tight_along_hexagons() -> None:
    # In a rhombus of rows r, a full row of rocks keeps the far side apart; one gap opens it.
    wall = [(i, 2, 0) for i in range(5)]
    world = World((5, 5, 1), (0, 0, 0), foods=[(0, 4, 0), (0, 1, 0)], obstacles=wall)
    assert world.reachable_foods().tolist() == [True, False]
    gap = dataclasses.replace(world, obstacles=wall[:-1])
    assert gap.reachable_foods().tolist() == [True, True]


def test_large_worlds_are_no_burden() -> None:
    world = World((1000, 1000, 1), (0, 0, 0))
    cells, _ = world.start(0, 10_000)
    assert len(np.unique(cells)) == 10_000
    # A sector of radius d around the corner holds (d + 1)^2 cells.
    assert world.distances()[cells].max() == 100
