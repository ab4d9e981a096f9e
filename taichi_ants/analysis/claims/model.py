"""What a claim is: a sentence of the paper made precise, as data.

A claim speaks of one quantity in one unit. It has one or more contrasts; each yields an effect
for every seed, and all must hold for the claim to hold.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np

from taichi_ants.analysis.claims.slice import Slice

WITHIN_MARGIN = "may be within the margin"


class Verdict(str, Enum):
    """What the data say about a claim, the strongest objection first."""

    CONTRADICTED = "contradicted"
    UNDISTINGUISHED = "not distinguishable"
    SUPPORTED = "supported"
    NOT_TESTED = "not tested"


@dataclass(frozen=True)
class Above:
    """The effect is above 0, by an amount that matters.

    Supported if the interval lies above 0 and reaches past the margin, contradicted if it lies
    below 0 and reaches past the negative margin.
    """

    margin: float

    def judge(self, low: float, high: float) -> tuple[Verdict, str]:
        """The verdict on an interval, and a note."""
        if low > 0 and high > self.margin:
            return Verdict.SUPPORTED, "" if low > self.margin else WITHIN_MARGIN
        if high < 0 and low < -self.margin:
            return Verdict.CONTRADICTED, "" if high < -self.margin else WITHIN_MARGIN
        inside = -self.margin <= low and high <= self.margin
        return Verdict.UNDISTINGUISHED, "equal within the margin" if inside else "undecided"

    def slack(self, effect: float) -> float:
        """How far an effect is on the claim's side; the smallest is the weakest."""
        return effect

    @property
    def words(self) -> str:
        return f"above 0, margin {self.margin:g}"


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
        return Verdict.UNDISTINGUISHED, "undecided"

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
    """

    label: str
    effect: Callable[[Slice], np.ndarray]


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


@dataclass(frozen=True)
class Finding:
    """What became of a claim in one delivery setting.

    Attributes:
        claim: The claim.
        delivery: The delivery setting.
        verdict: The verdict.
        note: A word on it; the reason where it was not tested.
        contrast: Label of the contrast that is weakest, which is the one shown; "" if untested.
        effect: Its mean over seeds, in the claim's unit.
        low, high: Its interval at the corrected level.
        level: Confidence level of that one interval; nan if untested.
        seeds: Seeds on which the effect rests, 0 if untested.
        configurations: Rows of the comparison that the claim uses, 0 if untested.
        scope: Which configurations these are, for example "table 2 configurations".
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
