"""From claims and a comparison to verdicts.

Every contrast of every claim, in every delivery setting, gets an interval over seeds. Their
levels are corrected for their number (Bonferroni), so that with a probability of at least the
simultaneous level all of them hold at once, however they depend on each other.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from taichi_ants.analysis.claims.catalogue import CLAIMS
from taichi_ants.analysis.claims.model import Claim, Finding, Verdict
from taichi_ants.analysis.claims.slice import NotTestedError, Slice
from taichi_ants.analysis.comparison import Comparison
from taichi_ants.analysis.statistics import cautious_interval

SIMULTANEOUS_LEVEL = 0.95
OTHER_WORLD = "the claims are about the paper's world"
_BY_OBJECTION = (Verdict.CONTRADICTED, Verdict.UNDISTINGUISHED, Verdict.SUPPORTED)


def assess(comparison: Comparison, claims: Sequence[Claim] = CLAIMS) -> list[Finding]:
    """The findings on the claims, in their order, for each delivery setting in turn.

    A claim is supported if all its contrasts are and contradicted if one is; the finding shows
    the weakest contrast. A claim whose configurations, episodes, rollouts or seeds are missing is
    not tested, and none is in another world than the paper's.
    """
    tests = [
        _Test(claim, comparison, delivery)
        for claim in claims
        for delivery in comparison.delivery_settings
    ]
    tested = [test for test in tests if not test.reason]
    level = 1 - (1 - SIMULTANEOUS_LEVEL) / max(1, sum(len(test.effects) for test in tested))
    # Claims on held-out seeds have fewer of them: one batch for each number of seeds.
    for seeds in {test.seeds for test in tested}:
        batch = [test for test in tested if test.seeds == seeds]
        ends = cautious_interval(np.concatenate([test.effects for test in batch]), level)
        borders = np.cumsum([len(test.effects) for test in batch])[:-1]
        for test, low, high in zip(batch, *(np.split(end, borders) for end in ends), strict=True):
            test.low, test.high = np.clip((low, high), *test.claim.possible)
    return [test.finding(level) for test in tests]


class _Test:
    """One claim in one delivery setting, with the effects (contrasts, seeds) of its contrasts."""

    def __init__(self, claim: Claim, comparison: Comparison, delivery: str) -> None:
        self.claim, self.delivery, self.reason = claim, delivery, ""
        if not comparison.in_paper_world:
            self.reason = OTHER_WORLD
            return
        part = Slice(comparison, delivery)
        try:
            self.effects = np.stack([contrast.effect(part) for contrast in claim.contrasts])
        except NotTestedError as error:
            self.reason = str(error)
            return
        self.seeds, self.rows = self.effects.shape[1], len(part.used)
        self.scope = part.scope
        if self.seeds < 2:
            few = len(comparison.seeds) < 2
            self.reason = f"{'one seed' if few else 'one seed in each half'} gives no interval"
        self.low = self.high = np.full(len(self.effects), np.nan)

    def finding(self, level: float) -> Finding:
        if self.reason:
            return Finding(self.claim, self.delivery, Verdict.NOT_TESTED, self.reason)
        effects = self.effects.mean(axis=1)
        criterion = self.claim.criterion
        judged = [criterion.judge(low, high) for low, high in zip(self.low, self.high, strict=True)]
        weakest = min(
            range(len(judged)),
            key=lambda k: (_BY_OBJECTION.index(judged[k][0]), criterion.slack(effects[k])),
        )
        verdict, note = judged[weakest]
        return Finding(
            self.claim,
            self.delivery,
            verdict,
            note,
            self.claim.contrasts[weakest].label,
            float(effects[weakest]),
            float(self.low[weakest]),
            float(self.high[weakest]),
            level,
            self.seeds,
            self.rows,
            self.scope,
        )
