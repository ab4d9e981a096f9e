"""What the scaling study compares: contrasts by the question that they answer, as one table."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from typing import Literal

from taichi_ants.analysis.colony.study import (
    ABC,
    ABC_SILENT,
    ABROAD,
    ALONE,
    BC,
    FEW,
    PAPER,
    QUEUES,
    SILENT,
    SOME,
    A,
    Condition,
    Design,
    Measured,
)
from taichi_ants.analysis.findings import LEAST_SEEDS, Contrast, Finding, Verdict, above, judge

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
            with the same number or with each smaller one.
        least: The smallest number of ants that is compared with the same. For one ant all regimes
            are alike, and so are rules for several.
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


ADDS = "What does each rule add?"
TRAIL = "Do the trails help?"
MORE = "Do more ants help?"
TRAINING = "With how many ants to train?"
ELSEWHERE = "Does a policy hold in other worlds?"

# fmt: off
SERIES: tuple[Series, ...] = (
    Series(ADDS, "ants with all three rules deliver more than under the paper's rules",
           Design(ABC), Design(PAPER), main=True),
    Series(ADDS, "ants with all three rules deliver more than with trails with a direction alone",
           Design(ABC), Design(A)),
    Series(ADDS, "ants with all three rules deliver more than with right of way and ants in view",
           Design(ABC), Design(BC)),
    Series(ADDS, "ants that queue deliver more than with the three rules",
           Design(QUEUES), Design(ABC)),
    Series(TRAIL, "under the paper's rules, ants deliver more if they lay trails",
           Design(PAPER), Design(SILENT), least=1, main=True),
    Series(TRAIL, "under the paper's rules, ants deliver more if trails have a direction",
           Design(A), Design(PAPER), least=1),
    Series(TRAIL, "with all three rules, ants deliver more if they lay trails",
           Design(ABC), Design(ABC_SILENT), least=1),
    Series(MORE, "under the paper's rules, ants deliver more than fewer of them do",
           Design(PAPER), Design(PAPER), against="smaller"),
    Series(MORE, "with all three rules, ants deliver more than fewer of them do",
           Design(ABC), Design(ABC), against="smaller"),
    Series(MORE, "with all three rules, each ant delivers more than each of fewer",
           Design(ABC), Design(ABC), "per_ant", "smaller"),
    Series(TRAINING, "under the paper's rules, ants deliver more if all train, not only one",
           Design(PAPER), Design(PAPER, ALONE)),
    Series(TRAINING, "with all three rules, ants deliver more if all train, not only one",
           Design(ABC), Design(ABC, ALONE), main=True),
    Series(TRAINING, "with all three rules, ants deliver more if all train, not only 4",
           Design(ABC), Design(ABC, FEW)),
    Series(TRAINING, "with all three rules, ants deliver more if all train, not only 16",
           Design(ABC), Design(ABC, SOME)),
    Series(ELSEWHERE, "ants trained where they are deliver more than ants trained in open worlds",
           Design(ABC), Design(ABC, ABROAD)),
    Series(ELSEWHERE, "trained in open worlds, all three rules deliver more than the paper's",
           Design(ABC, ABROAD), Design(PAPER, ABROAD)),
    Series(ELSEWHERE, "trained in open worlds, ants that queue deliver more than with three rules",
           Design(QUEUES, ABROAD), Design(ABC, ABROAD)),
)
# fmt: on

QUESTIONS: tuple[str, ...] = tuple(dict.fromkeys(series.question for series in SERIES))
# By the name of the kind of world and the series.
Judged = dict[tuple[str, Series], dict[Sizes, Finding]]


def judge_all(measured: Measured) -> Judged:
    """Return the findings on all contrasts; those of one question in one kind of world are judged
    together.

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
