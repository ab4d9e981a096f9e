"""The study as tables: all conditions, all differences, and the deliveries at a glance."""

from __future__ import annotations

from typing import Any

import numpy as np

from taichi_ants.analysis import tables as markdown
from taichi_ants.analysis.colony.contrasts import CONTRASTS, Judged
from taichi_ants.analysis.colony.findings import Finding
from taichi_ants.analysis.colony.study import MEASURES, ON, PHEROMONES, WAYS, Arena, ColonyStudy
from taichi_ants.analysis.statistics import bootstrap_interval

CONDITION_COLUMNS: tuple[str, ...] = (
    *("arena", "pheromone", "way", "ants", "seeds"),
    *(f"{name}{end}" for name in MEASURES for end in ("_mean", "_ci_low", "_ci_high")),
    "deliveries_limit",
)
DIFFERENCE_COLUMNS: tuple[str, ...] = (
    *("arena", "question", "difference", "ants", "against", "mean", "low", "high", "verdict"),
)
_VERDICTS = {1: "above 0", -1: "below 0", 0: "not told from chance"}


def condition_rows(study: ColonyStudy) -> list[dict[str, Any]]:
    """The rows of conditions.csv: means over seeds with 95 % intervals (`bootstrap_interval`)."""
    rows = []
    for arena in study.arenas:
        named = sorted(
            (c for c in study.records if c.arena == arena.name),
            key=lambda c: (list(PHEROMONES).index(c.pheromone), list(WAYS).index(c.way), c.ants),
        )
        columns: dict[str, np.ndarray] = {}
        for measure in MEASURES:
            values = np.stack(
                [study.values(arena, c.pheromone, c.way, c.ants, measure) for c in named]
            )
            low, high = bootstrap_interval(values)
            columns |= {f"{measure}_mean": values.mean(axis=1), f"{measure}_ci_low": low}
            columns[f"{measure}_ci_high"] = high
        for number, condition in enumerate(named):
            limits = [limit.deliveries(condition.ants) for limit in arena.limits]
            rows.append(
                {
                    **vars(condition),
                    "seeds": arena.seeds,
                    **{name: float(values[number]) for name, values in columns.items()},
                    "deliveries_limit": float(np.mean(limits)) if limits else None,
                }
            )
    return rows


def difference_rows(judged: Judged) -> list[dict[str, Any]]:
    """The rows of differences.csv; the intervals of one question in one arena hold all at once."""
    return [
        {
            "arena": arena,
            "question": question,
            "difference": CONTRASTS[question][name].words,
            "ants": ants,
            "against": against,
            **vars(difference),
            "verdict": _VERDICTS[difference.sign],
        }
        for (arena, question), verdicts in judged.items()
        for name, differences in verdicts.items()
        for (ants, against), difference in differences.items()
    ]


def table_markdown(study: ColonyStudy, rows: list[dict[str, Any]]) -> str:
    """Deliveries per 1000 ticks with 95 % intervals, a table for each arena; evaporating trails."""
    parts = []
    for arena in study.arenas:
        ways = [way for way in WAYS if study.sizes(arena, ON, way)]
        found = {
            (row["way"], row["ants"]): row
            for row in rows
            if row["arena"] == arena.name and row["pheromone"] == ON
        }
        headers = ("ants", *(_way(arena, way) for way in ways), "blocked moves", "limit")
        lines = [
            [
                str(ants),
                *(_cell(found.get((way, ants))) for way in ways),
                _blocked([found[way, ants] for way in ways if (way, ants) in found]),
                _limit(arena, ants),
            ]
            for ants in arena.sizes
        ]
        title = arena.words[0].upper() + arena.words[1:]
        parts.append(f"**{title}**\n\n{markdown.table(headers, lines, text_columns=0)}")
    return "\n".join(parts)


def findings_markdown(findings: list[Finding]) -> str:
    """The findings under their questions."""
    parts = []
    for question in dict.fromkeys(finding.question for finding in findings):
        sentences = [f"- {f.sentence}" for f in findings if f.question == question]
        parts.append(f"**{question}**\n\n" + "\n".join(sentences) + "\n")
    return "\n".join(parts)


def _way(arena: Arena, way: str) -> str:
    return WAYS[way].replace("for long", f"{arena.long_factor} times as long")


def _cell(row: dict[str, Any] | None) -> str:
    if row is None:
        return markdown.MISSING
    mean, low, high = (row[f"deliveries_{end}"] for end in ("mean", "ci_low", "ci_high"))
    digits = 0 if mean >= 100 else 1
    span = markdown.interval(low, high, digits)
    return markdown.number(mean, digits) + ("" if span == markdown.MISSING else f" {span}")


def _blocked(rows: list[dict[str, Any]]) -> str:
    """The smallest and the largest share of the ways."""
    shares = [100 * row["blocked_mean"] for row in rows]
    low, high = (f"{share:.0f}" for share in (min(shares), max(shares)))
    return f"{low} %" if low == high else f"{low} to {high} %"


def _limit(arena: Arena, ants: int) -> str:
    if not arena.limits:
        return markdown.MISSING
    limit = float(np.mean([limit.deliveries(ants) for limit in arena.limits]))
    return markdown.number(limit, 0 if limit >= 100 else 1)
