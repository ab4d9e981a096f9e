"""The page of the colony's study, and its recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from taichi_ants.analysis.colony.study import (
    EVALUATION_EPSILON,
    JOINT,
    MEASURES,
    RULES,
    WORLD_KINDS,
    WORLDS,
    Judged,
)
from taichi_ants.analysis.colony.tables import ConditionRow, glance, headlines, means, of_largest
from taichi_ants.analysis.drawings import Drawing
from taichi_ants.analysis.findings import seeds_in_words
from taichi_ants.analysis.tables import sentence
from taichi_ants.engines.colony.colony import Colony
from taichi_ants.errors import count
from taichi_ants.learners.policies import load_policy
from taichi_ants.report.page import Player, Shown, Statement, Statements, fill
from taichi_ants.studies.colony_study import COMPARED, Plan
from taichi_ants.viewer import record_colony

TICKS, MOST_ANTS = 240, 1000  # of a recording


def colony_page(
    rows: Sequence[ConditionRow],
    findings: Judged,
    *,
    drawings: Sequence[Drawing],
    players: Sequence[Player],
    facts: Mapping[str, str],
    files: Sequence[str],
) -> str:
    """Return the page as HTML; `facts` describe the method, and `files` are links to results."""
    world_kinds = list(dict.fromkeys(row.condition.world_kind for row in rows))
    trained = [world_kind for world_kind in WORLD_KINDS if world_kind in world_kinds]
    seeds = seeds_in_words(rows[0].seeds)
    return fill(
        "colony.html",
        title="Which rules and which training make a colony deliver more?",
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


def at_work(policies: Path, conditions: Plan, seeds: Sequence[int], arch: str) -> list[Player]:
    """Return recordings of the largest colony under each of the compared rules, in one world."""
    trained = [one for one in conditions if one.regime == JOINT and one.ants <= MOST_ANTS]
    if not trained:
        return []
    world_kind = max((one.world_kind for one in trained), key=list(WORLD_KINDS).index)
    ants = max(one.ants for one in trained)
    players = []
    for condition in [one for one in trained if (one.world_kind, one.ants) == (world_kind, ants)]:
        rules, point = condition.rules, conditions[condition]
        if rules not in COMPARED:
            continue
        colony = Colony(
            *(point.world[0] if isinstance(point.world, tuple) else point.world, point.task),
            replace(point.training, epsilon=point.training.least_epsilon),
            *(seeds[0], ants),
            sharing="frozen",
            q_values=load_policy(policies / f"{world_kind}_{rules}_{ants}.npz").q_values,
            arch=arch,
        )
        colony.begin_episode()
        recording = record_colony(colony, TICKS, title=RULES[rules])
        done = count(int(colony.outcome().deliveries.sum()), "delivery")
        words = f"{count(ants, 'ant')} in {WORLD_KINDS[world_kind]}: {done} in {TICKS} ticks."
        players.append(Player(sentence(RULES[rules]), words, recording))
    return players
