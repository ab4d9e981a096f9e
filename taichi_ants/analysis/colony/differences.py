"""Paired differences between conditions, judged together.

Verdicts rest on the cautious interval of `analysis.statistics`, at a level corrected for the number
of differences that are judged together (Bonferroni): with a probability of at least 95 % all their
intervals hold, however they depend on each other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from taichi_ants.analysis.statistics import cautious_interval

SIMULTANEOUS_LEVEL = 0.95

Key = TypeVar("Key")


@dataclass(frozen=True)
class Difference:
    """A mean difference over seeds with its interval.

    Attributes:
        mean, low, high: In the unit of the measure.
    """

    mean: float
    low: float
    high: float

    @property
    def sign(self) -> int:
        """1 if it is above 0 beyond chance, -1 if below, 0 if neither can be told."""
        return int(self.low > 0) - int(self.high < 0)


def judge(differences: Mapping[Key, np.ndarray]) -> dict[Key, Difference]:
    """Judge differences together.

    Args:
        differences: Float (seeds,) each, all of the same seeds.

    Returns:
        The verdicts under the same keys.
    """
    if not differences:
        return {}
    level = 1 - (1 - SIMULTANEOUS_LEVEL) / len(differences)
    rows = np.stack(list(differences.values())).astype(float)
    ends = zip(rows.mean(axis=1), *cautious_interval(rows, level), strict=True)
    return {
        key: Difference(*map(float, numbers))
        for key, numbers in zip(differences, ends, strict=True)
    }
