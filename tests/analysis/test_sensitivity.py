"""Sensitivity indices, for functions whose indices are known."""

from __future__ import annotations

import numpy as np
import pytest
from SALib.test_functions import Ishigami

from taichi_ants.analysis import sensitivity
from taichi_ants.analysis.sensitivity import indices, seed_share
from taichi_ants.studies.design import Design

NAMES = ("x1", "x2", "x3")
# For a = 7 and b = 0.1, from the formulas of Ishigami and Homma (1990).
FIRST, TOTAL = (0.3139, 0.4424, 0.0), (0.5576, 0.4424, 0.2437)


@pytest.fixture(scope="module")
def ishigami():
    shares = Design("sobol", 1024, 3, True).shares(3)
    return Ishigami.evaluate((2 * shares - 1) * np.pi)


def test_indices_of_ishigami(ishigami):
    found = indices("y", NAMES, ishigami[:, None])
    assert [one.setting for one in found] == list(NAMES)
    for one, first, total in zip(found, FIRST, TOTAL, strict=True):
        assert one.first_order == pytest.approx(first, abs=0.02)
        assert one.total == pytest.approx(total, abs=0.02)
        assert one.first_order_low < first < one.first_order_high
        assert one.total_low < total < one.total_high
        assert one.first_order_high - one.first_order_low < 0.25
    again = indices("y", NAMES, ishigami[:, None])  # the same bootstrap
    assert [one[:-2] for one in found] == [one[:-2] for one in again]
    assert {one.left_out for one in found} == {0}


@pytest.mark.parametrize("variance", [0.0, 5.0, 200.0])
def test_the_share_of_seeds(ishigami, variance):
    """Noise of each run counts; what a seed adds to all points does not."""
    random = np.random.default_rng(1)
    seeds = 4
    noise = random.normal(0, np.sqrt(variance), (len(ishigami), seeds))
    values = ishigami[:, None] + noise + random.normal(0, 100, seeds)
    expected = variance / seeds / (ishigami.var() + variance / seeds)
    assert seed_share(values, 3) == pytest.approx(expected, rel=0.1, abs=1e-9)
    found = indices("y", NAMES, values)
    assert found[0].seed_share == seed_share(values, 3)
    of_nothing = found[1].total - TOTAL[1] * (1 - expected)  # x2 interacts with nothing
    assert of_nothing == pytest.approx(expected, abs=0.06)


def test_the_share_of_one_seed_is_unknown(ishigami):
    assert np.isnan(seed_share(ishigami[:, None], 3))
    assert "make -" in sensitivity.report({"y": indices("y", NAMES, ishigami[:, None])}, 1)


def test_groups_with_a_point_without_a_value_are_left_out(ishigami):
    values = np.stack([ishigami, ishigami + 1], axis=1)
    kept = np.delete(values, np.s_[5:10], axis=0)  # the second group of 3 + 2 points
    values[7] = np.nan
    found, wanted = indices("y", NAMES, values), indices("y", NAMES, kept)
    assert [one[:8] for one in found] == [one[:8] for one in wanted]
    assert {one.left_out for one in found} == {5}
    assert "5 points are left out, because" in sensitivity.report({"y": found}, 2)
    values[7] = kept[2, 0], np.nan  # one of two seeds has a value
    assert {one.left_out for one in indices("y", NAMES, values)} == {0}


def test_constant_and_missing_values_have_no_indices(ishigami):
    values = ishigami[:, None].copy()
    values[7:-10:5] = np.nan  # leaves the first and the last two groups
    assert indices("gaps", NAMES, values)[0].left_out == len(values) - 3 * 5
    values[7::5] = np.nan
    found = {
        "gaps": indices("gaps", NAMES, values),
        "flat": indices("flat", NAMES, 0 * ishigami[:15, None]),
    }
    assert found == {"gaps": [], "flat": []}
    text = sensitivity.report(found, 1)
    assert "gaps has no indices" in text
    assert "flat has no indices" in text


def test_the_report_begins_with_the_largest_total_index(ishigami):
    lines = sensitivity.report({"y": indices("y", NAMES, ishigami[:, None])}, 1).splitlines()
    assert [line.split()[0] for line in lines[2:5]] == ["x1", "x2", "x3"]
