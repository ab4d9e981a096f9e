"""All that is computed of a comparison, once, for the tables, the terminal and the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from taichi_ants.analysis.paper.answer import answer
from taichi_ants.analysis.paper.audit import Audit, assess
from taichi_ants.analysis.paper.comparison import Comparison
from taichi_ants.analysis.paper.summary import summarise, summarise_behaviours
from taichi_ants.analysis.paper.table2 import table2


class Results(NamedTuple):
    """A comparison, the baselines, and what follows from them.

    Attributes:
        comparison: What was measured.
        baselines: Rows of `bounds.baselines`.
        summary, behaviours: See `summary`.
        lines: See `table2`.
        audit: See `audit`.
        answer: Three sentences.
    """

    comparison: Comparison
    baselines: Sequence[Mapping]
    summary: Sequence[Mapping]
    behaviours: Sequence[Mapping]
    lines: Sequence[Mapping]
    audit: Audit
    answer: Sequence[str]

    @classmethod
    def of(cls, comparison: Comparison, baselines: Sequence[Mapping]) -> Results:
        """The results of a comparison."""
        summary = summarise(comparison)
        lines, audit = table2(comparison, summary), assess(comparison)
        told = answer(comparison, lines, audit)
        behaviours = summarise_behaviours(comparison)
        return cls(comparison, baselines, summary, behaviours, lines, audit, told)
