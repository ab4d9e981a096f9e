"""Designs: the points that they draw, wrong files, and indices of functions that are known."""

import numpy as np
import pytest
import SALib.analyze.sobol
import SALib.sample.sobol
from hypothesis import given
from hypothesis import strategies as st
from SALib.test_functions import Ishigami

from taichi_ants import files
from taichi_ants.analysis.sensitivity import indices
from taichi_ants.analysis.statistics import RANDOM_SEED
from taichi_ants.errors import AntsError
from taichi_ants.studies.design import Design, Range, value_at
from taichi_ants.studies.sweep import plan, sweep_of

SHARES, NAMES = st.floats(0, 1), ("x1", "x2", "x3")
AXES = {
    "a": Range(0.0, 1.0),
    "b": Range(1, 9, whole=True),
    "c": ["x", "y"],
    "d": [3],
}
COLONY = """
kind = "colony"
measures = ["deliveries"]
seeds = 2
ants = 2
episodes = 0
ticks = 20
rollouts = 1
policy = "trail_follower"
design = "sobol"
samples = 8

[task]
pheromone.evaporation = "exponential"

[vary]
task.pheromone.half_life = { from = 10, to = 1000, scale = "log" }
task.noise.slip = { from = 0, to = 0.5 }
"""


@st.composite
def ranges(draw):
    log, whole = draw(st.booleans()), draw(st.booleans())
    if whole:
        ends = st.integers(1 if log else -(2**40), 2**40)
    else:
        ends = st.floats(1e-300 if log else -1e300, 1e300)
    low, high = sorted(draw(st.lists(ends, min_size=2, max_size=2, unique=True)))
    return Range(low, high, log, whole)


@given(ranges(), SHARES, SHARES)
def test_values_lie_in_the_range_and_rise_with_the_share(one, share, other):
    low, high = (value_at(one, each) for each in sorted((share, other)))
    assert one.low <= low <= high <= one.high
    assert isinstance(low, int) == one.whole


@given(ranges())
def test_a_range_has_both_ends(one):
    ends = value_at(one, 0.0), value_at(one, 1.0)
    assert ends == pytest.approx((one.low, one.high), rel=1e-9)
    assert one.log or ends == (one.low, one.high)


def test_scales_spread_values_as_they_say():
    shares = (np.arange(900) + 0.5) / 900
    whole = [value_at(Range(1, 9, whole=True), share) for share in shares]
    assert np.bincount(whole).tolist() == [0, *[100] * 9]
    assert value_at(Range(10.0, 1000.0, log=True), 0.5) == pytest.approx(100)
    assert value_at(Range(10.0, 1000.0), 0.5) == 505
    few = [value_at(Range(1, 64, log=True, whole=True), share) for share in shares]
    assert few.count(1) > 10 * few.count(32) > 0
    assert [value_at("abc", share) for share in (0, 0.33, 0.34, 0.99, 1)] == [*"aabcc"]


@pytest.mark.parametrize("sensitivity", [False, True])
def test_more_samples_keep_the_first_points(sensitivity):
    few, many = (Design("sobol", n, 5, sensitivity).rows(AXES) for n in (8, 64))
    assert few == many[: len(few)]
    assert len(few) == (8 * 5 if sensitivity else 8)
    assert few == Design("sobol", 8, 5, sensitivity).rows(AXES)
    assert few != Design("sobol", 8, 6, sensitivity).rows(AXES)
    assert all(row["d"] == 3 and list(row) == ["a", "b", "c", "d"] for row in many)


def test_points_and_indices_are_those_of_salib():
    problem = {"num_vars": 3, "names": NAMES, "bounds": [[0, 1]] * 3}
    shares = Design("sobol", 64, 7, True).shares(3)
    how = {"calc_second_order": False}
    assert (shares == SALib.sample.sobol.sample(problem, 64, **how, seed=7)).all()
    y = Ishigami.evaluate((2 * shares - 1) * np.pi)
    how |= {"num_resamples": 1000, "seed": RANDOM_SEED}
    found, ours = SALib.analyze.sobol.analyze(problem, y, **how), indices("y", NAMES, y[:, None])
    for salib, name in (("S1", "first_order"), ("ST", "total")):
        assert found[salib] == pytest.approx([row[name] for row in ours], rel=1e-12)
        highest = found[salib] + found[f"{salib}_conf"]
        assert highest == pytest.approx([row[f"{name}_high"] for row in ours], rel=1e-12)


def test_the_points_of_a_file_are_built_from_drawn_values(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text(COLONY, "utf-8")
    sweep = plan({"file": path})
    assert len(sweep.settings) == len(set(sweep.study.points)) == 8
    for row, point in zip(sweep.settings, sweep.study.points, strict=True):
        assert point.task.pheromone.half_life == row["task.pheromone.half_life"]
        assert point.task.noise.slip == row["task.noise.slip"]
    assert sweep.facts()["design"] == "sobol"


def test_declared_whole_numbers_need_no_key():
    text = COLONY.replace("ants = 2", "").replace(
        "task.noise.slip = { from = 0, to = 0.5 }", "ants = { from = 1, to = 9 }"
    )
    text += 'task.pheromone.level = { from = 9, to = 99, scale = "log" }\n'
    rows = sweep_of(files.tomllib.loads(text)).settings
    assert all(type(row[name]) is int for row in rows for name in ("ants", "task.pheromone.level"))


SLIP, HALF = "{ from = 0, to = 0.5 }", '{ from = 10, to = 1000, scale = "log" }'
RANGE = "it must be a range with the keys from and to"
WRONG = {
    "design": ('"sobol"', '"halton"', ["`design` is 'halton'", "one of grid, sobol"]),
    "samples": ("samples = 8", "", ["samples is None; it must be a power of 2"]),
    "samples of a grid": ('design = "sobol"', "", ["`samples` is 8; leave it out unless"]),
    "reversed": (SLIP, "{ from = 0.5, to = 0 }", ["slip is {'from': 0.5, 'to': 0}", RANGE]),
    "scale": (SLIP, '{ from = 1, to = 2, scale = "ln" }', ["'scale': 'ln'", "linear or, if"]),
    "log of 0": (HALF, '{ from = 0, to = 9, scale = "log" }', ["if both are above 0, log"]),
    "out of range": (SLIP, "{ from = 0, to = 1.5 }", ["noise.slip` is 1.", "between 0 and 1"]),
    "whole": (
        f"task.noise.slip = {SLIP}",
        "capacity = { from = 1.5, to = 3 }",
        ["which are whole numbers"],
    ),
    "nothing varies": (
        f"half_life = {HALF}\ntask.noise.slip = {SLIP}",
        "half_life = 5",
        ["has single values only"],
    ),
    "grid": ('design = "sobol"\nsamples = 8', "", ["half_life is a range, but a grid needs lists"]),
    "not a power": ("samples = 8", "samples = 9", ["samples is 9; it must be a power of 2"]),
    "against": ("[task]", "against.task.noise.slip = 0\n[task]", ["with a grid, it must be"]),
}


@pytest.mark.parametrize("name", WRONG)
def test_mistakes_are_named(name):
    old, new, words = WRONG[name]
    assert old in COLONY
    with pytest.raises(AntsError) as error:
        sweep_of(files.tomllib.loads(COLONY.replace(old, new, 1)))
    for word in words:
        assert word in str(error.value)


def test_constant_and_missing_values_have_no_indices():
    ishigami = Ishigami.evaluate((2 * Design("sobol", 64, 3, True).shares(3) - 1) * np.pi)
    values = np.stack([ishigami, ishigami + 1], axis=1)
    values[7] = ishigami[7], np.nan  # one of two seeds has a value
    assert len(indices("y", NAMES, values)) == 3
    values[7] = np.nan
    assert indices("gaps", NAMES, values) == []
    assert indices("flat", NAMES, 0 * ishigami[:15, None]) == []
