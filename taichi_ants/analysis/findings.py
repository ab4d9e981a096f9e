"""Contrasts and their verdicts.

Contrasts that are judged together get intervals at a level corrected for their number (Bonferroni):
all hold at once with a probability of at least 95 %, even if they depend on each other. A contrast
is judged by its IQM or its mean over seeds; if by its IQM, it is also judged by its mean.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from taichi_ants.analysis.statistics import cautious_interval, interquartile_mean, without_noise
from taichi_ants.errors import count

SIMULTANEOUS_LEVEL = 0.95
# With fewer, intervals cover less than their level and are too wide for a verdict; see
# docs/concepts/statistics.md.
LEAST_SEEDS = 10
UNBOUNDED = (-np.inf, np.inf)


class Verdict(str, Enum):
    """A verdict on a contrast, in order from the strongest objection to support."""

    NOT_TESTED = "not tested"
    TOO_FEW = "too few seeds"
    CONTRADICTED = "contradicted"
    EQUIVALENT = "equivalent"
    UNDECIDED = "undecided"
    SUPPORTED = "supported"


@dataclass(frozen=True)
class Criterion:
    """The range in which the effect must lie, and the differences that are too small to matter.

    The verdict is "supported" if the whole interval lies in the range, "equivalent" if it lies
    within the margin on either side of 0, "contradicted" if it lies outside of both, and else
    "undecided". A difference must exceed `low`, which is at least its `margin`; the `margin` of an
    effect that is not a difference is None.
    """

    low: float
    high: float = np.inf
    margin: float | None = None

    def judge(self, low: float, high: float) -> Verdict:
        """Return the verdict on an interval."""
        small = self.margin
        if small is not None and -small <= low and high <= small:
            return Verdict.EQUIVALENT
        if self.low <= low and high <= self.high and (small is None or low > self.low):
            return Verdict.SUPPORTED
        outside = high < self.low or low > self.high
        reaches_margin = small is not None and -small <= high and low <= small
        return Verdict.CONTRADICTED if outside and not reaches_margin else Verdict.UNDECIDED


def above(margin: float = 0.0) -> Criterion:
    """Return the criterion of a difference above its margin."""
    return Criterion(margin, margin=margin)


@dataclass(frozen=True, eq=False)
class Contrast:
    """A number for each seed, and the criterion for its estimate over seeds.

    Attributes:
        label: The name in tables, for example "Q-learning minus SARSA".
        values: Float64 (seeds,), or (k, seeds) if a subclass reads them. Seeds with a missing value
            (nan) are left out, unless it is missing for all seeds.
        uses_iqm: Whether it is judged by the interquartile mean (IQM) over seeds.
        possible: The range of possible estimates; the interval is clipped to it.
    """

    label: str
    values: np.ndarray
    criterion: Criterion
    uses_iqm: bool = False
    possible: tuple[float, float] = UNBOUNDED

    def __post_init__(self) -> None:
        known = ~np.isnan(np.atleast_2d(self.values)).any(axis=0)
        if known.any():
            object.__setattr__(self, "values", self.values[..., known])

    @property
    def seeds(self) -> int:
        """The number of seeds that have values."""
        return self.values.shape[-1]

    @property
    def missing(self) -> bool:
        """Whether no seed has all values."""
        return not self.seeds or bool(np.isnan(self.values).any())

    def reading(self, uses_iqm: bool) -> tuple[np.ndarray, bool]:
        """Return numbers to average over seeds, float64 (seeds,), and whether to use the IQM."""
        return self.values, uses_iqm


@dataclass(frozen=True)
class Finding:
    """The result of a contrast: verdict, estimate over seeds, and interval at `level`.

    If the contrast is not tested, the numbers are nan. If a contrast is judged by the IQM,
    `by_mean` is its finding by the mean.
    """

    contrast: Contrast
    verdict: Verdict
    effect: float
    low: float
    high: float
    level: float
    by_mean: Finding | None = None


def judge(contrasts: Sequence[Contrast]) -> list[Finding]:
    """Return the findings on contrasts, in their order; all intervals hold at the same time."""
    readings = {
        (place, uses_iqm): contrast.reading(uses_iqm)
        for place, contrast in enumerate(contrasts)
        for uses_iqm in ((True, False) if contrast.uses_iqm else (False,))
        if not contrast.missing
    }
    level = 1 - (1 - SIMULTANEOUS_LEVEL) / max(1, len(readings))
    numbers: dict[tuple[int, bool], tuple[float, ...]] = {}
    # One batch for each number of seeds and each estimator.
    for seeds, iqm in {(len(values), iqm) for values, iqm in readings.values()}:
        batch = [key for key, (values, by) in readings.items() if (len(values), by) == (seeds, iqm)]
        rows = np.stack([readings[key][0] for key in batch])
        estimates = interquartile_mean(rows) if iqm else rows.mean(axis=1)
        columns = (estimates, *cautious_interval(rows, level, iqm=iqm))
        lines = zip(*(without_noise(column, rows).tolist() for column in columns), strict=True)
        numbers.update(zip(batch, lines, strict=True))

    def finding(place: int, uses_iqm: bool) -> Finding:
        contrast, by_mean = contrasts[place], finding(place, False) if uses_iqm else None
        if contrast.missing:
            return Finding(contrast, Verdict.NOT_TESTED, np.nan, np.nan, np.nan, level, by_mean)
        effect, *ends = numbers[place, uses_iqm]
        low, high = np.clip(ends, *contrast.possible).tolist()
        verdict = contrast.criterion.judge(low, high)
        return Finding(contrast, verdict, effect, low, high, level, by_mean)

    return [finding(place, contrast.uses_iqm) for place, contrast in enumerate(contrasts)]


def means_in_words(seeds: int) -> str:
    """Return "Means over 20 seeds with 95 % intervals", for example, for captions."""
    few = f" (too few for these: use {LEAST_SEEDS} or more)" if seeds < LEAST_SEEDS else ""
    return f"Means over {seeds} seeds with 95 % intervals{few}" if seeds > 1 else "One seed"


def gaps_in_words(values: np.ndarray) -> str:
    """Return " 3 of 40 runs have no value and are left out.", for example; "" if all have one."""
    without = int(np.isnan(values).sum())
    runs = f"{without} of {count(values.size, 'run')}"
    return f" {runs} ha{'s' if without == 1 else 've'} no value, left out." if without else ""


def weakest(findings: Sequence[Finding]) -> Finding:
    """Return the finding with the strongest objection; its `by_mean` is chosen in the same way."""
    first = min(findings, key=_strength)
    by_mean = [finding.by_mean for finding in findings if finding.by_mean is not None]
    return replace(first, by_mean=min(by_mean, key=_strength) if by_mean else None)


def _strength(finding: Finding) -> tuple[int, float]:
    """Return a sort key: the verdict, then the distance of the effect to the end of the range."""
    low, high = finding.contrast.criterion.low, finding.contrast.criterion.high
    inside = min(finding.effect - low, high - finding.effect)
    return list(Verdict).index(finding.verdict), inside
