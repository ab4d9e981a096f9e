"""The study as tables: all conditions, all differences, and the findings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from taichi_ants.analysis.bounds.limits import Limits
from taichi_ants.analysis.colony.contrasts import QUESTIONS, Judged, Series, Sizes
from taichi_ants.analysis.colony.study import ARENAS, MEASURES, Condition, Design, Measured
from taichi_ants.analysis.findings import Finding, Verdict, weakest
from taichi_ants.analysis.sweeps import seed_rows, summary_rows
from taichi_ants.analysis.tables import MISSING, Block, Table, figure, sentence
from taichi_ants.errors import count

# The limits of the worlds of an arena: one, or one for each seed.
LimitsByArena = Mapping[str, Sequence[Limits]]


def rows_of_seeds(measured: Measured, seeds: Sequence[int]) -> list[dict[str, Any]]:
    """The rows of seeds.csv: all measures of each seed under each condition."""
    return seed_rows([one._asdict() for one in measured], seeds, _stacked(measured))


def _stacked(measured: Measured) -> dict[str, np.ndarray]:
    """The measures as arrays (conditions, seeds)."""
    return {name: np.stack([one[name] for one in measured.values()]) for name in MEASURES}


def condition_rows(measured: Measured, limits: LimitsByArena) -> list[dict[str, Any]]:
    """The rows of conditions.csv: means over seeds with 95 % intervals, and the most possible."""
    rows = summary_rows([one._asdict() for one in measured], _stacked(measured))
    for row in rows:
        possible = [one.deliveries(row["ants"]) for one in limits[row["arena"]]]
        row["deliveries_limit"] = float(np.mean(possible))
    return rows


def difference_rows(judged: Judged) -> list[dict[str, Any]]:
    """The rows of differences.csv; the intervals of one question in one arena hold all at once."""
    return [
        {
            "arena": arena,
            "question": series.question,
            "statement": series.statement,
            "measure": series.measure,
            "ants": ants,
            "against": against,
            "mean": finding.effect,
            "low": finding.low,
            "high": finding.high,
            "verdict": finding.verdict.value,
        }
        for (arena, series), findings in judged.items()
        for (ants, against), finding in findings.items()
    ]


def means(rows: Sequence[Mapping[str, Any]]) -> list[Table]:
    """Mean deliveries, from `condition_rows`, a table for each arena: designs down, ants across."""
    tables = []
    for arena in dict.fromkeys(row["arena"] for row in rows):
        lines: dict[str, dict[int, float]] = {}
        of_arena = [row for row in rows if row["arena"] == arena]
        for row in of_arena:
            words = Design(row["rules"], row["way"]).words
            lines.setdefault(words, {})[row["ants"]] = row["deliveries_mean"]
        lines["limit"] = {row["ants"]: row["deliveries_limit"] for row in of_arena}
        sizes = sorted(lines["limit"])
        cells = [[who, *(figure(by.get(n, np.nan)) for n in sizes)] for who, by in lines.items()]
        seeds = count(rows[0]["seeds"], "seed")
        title = f"{sentence(ARENAS[arena])}, {seeds}: {MEASURES['deliveries']}"
        tables.append(Table(title, ("ants", *map(str, sizes)), cells))
    return tables


_SHOWN = (Verdict.SUPPORTED, Verdict.CONTRADICTED, Verdict.UNDECIDED)
_HEADERS = ("World", "Statement", *(f"{sentence(one)}\nwith" for one in _SHOWN), "Clearest")


def found(measured: Measured, judged: Judged) -> list[Block]:
    """The findings: a table for each question, with a line for each series in each arena."""
    blocks: list[Block] = []
    for question in QUESTIONS:
        lines, units, shown = [], [], ""
        for (arena, series), findings in judged.items():
            if series.question == question:
                world = "" if arena == shown else sentence(ARENAS[arena])
                verdicts = _verdicts(measured, arena, series, findings)
                lines.append([world, sentence(series.statement), *verdicts])
                units.append(MEASURES[series.measure])
                shown = arena
        notes = [f"{sentence(' or '.join(dict.fromkeys(units)))}, as the statement says."]
        if lines:
            blocks.append(Table(question, _HEADERS, lines, notes, text_columns=len(_HEADERS)))
    return [
        *blocks,
        "The numbers are those of ants. Where a colony is compared with each smaller one, the "
        "strongest objection counts. The intervals behind the answers to one question in one kind "
        "of world hold at once with 95 %.",
    ]


def _verdicts(
    measured: Measured, arena: str, series: Series, findings: Mapping[Sizes, Finding]
) -> list[str]:
    """With how many ants a statement holds, and the two means that differ most."""
    by_verdict: dict[Verdict, list[int]] = {verdict: [] for verdict in Verdict}
    for n in sorted({n for n, _ in findings}):
        of_all = weakest([one for (ants, _), one in findings.items() if ants == n])
        by_verdict[of_all.verdict].append(n)
    by_verdict[Verdict.UNDECIDED] += by_verdict[Verdict.EQUIVALENT]
    cells = [", ".join(map(str, sorted(by_verdict[one]))) or MISSING for one in _SHOWN]

    def both(n: int, other: int) -> tuple[float, float]:
        first = measured[Condition(arena, *series.first, n)][series.measure]
        second = measured[Condition(arena, *series.second, other)][series.measure]
        return float(first.mean()), float(second.mean())

    def distance(sizes: Sizes) -> float:
        one, other = both(*sizes)
        return abs(one - other) / (abs(one) + abs(other) or 1.0)

    n, less = max(findings, key=distance)
    one, other = both(n, less)
    example = f"{n}: {figure(one)} against {figure(other)}"
    example += "" if less == n else f" with {less}"
    example += f" ({100 * (one / other - 1):+.0f} %)" if min(one, other) > 0 else ""
    return [*cells, example]
