"""The page that tells the study of the colony."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from taichi_ants.analysis.colony.contrasts import Judged
from taichi_ants.analysis.colony.study import EVALUATION_EPSILON, MEASURES, WORLD_KINDS, WORLDS
from taichi_ants.analysis.colony.tables import ConditionRow, glance, headlines, means, of_largest
from taichi_ants.analysis.drawings import Drawing
from taichi_ants.analysis.findings import seeds_in_words
from taichi_ants.analysis.tables import sentence
from taichi_ants.errors import count
from taichi_ants.report.page import Player, Shown, Statement, Statements, fill


def colony_page(
    rows: Sequence[ConditionRow],
    findings: Judged,
    *,
    drawings: Sequence[Drawing],
    players: Sequence[Player],
    facts: Mapping[str, str],
    files: Sequence[str],
) -> str:
    """Return the page as HTML; `facts` say how it was done, `files` what lies beside it."""
    world_kinds = list(dict.fromkeys(row.condition.world_kind for row in rows))
    trained = [world_kind for world_kind in WORLD_KINDS if world_kind in world_kinds]
    seeds = seeds_in_words(rows[0].seeds)
    return fill(
        "colony.html",
        title="When does a colony do more than its ants?",
        byline=f"{seeds}, {count(len(rows), 'condition')}, "
        f"{count(len(world_kinds), 'kind')} of world",
        seeds=seeds,
        epsilon=f"{EVALUATION_EPSILON:g}",
        worlds=[WORLD_KINDS[world_kind] for world_kind in trained],
        headlines=headlines(rows, findings),
        findings=_statements(findings),
        glance=glance(rows),
        tables=means(rows),
        drawings=drawings,
        players=players,
        facts=facts,
        files=files,
    )


def _statements(findings: Judged) -> Statements:
    """The findings, with the verdict on the largest colony."""
    lines = []
    for (world_kind, series), by_sizes in findings.items():
        unit = MEASURES[series.measure]
        told = [
            Shown(count(n, "ant") if n == less else f"{n} against {less}", one, "Difference", unit)
            for (n, less), one in by_sizes.items()
        ]
        facts = {"Question": series.question, "Difference in": unit}
        verdicts = [of_largest(by_sizes).verdict]
        statement = f"{sentence(series.statement)}."
        lines.append(Statement(statement, sentence(WORLDS[world_kind]), verdicts, facts, told))
    return Statements(("Statement", "World", "Largest colony"), lines, "statements")
