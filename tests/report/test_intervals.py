"""Findings as drawings: the dot lies where the effect is, the band where it was to be."""

from __future__ import annotations

import re

import numpy as np
import pytest

from taichi_ants.analysis.findings import Contrast, Criterion, Finding, Verdict, above
from taichi_ants.report.intervals import WIDTH, interval_drawing


def finding(criterion: Criterion, effect: float, low: float, high: float) -> Finding:
    contrast = Contrast("one minus other", np.zeros(3), criterion)
    return Finding(contrast, criterion.judge(low, high), effect, low, high, 0.99)


def numbers(svg: str) -> dict[str, tuple[float, ...]]:
    found = {"dot": (float(re.findall(r'cx="([^"]*)"', svg)[0]),)}
    found["span"] = tuple(
        map(float, re.findall(r'class="span" d="M([\d.]+) 15.0H([\d.]+)', svg)[0])
    )
    for kind in ("wanted", "small"):
        for x, width in re.findall(rf'class="{kind}" x="([^"]*)" width="([^"]*)"', svg):
            found[kind] = float(x), float(x) + float(width)
    return found


@pytest.mark.parametrize(
    ("criterion", "ends", "verdict"),
    [
        (above(1.0), (3.0, 2.0, 4.0), Verdict.SUPPORTED),
        (above(1.0), (-300.0, -400.0, -200.0), Verdict.CONTRADICTED),
        (Criterion(44, 46), (45.0, 44.5, 45.5), Verdict.SUPPORTED),
        (Criterion(-np.inf, 1.0), (5.0, 4.0, 6.0), Verdict.CONTRADICTED),
        (Criterion(0.98), (0.99, 0.97, 1.0), Verdict.UNDECIDED),
    ],
)
def test_the_interval_lies_in_the_band_where_it_is_supported(criterion, ends, verdict) -> None:
    one = finding(criterion, *ends)
    assert one.verdict is verdict
    drawn = numbers(interval_drawing(one))
    (low, high), (left, right) = drawn["span"], drawn["wanted"]
    assert low < drawn["dot"][0] < high
    assert 0 < min(low, left) < max(high, right) < WIDTH
    inside, outside = left <= low and high <= right, high < left or right < low
    assert inside == (verdict is Verdict.SUPPORTED)
    assert outside == (verdict is Verdict.CONTRADICTED)


def test_what_is_too_small_to_matter_is_marked() -> None:
    one = finding(above(1.0), 0.1, -0.5, 0.5)
    drawn = numbers(interval_drawing(one))
    assert drawn["small"][0] < drawn["span"][0] < drawn["span"][1] < drawn["small"][1]


@pytest.mark.parametrize("ends", [(1.0, np.nan, np.nan), (np.nan, np.nan, np.nan)])
def test_without_an_interval_there_is_no_drawing(ends) -> None:
    assert interval_drawing(finding(above(), *ends)) == ""


def test_one_value_only_is_drawn() -> None:
    assert "circle" in interval_drawing(finding(above(), 0.0, 0.0, 0.0))
