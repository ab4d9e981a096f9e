"""What the scaling study compares: contrasts by the question that they answer, as one table."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Literal

from taichi_ants.analysis.colony.study import (
    COPIED,
    COPIED_LONG,
    JOINT,
    LASTING,
    OFF,
    ON,
    OWN,
    THEN_JOINT,
    Condition,
    Design,
    Measured,
)
from taichi_ants.analysis.findings import Contrast, Finding, above, judge

# Numbers of ants, of the first and of the second condition of a difference.
Sizes = tuple[int, int]


@dataclass(frozen=True)
class Series:
    """Differences of one kind, for several numbers of ants.

    Attributes:
        question: What it helps to answer.
        statement: What is so where the differences are above 0.
        first, second: The difference is first minus second.
        measure: A name in `MEASURES`.
        against: With how many ants of the second each number of ants of the first is compared:
            with the same number, with each smaller one, or the largest with one ant.
        least: The smallest number of ants that is compared with the same. With one ant all ways
            but two trainings in turn are alike.
    """

    question: str
    statement: str
    first: Design
    second: Design
    measure: str = "deliveries"
    against: Literal["same", "smaller", "one"] = "same"
    least: int = 2

    def contrasts(self, measured: Measured, arena: str) -> dict[Sizes, Contrast]:
        """The contrasts of an arena; none where conditions are missing."""
        found = {}
        for n, other in self._sizes(measured, arena):
            values = measured[Condition(arena, *self.first, n)][self.measure]
            subtracted = measured[Condition(arena, *self.second, other)][self.measure]
            found[n, other] = Contrast(self.statement, values - subtracted, above())
        return found

    def _sizes(self, measured: Measured, arena: str) -> list[Sizes]:
        sizes, others = (
            sorted(one.ants for one in measured if one[:3] == (arena, *design))
            for design in (self.first, self.second)
        )
        if self.against == "smaller":
            return [(n, less) for less, n in combinations(sizes, 2) if less in others]
        if self.against == "one":
            return [(n, 1) for n in sizes[-1:] if n > 1 and 1 in others]
        return [(n, n) for n in sizes if n >= self.least and n in others]


COPIES = "Do more copies help?"
CROWDING = "Where does crowding begin?"
CURE = "Does joint learning cure it?"
TRAIL = "Does the trail that ants lay themselves help?"

_COPIES, _COPIES_OFF, _COPIES_LASTING = (Design(one, COPIED) for one in (ON, OFF, LASTING))
_JOINT, _JOINT_OFF, _JOINT_LASTING = (Design(one, JOINT) for one in (ON, OFF, LASTING))

# fmt: off
SERIES: tuple[Series, ...] = (
    Series(COPIES, "copies of an ant trained alone deliver more than fewer of them do",
           _COPIES, _COPIES, against="smaller"),
    Series(COPIES, "jointly trained ants deliver more than fewer of them do",
           _JOINT, _JOINT, against="smaller"),
    Series(CROWDING, "each of many copies delivers more than each of fewer",
           _COPIES, _COPIES, "per_ant", "smaller"),
    Series(CROWDING, "each of many copies that lay no trails delivers more than each of fewer",
           _COPIES_OFF, _COPIES_OFF, "per_ant", "smaller"),
    Series(CROWDING, "each of many jointly trained ants delivers more than each of fewer",
           _JOINT, _JOINT, "per_ant", "smaller"),
    Series(CURE, "jointly trained ants deliver more than copies of an ant trained alone",
           _JOINT, _COPIES),
    Series(CURE, "jointly trained ants deliver more than copies of one trained alone for long",
           _JOINT, Design(ON, COPIED_LONG)),
    Series(CURE, "ants with a table each deliver more than ants that share one",
           Design(ON, OWN), _JOINT),
    Series(CURE, "ants trained alone and then jointly deliver more than ants only trained jointly",
           Design(ON, THEN_JOINT), _JOINT),
    Series(CURE, "each of many jointly trained ants delivers more than one ant alone",
           _JOINT, _COPIES, "per_ant", "one"),
    Series(TRAIL, "jointly trained ants that lay trails deliver more than ants that lay none",
           _JOINT, _JOINT_OFF),
    Series(TRAIL, "copies that lay trails deliver more than copies that lay none",
           _COPIES, _COPIES_OFF, least=1),
    Series(TRAIL, "jointly trained ants deliver more if their trails evaporate",
           _JOINT, _JOINT_LASTING),
    Series(TRAIL, "copies deliver more if their trails evaporate",
           _COPIES, _COPIES_LASTING, least=1),
    Series(TRAIL, "jointly trained ants that lay trails get more reward than ants that lay none",
           _JOINT, _JOINT_OFF, "reward"),
)
# fmt: on

QUESTIONS: tuple[str, ...] = tuple(dict.fromkeys(series.question for series in SERIES))
# By the name of the arena and the series.
Judged = dict[tuple[str, Series], dict[Sizes, Finding]]


def judge_all(measured: Measured) -> Judged:
    """The findings on all contrasts; those of one question in one arena are judged together."""
    judged: Judged = {}
    for arena in dict.fromkeys(one.arena for one in measured):
        for question in QUESTIONS:
            contrasts = {
                (series, sizes): contrast
                for series in SERIES
                if series.question == question
                for sizes, contrast in series.contrasts(measured, arena).items()
            }
            findings = judge(list(contrasts.values()))
            for (series, sizes), finding in zip(contrasts, findings, strict=True):
                judged.setdefault((arena, series), {})[sizes] = finding
    return judged
