"""The common parts of the report pages: templates, players, drawings of intervals, and tables."""

from __future__ import annotations

import base64
import io
import math
import re
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from textwrap import wrap
from typing import Any, NamedTuple

import numpy as np

from taichi_ants.analysis.findings import Finding, Verdict
from taichi_ants.analysis.tables import figure, number
from taichi_ants.errors import count
from taichi_ants.viewer.frames import Recording
from taichi_ants.viewer.page import content_policy, part

_HERE = "taichi_ants.report"
# Scripts of the viewer: the data of a recording, the picture of the world, and the playback.
_PLAYING = ("history.js", "stage.js", "timeline.js")

# Sizes of drawings of intervals.
WIDTH, _MIDDLE, _NUMBERS, _LINE = 340.0, 15.0, 39.0, 15.0
_SIDE = 26.0  # space for a number
_SHOWN_PACKAGES = ("taichi_ants", "taichi", "numpy", "scipy", "matplotlib")
_LETTERS = 58  # characters of a line as wide as the drawing


def signed(text: Any) -> Any:
    """Return text with true minus signs before numbers, and other values unchanged."""
    plain = isinstance(text, str) and not hasattr(text, "__html__")
    return re.sub(r"(?<![\w.-])-(?=[\d.])", "\N{MINUS SIGN}", text) if plain else text


def fill(template: Path, **parts: Any) -> str:
    """Return a page as HTML from a file that extends base.html; text in `parts` is escaped."""
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    how: dict[str, Any] = {"autoescape": True, "trim_blocks": True, "lstrip_blocks": True}
    how |= {"finalize": signed, "undefined": StrictUndefined}
    style = part("colours.css") + part("report.css", _HERE)
    script = "\n".join([*map(part, _PLAYING), part("report.js", _HERE)])
    shared = {"style": style, "script": script}
    shared["policy"] = content_policy(f"\n{script}\n", f"\n{style}\n")
    parts |= {name: Markup(text) for name, text in shared.items()}
    page = Environment(loader=PackageLoader("taichi_ants", "report"), **how).from_string(
        template.read_text(encoding="utf-8")
    )
    return page.render(**parts)


class Player(NamedTuple):
    """A recording that plays on the page, with a title and a caption (`words`)."""

    title: str
    words: str
    recording: Recording

    @property
    def data(self) -> str:
        """The recording as base64."""
        return base64.b64encode(self.recording.to_bytes()).decode()


class Picture(NamedTuple):
    """An image, uint8 (height, width, 3), with alternative text (`words`)."""

    words: str
    image: np.ndarray

    @property
    def data(self) -> str:
        """A PNG with 64 colours as base64."""
        from PIL import Image

        file = io.BytesIO()
        Image.fromarray(self.image).quantize(64).save(file, "png")
        return base64.b64encode(file.getvalue()).decode()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.image.shape[1], self.image.shape[0]


class Shown(NamedTuple):
    """A finding in one setting, with the label and the unit of its effect."""

    setting: str
    finding: Finding
    label: str
    unit: str = ""

    @property
    def words(self) -> str:
        """The effect and its interval as text, also by the mean if that gives another verdict."""
        words, by_mean = _measured(self.finding, self.label, self.unit), self.finding.by_mean
        if by_mean and by_mean.verdict is not self.finding.verdict:
            told = _measured(by_mean, by_mean.contrast.label, self.unit)  # its contrast may differ
            words += f". With the mean instead of the IQM, {by_mean.verdict.value}: {told}"
        return words

    @property
    def drawing(self) -> str:
        """The interval as a picture (SVG)."""
        return interval_drawing(*self[1:])


def _measured(finding: Finding, label: str, unit: str) -> str:
    if finding.verdict is Verdict.NOT_TESTED:
        return label
    digits = 1 if finding.contrast.uses_iqm or abs(finding.effect) >= 10 else 2
    effect, low, high = (number(x, digits) for x in (finding.effect, finding.low, finding.high))
    known = math.isfinite(finding.low) and math.isfinite(finding.high)
    ends = f"between {low} and {high}" if known else "without an interval"
    return f"{label}: {f'{effect} {unit}'.rstrip()}, {ends}"


def interval_drawing(finding: Finding, label: str, unit: str = "") -> str:
    """Return a finding as an SVG element, empty without numbers; `label` and `unit` name the axis.

    The line is the interval and the dot is the effect. One band is the range that the criterion
    requires, the other one the differences that are too small to matter, as in `Criterion.judge`.
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
    ends = sorted({edge for edge in edges if math.isfinite(edge)})
    parts = [
        band(*wanted, "wanted"),
        band(-margin, margin, "small") if margin else "",
        *(f'<path class="edge" d="M{at(edge)} {_MIDDLE - 9}v18"/>' for edge in ends),
        f'<path class="span" d="M{low} {_MIDDLE}H{high}"/>',
        f'<circle cx="{at(finding.effect)}" cy="{_MIDDLE}" r="4.5"/>',
    ]
    labelled: list[float] = []
    for tick in sorted(ends, key=lambda edge: (edge != 0, edge)):
        if all(abs(at(tick) - at(other)) > _SIDE for other in labelled):
            labelled.append(tick)
            parts.append(text(figure(tick).replace("-", "\N{MINUS SIGN}"), at(tick), _NUMBERS))
    lines = wrap(axis, _LETTERS)
    for n, line in enumerate(lines, start=1):
        parts.append(text(line, WIDTH / 2, _NUMBERS + _LINE * n))
    height = _NUMBERS + _LINE * len(lines) + 5.0
    size = f'viewBox="0 0 {WIDTH:g} {height:g}" width="{WIDTH:g}" height="{height:g}"'
    return f'<svg class="interval" {size} aria-hidden="true">{"".join(parts)}</svg>'


class Statement(NamedTuple):
    """A row of a table that readers can sort and filter.

    `place` is the second column: the section of the paper, or the world. `verdicts` has the
    verdict in each further column. Facts and findings are shown on demand.
    """

    text: str
    place: str
    verdicts: Sequence[Verdict]
    facts: Mapping[str, str]
    shown: Sequence[Shown]


# In the order of the tallies on the page.
KINDS = (
    *(Verdict.SUPPORTED, Verdict.EQUIVALENT, Verdict.UNDECIDED),
    *(Verdict.CONTRADICTED, Verdict.NOT_TESTED, Verdict.TOO_FEW),
)


class Statements(NamedTuple):
    """A table of statements with a header for each column; `noun` is the word for them."""

    headers: Sequence[str]
    lines: Sequence[Statement]
    noun: str

    @property
    def kinds(self) -> list[Verdict]:
        """The verdicts that occur, in the order of `KINDS`."""
        return [kind for kind in KINDS if any(kind in line.verdicts for line in self.lines)]

    @property
    def tallies(self) -> list[tuple[str, list[tuple[Verdict, int]]]]:
        """The number of statements by verdict, for each column of verdicts."""
        columns = zip(*(line.verdicts for line in self.lines), strict=True)
        return [
            (header, [(kind, column.count(kind)) for kind in self.kinds if kind in column])
            for header, column in zip(self.headers[2:], columns, strict=True)
        ]


def setting_facts(settings: Mapping[str, Any]) -> dict[str, str]:
    """Return the settings of a study as text by name, each value of a list once."""
    facts = {}
    for name, value in settings.items():
        entries = value if isinstance(value, list) else [value]
        entries = [entry for entry in entries if entry is not None]
        numbers = all(isinstance(entry, int) and not isinstance(entry, bool) for entry in entries)
        if name == "seeds" and entries[1:]:
            facts["Seeds"] = f"{entries[0]} to {entries[-1]}"
        elif name not in ("version", "worlds", "world", "pool", "after"):
            values = sorted(set(entries)) if numbers else dict.fromkeys(map(_plain, entries))
            words = name.split(".", 1)[-1].replace("_", " ").replace(".", ", ")
            facts[words.capitalize()] = ", ".join(map(str, values))
    return {name: words for name, words in facts.items() if words}


def _plain(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)


def made_facts(made: Mapping[str, Any]) -> dict[str, str]:
    """Return the command, versions, machine and time of results as text, from their manifest."""
    shown = [item for item in made["packages"].items() if item[0] in _SHOWN_PACKAGES]
    packages = ", ".join(f"{name} {version}" for name, version in shown)
    changed = ", with changes that are not committed" if made.get("clean") is False else ""
    cpus = f"{made['cpus']} processors" if made["cpus"] != 1 else "one processor"
    facts = {
        "Command": made["command"],
        "Finished": made["finished"].replace("T", " ").replace("+00:00", " UTC"),
        "Commit": made["commit"] and made["commit"] + changed,
        "Versions": f"Python {made['python']}, {packages}",
        "Machine": f"{made['platform']}, {cpus}",
        "Time": f"{made['seconds']:.0f} seconds",
    }
    return {name: words for name, words in facts.items() if words}
