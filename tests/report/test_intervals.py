"""Findings as drawings: the dot lies where the effect is, the band where it was to be."""

from __future__ import annotations

import re
from html import escape, unescape

import numpy as np
import pytest

from taichi_ants.analysis.findings import Contrast, Criterion, Finding, Verdict, above
from taichi_ants.report.page import WIDTH, interval_drawing


def finding(criterion: Criterion, effect: float, low: float, high: float) -> Finding:
    contrast = Contrast("one minus other", np.zeros(3), criterion)
    return Finding(contrast, criterion.judge(low, high), effect, low, high, 0.99)


def drawing(one: Finding) -> str:
    return interval_drawing(one, "one minus other", "steps")


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
    drawn = numbers(drawing(one))
    (low, high), (left, right) = drawn["span"], drawn["wanted"]
    assert low < drawn["dot"][0] < high
    assert 0 < min(low, left) < max(high, right) < WIDTH
    inside, outside = left <= low and high <= right, high < left or right < low
    assert inside == (verdict is Verdict.SUPPORTED)
    assert outside == (verdict is Verdict.CONTRADICTED)


@pytest.mark.parametrize("low", [-14.0, -9.0, -4.0, -1.5, 0.5, 3.0, 11.0])
@pytest.mark.parametrize("width", [1.0, 4.0, 8.0])
@pytest.mark.parametrize("least", [2.0, 10.0])
def test_the_verdict_is_the_band_that_holds_the_line(low, width, least) -> None:
    """So a dot in the band of what is too small to matter never supports or contradicts."""
    one = finding(Criterion(least, margin=2.0), low + width / 2, low, low + width)
    drawn = numbers(drawing(one))
    within = {
        kind: drawn[kind][0] <= drawn["span"][0] and drawn["span"][1] <= drawn[kind][1]
        for kind in ("wanted", "small")
    }
    assert within["wanted"] == (one.verdict is Verdict.SUPPORTED)
    assert within["small"] == (one.verdict is Verdict.EQUIVALENT)
    if drawn["small"][0] <= drawn["dot"][0] <= drawn["small"][1]:
        assert one.verdict in (Verdict.EQUIVALENT, Verdict.UNDECIDED)


@pytest.mark.parametrize("label", ["one minus other", ("epsilon < 0.3, " * 12).strip()])
def test_the_axis_has_a_name_and_a_unit(label: str) -> None:
    one = finding(above(1.0), 3.0, 2.0, 4.0)
    svg = interval_drawing(one, label, "steps")
    height = float(re.findall(r'height="([\d.]+)" aria', svg)[0])
    lines = re.findall(r'<text x="[\d.]+" y="([\d.]+)">([^<]*)</text>', svg)
    named = [words for y, words in lines if float(y) > 39]
    assert " ".join(named) == escape(f"{label} (steps), mean of 3 seeds")
    assert max(float(y) for y, _ in lines) < height
    assert max(map(len, map(unescape, named))) <= 58


@pytest.mark.parametrize("ends", [(1.0, np.nan, np.nan), (np.nan, np.nan, np.nan)])
def test_without_an_interval_there_is_no_drawing(ends) -> None:
    assert drawing(finding(above(), *ends)) == ""
