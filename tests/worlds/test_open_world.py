"""The open world: what every one guarantees, and how the drawing goes."""

import importlib

import numpy as np
import pytest
from hexagons import distance

from taichi_ants.errors import AntsError
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.grid.randomness import Stream
from taichi_ants.task.constants import EMPTY
from taichi_ants.worlds import World, far_piles, open_world

# The package's name `open_world` is the function, which hides the module of that name.
module = importlib.import_module("taichi_ants.worlds.open_world")

RANGES = [(30, 20, 25), (40, 40, 1), (12, 5, 9), (64, 1, 33)]


def all_cells(world: World) -> np.ndarray:
    return world.grid.cells(np.flatnonzero(world.grid.exists))


def pile_cells(world: World) -> set[tuple]:
    """The cells of the three piles, by their definition."""
    cells = all_cells(world)
    found = set()
    for axis, n in enumerate(world.ranges):
        centre = [0, 0, 0]
        centre[axis] = 3 * n // 4
        near = distance(cells, centre) <= max(1, n // 16)
        found |= set(map(tuple, cells[near].tolist()))
    return found


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("ranges", RANGES)
def test_what_every_open_world_guarantees(ranges: tuple, seed: int) -> None:
    world = open_world(seed, ranges)
    assert world.ranges == ranges
    assert world.queen == (0, 0, 0)
    assert len(world.trails) == len(world.ants) == 0
    assert world.reachable_foods().any()

    cells = all_cells(world)
    clearing = cells[distance(cells, world.queen) <= 3]
    beside = [cell for cell in clearing.tolist() if cell != [0, 0, 0]]
    assert (world.ground()[world.grid.index(beside)] == EMPTY).all()

    foods = set(map(tuple, world.foods.tolist()))
    piles = pile_cells(world) - set(map(tuple, clearing.tolist()))
    assert piles <= foods
    assert len(foods - piles) == round(0.03 * world.grid.count)


@pytest.mark.parametrize("share", [0.0, 0.01, 0.15, 0.6])
@pytest.mark.parametrize("ranges", RANGES)
def test_rocks_cover_their_share_and_no_rock_more(ranges: tuple, share: float) -> None:
    grid = AxialGrid(ranges)
    covered = module.scatter_rocks(grid, share, Stream(1, 2, 3))
    assert not covered[~grid.exists].any()
    radius = max(1, min(ranges) // 20)
    excess = covered.sum() - share * grid.count
    assert 0 <= excess < 1 + 3 * radius * (radius + 1)


def test_pinned_worlds() -> None:
    """Worlds of known seeds stay as they are, whatever the version of NumPy."""
    world = open_world(0)
    assert world.ranges == (64, 56, 29)
    assert (len(world.foods), len(world.obstacles)) == (312, 1018)
    assert world.obstacles.sum(axis=0).tolist() == [25950, 24092, 6654]
    assert world.foods.sum(axis=0).tolist() == [7981, 5663, 1742]


def test_a_world_without_reachable_food_is_drawn_again(monkeypatch: pytest.MonkeyPatch) -> None:
    draw, attempts = module._draw, []

    def shut_in(*arguments: object) -> World:
        attempts.append(arguments[-1])
        if len(attempts) <= 2:
            return World((9, 1, 1), (0, 0, 0), foods=[(8, 0, 0)], obstacles=[(4, 0, 0)])
        return draw(*arguments)

    monkeypatch.setattr(module, "_draw", shut_in)
    world = open_world(0, (20, 20, 20))
    assert attempts == [0, 1, 2]
    assert world == draw(world.grid, 0.15, 0.03, 3, 0, 2)
    assert world != draw(world.grid, 0.15, 0.03, 3, 0, 0)


@pytest.mark.parametrize("ranges", [(1, 1, 1), (3, 3, 1), (4, 4, 4)])
def test_a_hundred_worlds_without_food_are_an_error(ranges: tuple) -> None:
    with pytest.raises(AntsError, match=r"in 100 open worlds of ranges .* choose larger ranges"):
        open_world(0, ranges)


def test_piles_lie_along_the_first_ranges_and_may_be_all_food() -> None:
    three, one = (far_piles(3, (30, 30, 30), piles=n) for n in (3, 1))
    assert set(map(tuple, three.foods.tolist())) == pile_cells(three)
    assert set(map(tuple, one.foods.tolist())) < pile_cells(three)
    assert (one.foods[:, 0] > 15).all()
    assert far_piles(3, (30, 30, 30)) == open_world(3, (30, 30, 30), food_share=0)
    for piles in (0, 4, 1.5):
        with pytest.raises(AntsError, match=f"`world.piles` is {piles}; it must"):
            far_piles(3, piles=piles)
