"""The audit of the paper's claims: each tested in each delivery setting, judged, and shown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from taichi_ants.analysis.findings import Contrast, Finding, Verdict, judge, weakest
from taichi_ants.analysis.paper.claims import CLAIMS, Claim
from taichi_ants.analysis.paper.comparison import Comparison
from taichi_ants.analysis.paper.quantities import Slice
from taichi_ants.analysis.tables import Block, Table, interval, markdown, number, sentence

# By claim and delivery setting.
Audit = dict[Claim, dict[str, Finding]]
# The main claims. Two of them are about steps, because they disagree.
HEADLINES = ("q-return-highest", "overall-sarsa-length", "sarsa-much-shorter")


def assess(comparison: Comparison, claims: Sequence[Claim] = CLAIMS) -> Audit:
    """The claims in their order, each in all delivery settings, all judged together.

    A claim is supported if all its contrasts are and contradicted if one is; the finding is that
    on the weakest contrast. A claim is not tested where something of what it needs is missing.
    """
    contrasts = {
        (claim, delivery): [
            Contrast(
                *(label, effect(Slice(comparison, delivery)), claim.criterion),
                *(claim.quantity.uses_iqm, claim.quantity.possible, claim.quantity.of_estimates),
            )
            for label, effect in claim.quantity.effects.items()
        ]
        for claim in claims
        for delivery in comparison.delivery_settings
    }
    findings = iter(judge([one for several in contrasts.values() for one in several]))
    audit: Audit = {claim: {} for claim in claims}
    for (claim, delivery), several in contrasts.items():
        audit[claim][delivery] = weakest([next(findings) for _ in several])
    return audit


def claims_rows(audit: Audit) -> list[dict]:
    """The rows of claims.csv; numbers are nan if not tested, None if not read by mean."""
    rows = []
    for claim, findings in audit.items():
        for delivery, one in findings.items():
            numbers = _numbers(one)
            by_mean = _numbers(one.by_mean) if one.by_mean else dict.fromkeys(numbers)
            row = {
                "claim": claim.id,
                "section": claim.section,
                "statement": claim.statement,
                "quantity": claim.tested_on,
                "criterion": claim.criterion.words,
                "unit": claim.quantity.unit,
                "delivery": delivery,
                "estimator": claim.estimator,
                **numbers,
                **{f"mean_{name}": value for name, value in by_mean.items()},
                "level": one.level,
                "seeds": one.contrast.seeds,
            }
            rows.append(row)
    return rows


def _numbers(finding: Finding) -> dict:
    return {
        "contrast": finding.contrast.label,
        "effect": finding.effect,
        "ci_low": finding.low,
        "ci_high": finding.high,
        "verdict": finding.verdict.value,
    }


def _tallies(audit: Audit) -> list[str]:
    """How many verdicts of each kind there are, a line for each delivery setting."""
    lines = []
    for setting in next(iter(audit.values())):
        counted = Counter(findings[setting].verdict.value for findings in audit.values())
        numbers = ", ".join(f"{n} {verdict}" for verdict, n in counted.most_common())
        lines.append(f"{setting}: {numbers}")
    return lines


def claims_tallies(audit: Audit) -> str:
    """How many claims of the paper hold, in lines for a terminal."""
    lines = [f"The paper's {len(audit)} claims", *(f"  {line}" for line in _tallies(audit))]
    return "\n".join(lines)


def headlines(audit: Audit) -> Table:
    """Return a table of the findings on the main claims, a column for each delivery setting."""
    claims = {claim.id: claim for claim in audit}
    rows = [
        [claims[name].statement, *map(_verdict_and_difference, audit[claims[name]].values())]
        for name in HEADLINES
    ]
    note = (
        "Below the verdict: the difference that decides, its interquartile mean (IQM) over seeds "
        "in reward or steps, and its interval, which holds for all claims at once."
    )
    settings = next(iter(audit.values()))
    headers = ("The paper's main claims", *map(sentence, settings))
    return Table("", headers, rows, [note], text_columns=len(headers))


def _verdict_and_difference(finding: Finding) -> str:
    if finding.verdict is Verdict.NOT_TESTED:
        return finding.verdict.value
    numbers = f"{number(finding.effect)} {interval(finding.low, finding.high)}"
    return f"{finding.verdict.value}\n{finding.contrast.label}\n{numbers}"


def claims_markdown(audit: Audit, world: str) -> str:
    """The world's name, how to read it, and a table of all claims with effects and intervals."""
    rows = [
        [
            *(claim.id, claim.section, claim.statement, claim.tested_on),
            f"{claim.estimator} {claim.criterion.words} {claim.quantity.unit}",
            *map(_effect, findings.values()),
        ]
        for claim, findings in audit.items()
    ]
    settings = next(iter(audit.values()))
    headers = ("Claim", "Section", "The paper, in our words", "Tested on", "Criterion", *settings)
    level = next(iter(settings.values())).level
    blocks: list[Block] = [
        f"World: {world}.",
        "\n".join(f"- {line}." for line in _tallies(audit)),
        _EXPLANATION.format(100 * level),
        Table("", headers, rows, text_columns=len(headers)),
    ]
    return markdown(blocks)


_EXPLANATION = """\
Effects are paired by seed. Where the verdict by the mean is another, it stands behind. Of claims \
with several contrasts the weakest is shown. Intervals are at {:.3f} % each, so that all hold at \
once with 95 %. docs/statistics.md explains estimators, verdicts and margins mean."""


def _effect(finding: Finding) -> str:
    """Verdict, effect, interval and contrast of a claim; then those by mean where they differ."""
    if finding.verdict is Verdict.NOT_TESTED:
        return finding.verdict.value
    digits = 1 if finding.contrast.uses_iqm else 2
    span = interval(finding.low, finding.high, digits)
    text = f"**{finding.verdict.value}** {number(finding.effect, digits)} {span}, "
    text += finding.contrast.label
    if finding.by_mean and finding.by_mean.verdict is not finding.verdict:
        text += f"; by mean: {_effect(finding.by_mean)}"
    return text
