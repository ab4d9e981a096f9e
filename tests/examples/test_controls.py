"""The scripts in experiments: their own computations, with inputs and results made by hand."""

import inspect
import runpy
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from ant_system import Search
from command_lines import EXPERIMENTS, run
from matplotlib.figure import Figure
from utility import Foraging

from taichi_ants import World
from taichi_ants.learners import registry as learners
from taichi_ants.worlds import double_bridge, paper

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

    def run(self, episodes: int, ticks: int):
        return self


def test_home_trail_averages_the_last_five_episodes(script):
    found = script("models/home_trail", Colony=Given, EPISODES=6)
    Given.deliveries = np.array([[100, 7], [1, 2], [2, 2], [3, 2], [4, 2], [5, 2]])
    results = found["measure"]([3, 9])
    assert table(results[1], "deliveries") == [(3.0,), (2.0,)] * 3
    rows = table(results[0], "model", "seed", "episode", "deliveries")
    assert rows[:2] == [("compass", 3, 0, 100), ("compass", 3, 1, 1)]
    assert rows[6] == ("compass", 9, 0, 7)
    assert len(rows) == 3 * 2 * 6


def test_shares_of_two_nests_by_hand(script):
    """Before the first delivery of a colony, its share is not known, and no mean is drawn."""
    found = script("models/two_nests", DISTANCES=((1, 2),), TICKS=40)
    given = np.array(
        [[[1, 1], [3, 1]], [[0, 0], [0, 5]], [[0, 0], [4, 4]]]
    )  # (seeds, times, nests)
    found["deliveries_over_time"] = lambda seeds, near, far: given
    results = found["measure"]([4, 7, 8])
    columns = ("share of the first nest", "loads of both")
    assert table(results[1], *columns) == [(0.75, 4), (0.0, 5), (0.5, 8)]
    rows = table(results[0], "seed", "tick", "first", "second")
    assert rows[:4] == [(4, 20, 1, 1), (4, 40, 3, 1), (7, 20, 0, 0), (7, 40, 0, 5)]
    axes = Figure().subplots()
    results[3](axes)
    (x,), (y,) = axes.lines[0].get_data()
    assert (x, y) == (40, 1.25 / 3)


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
    assert table(results[1], "share removed", "ticks to recover") == expected
    assert results[0][-1] == {"removed": 0.5, "seed": 2, "tick": 250, "ants": 95}


@pytest.mark.parametrize(
    ("ticks", "delivered", "expected"),
    [(1000, [[4, 6], [8, 7]], [6.0, 6.5]), (500, [[4, 6], [8, 7]], [12.0, 13.0])],
)
def test_deliveries_of_ants_that_misread_by_hand(script, ticks, delivered, expected):
    found = script("models/misreading", Colony=Given, TICKS=ticks)
    Given.deliveries = np.array(delivered)
    assert found["deliveries"](found["FORAGING"], 0.1, [0, 1]).tolist() == expected
    given = {"with trails": [5, 9], "without": [3, 10]}
    found["deliveries"] = lambda rules, *_: np.array(
        next(given[name] for name, one in found["RULES"].items() if one == rules)
    )
    rows, summary, *_ = found["measure"]([0, 1])
    assert table(rows, "misread", "seed", "difference")[:3] == [(0, 0, 2), (0, 1, -1), (0.01, 0, 2)]
    assert summary[0] == {"misread": 0, "with trails": 5, "without": 3, "difference": 2}


@pytest.mark.long
def test_ants_that_misread_all_cells_hardly_deliver(script):
    found = script("models/misreading", EPISODES=6, TICKS=300)
    never, always = (found["deliveries"](found["FORAGING"], rate, [0, 1, 2]) for rate in (0.0, 1.0))
    assert never.min() > 100
    assert always.max() < 0.02 * never.min()


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


def test_chosen_branches_by_hand(script):
    """A colony chooses with 80 % of its crossings on one branch; without any, it is left out."""
    given = np.array([0.75, 0.125, np.nan, 0.5])
    found = script("models/double_bridge", shares=lambda *_: given, BRIDGES={"equal": (20, 0)})
    rows, summary, *_ = found["measure"]([0, 1, 2, 3])
    assert [row["short_share"] for row in rows[:2]] == [0.75, 0.125]
    assert len(rows) == 2 * 4
    assert table(summary[:3], "short (%)", "one side (%)") == [(100, 0), (0, 100), (0, 0)]


@pytest.mark.slow
def test_sides_of_equal_branches_do_not_matter_and_a_closed_branch_does(script):
    found = script("models/double_bridge", TICKS=2000)
    model, short = found["MODELS"]["both ways"], found["SHORT"]
    equal = found["shares"](model, short, 0, 60)
    won = (equal > 0.5).sum()  # of 60 colonies: 30 with a standard deviation of 3.9
    assert abs(won - 30) < 15
    assert (np.abs(equal - 0.5) > 0.2).mean() > 0.5
    closed = found["shares"](model, short, 2000, 2)
    assert np.array_equal(closed, [0, 0])


def test_shares_of_foragers_by_hand(script):
    found = script("models/division_of_labour", DEMANDS=(0.5,), TICKS=200, ANTS=3)
    # (seeds, times, ants): the ant with the threshold 1 always forages, that with 9 never.
    forages = np.array([[[0, 1, 0], [0, 1, 1], [0, 1, 1], [0, 1, 0]]], bool)
    given = forages, np.array([[9.0, 1.0, 5.0]]), np.array([25])
    found["foraging_over_time"] = lambda seeds, demand: given
    results = found["measure"]([0])
    (row,) = results[1]
    assert row == {
        **{"demand": 0.5, "foragers": 0.5, "low thresholds": 1.0, "high thresholds": 0.0},
        "food per demand": 0.25,
    }
    rows = table(results[0], "tick", "foragers")
    assert rows == [(50, 1 / 3), (100, 2 / 3), (150, 2 / 3), (200, 1 / 3)]


def test_the_table_of_goss_by_hand(script, capsys):
    found = script("goss")

    def took(short, long, colonies, ants, opens, **others):
        """Of four colonies, one takes the short branch at last, and one each second time."""
        choices = np.zeros((colonies, ants), np.uint8)
        choices[0, ants - 2 :] = 1
        choices[1, ants - 1] = 1
        return choices

    found["choices"] = took
    found["print_table"](found["parse_arguments"](["--colonies", "4", "--choices", "4"]))
    printed = capsys.readouterr().out
    rows = [line.split()[-5:] for line in printed.splitlines() if " ours " in line]
    assert rows == [["50.0", "0.0", "25.0", "0.0", "25.0"]] * 4
    words = " ".join(printed.split())
    assert "ants 3 to 4 on the short branch; if it opens after ant 4, of ants 7 to 8" in words
    assert words.endswith("at most 25.0 percentage points.")


# A ring around obstacles, with two ways from the queen to food: 5 and 7 steps.
WAYS = World((3, 3, 3), (2, 0, 0), foods=[(0, 2, 1)], obstacles=[CENTRE, *RING])


def test_the_row_of_ant_system_by_hand(script):
    found = script("ant_system")
    best = np.array([[5, 4, 4], [5, 5, 5], [4, 6, 4]], np.int32)
    mean = np.array([[8.0, 6.0, 4.0], [np.nan, 6.0, 5.0], [9.0, 6.0, np.nan]])
    found["search"] = lambda *given, **settings: Search(4, best, mean, 0 * best)
    settings = found["parse_arguments"](["--colonies", "3"])
    row = found["row"](settings, WAYS, "max_min")
    assert row == ["4", "2/3", "2", "8.5", "4.5"]  # found in the iterations 2 and 1
    found["search"] = lambda *given, **settings: Search(3, best, mean, 0 * best)
    assert found["row"](settings, WAYS, "max_min") == ["3", "0/3", "-", "8.5", "4.5"]


def test_the_rules_and_rows_of_fixed_rules_by_hand(script):
    found = script("fixed_rules")
    assert found["rule"]("paper") == (
        "paper: without food F take, P stay, T straight, E open, else left; with food Q take, "
        "S any, E any, else left"
    )
    # Two episodes of two seeds; one episode is without any delivery.
    outcome = SimpleNamespace(
        deliveries=np.array([[10, 0], [20, 2]]),
        first_delivery=np.array([[4, -1], [6, 90]]),
        blocked=np.array([[1, 2], [3, 4]]),
        moves=np.array([[10, 10], [10, 10]]),
    )
    cells = found["row"](outcome, {})
    assert cells == ["8 [1, 15]", "1", "275", "25 %"]
    assert found["row"](outcome, {0: 25.0, 1: 11.0, 2: 99.0}) == [*cells, "18", "10 [10, 10]"]
    with pytest.raises(found["AntsError"], match="the study has no seed 1"):
        found["row"](outcome, {0: 25.0})
    assert found["NETLOGO"].half_life == pytest.approx(6.57881)  # 0.9^6.57881 = 1 / 2


def test_the_study_of_fixed_rules_by_hand(script, tmp_path):
    (tmp_path / "seeds.csv").write_text(
        "world_kind,rules,regime,ants,seed,deliveries,greedy\n"
        "paper,foraging,joint,64,0,50,60\n"
        "paper,foraging,open,64,0,1,1\n"
        "rocks,foraging,open,64,1,70,80\n"
        "rocks,foraging,joint,64,1,2,2\n",
        "utf-8",
    )
    assert script("fixed_rules")["read_study"](tmp_path) == {
        ("paper", "foraging", 64, "deliveries"): {0: 50},
        ("paper", "foraging", 64, "greedy"): {0: 60},
        ("rocks", "foraging", 64, "deliveries"): {1: 70},
        ("rocks", "foraging", 64, "greedy"): {1: 80},
    }


@pytest.mark.slow
def test_ants_with_fixed_rules_deliver_unless_they_explore(script):
    found = script("fixed_rules", EPISODES=2, TICKS=200)
    settings = found["parse_arguments"](["--seeds", "2"])
    given = settings, [paper(), paper()], found["task_in"]("paper", found["TASKS"]["foraging"])
    fixed, random = (found["evaluate"](*given, epsilon, 16).deliveries for epsilon in (0.01, 1.0))
    assert fixed.min() > 0
    assert random.max() < 0.5 * fixed.min()


def test_the_row_of_utilities_by_hand(script):
    found = script("utility")
    first = Foraging(
        8, np.array([[0, 2, 0, 2], [0, 0, 0, 0]]), np.array([[9, 8], [0, 12]]), np.zeros(1)
    )
    second = Foraging(
        4, np.array([[1, 1, 1, 1], [0, 0, 0, 4]]), np.array([[4, 4], [0, 0]]), np.zeros(1)
    )
    # Per 1000 ticks, the colonies of the seeds deliver 500 and 1000 food items. First deliveries
    # are in the ticks 2, 1 and 4; one colony has none, and counts with 4. Paths are shortest from
    # the ticks 20 and 10 on. At the end, three have the lengths 8 / 8, 12 / 8 and 4 / 4.
    expected = ["750 [500, 1000]", "3", "2/4", "15", "1.17", "3"]
    assert found["row"]([first, second]) == expected


@pytest.mark.parametrize(
    ("value", "reward", "largest", "error"),
    [(1, 2, 4, 3), (5, 0, 4, -0.6), (2, 0, 4, 0), (0, -1, 0, -0.2), (-3, -1, 0, 2)],
)
def test_td_errors_of_hysteretic_q_learning_by_hand(script, value, reward, largest, error):
    td_error = script("plugins/hysteretic")["td_error"]
    next_values = np.array([-9.0, largest, -9.0, -9.0, -9.0])
    assert td_error(value, reward, 0.5, next_values, 0, 0.3) == pytest.approx(error)


@pytest.mark.long
def test_offline_prints_three_tables(kernels, tmp_path):
    done = run("offline", ["--seeds", 2], kernels, tmp_path)
    assert done.returncode == 0, done.stderr
    behaviours = ("random", "epsilon", "a learner's")
    tables = [table.splitlines() for table in done.stdout.split("─\n")[1:]]
    rows = [[line for line in lines if line.startswith(behaviours)] for lines in tables]
    assert list(map(len, rows)) == [4 * 5, 3 * 3 * 3, 2 * 3 * 2]
    # With what exploits its knowledge, every learner delivers.
    best = [line for line in rows[0] if line.startswith("epsilon 0.1") and " 100000 " in line]
    assert best[0].count("1.00 [1.00, 1.00]") == 4
