"""Drawings of findings: the interval, and the regions that decide the verdict."""

from __future__ import annotations

import math
from html import escape
from textwrap import wrap

from taichi_ants.analysis.findings import Finding, Verdict
from taichi_ants.analysis.tables import figure
from taichi_ants.errors import count

WIDTH, _MIDDLE, _NUMBERS, _LINE = 340.0, 15.0, 39.0, 15.0
_SIDE = 26.0  # room for a number
_LETTERS = 58  # of a line that is as wide as the drawing


def interval_drawing(finding: Finding, label: str, unit: str = "") -> str:
    """Return a finding as an SVG element, empty without numbers; `label` and `unit` name the axis.

    The line is the interval, the dot the effect. One band is the range in which the criterion wants
    the effect, another one the differences that are too small to matter: the regions by which
    `Criterion.judge` decides.
    """
    if finding.verdict is Verdict.NOT_TESTED or not math.isfinite(finding.low + finding.high):
        return ""
    criterion, contrast = finding.contrast.criterion, finding.contrast
    margin, wanted = criterion.margin, (criterion.low, criterion.high)
    estimator = "IQM" if contrast.uses_iqm else "mean"
    axis = f"{label}{f' ({unit})' if unit else ''}, {estimator} of {count(contrast.seeds, 'seed')}"
    edges = [*wanted, *(() if margin is None else (-margin, margin))]
    shown = [finding.low, finding.high, *filter(math.isfinite, edges)]
    room = 0.06 * (max(shown) - min(shown)) or 1.0
    left, right = min(shown) - room, max(shown) + room

    def at(value: float) -> float:
        share = (min(max(value, left), right) - left) / (right - left)
        return round(_SIDE + share * (WIDTH - 2 * _SIDE), 1)

    def band(low: float, high: float, kind: str) -> str:
        size = f'x="{at(low)}" width="{at(high) - at(low):.1f}" y="{_MIDDLE - 9}" height="18"'
        return f'<rect class="{kind}" {size}/>'

    def text(words: str, x: float, y: float) -> str:
        return f'<text x="{x:g}" y="{y:g}">{escape(words)}</text>'

    low, high = at(finding.low), at(finding.high)
    ends = sorted({one for one in edges if math.isfinite(one)})
    parts = [
        band(*wanted, "wanted"),
        band(-margin, margin, "small") if margin else "",
        *(f'<path class="edge" d="M{at(one)} {_MIDDLE - 9}v18"/>' for one in ends),
        f'<path class="span" d="M{low} {_MIDDLE}H{high}"/>',
        f'<circle cx="{at(finding.effect)}" cy="{_MIDDLE}" r="4.5"/>',
    ]
    labelled: list[float] = []
    for one in sorted(ends, key=lambda one: (one != 0, one)):
        if all(abs(at(one) - at(other)) > _SIDE for other in labelled):
            labelled.append(one)
            signed = figure(one).replace("-", "\N{MINUS SIGN}")
            parts.append(text(signed, at(one), _NUMBERS))
    lines = wrap(axis, _LETTERS)
    below = enumerate(lines, start=1)
    parts += [text(line, WIDTH / 2, _NUMBERS + _LINE * number) for number, line in below]
    height = _NUMBERS + _LINE * len(lines) + 5.0
    size = f'viewBox="0 0 {WIDTH:g} {height:g}" width="{WIDTH:g}" height="{height:g}"'
    return f'<svg class="interval" {size} aria-hidden="true">{"".join(parts)}</svg>'
