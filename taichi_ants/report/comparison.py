"""The page that tells the paper's comparison."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from taichi_ants.analysis.paper import published, report
from taichi_ants.analysis.paper.claims import headlines
from taichi_ants.analysis.paper.report import Results
from taichi_ants.analysis.tables import sentence, thousands
from taichi_ants.errors import count
from taichi_ants.report.page import Shown, Statement, Statements, fill
from taichi_ants.report.players import Seen


def comparison_page(
    results: Results, seen: Seen, *, facts: Mapping[str, str], files: Sequence[str]
) -> str:
    """Return the page as HTML; `facts` say how it was done, `files` what lies beside it."""
    comparison = results.comparison
    first, *others, notes = report.figure_tables(results.lines, comparison)
    greedy, baselines = report.greedy_table(results.lines), report.baseline_table(results.baselines)
    seeds = len(comparison.seeds)
    return fill(
        "comparison.html",
        title="Which learner makes the better ant?",
        byline=f"{count(seeds, 'seed')}, {count(len(comparison.rows), 'configuration')}, "
        f"{thousands(comparison.behaviours.size * comparison.episodes)} episodes of training, "
        f"world: {comparison.world}",
        seeds=f"{seeds} runs" if seeds > 1 else "a run",
        paper=published,
        deliveries=comparison.delivery_settings,
        world=comparison.world,
        in_paper_world=comparison.in_paper_world,
        headlines=headlines(results.audit),
        claims=_claims(results),
        first_table=first,
        table_notes=notes,
        more_tables=[*others, greedy, baselines],
        behaviours=report.behaviour_table(results.lines, results.behaviours),
        **seen._asdict(),
        facts=facts,
        files=files,
    )


def _claims(results: Results) -> Statements:
    """The claims, with a column of verdicts for each delivery setting."""
    lines = []
    for claim, findings in results.audit.items():
        told = [
            Shown(f"delivery {setting}", one, one.contrast.label, claim.quantity.unit)
            for setting, one in findings.items()
        ]
        facts = {"Tested on": claim.tested_on, "Asked": claim.asked}
        verdicts = [one.verdict for one in findings.values()]
        lines.append(Statement(claim.statement, claim.section, verdicts, facts, told))
    settings = map(sentence, results.comparison.delivery_settings)
    return Statements(("The paper, in our words", "Section", *settings), lines, "claims")
