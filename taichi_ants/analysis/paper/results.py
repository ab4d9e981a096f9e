"""All that is computed of a comparison, once, for the tables, the terminal and the page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from taichi_ants.analysis.bounds.baselines import Baseline
from taichi_ants.analysis.paper.audit import Audit, assess
from taichi_ants.analysis.paper.comparison import Comparison
from taichi_ants.analysis.paper.summary import (
    BehaviourMeans,
    Summary,
    summarise,
    summarise_behaviours,
)
from taichi_ants.analysis.paper.table2 import Line, table2


class Results(NamedTuple):
    """A comparison, the rows of `bounds.baselines`, and the tables that follow from them."""

    comparison: Comparison
    baselines: Sequence[Baseline]
    summaries: Sequence[Summary]
    behaviours: Sequence[BehaviourMeans]
    lines: Sequence[Line]
    audit: Audit

    @classmethod
    def of(cls, comparison: Comparison, baselines: Sequence[Baseline]) -> Results:
        """Return the results of a comparison."""
        summaries = summarise(comparison)
        lines, behaviours = table2(comparison, summaries), summarise_behaviours(comparison)
        return cls(comparison, baselines, summaries, behaviours, lines, assess(comparison))
