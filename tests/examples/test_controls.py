"""Controls of the scripts in experiments: what must not matter does not, and what must does.

Each script's own computations are checked with hand-made inputs whose results are computed by hand.
The controls of the no-entry model are in test_models.py.
"""

from __future__ import annotations

import inspect
import runpy
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from command_lines import EXPERIMENTS
from matplotlib.figure import Figure

from taichi_ants import World
from taichi_ants.learners import registry as learners
from taichi_ants.task import Caste, Threshold
from taichi_ants.worlds import double_bridge

# The centre of a world and the six cells around it, in order.
CENTRE, RING = (0, 0, 0), [(1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), (1, 0, 1)]


@pytest.fixture
def script(monkeypatch):
    """Load a script, and return its names; changes to them hold for its functions."""
    monkeypatch.setattr(learners.LEARNERS, "yours", dict(learners.LEARNERS.yours))

    def load(name: str, **changes: Any) -> dict[str, Any]:
        names = runpy.run_path(str(EXPERIMENTS / f"{name}.py"))
        functions = map(inspect.unwrap, filter(callable, names.values()))
        own = next(one.__globals__ for one in functions if one.__module__ == "<run_path>")
        assert own.keys() >= changes.keys()
        own.update(changes)
        return own

    return load


def table(rows: list[dict[str, Any]], *names: str) -> list[tuple[Any, ...]]:
    return [tuple(row[name] for name in names) for row in rows]


class Given:
    """A colony whose results are given: its deliveries, (episodes, worlds)."""

    deliveries: np.ndarray

    def __init__(self, *arguments: Any, **settings: Any) -> None:
        self.q_values = None

    def run(self, episodes: int, ticks: int) -> Given:
        return self


# experiments/models/home_trail.py


def test_home_trail_averages_the_last_five_episodes(script):
    found = script("models/home_trail", Colony=Given, EPISODES=6)
    Given.deliveries = np.array([[100, 7], [1, 2], [2, 2], [3, 2], [4, 2], [5, 2]])
    results = found["measure"]([3, 9])
    assert table(results.summary, "deliveries") == [(3.0,), (2.0,)] * 3
    rows = table(results.numbers, "model", "seed", "episode", "deliveries")
    assert rows[:2] == [("compass", 3, 0, 100), ("compass", 3, 1, 1)]
    assert rows[6] == ("compass", 9, 0, 7)
    assert len(rows) == 3 * 2 * 6


# experiments/models/two_nests.py


def test_shares_of_two_nests_by_hand(script):
    """Before the first delivery of a colony, its share is not known, and no mean is drawn."""
    found = script("models/two_nests", DISTANCES=((1, 2),), TICKS=40)
    given = np.array(
        [[[1, 1], [3, 1]], [[0, 0], [0, 5]], [[0, 0], [4, 4]]]
    )  # (seeds, times, nests)
    found["deliveries_over_time"] = lambda seeds, near, far: given
    results = found["measure"]([4, 7, 8])
    columns = ("share of the first nest", "loads of both")
    assert table(results.summary, *columns) == [(0.75, 4), (0.0, 5), (0.5, 8)]
    rows = table(results.numbers, "seed", "tick", "first", "second")
    assert rows[:4] == [(4, 20, 1, 1), (4, 40, 3, 1), (7, 20, 0, 0), (7, 40, 0, 5)]
    axes = Figure().subplots()
    results.draw(axes)
    (x,), (y,) = axes.lines[0].get_data()
    assert (x, y) == (40, 1.25 / 3)


# experiments/models/recovery.py


def test_times_to_recover_by_hand(script):
    found = script("models/recovery", SHARES=(0.0, 0.5), REMOVAL=100, TICKS=300)
    given = {
        0.0: np.array([[90, 95, 100, 100, 100, 100]] * 3),
        # The third colony has 95 % of 100 ants after 150 ticks; the second never has.
        0.5: np.array([[90, 95, 100, 50, 50, 50], [90, 95, 50, 60, 70, 94], [1, 1, 0, 1, 94, 95]]),
    }
    found["ants_over_time"] = lambda seeds, share: given[share]
    results = found["measure"]([0, 1, 2])
    expected = [(0.0, 0), (0.0, 0), (0.0, 0), (0.5, 0), (0.5, 200), (0.5, 150)]
    assert table(results.summary, "share removed", "ticks to recover") == expected
    assert results.numbers[-1] == {"removed": 0.5, "seed": 2, "tick": 250, "ants": 95}


# experiments/models/misreading.py


@pytest.mark.parametrize(
    ("ticks", "delivered", "expected"),
    [(1000, [[4, 6], [8, 7]], [6.0, 6.5]), (500, [[4, 6], [8, 7]], [12.0, 13.0])],
)
def test_deliveries_of_ants_that_misread_by_hand(script, ticks, delivered, expected):
    found = script("models/misreading", Colony=Given)
    Given.deliveries = np.array(delivered)
    assert found["deliveries"](found["FORAGING"], 0.1, 2, 1, ticks).tolist() == expected


# experiments/models/double_bridge.py


def test_shares_of_crossings_by_hand(script):
    """The last tenth counts: foragers and carriers, short branch then long, for each colony."""
    found = script("models/double_bridge", Colony=lambda *given, **settings: given)
    worlds = []

    def crossings(colony, bridge, ticks, opens):
        world, seeds = colony[0], list(colony[3])
        worlds.append((seeds, world == double_bridge(20, 24, mirrored=seeds[0] % 2 == 1)))
        assert world == double_bridge(**bridge)
        counts = np.full((10, 2, 2, len(seeds)), 50)
        last = {0: ((3, 1), (3, 1)), 1: ((0, 4), (1, 3)), 2: ((0, 0), (0, 0)), 3: ((5, 0), (0, 0))}
        counts[-1] = np.moveaxis([last[seed] for seed in seeds], 0, -1)
        return counts

    found["crossings"] = crossings
    for opens, several in ((0, [[0, 2], [1, 3]]), (5, [[0], [1], [2], [3]])):
        worlds.clear()
        shares = found["shares"](found["ON_THE_RETURN"], 24, opens, 4)
        assert np.array_equal(shares, [6 / 8, 1 / 8, np.nan, 1], equal_nan=True)
        assert worlds == [(some, True) for some in several]


@pytest.mark.parametrize(
    ("which", "expected"),
    [([True] * 9, "100 [100, 100]"), ([False] * 9, "  0 [0, 0]"), ([True, False] * 50, " 50 [")],
)
def test_intervals_of_shares(script, which, expected):
    interval = script("models/double_bridge")["interval"]
    assert interval(np.array(which)).startswith(expected)


# experiments/models/division_of_labour.py


def test_shares_of_foragers_by_hand(script):
    found = script("models/division_of_labour", DEMANDS=(0.5,), TICKS=200, ANTS=3)
    # (seeds, times, ants): the ant with the threshold 1 always forages, that with 9 never.
    forages = np.array([[[0, 1, 0], [0, 1, 1], [0, 1, 1], [0, 1, 0]]], bool)
    given = forages, np.array([[9.0, 1.0, 5.0]]), np.array([25])
    found["foraging_over_time"] = lambda seeds, demand: given
    results = found["measure"]([0])
    (row,) = results.summary
    assert row == {
        **{"demand": 0.5, "foragers": 0.5, "low thresholds": 1.0, "high thresholds": 0.0},
        "food per demand": 0.25,
    }
    rows = table(results.numbers, "tick", "foragers")
    assert rows == [(50, 1 / 3), (100, 2 / 3), (150, 2 / 3), (200, 1 / 3)]


# experiments/goss.py


# experiments/ant_system.py


# experiments/fixed_rules.py


# experiments/utility.py


# experiments/bridge.py


# experiments/plugins/hysteretic.py


@pytest.mark.parametrize(
    ("value", "reward", "largest", "error"),
    [(1, 2, 4, 3), (5, 0, 4, -0.6), (2, 0, 4, 0), (0, -1, 0, -0.2), (-3, -1, 0, 2)],
)
def test_td_errors_of_hysteretic_q_learning_by_hand(script, value, reward, largest, error):
    td_error = script("plugins/hysteretic")["td_error"].__wrapped__
    next_values = np.array([-9.0, largest, -9.0, -9.0, -9.0])
    assert td_error(value, reward, 0.5, next_values, 0, 0.3) == pytest.approx(error)


@pytest.mark.slow
def test_the_share_of_foragers_is_demand_by_relief_whatever_the_thresholds(script):
    """The closed form of Bonabeau et al. (1996): of thresholds of ratio 8, a third is active."""
    # Three ants, each in the only cell between the queen and a food, deliver equally often.
    grid = World((3, 3, 3), CENTRE).grid
    cells = {tuple(cell) for cell in grid.cells(np.flatnonzero(grid.exists)).tolist()}
    foods = [(2, 0, 0), (0, 2, 0), (0, 0, 2)]
    rock = sorted(cells - {CENTRE, *RING[::2], *foods})
    corridors = World((3, 3, 3), CENTRE, foods=foods, obstacles=rock)
    worlds = SimpleNamespace(open_world=lambda seed, ranges: corridors)
    found = script("models/division_of_labour", worlds=worlds, ANTS=3, TICKS=10_000, STEP=1)
    found["WORKERS"] = {
        "major": Caste(share=1 / 3, threshold=Threshold("fixed", value=80)),
        "minor": Caste(share=2 / 3, threshold=Threshold("fixed", value=10)),
    }
    forages, _, deliveries = found["foraging_over_time"](range(4), 100.0)
    rate = deliveries.sum() / forages.sum()  # of a forager, per tick
    demand = rate  # a third of what three foragers would deliver
    forages, thresholds, _ = found["foraging_over_time"](range(4), demand)
    assert np.allclose(forages[:, 1000:].mean(axis=(1, 2)), 1 / 3, atol=0.005)
    majors = np.where(thresholds == 80, forages.mean(axis=1), np.nan)
    minors = np.where(thresholds == 10, forages.mean(axis=1), np.nan)
    assert (np.nanmean(minors, axis=1) > 3 * np.nanmean(majors, axis=1)).all()
