"""All that is computed of the study, once, for the tables, the terminal and the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from taichi_ants.analysis.colony.contrasts import Judged, judge_all
from taichi_ants.analysis.colony.study import OF_STUDY, Condition, Measured
from taichi_ants.analysis.colony.tables import ConditionRow, condition_rows


class Results(NamedTuple):
    """The conditions over all seeds, and the findings."""

    rows: Sequence[ConditionRow]
    judged: Judged

    @classmethod
    def of(cls, measured: Measured) -> Results:
        """Return the results that follow from all measures."""
        return cls(condition_rows(measured), judge_all(measured))

    @classmethod
    def read(cls, seeds: Sequence[Mapping]) -> Results:
        """Return the same from the rows of seeds.csv."""
        by_condition: dict[Condition, list[Mapping]] = {}
        for row in seeds:
            condition = Condition(row["world_kind"], row["rules"], row["regime"], int(row["ants"]))
            by_condition.setdefault(condition, []).append(row)
        return cls.of(
            {  # an empty field is None, which is nan as a float
                one: {name: np.array([row[name] for row in rows], float) for name in OF_STUDY}
                for one, rows in by_condition.items()
            }
        )
