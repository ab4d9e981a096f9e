"""Ants that back up utilities: equal to the reference, and they find the shortest way."""

from __future__ import annotations

import numpy as np
import pytest
from random_worlds import random_world

from taichi_ants import worlds
from taichi_ants.baselines.utility import Foraging, forage
from taichi_ants.errors import AntsError
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.reference.baselines import UtilityColony
from taichi_ants.worlds import World, double_bridge

# Seven cells up, one way alone.
LINE = World((8, 2, 1), (0, 0, 0), foods=[(7, 0, 0)], obstacles=[(x, 1, 0) for x in range(1, 8)])


WORLDS = {
    "line": lambda: LINE,
    "bridge": lambda: double_bridge(5, 7),
    "paper": worlds.paper,
    **{f"drawn {n}": lambda n=n: random_world(n) for n in range(5)},
}
DEFAULTS = {
    **{"ants": 6, "capacity": 10, "discount": 0.9, "evaporation": 0.001},
    **{"exploration": 0.1, "momentum": 0.8},
}


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"capacity": 1, "ants": 20},
        {"capacity": 2, "discount": 0.37, "evaporation": 0.03, "seed": -3},
        {"exploration": 0.0, "momentum": 0.0, "evaporation": 0.0},
        {"exploration": 1.0, "momentum": 1.0, "evaporation": 1.0},
    ],
    ids=str,
)
@pytest.mark.parametrize("name", WORLDS)
def test_every_utility_delivery_and_path_equals_the_reference(name: str, settings: dict) -> None:
    world = WORLDS[name]()
    common = {"seed": 5, **DEFAULTS, **settings}
    ticks = 125 if name in ("bridge", "paper") else 65
    result = forage(world, colonies=2, ticks=ticks, **common)
    grid = AxialGrid(world.ranges)
    for number in range(2):
        colony = UtilityColony(world, colony=number, **common)
        lengths = []
        for tick in range(1, ticks + 1):
            colony.tick()
            if tick % 10 == 0:
                lengths.append(colony.path_length())
        assert result.deliveries[number].tolist() == colony.deliveries
        assert result.lengths[number].tolist() == lengths
        for row, goal in enumerate(("nest", "food")):
            levels = np.zeros(grid.size)
            for cell, level in colony.utilities[goal].items():
                levels[grid.index(cell)] = level
            assert np.array_equal(result.utilities[number, row], levels)


def test_utilities_by_hand() -> None:
    """One ant goes up a corridor and back; nothing evaporates."""
    world = World((4, 1, 1), (0, 0, 0), foods=[(3, 0, 0)])
    settings = {"ants": 1, "colonies": 1, "evaporation": 0, "exploration": 0, "discount": 0.5}
    result = forage(world, ticks=7, **settings)
    cells = world.grid.index([(x, 0, 0) for x in range(4)])
    nest, food = result.utilities[0][:, cells]
    # Ticks 1 to 3 carry the nest's reward up, 4 to 6 the food's down; in tick 7 the ant is at the
    # nest again, and what it backs up there is 1 + half of its neighbour's.
    assert nest.tolist() == [1.25, 0.5, 0.25, 0]
    assert food.tolist() == [0, 0.25, 0.5, 1]
    assert result.deliveries[0].tolist() == [0, 0, 0, 0, 0, 1, 0]
    assert result.first_delivery.tolist() == [6]


@pytest.mark.parametrize("capacity", [1, 10])
def test_all_colonies_find_a_shortest_way(capacity: int) -> None:
    result = forage(double_bridge(10, 15), capacity=capacity)
    assert result.shortest == 2 * (6 + 10 + 3)  # to the junction, over the bridge, to the pile
    assert (result.found > 0).all()
    assert (result.lengths[:, -1] == result.shortest).mean() > 0.8
    assert (result.deliveries[:, 500:].sum(axis=1) > 60).all()


def test_neither_threads_nor_other_colonies_change_a_colony() -> None:
    def run(**settings) -> Foraging:
        return forage(worlds.paper(), **{"ticks": 200, "colonies": 6, "ants": 16, **settings})

    first = run(threads=1)
    for again in (run(threads=2), run(colonies=9), run()):
        for name in ("deliveries", "lengths", "utilities"):
            assert np.array_equal(getattr(again, name)[:6], getattr(first, name))
    assert np.array_equal(run(ticks=157).deliveries, first.deliveries[:, :157])
    assert not np.array_equal(run(seed=1).utilities, first.utilities)
    assert len(np.unique(first.utilities, axis=0)) == 6


def test_moments_count_from_one() -> None:
    deliveries = np.array([[0, 2, 1], [1, 0, 0], [0, 0, 0]])
    lengths = np.array([[9, 8], [8, 0], [0, 12]])
    result = Foraging(8, deliveries, lengths, np.zeros((3, 2, 1)))
    assert result.first_delivery.tolist() == [2, 1, 0]
    assert result.found.tolist() == [20, 10, 0]
    assert Foraging(8, deliveries, lengths[:, :0], np.zeros((3, 2, 1))).found.tolist() == [0, 0, 0]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"ticks": 0}, "`ticks` is 0"),
        ({"ants": 1.5}, "`ants` is 1.5"),
        ({"colonies": 10**8}, "need too much memory; choose fewer colonies"),
        ({"capacity": 0}, "`capacity` is 0; it must be between 1"),
        ({"discount": 1}, "`discount` is 1; it must be above 0"),
        ({"discount": "0.9"}, "`discount` is '0.9'; it must be a number"),
        ({"evaporation": -0.1}, "`evaporation` is -0.1"),
        ({"exploration": 2}, "`exploration` is 2"),
        ({"momentum": float("nan")}, "`momentum` is nan"),
        ({"seed": "1"}, "`seed` is '1'"),
        ({"world": World((3, 3, 3), (0, 0, 0))}, "the world has no food"),
        ({"world": worlds.from_text("F\n  #\n#\n  #\nQ")}, "no food can be reached"),
        ({"world": None}, "world is None"),
    ],
)
def test_errors_name_what_is_wrong(given: dict, message: str) -> None:
    with pytest.raises(AntsError, match=message):
        forage(**{"world": LINE, **given})
