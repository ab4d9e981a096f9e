"""Findings as rows of claims.csv and as Markdown."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

from taichi_ants.analysis.claims.assess import SIMULTANEOUS_LEVEL
from taichi_ants.analysis.claims.model import Finding, Verdict
from taichi_ants.analysis.paper.comparison import PAPER_WORLD
from taichi_ants.analysis.tables import interval, number, table


def claims_rows(findings: Sequence[Finding]) -> list[dict]:
    """The rows of claims.csv; effect, ends of the interval and level are nan if not tested."""
    return [
        {
            "claim": finding.claim.id,
            "section": finding.claim.section,
            "statement": finding.claim.statement,
            "quantity": finding.claim.quantity,
            "criterion": finding.claim.criterion.words,
            "unit": finding.claim.unit,
            "delivery": finding.delivery,
            "scope": finding.scope,
            "contrast": finding.contrast,
            "centre": _centre(finding),
            "effect": finding.effect,
            "ci_low": finding.low,
            "ci_high": finding.high,
            "level": finding.level,
            "simultaneous_level": SIMULTANEOUS_LEVEL,
            "verdict": finding.verdict.value,
            "note": finding.note,
            **_by_mean(finding),
            "seeds": finding.seeds,
            "configurations": finding.configurations,
        }
        for finding in findings
    ]


def _centre(finding: Finding) -> str:
    return "interquartile mean" if finding.claim.typical else "mean"


def _by_mean(finding: Finding) -> dict:
    """The other reading, of claims that rest on the typical run; "" and nan where there is none."""
    other = finding.by_mean
    return {
        "mean_contrast": other.contrast if other else "",
        "mean_effect": other.effect if other else math.nan,
        "mean_ci_low": other.low if other else math.nan,
        "mean_ci_high": other.high if other else math.nan,
        "mean_verdict": other.verdict.value if other else "",
    }


def by_claim(findings: Sequence[Finding]) -> list[list[Finding]]:
    """Findings on one claim together, one for each delivery setting, in the order of claims."""
    grouped: dict[str, list[Finding]] = {}
    for finding in findings:
        grouped.setdefault(finding.claim.id, []).append(finding)
    return list(grouped.values())


def effect_text(finding: Finding) -> str:
    """The effect with its interval, "-" if not tested."""
    digits = 2 if finding.claim.unit.startswith(("share", "deliveries", "correlation")) else 1
    if finding.verdict is Verdict.NOT_TESTED:
        return number(math.nan)
    return f"{number(finding.effect, digits)} {interval(finding.low, finding.high, digits)}"


def verdict_text(finding: Finding) -> str:
    """The verdict, with its note in brackets."""
    return finding.verdict.value + (f" ({finding.note})" if finding.note else "")


def tally(findings: Sequence[Finding]) -> str:
    """How many findings of each verdict there are, as a phrase."""
    counts = Counter(finding.verdict for finding in findings)
    order = (
        Verdict.SUPPORTED,
        Verdict.CONTRADICTED,
        Verdict.EQUIVALENT,
        Verdict.UNDECIDED,
        Verdict.NOT_TESTED,
    )
    return ", ".join(f"{counts[verdict]} {verdict.value}" for verdict in order if counts[verdict])


def claims_markdown(findings: Sequence[Finding], world: str = PAPER_WORLD) -> str:
    """The world's name, a table of all verdicts, then every claim made precise."""
    settings = list(dict.fromkeys(finding.delivery for finding in findings))
    parts = [
        f"{setting}: {tally([f for f in findings if f.delivery == setting])}."
        for setting in settings
    ]
    return "\n".join(
        (
            f"World: {world}.\n",
            "\n".join(f"- {part}" for part in parts) + "\n",
            _explanation(findings),
            _verdict_table(findings, settings),
            "What each claim was tested on:\n",
            *(_precise(group[0]) for group in by_claim(findings)),
        )
    )


def _explanation(findings: Sequence[Finding]) -> str:
    level = max((f.level for f in findings if not math.isnan(f.level)), default=math.nan)
    if math.isnan(level):
        return "No claim could be tested here.\n"
    return (
        "Effects are paired by seed. Claims in reward or steps rest on the typical run: the "
        "interquartile mean over seeds (the mean of the middle half), as one run in hundreds that "
        "does something else moves the mean. Where the mean gives another verdict, it stands "
        "behind. Shares, deliveries and correlations rest on the mean: they are bounded, and the "
        "middle half would hide that a quarter fails. Intervals are at "
        f"{number(100 * level, 3)} % each, those of both readings counted, so that all hold at "
        f"once with {number(100 * SIMULTANEOUS_LEVEL, 0)} %, as far as an interval of a mean with "
        "heavy tails can.\n\n"
        "Of claims with several contrasts the weakest is shown. A claim 'above 0' is equivalent if "
        "its interval lies within the margin on either side of 0, so that what shall differ "
        "differs by less than matters; else supported if it lies above 0, contradicted if it lies "
        "below. A claim of a range is supported if the interval lies inside it, contradicted if it "
        "lies outside. All others are undecided. Margins are what is too small to matter: one "
        "reward is one step on a trail, two steps are what the paper itself calls alike.\n"
    )


def _verdict_table(findings: Sequence[Finding], settings: Sequence[str]) -> str:
    lines = []
    for group in by_claim(findings):
        claim = group[0].claim
        cells = {finding.delivery: _cell(finding) for finding in group}
        criterion = f"{claim.criterion.words} {claim.unit}"
        lines.append([claim.id, claim.section, claim.statement, criterion])
        lines[-1] += [cells[setting] for setting in settings]
    headers = ["Claim", "Section", "The paper, in our words", "Criterion", *settings]
    return table(headers, lines, text_columns=len(headers))


def _cell(finding: Finding) -> str:
    if finding.verdict is Verdict.NOT_TESTED:
        return verdict_text(finding)
    text = f"**{verdict_text(finding)}** {effect_text(finding)}, {finding.contrast}"
    if finding.by_mean is not None and finding.disagrees:
        text += f"; by mean: {_cell(finding.by_mean)}"
    return text


def _precise(finding: Finding) -> str:
    claim = finding.claim
    contrasts = "; ".join(contrast.label for contrast in claim.contrasts)
    return (
        f"- **{claim.id}**: {claim.quantity}. Contrasts: {contrasts}. "
        f"Criterion: {_centre(finding)} {claim.criterion.words} {claim.unit}."
    )
