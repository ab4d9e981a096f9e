"""The published models of ants: equal to plain Python, and to what was published."""

from pathlib import Path

import ant_system
import goss
import numpy as np
import pytest
import utility
from ant_system import METHODS, search
from command_lines import assert_one_sentence, call_script, run
from goss import PUBLISHED, choices, class_shares, crossing_steps
from plain_baselines import UtilityColony, bridge_choices, tours
from random_worlds import random_world
from utility import forage

from taichi_ants import AntsError, worlds
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.worlds import World, double_bridge

# Seven cells up, one way alone.
LINE = World((8, 2, 1), (0, 0, 0), foods=[(7, 0, 0)], obstacles=[(x, 1, 0) for x in range(1, 8)])


def with_food(world: World) -> bool:
    return bool(len(world.foods) and world.reachable_foods().any())


WORLDS = {
    "line": LINE,
    "bridge": double_bridge(5, 7),
    **{f"drawn {n}": random_world(n) for n in range(5) if with_food(random_world(n))},
}


@pytest.mark.parametrize(
    ("short", "long", "settings"),
    [
        (9, 9, {}),
        (9, 19, {"seed": 2**64 - 1}),
        (1, 1, {"k": 0.37, "n": 3}),
        (400, 600, {"k": 1e9, "n": 8}),
        (9, 19, {"opens": 31, "k": 200, "seed": -3}),
    ],
)
def test_every_choice_equals_the_reference(short: int, long: int, settings: dict) -> None:
    took = choices(short, long, 5, **settings)
    reference = {"seed": 0, **settings}
    for colony in range(5):
        expected = bridge_choices(short, long, colony=colony, ants=1000, **reference)
        assert took[colony].tolist() == expected


def test_colonies_divide_as_published() -> None:
    assert [crossing_steps(ratio) for ratio in PUBLISHED] == [(9, 9), (9, 13), (9, 19)]
    for ratio, published in PUBLISHED.items():
        shares = class_shares(choices(*crossing_steps(ratio), 30_000))
        assert shares.sum() == pytest.approx(100)
        assert np.abs(shares - published).max() < 3
    late = choices(*crossing_steps(goss.LATE_RATIO), 5000, ants=2000, opens=1000)
    assert not late[:, :1000].any()
    assert np.abs(class_shares(late, 1501, 2000) - goss.PUBLISHED_LATE).max() < 1


def test_classes_by_hand() -> None:
    took = np.zeros((5, 20), np.uint8)
    for colony, short in enumerate((0, 1, 2, 9, 10)):
        took[colony, 10 : 10 + short] = 1
    # Shares of the last ten ants 0, 0.1, 0.2, 0.9 and 1.
    assert class_shares(took, 11, 20).tolist() == [40, 20, 0, 0, 40]
    assert class_shares(took, 1, 10).tolist() == [100, 0, 0, 0, 0]


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
            mean = np.mean(lengths) if lengths else np.nan
            assert np.array_equal(result.mean[colony, i], mean, equal_nan=True)


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
    common = {"ants": 6, "capacity": 10, "discount": 0.9, "evaporation": 0.001, "seed": 5}
    common |= {"exploration": 0.1, "momentum": 0.8, **settings}
    world, ticks = WORLDS[name], 125 if name == "bridge" else 65
    result = forage(world, colonies=2, ticks=ticks, **common)
    grid = AxialGrid(world.ranges)
    for number in range(2):
        colony, lengths = UtilityColony(world, colony=number, **common), []
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


def results(model: str, colonies: int = 6, **how: int) -> list[np.ndarray]:
    """Return arrays of some colonies."""
    if model == "goss":
        return [choices(9, 13, colonies, **how)]
    if model == "ant_system":
        found = search(worlds.paper(), iterations=20, ants=8, colonies=colonies, **how)
    else:
        found = forage(worlds.paper(), ticks=150, ants=16, colonies=colonies, **how)
    return [one for one in vars(found).values() if isinstance(one, np.ndarray)]


@pytest.mark.slow
def test_neither_threads_nor_other_colonies_change_a_colony(monkeypatch) -> None:
    monkeypatch.setattr(goss, "_LAUNCH", 4)
    models = ("goss", "ant_system", "utility")  # in turn: with other threads, Taichi restarts
    first, again = (
        {model: results(model, colonies, threads=threads) for model in models}
        for colonies, threads in ((6, 1), (9, 2))
    )
    for model in models:
        pairs = zip(again[model], first[model], strict=True)
        assert all(np.array_equal(one[:6], other) for one, other in pairs)
        assert not all(map(np.array_equal, results(model, seed=1, threads=2), first[model]))
        assert len(np.unique(first[model][0], axis=0)) > 1


@pytest.mark.parametrize("model", [search, forage])
def test_worlds_without_a_way_to_food_are_refused(model) -> None:
    for world, message in (
        (World((3, 3, 3), (0, 0, 0)), "the world has no food"),
        (worlds.from_text("F\n  #\n#\n  #\nQ"), "no food can be reached"),
    ):
        with pytest.raises(AntsError, match=message):
            model(world)


def test_scripts_print_a_row_for_each_case(kernels: Path, tmp_path: Path, capsys) -> None:
    done = run("goss", ["--colonies", 500], kernels, tmp_path)
    assert done.returncode == 0, done.stderr
    rows = [line.split() for line in done.stdout.splitlines() if "published" in line]
    assert rows[2] == ["2.0", "published", "15.0", "6.0", "6.0", "7.0", "66.0"]
    assert "a standard error of at most 2.2 percentage points" in " ".join(done.stdout.split())
    ant_system.print_table(
        ant_system.parse_arguments(["--iterations", "3", "--colonies", "2", "--ants", "4"])
    )
    rows = [line.split()[:3] for line in capsys.readouterr().out.splitlines()[2:]]
    assert rows[:2] == [["paper", "ant_system", "18"], ["paper", "max_min", "18"]]
    arguments = ["--seeds", "2", "--ants", "5", "--ticks", "300", "--room", "1", "3"]
    utility.print_table(utility.parse_arguments(arguments))
    rows = [line.split() for line in capsys.readouterr().out.strip().splitlines()[2:]]
    expected = [[kind, room] for kind in ("paper", "open", "piles", "bridge") for room in "13"]
    assert [row[:2] for row in rows] == expected
    how = {"ticks": 300, "ants": 5, "colonies": 4, "capacity": 3}
    each = [forage(worlds.paper(), seed=seed, **how) for seed in (0, 1)]
    assert rows[1][2] == f"{1000 * sum(one.deliveries.mean() for one in each) / 2:.0f}"


@pytest.mark.parametrize(
    ("name", "arguments", "said"),
    [
        ("ant_system", ["--worlds", "paper", "mars"], "double_bridge"),
        ("ant_system", ["--evaporation", 2], "`evaporation` is 2.0"),
        ("fixed_rules", ["--epsilon", 2], "epsilon` is 2.0"),
        ("fixed_rules", ["--worlds", "moon"], "invalid choice: 'moon'"),
        ("fixed_rules", ["--study", "nowhere"], "cannot read 'nowhere/seeds.csv'"),
        ("utility", ["--discount", 1], "`discount` is 1.0"),
        ("goss", ["--choices", 401], "--choices is 401; it must be even"),
    ],
)
def test_mistakes_end_in_a_sentence_and_nothing_else(
    name: str, arguments: list, said: str, capsys: pytest.CaptureFixture
) -> None:
    status, out, err = call_script(name, arguments, capsys)
    assert (status, out) == (2, "")
    assert_one_sentence(err)
    assert said in err
