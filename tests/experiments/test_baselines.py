"""The published models of ants: equal to what was published, and to recorded results."""

from __future__ import annotations

import hashlib
from pathlib import Path

import ant_system
import goss
import numpy as np
import pytest
import utility
from ant_system import search
from command_lines import assert_one_sentence, call_script, run
from goss import PUBLISHED, choices, class_shares, crossing_steps
from utility import forage

from taichi_ants import AntsError, worlds
from taichi_ants.worlds import World, double_bridge

# The double bridge of Goss and others.


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


# Ant colony optimisation.


def test_all_colonies_find_the_shorter_branch() -> None:
    result = search(double_bridge(10, 15, mirrored=True), iterations=200, colonies=8)
    assert result.shortest == 6 + 10 + 3  # to the junction, over the bridge, to the pile
    assert (result.found > 0).all()
    assert (result.best[:, -20:] < result.shortest + 5).all()
    assert result.mean[:, -1].mean() < 0.8 * result.mean[:, 0].mean()


# Ants that back up utilities.


def test_all_colonies_find_a_shortest_way() -> None:
    result = forage(double_bridge(10, 15))
    assert result.shortest == 2 * (6 + 10 + 3)
    assert (result.found > 0).all()
    assert (result.deliveries[:, 500:].sum(axis=1) > 60).all()


# All three.


SEARCH = {"colonies": 3, "iterations": 6, "ants": 4, "evaporation": 0.3, "seed": 5}
FORAGE = {"colonies": 2, "ticks": 125, "ants": 6, "capacity": 2, "discount": 0.37}
FORAGE |= {"evaporation": 0.03, "exploration": 0.1, "momentum": 0.8, "seed": -3}
MODELS = {
    "0ce76566a5ea": lambda: choices(9, 19, 5, opens=31, k=200, seed=-3),
    "6dcf2a03bb11": lambda: search(double_bridge(5, 7), "ant_system", **SEARCH),
    "43d8681930f6": lambda: search(double_bridge(5, 7), "max_min", **SEARCH),
    "2d728eaec53f": lambda: forage(double_bridge(5, 7), **FORAGE),
}
ARRAYS = ("best", "lost", "mean", "deliveries", "lengths", "utilities")


@pytest.mark.parametrize("recorded", MODELS)
def test_results_are_those_that_equalled_a_plain_version_of_the_models(recorded: str) -> None:
    """Hashes of choices, tours and utilities, recorded when a version in plain Python had them."""
    result, digest = MODELS[recorded](), hashlib.sha256()
    found = [result] if isinstance(result, np.ndarray) else [vars(result).get(n) for n in ARRAYS]
    for array in found:
        digest.update(b"" if array is None else np.ascontiguousarray(array).tobytes())
    assert digest.hexdigest()[:12] == recorded


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
    assert "with a standard error of at most 2.2 percentage points" in done.stdout
    ant_system.print_table(
        ant_system.parse_arguments(["--iterations", "3", "--colonies", "2", "--ants", "4"])
    )
    rows = [line.split()[:3] for line in capsys.readouterr().out.splitlines()[1:]]
    assert rows[:2] == [["paper", "ant_system", "18"], ["paper", "max_min", "18"]]
    arguments = ["--seeds", "2", "--ants", "5", "--ticks", "300", "--room", "1", "3"]
    utility.print_table(utility.parse_arguments(arguments))
    rows = [line.split() for line in capsys.readouterr().out.splitlines()[1:]]
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
        ("goss", ["--choices", 10**7], "2000 GB"),
    ],
)
def test_mistakes_end_in_a_sentence_and_nothing_else(
    name: str, arguments: list, said: str, capsys: pytest.CaptureFixture
) -> None:
    status, out, err = call_script(name, arguments, capsys)
    assert (status, out) == (2, "")
    assert_one_sentence(err)
    assert said in err
