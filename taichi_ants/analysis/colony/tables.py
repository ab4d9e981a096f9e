"""The study as tables: all conditions, all differences, and the findings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from taichi_ants.analysis.colony.contrasts import QUESTIONS, Judged, Series, Sizes
from taichi_ants.analysis.colony.study import (
    ABC,
    ABROAD,
    ALONE,
    ARENAS,
    EVALUATION_EPSILON,
    MEASURES,
    OF_STUDY,
    PAPER,
    RULES,
    WAYS,
    WORLDS,
    Condition,
    Design,
    Measured,
)
from taichi_ants.analysis.findings import Finding, Verdict, seeds_in_words, weakest
from taichi_ants.analysis.sweeps import seed_rows, summary_rows
from taichi_ants.analysis.tables import (
    MISSING,
    Block,
    Table,
    figure,
    interval,
    number,
    percent,
    sentence,
)
from taichi_ants.errors import count


def rows_of_seeds(measured: Measured, seeds: Sequence[int]) -> list[dict[str, Any]]:
    """The rows of seeds.csv: all measures of each seed under each condition."""
    return list(seed_rows([one._asdict() for one in measured], seeds, _stacked(measured)))


def _stacked(measured: Measured) -> dict[str, np.ndarray]:
    """The measures as arrays (conditions, seeds)."""
    return {name: np.stack([one[name] for one in measured.values()]) for name in OF_STUDY}


def condition_rows(measured: Measured) -> list[dict[str, Any]]:
    """Return the rows of conditions.csv: means over seeds with 95 % intervals, and some ranges."""
    rows = summary_rows([one._asdict() for one in measured], _stacked(measured))
    for row, values in zip(rows, measured.values(), strict=True):
        for name in ("deliveries", "bound"):
            row |= {
                f"{name}_min": float(values[name].min()),
                f"{name}_max": float(values[name].max()),
            }
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
    """Return tables of mean deliveries, from `condition_rows`.

    One for each arena in which ants were trained, designs down, ants across; then one of the
    policies of open worlds in others, with intervals and the worst seed.
    """
    tables, seeds = [], f"{_basis(rows)}: {MEASURES['deliveries']}"
    for arena in ARENAS:
        at_home = [row for row in rows if row["arena"] == arena and row["way"] != ABROAD]
        sizes = sorted({row["ants"] for row in at_home})
        lines: dict[str, dict[Any, float]] = {}
        for row in at_home:
            line = lines.setdefault(Design(row["rules"], row["way"]).words, {})
            share = {"share": row["of_bound_mean"], "bound": row["bound_mean"]}
            line |= {row["ants"]: row["deliveries_mean"], **share}  # of most ants, who come last
        cells = [
            [
                *(who, *(figure(by.get(n, np.nan)) for n in sizes)),
                *(percent(by["share"]), figure(by["bound"])),
            ]
            for who, by in lines.items()
        ]
        if cells:
            headers = ("ants", *map(str, sizes), "share of\nbound", "mean\nbound")
            note = (
                f"Of {count(sizes[-1], 'ant')}: the mean share of each world's own bound, and the "
                "mean of the bounds."
            )
            title = f"{sentence(ARENAS[arena])}, {seeds}"
            tables.append(Table(title, headers, cells, [note]))
    abroad = [row for row in rows if row["way"] == ABROAD]
    if abroad:
        rules = list(dict.fromkeys(row["rules"] for row in abroad))
        there: dict[str, dict[str, str]] = {}
        for row in abroad:
            there.setdefault(row["arena"], {})[row["rules"]] = _spread(row)
        cells = [[WORLDS[a], *(by[one] for one in rules)] for a, by in there.items()]
        headers = ("world", *(RULES[one] for one in rules))
        title = f"{sentence(WAYS[ABROAD])}, {count(abroad[0]['ants'], 'ant')}, {seeds}"
        note = "Mean, its 95 % interval, and the worst seed."
        tables.append(Table(title, headers, cells, [note]))
    return tables


def _basis(rows: Sequence[Mapping[str, Any]]) -> str:
    """The seeds and the exploration rate behind the numbers of a table."""
    return f"{seeds_in_words(rows[0]['seeds'])}, exploration rate {EVALUATION_EPSILON:g}"


def _spread(row: Mapping[str, Any]) -> str:
    """A mean with its interval, and the worst seed."""
    mean, *ends, worst = (
        row[f"deliveries_{which}"] for which in ("mean", "ci_low", "ci_high", "min")
    )
    return f"{figure(mean)} {interval(ends[0], ends[1], 0)}, {figure(worst)}"


def glance(rows: Sequence[Mapping[str, Any]]) -> Table:
    """Return what the largest colonies deliver, from `condition_rows`: designs down, arenas across.

    It has no rows where none are trained.
    """
    largest = max((row["ants"] for row in rows if row["way"] != ABROAD), default=0)
    shown = [row for row in rows if row["ants"] == largest and row["arena"] in ARENAS]
    designs = [Design(PAPER, ALONE), *(Design(rules) for rules in RULES), Design(ABC, ALONE)]
    arenas = [arena for arena in ARENAS if any(row["arena"] == arena for row in shown)]
    by_place = {(row["arena"], Design(row["rules"], row["way"])): row for row in shown}
    digits = 0 if max((row["deliveries_mean"] for row in shown), default=0) >= 100 else 1
    cells = [
        [sentence(one.words), *(_delivered(by_place.get((arena, one)), digits) for arena in arenas)]
        for one in designs
        if any((arena, one) in by_place for arena in arenas)
    ]
    if cells:  # most is possible where ants with food have right of way
        most = [
            max((row for row in shown if row["arena"] == arena), key=lambda row: row["bound_mean"])
            for arena in arenas
        ]
        cells.append(["Mean bound, right of way [range]", *map(_bounds, most)])
    headers = ("", *(sentence(ARENAS[arena]).replace(" (", "\n(") for arena in arenas))
    title = f"{sentence(MEASURES['deliveries'])} of {count(largest, 'ant')}"
    note = f"{_basis(rows)}; in brackets: 0. %: of each world's own bound."
    return Table(title, headers, cells, [note] if cells else [])


def _delivered(row: Mapping[str, Any] | None, digits: int) -> str:
    """Deliveries with and without exploration, and the share of the bounds."""
    if row is None:
        return MISSING
    with_, without = (number(row[f"{name}_mean"], digits) for name in ("deliveries", "greedy"))
    return f"{with_} ({without}), {percent(row['of_bound_mean'])}"


def _bounds(row: Mapping[str, Any]) -> str:
    """The mean of the worlds' bounds, with their range where they differ."""
    low, high = row["bound_min"], row["bound_max"]
    return figure(row["bound_mean"]) + ("" if low == high else f" {interval(low, high, 0)}")


def on_one_screen(
    rows: Sequence[Mapping[str, Any]], judged: Judged, answer: Sequence[str]
) -> list[Block]:
    """The answer, deliveries at a glance, and how many statements hold."""
    seen = glance(rows)
    tables = [seen] if seen.rows else means(rows)
    return [_sizes(rows), "\n".join(answer), *tables, tallies(judged)]


def _sizes(rows: Sequence[Mapping[str, Any]]) -> str:
    arenas = dict.fromkeys(row["arena"] for row in rows)
    conditions = f"{count(len(rows), 'condition')} in {count(len(arenas), 'kind')} of world"
    return f"{conditions}, {seeds_in_words(rows[0]['seeds'])}."


def tallies(judged: Judged) -> str:
    """How many statements hold of the largest colonies, a line for each question."""
    lines = []
    for question in QUESTIONS:
        verdicts = Counter(
            of_largest(findings).verdict.value
            for (_, series), findings in judged.items()
            if series.question == question
        )
        if verdicts:
            words = ", ".join(f"{n} {verdict}" for verdict, n in verdicts.most_common())
            lines.append(f"  {question} {words}")
    return "\n".join(["Statements about the largest colonies", *lines])


def of_largest(findings: Mapping[Sizes, Finding]) -> Finding:
    """What is found of the largest colony; compared with several, the strongest objection."""
    n = max(ants for ants, _ in findings)
    return weakest([one for (ants, _), one in findings.items() if ants == n])


_SHOWN = (Verdict.SUPPORTED, Verdict.CONTRADICTED, Verdict.UNDECIDED)
_HEADERS = ("World", "Statement", *(f"{sentence(one)}\nwith" for one in _SHOWN), "Clearest")


def found(measured: Measured, judged: Judged) -> list[Block]:
    """Return the findings: a table for each question, a line for each series in each arena."""
    blocks: list[Block] = []
    seeds = len(measured[next(iter(measured))]["deliveries"])
    basis = f"{seeds_in_words(seeds)}, exploration rate {EVALUATION_EPSILON:g}"
    for question in QUESTIONS:
        lines, units, shown = [], [], ""
        for (arena, series), findings in judged.items():
            if series.question == question:
                world = "" if arena == shown else sentence(WORLDS[arena])
                verdicts = _verdicts(measured, arena, series, findings)
                lines.append([world, sentence(series.statement), *verdicts])
                units.append(MEASURES[series.measure])
                shown = arena
        what = f"{sentence(' or '.join(dict.fromkeys(units)))}, as the statement says"
        notes = [f"{what}; {basis}."]
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
