"""The common parts of the report pages: templates, players, and tables."""

from __future__ import annotations

import base64
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from taichi_ants.analysis.findings import Finding, Verdict
from taichi_ants.analysis.tables import number
from taichi_ants.errors import count
from taichi_ants.rendering.writers import png
from taichi_ants.report.odd import in_words
from taichi_ants.viewer.page import Recording, content_policy, part

_HERE = "taichi_ants.report"
# Scripts of the viewer: the data of a recording, the picture of the world, and the playback.
_PLAYING = ("history.js", "stage.js", "timeline.js")

_SHOWN_PACKAGES = ("taichi_ants", "taichi", "numpy", "scipy", "matplotlib")


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
    """An image of a `shape` as a PNG in base64 (`data`), with alternative text (`words`)."""

    words: str
    shape: tuple[int, ...]
    data: str

    @classmethod
    def of(cls, words: str, image: np.ndarray) -> Picture:
        """Return the picture of an image, uint8 (height, width, 3)."""
        return cls(words, image.shape, base64.b64encode(png(image)).decode())


class ShownFinding(NamedTuple):
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


def _measured(finding: Finding, label: str, unit: str) -> str:
    if finding.verdict is Verdict.NOT_TESTED:
        return label
    digits = 1 if finding.contrast.uses_iqm or abs(finding.effect) >= 10 else 2
    effect, low, high = (number(x, digits) for x in (finding.effect, finding.low, finding.high))
    known = math.isfinite(finding.low) and math.isfinite(finding.high)
    ends = f"between {low} and {high}" if known else "without an interval"
    return f"{label}: {f'{effect} {unit}'.rstrip()}, {ends}"


class Statement(NamedTuple):
    """A row of a table that readers can sort and filter.

    `place` is the second column: the section of the paper, or the world. `verdicts` has the
    verdict in each further column. Facts and findings are shown on demand.
    """

    text: str
    place: str
    verdicts: Sequence[Verdict]
    facts: Mapping[str, str]
    shown: Sequence[ShownFinding]


# In the order of the tallies on the page.
_ORDER = "supported", "equivalent", "undecided", "contradicted", "not tested", "too few seeds"


class Statements(NamedTuple):
    """A table of statements with a header for each column; `noun` is the word for them."""

    headers: Sequence[str]
    lines: Sequence[Statement]
    noun: str

    @property
    def kinds(self) -> list[Verdict]:
        """The verdicts that occur, in order."""
        return sorted({kind for line in self.lines for kind in line.verdicts}, key=_ORDER.index)

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
            values = sorted(set(entries)) if numbers else dict.fromkeys(map(in_words, entries))
            words = name.split(".", 1)[-1].replace("_", " ").replace(".", ", ")
            facts[words.capitalize()] = ", ".join(map(str, values))
    return {name: words for name, words in facts.items() if words}


def made_facts(made: Mapping[str, Any]) -> dict[str, str]:
    """Return the command, versions, machine and time of results as text, from their manifest."""
    shown = [item for item in made["packages"].items() if item[0] in _SHOWN_PACKAGES]
    packages = ", ".join(f"{name} {version}" for name, version in shown)
    changed = ", with changes that are not committed" if made.get("clean") is False else ""
    facts = {
        "Command": made["command"],
        "Finished": made["finished"].replace("T", " ").replace("+00:00", " UTC"),
        "Commit": made["commit"] and made["commit"] + changed,
        "Versions": f"Python {made['python']}, {packages}",
        "Machine": f"{made['platform']}, {count(made['cpus'], 'processor')}",
        "Time": f"{made['seconds']:.0f} seconds",
    }
    return {name: words for name, words in facts.items() if words}
