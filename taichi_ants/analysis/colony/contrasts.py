"""What the scaling study compares: contrasts by the question that they answer, as one table."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations

from taichi_ants.analysis.colony.study import (
    COPIED,
    COPIED_LONG,
    JOINT,
    LASTING,
    MEASURES,
    OFF,
    ON,
    OWN,
    PHEROMONES,
    THEN_JOINT,
    WAYS,
    Arena,
    ColonyStudy,
)
from taichi_ants.analysis.findings import Above, Contrast, Finding, Verdict, Within, judge

# Numbers of ants: of the condition from which is subtracted, and of the one that is.
Sizes = tuple[int, int]
# Those of two lists of numbers of ants that are compared.
Choose = Callable[[Sequence[int], Sequence[int]], list[Sizes]]


def with_smaller(sizes: Sequence[int], others: Sequence[int]) -> list[Sizes]:
    """Each number of ants with every smaller one."""
    return [(n, less) for less, n in combinations(sizes, 2) if less in others]


def equally_many(sizes: Sequence[int], others: Sequence[int]) -> list[Sizes]:
    """From two ants on: for one ant all ways but two trainings in turn are the same."""
    return [(n, n) for n in sizes if n > 1 and n in others]


def equally_many_or_one(sizes: Sequence[int], others: Sequence[int]) -> list[Sizes]:
    """From one ant on, where it is not the same."""
    return [(n, n) for n in sizes if n in others]


def most_with_one(sizes: Sequence[int], others: Sequence[int]) -> list[Sizes]:
    """The largest colony with a single ant."""
    return [(n, 1) for n in sizes[-1:] if n > 1 and 1 in others]


@dataclass(frozen=True)
class Series:
    """Differences of one kind, for several numbers of ants.

    Attributes:
        question: What it helps to answer.
        statement: What is so where the difference is above 0; of `with_smaller` who is meant.
        first, second: (way, pheromone) from which is subtracted, and which is.
        measure: A name in `MEASURES`.
        choose: Which numbers of ants are compared.
        share: If positive, the statement holds where the first has at least this share of the
            second's mean.
    """

    question: str
    statement: str
    first: tuple[str, str]
    second: tuple[str, str]
    measure: str = "deliveries"
    choose: Choose = field(default=equally_many)
    share: float = 0.0

    @property
    def words(self) -> str:
        """What is computed."""
        names = [f"{WAYS[way]} ({PHEROMONES[trail]})" for way, trail in (self.first, self.second)]
        whom = "a smaller colony" if self.choose is with_smaller else names[1]
        return f"{MEASURES[self.measure].words}: {names[0]} minus {whom}"

    def contrasts(self, study: ColonyStudy, arena: Arena) -> dict[Sizes, Contrast]:
        """The contrasts of an arena; none where conditions are missing."""
        sides = [(trail, way) for way, trail in (self.first, self.second)]
        sizes = self.choose(*(study.sizes(arena, *side) for side in sides))
        found = {}
        for pair in sizes:
            one, other = (
                study.values(arena, *side, n, self.measure)
                for side, n in zip(sides, pair, strict=True)
            )
            least = (self.share - 1) * float(other.mean())
            criterion = Within(least, float("inf")) if self.share else Above()
            found[pair] = Contrast(self.words, one - other, criterion)
        return found


COPIES = "Do more copies help?"
CROWDING = "Where does crowding begin?"
CURE = "Does joint learning cure it?"
TRAIL = "Does the trail that ants lay themselves help?"
FIRST = "Does a crowd find food sooner?"
# Crowding counts as cured if each ant delivers at least this share of what an ant alone does.
CURED = 0.9

_COPIES, _COPIES_OFF, _COPIES_LASTING = (COPIED, ON), (COPIED, OFF), (COPIED, LASTING)
_JOINT, _JOINT_OFF, _JOINT_LASTING = (JOINT, ON), (JOINT, OFF), (JOINT, LASTING)
_COPIED_WORDS = "copies of an ant trained alone"

# fmt: off
SERIES: tuple[Series, ...] = (
    Series(COPIES, _COPIED_WORDS, _COPIES, _COPIES, choose=with_smaller),
    Series(COPIES, "jointly trained ants", _JOINT, _JOINT, choose=with_smaller),
    Series(CROWDING, _COPIED_WORDS, _COPIES, _COPIES, "per_ant", with_smaller),
    Series(CROWDING, "copies that lay no trails", _COPIES_OFF, _COPIES_OFF, "per_ant",
           with_smaller),
    Series(CROWDING, "jointly trained ants", _JOINT, _JOINT, "per_ant", with_smaller),
    Series(CURE, f"jointly trained ants deliver more than {_COPIED_WORDS}", _JOINT, _COPIES),
    Series(CURE, "jointly trained ants deliver more than copies of one trained alone for long",
           _JOINT, (COPIED_LONG, ON)),
    Series(CURE, "ants with a table each deliver more than ants that share one",
           (OWN, ON), _JOINT),
    Series(CURE, "ants trained alone and then jointly deliver more than ants only trained jointly",
           (THEN_JOINT, ON), _JOINT),
    Series(CURE, f"joint learning cures crowding: each of many ants delivers at least {CURED:.0%} "
                 "of what one alone does",
           _JOINT, _COPIES, "per_ant", most_with_one, CURED),
    Series(TRAIL, "jointly trained ants that lay trails deliver more than ants that lay none",
           _JOINT, _JOINT_OFF),
    Series(TRAIL, "copies that lay trails deliver more than copies that lay none",
           _COPIES, _COPIES_OFF, choose=equally_many_or_one),
    Series(TRAIL, "jointly trained ants deliver more if their trails evaporate",
           _JOINT, _JOINT_LASTING),
    Series(TRAIL, "copies deliver more if their trails evaporate",
           _COPIES, _COPIES_LASTING, choose=equally_many_or_one),
    Series(TRAIL, "jointly trained ants that lay trails get more reward than ants that lay none",
           _JOINT, _JOINT_OFF, "reward"),
    Series(FIRST, "many copies need more ticks to the first delivery than one ant",
           _COPIES, _COPIES, "first_delivery", most_with_one),
    Series(FIRST, "many jointly trained ants need more ticks to the first delivery than one ant",
           _JOINT, _COPIES, "first_delivery", most_with_one),
)
# fmt: on

QUESTIONS: tuple[str, ...] = tuple(dict.fromkeys(series.question for series in SERIES))
# By the name of the arena and the series.
Judged = dict[tuple[str, Series], dict[Sizes, Finding]]


def judge_all(study: ColonyStudy) -> Judged:
    """The findings on all contrasts; those of one question in one arena are judged together."""
    judged: Judged = {}
    for arena in study.arenas:
        for question in QUESTIONS:
            contrasts = {
                (series, sizes): contrast
                for series in SERIES
                if series.question == question
                for sizes, contrast in series.contrasts(study, arena).items()
            }
            findings = judge(list(contrasts.values()))
            for (series, sizes), finding in zip(contrasts, findings, strict=True):
                judged.setdefault((arena.name, series), {})[sizes] = finding
    return judged


def peak(findings: Mapping[Sizes, Finding]) -> int:
    """The smallest number of ants that no larger one exceeds beyond chance."""
    sizes = sorted({n for pair in findings for n in pair})
    return next(n for n in sizes if not _exceeded(findings, n, sizes))


def decline(findings: Mapping[Sizes, Finding]) -> Sizes | None:
    """The smallest number of ants that stays below a smaller one beyond chance, and that one.

    It stays below if no larger number exceeds it again. Of several smaller ones the one with the
    greatest difference; None if there is none.
    """
    sizes = sorted({n for pair in findings for n in pair})
    for n in sizes:
        below = [less for less in sizes if less < n and _falls(findings[n, less])]
        if below and not _exceeded(findings, n, sizes):
            return n, min(below, key=lambda less: findings[n, less].effect)
    return None


def _exceeded(findings: Mapping[Sizes, Finding], n: int, sizes: Sequence[int]) -> bool:
    return any(findings[more, n].verdict is Verdict.SUPPORTED for more in sizes if more > n)


def _falls(finding: Finding) -> bool:
    return finding.verdict is Verdict.CONTRADICTED
