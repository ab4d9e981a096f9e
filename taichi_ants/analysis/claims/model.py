"""What a claim is: a sentence of the paper made precise, as data.

A claim speaks of one quantity in one unit. It has one or more contrasts; each yields an effect
for every seed, and all must hold for the claim to hold. What a claim rests on, the typical run or
the mean, is settled in one place: `Claim.typical`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np

from taichi_ants.analysis.claims.slice import Slice
from taichi_ants.analysis.statistics import interquartile_values, jackknife_values

WITHIN_MARGIN = "may be within the margin"


class Verdict(str, Enum):
    """What the data say about a claim, the strongest objection first.

    "Equivalent" is a finding, "undecided" is none: where a claim says that one thing is above
    another, the first says that they differ by less than matters, the second that the data leave
    open whether they differ.
    """

    CONTRADICTED = "contradicted"
    EQUIVALENT = "equivalent"
    UNDECIDED = "undecided"
    SUPPORTED = "supported"
    NOT_TESTED = "not tested"


@dataclass(frozen=True)
class Above:
    """The effect is above 0, by an amount that matters, and at most a limit.

    Equivalent if the interval lies within the margin on either side of 0. Else supported if it
    lies above 0 and below the limit, contradicted if it lies below 0 or above the limit.
    """

    margin: float
    most: float = np.inf

    def judge(self, low: float, high: float) -> tuple[Verdict, str]:
        """The verdict on an interval, and a note."""
        if -self.margin <= low and high <= self.margin:
            return Verdict.EQUIVALENT, ""
        if low > 0 and high <= self.most:
            return Verdict.SUPPORTED, "" if low > self.margin else WITHIN_MARGIN
        if high < 0 or low > self.most:
            return Verdict.CONTRADICTED, "" if high < -self.margin or low > 0 else WITHIN_MARGIN
        return Verdict.UNDECIDED, ""

    def slack(self, effect: float) -> float:
        """How far an effect is on the claim's side; the smallest is the weakest."""
        return min(effect, self.most - effect)

    @property
    def words(self) -> str:
        limit = "" if self.most == np.inf else f" and at most {self.most:g}"
        return f"above 0{limit}, margin {self.margin:g}"


@dataclass(frozen=True)
class Within:
    """The effect lies in a range.

    Supported if the interval lies in it, contradicted if it lies outside entirely.
    """

    low: float
    high: float

    def judge(self, low: float, high: float) -> tuple[Verdict, str]:
        """The verdict on an interval, and a note."""
        if self.low <= low and high <= self.high:
            return Verdict.SUPPORTED, ""
        if high < self.low or low > self.high:
            return Verdict.CONTRADICTED, ""
        return Verdict.UNDECIDED, ""

    def slack(self, effect: float) -> float:
        """Distance to the nearer end of the range, negative outside of it."""
        return min(effect - self.low, self.high - effect)

    @property
    def words(self) -> str:
        if self.low == -np.inf:
            return f"at most {self.high:g}"
        if self.high == np.inf:
            return f"at least {self.low:g}"
        return f"from {self.low:g} to {self.high:g}"


@dataclass(frozen=True)
class Contrast:
    """One comparison that a claim makes.

    Attributes:
        label: What is compared, for example "Q-learning minus SARSA".
        effect: Slice -> the effect of each seed, float64 (seeds,), in the claim's unit. Raises
            `NotTestedError` where the comparison lacks what it needs.
        of_centres: For a question about the centres themselves (how unequal are the effects of 8
            configurations?), as the noise of single seeds would be taken for the answer: a smooth
            function of them, float (k, ...) -> float (...). `effect` then yields (k, seeds).
    """

    label: str
    effect: Callable[[Slice], np.ndarray]
    of_centres: Callable[[np.ndarray], np.ndarray] | None = None

    def values(self, part: Slice, typical: bool) -> np.ndarray:
        """What is averaged over seeds, by mean or by IQM (`typical`), float64 (seeds,)."""
        effects = self.effect(part)
        if self.of_centres is None:
            return effects
        return jackknife_values(
            self.of_centres, interquartile_values(effects) if typical else effects
        )


@dataclass(frozen=True)
class Claim:
    """An empirical claim of the paper.

    Attributes:
        id: Short name, unique.
        section: Section of the paper.
        statement: What the paper claims, in our words.
        quantity: What is computed from which configurations.
        unit: Unit of the effects and of the criterion.
        criterion: What the effects must fulfil.
        contrasts: All must fulfil it.
        possible: The range that an effect cannot leave; its interval is cut off there.
    """

    id: str
    section: str
    statement: str
    quantity: str
    unit: str
    criterion: Above | Within
    contrasts: tuple[Contrast, ...]
    possible: tuple[float, float] = (-np.inf, np.inf)

    @property
    def typical(self) -> bool:
        """Whether the claim rests on the typical run, that is on the IQM over seeds.

        Claims in reward or steps do: the paper speaks of what a learner does, and there the mean
        hangs on a run in hundreds that does something else. Shares, counts of deliveries and
        correlations rest on the mean: they are bounded, so that no run can outweigh the others,
        and an IQM would hide that a quarter of all runs fails.
        """
        return self.possible == (-np.inf, np.inf)


@dataclass(frozen=True)
class Finding:
    """What became of a claim in one delivery setting.

    Attributes:
        claim: The claim.
        delivery: The delivery setting.
        verdict: The verdict.
        note: A word on it; the reason where it was not tested.
        contrast: Label of the contrast that is weakest, which is the one shown; "" if untested.
        effect: Its centre over seeds (see `Claim.typical`), in the claim's unit.
        low, high: Its interval at the corrected level.
        level: Confidence level of that one interval; nan if untested.
        seeds: Seeds on which the effect rests, 0 if untested.
        configurations: Rows of the comparison that the claim uses, 0 if untested.
        scope: Which configurations these are, for example "table 2 configurations".
        by_mean: What the mean says of a claim that rests on the typical run, else None.
    """

    claim: Claim
    delivery: str
    verdict: Verdict
    note: str
    contrast: str = ""
    effect: float = np.nan
    low: float = np.nan
    high: float = np.nan
    level: float = np.nan
    seeds: int = 0
    configurations: int = 0
    scope: str = ""
    by_mean: Finding | None = None

    @property
    def disagrees(self) -> bool:
        """Whether the mean gives another verdict than the typical run."""
        return self.by_mean is not None and self.by_mean.verdict is not self.verdict
