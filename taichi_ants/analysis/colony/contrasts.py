"""Contrasts of the scaling study by the question that they answer, as `series.toml` has them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from importlib import resources
from itertools import combinations
from typing import Literal

from taichi_ants.analysis.colony.study import Condition, Design, Measured
from taichi_ants.analysis.findings import LEAST_SEEDS, Contrast, Finding, Verdict, above, judge
from taichi_ants.files import tomllib

# Numbers of ants, of the first and of the second condition of a difference.
Sizes = tuple[int, int]


@dataclass(frozen=True)
class Series:
    """Differences of one kind, for several numbers of ants: the first minus the second design.

    Attributes:
        question: What it helps to answer.
        statement: What is so where the differences are above 0.
        measure: A name in `MEASURES`.
        against: With how many ants of the second each number of ants of the first is compared.
        least: The smallest number of ants that is compared with the same: for one ant all regimes,
            and rules for several, are alike.
        main: Whether it is one of the main findings.
    """

    question: str
    statement: str
    first: Design
    second: Design
    measure: str = "deliveries"
    against: Literal["same", "smaller"] = "same"
    least: int = 2
    main: bool = False

    def contrasts(self, measured: Measured, world_kind: str) -> dict[Sizes, Contrast]:
        """The contrasts of a kind of world; none where conditions are missing."""
        found = {}
        for n, other in self._sizes(measured, world_kind):
            values = measured[Condition(world_kind, *self.first, n)][self.measure]
            subtracted = measured[Condition(world_kind, *self.second, other)][self.measure]
            found[n, other] = Contrast(self.statement, values - subtracted, above())
        return found

    def _sizes(self, measured: Measured, world_kind: str) -> list[Sizes]:
        sizes, others = (
            sorted(one.ants for one in measured if one[:3] == (world_kind, *design))
            for design in (self.first, self.second)
        )
        if self.against == "smaller":
            return [(n, less) for less, n in combinations(sizes, 2) if less in others]
        return [(n, n) for n in sizes if n >= self.least and n in others]


def _series() -> tuple[Series, ...]:
    path = resources.files(__package__).joinpath("series.toml")
    several = tomllib.loads(path.read_text(encoding="utf-8"))["series"]
    return tuple(
        Series(**{**one, "first": Design(*one["first"]), "second": Design(*one["second"])})
        for one in several
    )


SERIES = _series()
QUESTIONS: tuple[str, ...] = tuple(dict.fromkeys(series.question for series in SERIES))
# By the name of the kind of world and the series.
Judged = dict[tuple[str, Series], dict[Sizes, Finding]]


def judge_all(measured: Measured) -> Judged:
    """Return the findings on all contrasts; a question in a kind of world is judged at once.

    With fewer than `LEAST_SEEDS` seeds none has a verdict.
    """
    judged: Judged = {}
    for world_kind in dict.fromkeys(one.world_kind for one in measured):
        for question in QUESTIONS:
            contrasts = {
                (series, sizes): contrast
                for series in SERIES
                if series.question == question
                for sizes, contrast in series.contrasts(measured, world_kind).items()
            }
            findings = judge(list(contrasts.values()))
            for (series, sizes), finding in zip(contrasts, findings, strict=True):
                if finding.contrast.seeds < LEAST_SEEDS:
                    finding = replace(finding, verdict=Verdict.TOO_FEW)
                judged.setdefault((world_kind, series), {})[sizes] = finding
    return judged
