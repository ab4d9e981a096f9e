"""Designs: the points that they draw, and the files that describe them wrongly."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taichi_ants import files
from taichi_ants.errors import AntsError
from taichi_ants.studies.design import Choices, Design, Range
from taichi_ants.studies.sweep import plan, sweep_of

SHARES = st.floats(0, 1)
AXES = {
    "a": Range(0.0, 1.0),
    "b": Range(1, 9, whole=True),
    "c": Choices(("x", "y")),
    "d": Choices((3,)),
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
    low, high = (one.at(each) for each in sorted((share, other)))
    assert one.low <= low <= high <= one.high
    assert isinstance(low, int) == one.whole


@given(ranges())
def test_a_range_has_both_ends(one):
    ends = one.at(0.0), one.at(1.0)
    assert ends == pytest.approx((one.low, one.high), rel=1e-9)
    assert one.log or ends == (one.low, one.high)


def test_scales_spread_values_as_they_say():
    shares = (np.arange(900) + 0.5) / 900
    whole = [Range(1, 9, whole=True).at(share) for share in shares]
    assert np.bincount(whole).tolist() == [0, *[100] * 9]
    assert Range(10.0, 1000.0, log=True).at(0.5) == pytest.approx(100)
    assert Range(10.0, 1000.0).at(0.5) == 505
    few = [Range(1, 64, log=True, whole=True).at(share) for share in shares]
    assert few.count(1) > 10 * few.count(32) > 0
    assert [Choices("abc").at(share) for share in (0, 0.33, 0.34, 0.99, 1)] == [*"aabcc"]


@pytest.mark.parametrize(
    ("kind", "sensitivity"), [("sobol", False), ("sobol", True), ("random", False)]
)
def test_more_samples_keep_the_first_points(kind, sensitivity):
    few, many = (Design(kind, n, 5, sensitivity).rows(AXES) for n in (8, 64))
    assert few == many[: len(few)]
    assert len(few) == (8 * 5 if sensitivity else 8)
    assert few == Design(kind, 8, 5, sensitivity).rows(AXES)
    assert few != Design(kind, 8, 6, sensitivity).rows(AXES)
    if not sensitivity:
        assert Design(kind, 11, 5).rows(AXES) == many[:11]
    assert all(row["d"] == 3 and list(row) == ["a", "b", "c", "d"] for row in many)


def test_a_latin_hypercube_has_a_point_in_each_part_of_each_setting():
    shares = Design("latin_hypercube", 10, 1).shares(3)
    assert np.sort((10 * shares).astype(int), axis=0).tolist() == [[n] * 3 for n in range(10)]
    assert (shares == Design("latin_hypercube", 10, 1).shares(3)).all()


def test_points_of_saltelli_differ_in_one_setting():
    shares = Design("sobol", 4, 0, True).shares(3).reshape(4, 5, 3)
    first, last = shares[:, 0], shares[:, -1]
    for k in range(3):
        expected = first.copy()
        expected[:, k] = last[:, k]
        assert (shares[:, 1 + k] == expected).all()


def test_the_points_of_a_file_are_built_from_drawn_values(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text(COLONY, "utf-8")
    sweep = plan({"file": path})
    assert len(sweep.settings) == len(set(sweep.study.points)) == 8
    for row, point in zip(sweep.settings, sweep.study.points, strict=True):
        assert point.task.pheromone.half_life == row["task.pheromone.half_life"]
        assert point.task.noise.slip == row["task.noise.slip"]
    assert sweep.facts()["design"] == {"design": "sobol", "design_seed": 0}
    path.write_text(COLONY.replace('"sobol"', '"latin_hypercube"'), "utf-8")
    assert plan({"file": path}).facts()["design"]["samples"] == 8


def test_declared_whole_numbers_need_no_key():
    text = COLONY.replace("ants = 2", "").replace(
        "task.noise.slip = { from = 0, to = 0.5 }", "ants = { from = 1, to = 9 }"
    )
    text += 'task.pheromone.level = { from = 9, to = 99, scale = "log" }\n'
    rows = sweep_of(files.tomllib.loads(text)).settings
    assert all(type(row[name]) is int for row in rows for name in ("ants", "task.pheromone.level"))


SLIP, HALF = "{ from = 0, to = 0.5 }", '{ from = 10, to = 1000, scale = "log" }'
WRONG = {
    "design": ('"sobol"', '"halton"', ["design is 'halton'", "latin_hypercube, sobol, random"]),
    "samples": ("samples = 8", "", ["samples is None"]),
    "samples of a grid": ('design = "sobol"', "", ["samples is for the designs latin_hypercube"]),
    "reversed": (SLIP, "{ from = 0.5, to = 0 }", ["slip is from 0.5 to 0; both must be a number"]),
    "key": (
        SLIP,
        "{ from = 0, too = 1 }",
        ["a key of the range task.noise.slip is 'too'", "from, to, scale"],
    ),
    "text": (SLIP, '{ from = "a", to = 1 }', ["slip is from 'a' to 1"]),
    "scale": (SLIP, '{ from = 0, to = 1, scale = "ln" }', ["slip.scale is 'ln'", "linear, log"]),
    "log of 0": (
        HALF,
        '{ from = 0, to = 9, scale = "log" }',
        ["half_life is from 0 to 9", "above 0 for the scale log"],
    ),
    "out of range": (SLIP, "{ from = 0, to = 1.5 }", ["noise.slip` is 1.5", "between 0 and 1"]),
    "whole": (
        f"task.noise.slip = {SLIP}",
        "capacity = { from = 1.5, to = 3 }",
        ["must be a whole number"],
    ),
    "below 1": (
        f"task.noise.slip = {SLIP}",
        "capacity = { from = 0, to = 3 }",
        ["capacity is 0"],
    ),
    "nothing varies": (
        f"half_life = {HALF}\ntask.noise.slip = {SLIP}",
        "half_life = 5",
        ["has single values only"],
    ),
    "grid": ('design = "sobol"\nsamples = 8', "", ["half_life is a range, but a grid needs lists"]),
    "sensitivity": ("sobol", "random", ["sensitivity = true with the design 'random'"]),
    "not a power": ("samples = 8", "samples = 9", ["samples = 9", "a power of 2"]),
    "against": ("[task]", "against.task.noise.slip = 0\n[task]", ["with a grid, it must be"]),
}


@pytest.mark.parametrize("name", WRONG)
def test_mistakes_are_named(name):
    old, new, words = WRONG[name]
    text = COLONY
    if name in ("sensitivity", "not a power"):
        text = text.replace("samples = 8", "samples = 8\nsensitivity = true")
    assert old in text
    with pytest.raises(AntsError) as error:
        sweep_of(files.tomllib.loads(text.replace(old, new, 1)))
    for word in words:
        assert word in str(error.value)


def test_a_missing_extra_is_named_with_the_command(monkeypatch):
    monkeypatch.setitem(sys.modules, "SALib", None)
    with pytest.raises(AntsError, match=r'pip install -e "\.\[sensitivity\]"'):
        Design.of({"design": "sobol", "samples": 8, "sensitivity": True})
