"""The page that tells the paper's comparison."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from taichi_ants.analysis.paper.audit import headlines
from taichi_ants.analysis.paper.published import (
    GREEDY_RETURN,
    GREEDY_STEPS,
    GRID,
    Q_LEARNING,
    TABLE_2,
)
from taichi_ants.analysis.paper.report import Results, all_tables, behaviour_table
from taichi_ants.analysis.tables import sentence, thousands
from taichi_ants.errors import count
from taichi_ants.report.page import Statement, Statements, fill, judged
from taichi_ants.report.players import Seen


def comparison_page(
    results: Results, seen: Seen, *, facts: Mapping[str, str], files: Sequence[str]
) -> str:
    """Return the page as HTML; `facts` say how it was done, `files` what lies beside it."""
    comparison = results.comparison
    first, *others = all_tables(comparison, results.lines, results.behaviours, results.baselines)
    # The notes explain the first four tables, of which one is shown at once.
    notes = next(one for one in others if not one.rows)
    behaviours = behaviour_table(results.lines, results.behaviours)
    more = [one for one in others if one not in (notes, behaviours)]
    returns = sorted((row.reward for one, row in TABLE_2.items() if one != Q_LEARNING))
    seeds = count(len(comparison.seeds), "seed")
    return fill(
        "comparison.html",
        title="Which learner makes the better ant?",
        byline=f"{seeds}, {count(len(comparison.rows), 'configuration')}, "
        f"{thousands(comparison.behaviours.size * comparison.episodes)} episodes of training, "
        f"world: {comparison.world}",
        seeds=f"{len(comparison.seeds)} runs" if len(comparison.seeds) > 1 else "a run",
        configurations=len(GRID),
        best=("Q-learning", TABLE_2[Q_LEARNING].reward),
        others=(returns[0], returns[-1]),
        greedy_return=f"{GREEDY_RETURN:g}",
        greedy_steps=[f"{one:g}" for one in GREEDY_STEPS],
        deliveries=comparison.delivery_settings,
        world=comparison.world,
        in_paper_world=comparison.in_paper_world,
        headlines=headlines(results.audit),
        claims=_claims(results),
        first_table=first,
        table_notes=notes,
        more_tables=more,
        behaviours=behaviours,
        **seen._asdict(),
        sheet_words=seen.sheet.words if seen.sheet else "",
        facts=facts,
        files=files,
    )


def _claims(results: Results) -> Statements:
    """The claims, with a column of verdicts for each delivery setting."""
    lines = []
    for claim, findings in results.audit.items():
        unit, estimator = claim.quantity.unit, claim.estimator
        told = [
            judged(f"delivery {setting}", one, one.contrast.label, unit)
            for setting, one in findings.items()
        ]
        facts = {
            "Tested on": claim.tested_on,
            "Asked": f"{estimator} {claim.criterion.words} {unit}",
        }
        verdicts = [one.verdict for one in findings.values()]
        lines.append(Statement(claim.statement, claim.section, verdicts, facts, told))
    settings = map(sentence, results.comparison.delivery_settings)
    return Statements(("The paper, in our words", "Section", *settings), lines, "claims")
