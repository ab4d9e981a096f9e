"""All that is computed of the study, once, for the tables, the terminal and the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from taichi_ants.analysis.colony.answer import answer
from taichi_ants.analysis.colony.contrasts import Judged, judge_all
from taichi_ants.analysis.colony.study import OF_STUDY, Condition, Measured
from taichi_ants.analysis.colony.tables import condition_rows


class Results(NamedTuple):
    """What follows from what was measured.

    Attributes:
        rows: See `tables.condition_rows`.
        judged: See `contrasts.judge_all`.
        answer: Three sentences.
    """

    rows: Sequence[Mapping[str, Any]]
    judged: Judged
    answer: Sequence[str]

    @classmethod
    def of(cls, measured: Measured) -> Results:
        """Return the results that follow from all measures."""
        judged = judge_all(measured)
        return cls(condition_rows(measured), judged, answer(measured, judged))

    @classmethod
    def read(cls, seeds: Sequence[Mapping]) -> Results:
        """Return the same from the rows of seeds.csv."""
        values: dict[Condition, dict[str, list[float]]] = {}
        for row in seeds:
            of_seeds = values.setdefault(_condition(row), {name: [] for name in OF_STUDY})
            for name in OF_STUDY:
                of_seeds[name].append(row[name])
        measured = {  # an empty field is None, which is nan as a float
            one: {name: np.array(numbers, float) for name, numbers in of_seeds.items()}
            for one, of_seeds in values.items()
        }
        return cls.of(measured)


def _condition(row: Mapping) -> Condition:
    return Condition(row["arena"], row["rules"], row["way"], int(row["ants"]))
