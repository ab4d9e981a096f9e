"""A finding drawn: its interval, and the range that it was to lie in."""

from __future__ import annotations

import math

from taichi_ants.analysis.findings import Finding, Verdict
from taichi_ants.analysis.tables import figure

WIDTH, _MIDDLE, _HEIGHT = 340.0, 15.0, 44.0
_SIDE = 26.0  # room for the numbers at the ends


def interval_drawing(finding: Finding) -> str:
    """An SVG element; nothing where there are no numbers.

    The band is what the criterion asks for, the line the interval, the dot the effect. Of a
    difference, the hatched band is what is too small to matter.
    """
    if finding.verdict is Verdict.NOT_TESTED or not math.isfinite(finding.low + finding.high):
        return ""
    criterion = finding.contrast.criterion
    margin = criterion.margin
    wanted = criterion.low if margin is None else 0.0, criterion.high
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

    def label(value: float, y: float, kind: str = "") -> str:
        signed = figure(value).replace("-", "\N{MINUS SIGN}")
        return f'<text x="{at(value)}" y="{y}" class="{kind}">{signed}</text>'

    low, high = at(finding.low), at(finding.high)
    ends = sorted({one for one in edges if math.isfinite(one)})
    parts = [
        band(*wanted, "wanted"),
        band(-margin, margin, "small") if margin else "",
        *(f'<path class="edge" d="M{at(one)} {_MIDDLE - 9}v18"/>' for one in ends),
        f'<path class="span" d="M{low} {_MIDDLE}H{high}"/>',
        f'<circle cx="{at(finding.effect)}" cy="{_MIDDLE}" r="4.5"/>',
        *(label(one, 39) for one in _apart(ends, at)),
    ]
    size = f'viewBox="0 0 {WIDTH:g} {_HEIGHT:g}" width="{WIDTH:g}" height="{_HEIGHT:g}"'
    return f'<svg class="interval" {size} aria-hidden="true">{"".join(parts)}</svg>'


def _apart(values: list[float], at) -> list[float]:  # type: ignore[no-untyped-def]
    """Those whose labels do not lie on each other."""
    kept: list[float] = []
    for value in sorted(values, key=lambda one: (one != 0, one)):
        if all(abs(at(value) - at(other)) > 26 for other in kept):
            kept.append(value)
    return kept
