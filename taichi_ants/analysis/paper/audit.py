"""The audit of the paper's claims: each tested in each delivery setting, judged, and shown."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from taichi_ants.analysis.findings import (
    SIMULTANEOUS_LEVEL,
    WITHIN_MARGIN,
    Contrast,
    Finding,
    Verdict,
    judge,
    tally,
    weakest,
)
from taichi_ants.analysis.paper.claims import CLAIMS, Claim
from taichi_ants.analysis.paper.comparison import PAPER_WORLD, Comparison
from taichi_ants.analysis.paper.measures import WINDOW
from taichi_ants.analysis.paper.quantities import NotTestedError, Slice
from taichi_ants.analysis.tables import Block, Table, interval, markdown, number
from taichi_ants.errors import count

OTHER_WORLD = "the claims are about the paper's world"


@dataclass(frozen=True)
class Audited:
    """What became of a claim in one delivery setting.

    Attributes:
        claim: The claim.
        delivery: The delivery setting.
        finding: That on its weakest contrast, None if it was not tested.
        reason: Why it was not tested, or "".
        configurations: Rows of the comparison that it rests on.
    """

    claim: Claim
    delivery: str
    finding: Finding | None
    reason: str = ""
    configurations: int = 0

    @property
    def verdict(self) -> Verdict:
        return self.finding.verdict if self.finding else Verdict.NOT_TESTED


def assess(comparison: Comparison, claims: Sequence[Claim] = CLAIMS) -> list[Audited]:
    """The claims in their order, each in all delivery settings, all judged together.

    A claim is supported if all its contrasts are and contradicted if one is; the finding is that
    on the weakest contrast. A claim whose configurations, episodes, rollouts or seeds are missing
    is not tested, and none is in another world than the paper's or with fewer than 50 episodes.
    """
    tests = [(claim, setting) for claim in claims for setting in comparison.delivery_settings]
    read = [_contrasts(claim, comparison, setting) for claim, setting in tests]
    findings = iter(judge([contrast for contrasts, _, _ in read for contrast in contrasts]))
    return [
        Audited(*test, weakest([next(findings) for _ in contrasts]), "", used)
        if contrasts
        else Audited(*test, None, reason)
        for test, (contrasts, reason, used) in zip(tests, read, strict=True)
    ]


def _contrasts(
    claim: Claim, comparison: Comparison, delivery: str
) -> tuple[list[Contrast], str, int]:
    """The contrasts of a claim, or why there are none, and how many rows they rest on."""
    part, quantity = Slice(comparison, delivery), claim.quantity
    try:
        if not comparison.in_paper_world:
            raise NotTestedError(OTHER_WORLD)
        if comparison.episodes < WINDOW:
            raise NotTestedError(
                f"the claims need at least {WINDOW} episodes, there are {comparison.episodes}"
            )
        contrasts = [
            Contrast(
                *(label, effect(part), claim.criterion, quantity.typical),
                *(quantity.possible, quantity.of_centres),
            )
            for label, effect in quantity.effects.items()
        ]
        if contrasts[0].seeds < 2:
            one = "one seed" if len(comparison.seeds) < 2 else "one seed in each half"
            raise NotTestedError(f"{one} gives no interval")
    except NotTestedError as error:
        return [], str(error), 0
    return contrasts, "", len(part.used)


def claims_rows(audit: Sequence[Audited]) -> list[dict]:
    """The rows of claims.csv; numbers are nan and texts "" if not tested or not read by mean."""
    return [
        {
            "claim": one.claim.id,
            "section": one.claim.section,
            "statement": one.claim.statement,
            "quantity": one.claim.tested_on,
            "criterion": one.claim.criterion.words,
            "unit": one.claim.quantity.unit,
            "delivery": one.delivery,
            "scope": one.claim.quantity.scope if one.finding else "",
            "contrast": one.finding.contrast.label if one.finding else "",
            "centre": _centre(one.claim),
            **_numbers(one.finding),
            "level": one.finding.level if one.finding else math.nan,
            "simultaneous_level": SIMULTANEOUS_LEVEL,
            "verdict": one.verdict.value,
            "note": one.finding.note if one.finding else one.reason,
            "mean_contrast": mean.contrast.label if mean else "",
            **_numbers(mean, "mean_"),
            "mean_verdict": mean.verdict.value if mean else "",
            "seeds": one.finding.contrast.seeds if one.finding else 0,
            "configurations": one.configurations,
        }
        for one, mean in ((one, one.finding and one.finding.by_mean) for one in audit)
    ]


def _numbers(finding: Finding | None, stem: str = "") -> dict:
    ends = (finding.effect, finding.low, finding.high) if finding else (math.nan,) * 3
    names = (f"{stem}effect", f"{stem}ci_low", f"{stem}ci_high")
    return dict(zip(names, ends, strict=True))


def _centre(claim: Claim) -> str:
    return "interquartile mean" if claim.quantity.typical else "mean"


def claims_table(audit: Sequence[Audited]) -> Table:
    """The verdicts on the claims that could be tested in some setting, and counts of all."""
    settings = list(dict.fromkeys(one.delivery for one in audit))
    by_claim = {
        claim_id: [one for one in audit if one.claim.id == claim_id and one.finding]
        for claim_id in dict.fromkeys(one.claim.id for one in audit)
    }
    rows = []
    for tested in filter(None, by_claim.values()):
        claim, cells = tested[0].claim, dict.fromkeys(settings, Verdict.NOT_TESTED.value)
        cells |= {one.delivery: _verdict(one.finding) for one in tested if one.finding}
        words = f"{claim.statement.removesuffix('.')} ({claim.quantity.scope})"
        rows.append([claim.section.split(",")[0], words, *cells.values()])
    shown = [one.finding for one in audit if one.finding]
    notes = [
        f"{setting}: {tally(one.verdict for one in audit if one.delivery == setting)}"
        for setting in settings
    ]
    if any(finding.verdict is Verdict.EQUIVALENT for finding in shown):
        notes.append("equivalent: what the claim says differs, differs by less than matters")
    if any(finding.note == WITHIN_MARGIN for finding in shown):
        notes.append("~ the effect may be too small to matter (within the margin)")
    if any(finding.disagrees for finding in shown):
        notes.append("mean: the verdict by the mean, where it is not that on the typical run (IQM)")
    if shown:
        notes.append(
            f"All intervals behind the verdicts hold at once with {100 * SIMULTANEOUS_LEVEL:.0f} % "
            "(docs/statistics.md)."
        )
        notes.append("claims.md holds effects, intervals and what each claim was tested on.")
    headers = ("Section", "In our words (tested on)", *settings)
    return Table("The paper's claims", headers, rows, [*notes, *_untested(audit)], len(headers))


def _verdict(finding: Finding) -> str:
    text = finding.verdict.value + (" ~" if finding.note == WITHIN_MARGIN else "")
    if finding.by_mean is not None and finding.disagrees:
        text += f"\nmean: {finding.by_mean.verdict.value}"
    return text


def _untested(audit: Sequence[Audited]) -> list[str]:
    """Why claims were not tested, the three most frequent reasons and a count of the others."""
    reasons = Counter(one.reason for one in audit if not one.finding)
    several = len({one.delivery for one in audit}) > 1
    notes = ["Why not tested, both settings together:"] if reasons and several else []
    notes += [f"not tested ({times}): {reason}" for reason, times in reasons.most_common(3)]
    if others := [times for _, times in reasons.most_common()[3:]]:
        notes.append(
            f"not tested ({sum(others)}): {count(len(others), 'other reason')}, see claims.md"
        )
    return notes


def claims_markdown(audit: Sequence[Audited], world: str = PAPER_WORLD) -> str:
    """The world's name, a table of all claims with effects and intervals, and how to read it."""
    settings = list(dict.fromkeys(one.delivery for one in audit))
    rows: dict[str, list[str]] = {}
    for one in audit:
        claim = one.claim
        criterion = f"{_centre(claim)} {claim.criterion.words} {claim.quantity.unit}"
        words = [claim.id, claim.section, claim.statement, claim.tested_on, criterion]
        rows.setdefault(claim.id, words).append(
            _effect(one.finding) if one.finding else f"{one.verdict.value} ({one.reason})"
        )
    headers = ("Claim", "Section", "The paper, in our words", "Tested on", "Criterion", *settings)
    level = max((one.finding.level for one in audit if one.finding), default=math.nan)
    blocks: list[Block] = [
        f"World: {world}.",
        "\n".join(
            f"- {setting}: {tally(one.verdict for one in audit if one.delivery == setting)}."
            for setting in settings
        ),
        "No claim could be tested here." if math.isnan(level) else _EXPLANATION.format(100 * level),
        Table("", headers, list(rows.values()), text_columns=len(headers)),
    ]
    return markdown(blocks)


_EXPLANATION = """\
Effects are paired by seed. Claims in reward or steps rest on the typical run: the interquartile \
mean over seeds (the mean of the middle half), as one run in hundreds that does something else \
moves the mean. Where the mean gives another verdict, it stands behind. Shares, deliveries and \
correlations rest on the mean: they are bounded, and the middle half would hide that a quarter \
fails. Intervals are at {:.3f} % each, those of both readings counted, so that all hold at once \
with 95 %, as far as an interval of a mean with heavy tails can.

Of claims with several contrasts the weakest is shown. A claim 'above 0' is equivalent if its \
interval lies within the margin on either side of 0, so that what shall differ differs by less \
than matters; else supported if it lies above 0, contradicted if it lies below. A claim of a range \
is supported if the interval lies inside it, contradicted if it lies outside. All others are \
undecided. Margins are what is too small to matter: one reward is one step on a trail, two steps \
are what the paper itself calls alike."""


def _effect(finding: Finding) -> str:
    """Verdict, effect, interval and contrast of a claim; then those by mean where they differ."""
    digits = 1 if finding.contrast.typical else 2
    note = f" ({finding.note})" if finding.note else ""
    span = interval(finding.low, finding.high, digits)
    text = f"**{finding.verdict.value}{note}** {number(finding.effect, digits)} {span}, "
    text += finding.contrast.label
    if finding.by_mean is not None and finding.disagrees:
        text += f"; by mean: {_effect(finding.by_mean)}"
    return text
