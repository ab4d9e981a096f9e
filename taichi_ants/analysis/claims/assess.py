"""From claims and a comparison to verdicts.

Every contrast of every claim, in every delivery setting, gets an interval over seeds: of the IQM
and of the mean where the claim rests on the typical run, else of the mean alone. Their levels are
corrected for their number (Bonferroni), so that with a probability of at least the simultaneous
level all of them hold at once, however they depend on each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from taichi_ants.analysis.claims.catalogue import CLAIMS
from taichi_ants.analysis.claims.model import Claim, Finding, Verdict
from taichi_ants.analysis.claims.slice import NotTestedError, Slice
from taichi_ants.analysis.paper.comparison import Comparison
from taichi_ants.analysis.paper.measures import WINDOW
from taichi_ants.analysis.statistics import cautious_interval, interquartile_mean, without_noise

SIMULTANEOUS_LEVEL = 0.95
OTHER_WORLD = "the claims are about the paper's world"
_BY_OBJECTION: list[Verdict] = [verdict for verdict in Verdict if verdict is not Verdict.NOT_TESTED]


def assess(comparison: Comparison, claims: Sequence[Claim] = CLAIMS) -> list[Finding]:
    """The findings on the claims, in their order, for each delivery setting in turn.

    A claim is supported if all its contrasts are and contradicted if one is; the finding shows
    the weakest contrast. A claim whose configurations, episodes, rollouts or seeds are missing is
    not tested, and none is in another world than the paper's or with fewer than 50 episodes.
    """
    tests = [
        _read(claim, comparison, delivery)
        for claim in claims
        for delivery in comparison.delivery_settings
    ]
    effects = [effect for test in tests for reading in test.readings for effect in reading]
    level = 1 - (1 - SIMULTANEOUS_LEVEL) / max(1, len(effects))
    _measure(effects, level)
    return [test.finding(level) for test in tests]


@dataclass
class _Effect:
    """One contrast over seeds, float64 (seeds,), its centre (IQM or mean) and interval."""

    label: str
    values: np.ndarray
    iqm: bool
    centre: float = np.nan
    low: float = np.nan
    high: float = np.nan


@dataclass
class _Test:
    """One claim in one delivery setting: the contrasts by what it rests on, then by the mean."""

    untested: Finding
    part: Slice
    readings: list[list[_Effect]]

    def finding(self, level: float) -> Finding:
        if not self.readings:
            return self.untested
        first, *others = (self._judge(effects, level) for effects in self.readings)
        return replace(first, by_mean=others[0] if others else None)

    def _judge(self, effects: Sequence[_Effect], level: float) -> Finding:
        claim, part = self.untested.claim, self.part
        ends = [np.clip((one.low, one.high), *claim.possible).tolist() for one in effects]
        judged = [claim.criterion.judge(*pair) for pair in ends]
        weakest = min(
            range(len(judged)),
            key=lambda k: (
                _BY_OBJECTION.index(judged[k][0]),
                claim.criterion.slack(effects[k].centre),
            ),
        )
        return replace(
            self.untested,
            verdict=judged[weakest][0],
            note=judged[weakest][1],
            contrast=effects[weakest].label,
            effect=effects[weakest].centre,
            low=ends[weakest][0],
            high=ends[weakest][1],
            level=level,
            seeds=len(effects[weakest].values),
            configurations=len(part.used),
            scope=part.scope,
        )


def _read(claim: Claim, comparison: Comparison, delivery: str) -> _Test:
    part, readings, reason = Slice(comparison, delivery), [], ""
    try:
        _check(comparison)
        for typical in (True, False) if claim.typical else (False,):
            effects = (contrast.values(part, typical) for contrast in claim.contrasts)
            iqm = (typical and contrast.of_centres is None for contrast in claim.contrasts)
            labels = (contrast.label for contrast in claim.contrasts)
            readings.append([*map(_Effect, labels, effects, iqm)])
        if len(readings[0][0].values) < 2:
            few = len(comparison.seeds) < 2
            one = "one seed" if few else "one seed in each half"
            raise NotTestedError(f"{one} gives no interval")
    except NotTestedError as error:
        readings, reason = [], str(error)
    return _Test(Finding(claim, delivery, Verdict.NOT_TESTED, reason), part, readings)


def _check(comparison: Comparison) -> None:
    if not comparison.in_paper_world:
        raise NotTestedError(OTHER_WORLD)
    if comparison.episodes < WINDOW:
        raise NotTestedError(
            f"the claims need at least {WINDOW} episodes, there are {comparison.episodes}"
        )


def _measure(effects: Sequence[_Effect], level: float) -> None:
    """Fills in centres and intervals, in one batch for each number of seeds and each centre."""
    for seeds, iqm in {(len(one.values), one.iqm) for one in effects}:
        batch = [one for one in effects if (len(one.values), one.iqm) == (seeds, iqm)]
        values = np.stack([one.values for one in batch])
        centres = interquartile_mean(values) if iqm else values.mean(axis=1)
        columns = (centres, *cautious_interval(values, level, iqm=iqm))
        ends = zip(*(without_noise(column, values) for column in columns), strict=True)
        for one, numbers in zip(batch, ends, strict=True):
            one.centre, one.low, one.high = map(float, numbers)
