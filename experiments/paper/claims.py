"""An audit of all empirical claims of the paper, which `claims.toml` lists in the paper's order."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from paper import quantities
from paper.comparison import VARIANTS, Comparison
from paper.quantities import Quantity, grids_of
from taichi_ants.analysis.findings import Criterion, Finding, Verdict, judge, weakest
from taichi_ants.analysis.tables import Table, interval, number, sentence, tally
from taichi_ants.files import tomllib


def in_words(criterion: Criterion) -> str:
    """Return a criterion in words, for tables."""
    low, high, margin = criterion.low, criterion.high, criterion.margin
    if margin is not None:
        limit = "" if high == math.inf else f" and at most {high:g}"
        return f"above {low:g}{limit}, margin {margin:g}"
    if low == -math.inf:
        return f"at most {high:g}"
    if high == math.inf:
        return f"at least {low:g}"
    return f"from {low:g} to {high:g}"


@dataclass(frozen=True, eq=False)
class Claim:
    """An empirical claim of the paper, made precise.

    Every effect of the quantity must fulfil the criterion, in which words of the paper such as
    "about", "close" or "consistently" become numbers.
    """

    id: str
    section: str  # of the paper
    statement: str  # in our words
    criterion: Criterion
    quantity: Quantity
    why: str = ""  # the reason for the criterion or the quantity

    @property
    def tested_on(self) -> str:
        """The quantity and the reason for it in words."""
        text = f"{self.quantity.words}: {'; '.join(self.quantity.effects)}"
        return f"{text}; {self.why}" if self.why else text

    @property
    def estimator(self) -> str:
        """The estimate over seeds that must fulfil the criterion."""
        return "interquartile mean" if self.quantity.uses_iqm else "mean"

    @property
    def asked(self) -> str:
        """The criterion in words."""
        return f"{self.estimator} {in_words(self.criterion)} {self.quantity.unit}"


# Arguments of quantities that are not measures, by their names in the file.
_NAMED: dict[str, Any] = {**{one.label: one for one in VARIANTS}, **quantities.READS}


def _claims() -> tuple[Claim, ...]:
    file = tomllib.loads(Path(__file__).with_name("claims.toml").read_text(encoding="utf-8"))

    def arguments(word: str) -> list[Any]:
        if word in file["groups"]:
            return [one for words in file["groups"][word] for one in arguments(words)]
        both = [_NAMED.get(part, part) for part in word.split(" minus ")]
        return [tuple(both)] if both[1:] else both

    def claim(quantity: list[str], **facts: Any) -> Claim:
        compute, *words = quantity
        criterion = Criterion(**{n: facts.pop(n) for n in ("low", "high", "margin") if n in facts})
        given = [one for word in words for one in arguments(word)]
        return Claim(criterion=criterion, quantity=getattr(quantities, compute)(*given), **facts)

    return tuple(claim(**one) for one in file["claims"])


CLAIMS = _claims()
# The main claims. Two of them are about steps, because they disagree.
HEADLINES = ("q-return-highest", "overall-sarsa-length", "sarsa-much-shorter")
ON_PAGE = (  # of the docs
    *(*HEADLINES, "sarsa-shortest-episode", "dyna-between-length", "rate-strongest", "discount-q"),
    *("dyna-depth-length-best", "dyna-depth-length", "greedy-success"),
)

Audit = dict[Claim, dict[str, Finding]]  # by claim and delivery setting


def assess(comparison: Comparison, claims: Sequence[Claim] = CLAIMS) -> Audit:
    """Return findings on the claims in all delivery settings; all intervals hold at the same time.

    A claim has one or more contrasts, the differences that must fulfil it. The finding on the claim
    is that on its weakest contrast: the claim is supported if all its contrasts are, and
    contradicted if one of them is.
    """
    grids = {delivery: grids_of(comparison, delivery) for delivery in comparison.delivery_settings}
    contrasts = {
        (claim, delivery): [
            claim.quantity.contrast(label, effect(grid), claim.criterion)
            for label, effect in claim.quantity.effects.items()
        ]
        for claim in claims
        for delivery, grid in grids.items()
    }
    findings = iter(judge([one for several in contrasts.values() for one in several]))
    audit: Audit = {claim: {} for claim in claims}
    for (claim, delivery), several in contrasts.items():
        audit[claim][delivery] = weakest([next(findings) for _ in several])
    return audit


def claims_rows(audit: Audit) -> list[dict[str, Any]]:
    """Return the rows of claims.csv; numbers are nan if not tested, None if not judged by mean."""

    def numbers(one: Finding | None, prefix: str = "") -> dict[str, Any]:
        names = ("contrast", "effect", "ci_low", "ci_high", "verdict")
        values: tuple[Any, ...] = (None,) * len(names)
        if one:
            values = one.contrast.label, one.effect, one.low, one.high, one.verdict.value
        return {prefix + name: value for name, value in zip(names, values, strict=True)}

    return [
        {
            "claim": claim.id,
            "section": claim.section,
            "statement": claim.statement,
            "quantity": claim.tested_on,
            "criterion": in_words(claim.criterion),
            "unit": claim.quantity.unit,
            "delivery": delivery,
            "estimator": claim.estimator,
            **numbers(one),
            **numbers(one.by_mean, "mean_"),
            "level": one.level,
            "seeds": one.contrast.seeds,
        }
        for claim, findings in audit.items()
        for delivery, one in findings.items()
    ]


def tallies(audit: Audit) -> list[str]:
    """Return a line for each delivery setting, with the number of claims by verdict."""
    return [
        f"{setting}: {tally(findings[setting].verdict.value for findings in audit.values())}"
        for setting in next(iter(audit.values()))
    ]


def verdict_table(audit: Audit) -> Table:
    """Return a table of the number of claims by verdict, a column for each delivery setting."""
    settings = list(next(iter(audit.values())))
    counts = [Counter(by[one].verdict.value for by in audit.values()) for one in settings]
    rows = [[word, *(f"{by[word]}" for by in counts)] for word in counts[0]]
    return Table("", ("Verdict", *settings), rows)


def headlines(audit: Audit, names: Sequence[str] = HEADLINES) -> Table:
    """Return a table of the findings on some claims, a column for each delivery setting."""
    claims = {claim.id: claim for claim in audit}
    rows = [
        [f"{claim.statement}\n({claim.quantity.words})", *map(_cell, audit[claim].values())]
        for claim in (claims[name] for name in names)
    ]
    note = (
        "Below the verdict: the difference that decides, its interquartile mean (IQM) over seeds "
        "in reward or steps, and its interval. All intervals hold at once."
    )
    settings = next(iter(audit.values()))
    headers = ("The paper's main claims", *map(sentence, settings))
    return Table("", headers, rows, [note], text_columns=len(headers))


def _cell(finding: Finding) -> str:
    if finding.verdict is Verdict.NOT_TESTED:
        return finding.verdict.value
    numbers = f"{number(finding.effect)} {interval(finding.low, finding.high)}"
    return f"{finding.verdict.value}\n{finding.contrast.label}\n{numbers}"
