"""What the pages have in common: how a template is filled, and the parts that stand on both."""

from __future__ import annotations

import base64
import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from taichi_ants.analysis.findings import Finding, Verdict
from taichi_ants.analysis.tables import number
from taichi_ants.report.intervals import interval_drawing
from taichi_ants.viewer.frames import Recording
from taichi_ants.viewer.page import content_policy, part

if TYPE_CHECKING:
    from jinja2 import Environment

# Of the viewer: what a recording holds, the picture of the world, and what plays it.
_PLAYING = ("history.js", "stage.js", "timeline.js")


@cache
def _text(name: str) -> str:
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")


@cache
def _templates() -> Environment:
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    return Environment(
        loader=FunctionLoader(_text),
        autoescape=True,
        finalize=signed,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def signed(text: Any) -> Any:
    """Text with true minus signs before numbers, as figures have them; what is no text stays."""
    plain = isinstance(text, str) and not hasattr(text, "__html__")
    return re.sub(r"(?<![\w.-])-(?=[\d.])", "\N{MINUS SIGN}", text) if plain else text


def fill(template: str, **parts: Any) -> str:
    """A page as HTML; all text in the parts is escaped."""
    from markupsafe import Markup

    shared = {
        "style": part("colours.css") + _text("report.css"),
        "script": "\n".join([*map(part, _PLAYING), _text("report.js")]),
    }
    shared["policy"] = content_policy(f"\n{shared['script']}\n", f"\n{shared['style']}\n")
    marked = {name: Markup(text) for name, text in shared.items()}
    return _templates().get_template(template).render(**marked, **parts)


class Player(NamedTuple):
    """A recording that plays on the page, with a title and words below it."""

    title: str
    words: str
    recording: Recording

    @property
    def data(self) -> str:
        """The recording as text."""
        return base64.b64encode(self.recording.to_bytes()).decode()


class Picture(NamedTuple):
    """An image, uint8 (height, width, 3), with words for those who do not see it."""

    words: str
    image: np.ndarray

    @property
    def data(self) -> str:
        """A PNG in few colours, as text."""
        from PIL import Image

        file = io.BytesIO()
        Image.fromarray(self.image).quantize(64).save(file, "png")
        return base64.b64encode(file.getvalue()).decode()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.image.shape[1], self.image.shape[0]


class Judged(NamedTuple):
    """A verdict in one setting: effect and interval in words, and as a picture (SVG)."""

    setting: str
    verdict: Verdict
    words: str
    drawing: str


def judged(setting: str, finding: Finding, label: str, unit: str = "") -> Judged:
    """Return a finding as a page shows it; `label` and `unit` are those of its effect."""
    words, by_mean = _measured(finding, label, unit), finding.by_mean
    if by_mean and by_mean.verdict is not finding.verdict:  # it may rest on another contrast
        told = _measured(by_mean, by_mean.contrast.label, unit)
        words += f"; by the mean {by_mean.verdict.value}: {told}"
    return Judged(setting, finding.verdict, words, interval_drawing(finding, label, unit))


def _measured(finding: Finding, label: str, unit: str) -> str:
    """The effect and its interval in words, after its label."""
    if finding.verdict is Verdict.NOT_TESTED:
        return label
    digits = 1 if finding.contrast.uses_iqm or abs(finding.effect) >= 10 else 2
    effect, low, high = (number(x, digits) for x in (finding.effect, finding.low, finding.high))
    known = math.isfinite(finding.low) and math.isfinite(finding.high)
    ends = f"between {low} and {high}" if known else "without an interval"
    return f"{label}: {f'{effect} {unit}'.rstrip()}, {ends}"


@dataclass(frozen=True)
class Statement:
    """A line of the table that can be sorted and filtered.

    `place` is the second column: of the paper, or of the world. There is a verdict for each column
    of verdicts; facts and findings are shown on demand.
    """

    text: str
    place: str
    verdicts: Sequence[Verdict]
    facts: Mapping[str, str] = field(default_factory=dict)
    judged: Sequence[Judged] = ()


class Statements(NamedTuple):
    """A table of statements, which `noun` calls them; a header for each column."""

    headers: Sequence[str]
    lines: Sequence[Statement]
    noun: str

    @property
    def kinds(self) -> list[Verdict]:
        """The verdicts that occur, in the order in which a reader wants them."""
        given = {one for line in self.lines for one in line.verdicts}
        return [one for one in KINDS if one in given]

    @property
    def tallies(self) -> list[tuple[str, list[tuple[Verdict, int]]]]:
        """How many verdicts of each kind there are, for each column of verdicts."""
        columns = zip(*(line.verdicts for line in self.lines), strict=True)
        return [
            (header, [(one, column.count(one)) for one in self.kinds if one in column])
            for header, column in zip(self.headers[2:], columns, strict=True)
        ]


# In the order in which a reader wants them.
KINDS = (
    *(Verdict.SUPPORTED, Verdict.EQUIVALENT, Verdict.UNDECIDED),
    *(Verdict.CONTRADICTED, Verdict.NOT_TESTED, Verdict.TOO_FEW),
)


def setting_facts(settings: Mapping[str, Any]) -> dict[str, str]:
    """Return settings of a study as names and words; a list shows each of its values once."""
    facts = {}
    for name, value in settings.items():
        several = value if isinstance(value, list) else [value]
        several = [one for one in several if one is not None]
        numbers = all(isinstance(one, int) and not isinstance(one, bool) for one in several)
        if name == "seeds" and several[1:]:
            facts["Seeds"] = f"{several[0]} to {several[-1]}"
        elif name not in ("version", "worlds", "world", "pool", "after"):
            values = sorted(set(several)) if numbers else dict.fromkeys(map(_plain, several))
            words = name.split(".", 1)[-1].replace("_", " ").replace(".", ", ")
            facts[words.capitalize()] = ", ".join(map(str, values))
    return {name: words for name, words in facts.items() if words}


def _plain(value: Any) -> str:
    """A value as readers write it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)


def made_facts(made: Mapping[str, Any]) -> dict[str, str]:
    """What made the results, from a manifest, in words."""
    finished = made["finished"].replace("T", " ").replace("+00:00", " UTC")
    facts = {"Command": made["command"], "Finished": finished}
    if made.get("commit"):
        facts["Commit"] = made["commit"]
    packages = ", ".join(f"{name} {version}" for name, version in made["packages"].items())
    facts["Versions"] = f"Python {made['python']}, {packages}"
    cpus = f"{made['cpus']} processors" if made["cpus"] != 1 else "one processor"
    facts["Machine"] = f"{made['platform']}, {cpus}"
    facts["Time"] = f"{made['seconds']:.0f} seconds"
    return facts
