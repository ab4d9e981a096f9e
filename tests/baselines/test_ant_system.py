"""Ant colony optimisation: equal to the reference, and it finds the shortest way."""

from __future__ import annotations

import numpy as np
import pytest
from random_worlds import random_world

from taichi_ants import worlds
from taichi_ants.baselines.ant_system import METHODS, Search, search
from taichi_ants.errors import AntsError
from taichi_ants.reference.baselines import tours
from taichi_ants.reference.geometry import neighbour
from taichi_ants.worlds import World, double_bridge

# Seven cells up, and a dead end beside them.
LINE = World((8, 2, 1), (0, 0, 0), foods=[(7, 0, 0)], obstacles=[(x, 1, 0) for x in range(1, 8)])


def reachable(world: World) -> bool:
    return bool(len(world.foods) and world.reachable_foods().any())


WORLDS = {
    "line": LINE,
    "bridge": double_bridge(5, 7),
    **{f"drawn {n}": random_world(n) for n in range(4) if reachable(random_world(n))},
}


@pytest.mark.parametrize("settings", [{}, {"alpha": 2}, {"max_steps": 12}], ids=str)
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", WORLDS)
def test_every_tour_is_as_long_as_the_references(name: str, method: str, settings: dict) -> None:
    common = {"iterations": 6, "ants": 4, "evaporation": 0.3, "seed": 5, **settings}
    result = search(WORLDS[name], method, colonies=3, **common)
    for colony in range(3):
        done = tours(WORLDS[name], method == "max_min", colony=colony, **common)
        for i, found in enumerate(done):
            lengths = [len(tour) for tour in found if tour]
            assert result.lost[colony, i] == 4 - len(lengths)
            assert result.best[colony, i] == min(lengths, default=0)
            if lengths:
                assert result.mean[colony, i] == np.mean(lengths)
            else:
                assert np.isnan(result.mean[colony, i])


def test_tours_of_the_reference_lead_to_food_without_loops() -> None:
    world = WORLDS["bridge"]
    for found in tours(world, True, 0, 0, 5, 5, 0.02):
        for tour in found:
            cells = [cell for cell, _ in tour]
            assert cells[0] == world.queen
            assert len(set(cells)) == len(cells)
            ahead = [neighbour(*arc) for arc in tour]
            assert ahead[:-1] == cells[1:]
            assert list(ahead[-1]) in world.foods.tolist()


@pytest.mark.parametrize("mirrored", [pytest.param(False, marks=pytest.mark.long), True])
def test_all_colonies_find_the_shorter_branch(mirrored: bool) -> None:
    result = search(double_bridge(10, 15, mirrored), iterations=200)
    assert result.shortest == 6 + 10 + 3  # to the junction, over the bridge, to the pile
    assert (result.found > 0).all()
    assert (result.best >= result.shortest).all()
    assert (result.best[:, -20:] < result.shortest + 5).all()
    assert result.mean[:, -1].mean() < 0.8 * result.mean[:, 0].mean()


def test_ant_system_settles_on_one_way() -> None:
    result = search(worlds.paper(), "ant_system", iterations=150)
    assert result.shortest == 18
    assert (result.best[:, -1] < result.best[:, 0]).all()
    assert (np.abs(result.mean[:, -1] - result.best[:, -1]) < 2).all()


def test_neither_threads_nor_other_colonies_change_a_tour() -> None:
    def run(**settings) -> Search:
        return search(worlds.paper(), iterations=20, ants=8, **{"colonies": 6, **settings})

    first = run(threads=1)
    for again in (run(threads=2), run(colonies=9), run()):
        for name in ("best", "mean", "lost"):
            assert np.array_equal(getattr(again, name)[:6], getattr(first, name))
    assert not np.array_equal(run(seed=1).mean, first.mean)
    assert len(np.unique(first.mean, axis=0)) == 6


def test_found_counts_from_one() -> None:
    best = np.array([[5, 4, 4], [4, 5, 6], [6, 0, 5]], np.int32)
    result = Search(4, best, best.astype(float), 0 * best)
    assert result.found.tolist() == [2, 1, 0]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"method": "best"}, "`method` is 'best'; it must be one of ant_system, max_min"),
        ({"iterations": 0}, "`iterations` is 0"),
        ({"ants": 1.5}, "`ants` is 1.5"),
        ({"colonies": 10**7}, "are allowed, so choose fewer"),
        ({"alpha": 0}, "`alpha` is 0; it must be between 1 and 8"),
        ({"evaporation": 0}, "`evaporation` is 0; it must be above 0"),
        ({"evaporation": True}, "`evaporation` is True"),
        ({"max_steps": 0}, "`max_steps` is 0"),
        ({"seed": "1"}, "`seed` is '1'"),
        ({"world": World((3, 3, 3), (0, 0, 0))}, "the world has no food"),
        ({"world": worlds.from_text("F\n  #\n#\n  #\nQ")}, "no food can be reached"),
        ({"world": None}, "world is None"),
    ],
)
def test_errors_name_what_is_wrong(given: dict, message: str) -> None:
    with pytest.raises(AntsError, match=message):
        search(**{"world": LINE, **given})
