"""The order of pheromone fields: the entropy of their levels."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.task.constants import OBSTACLE

if TYPE_CHECKING:
    from taichi_ants.engines.records import Snapshot


def entropy(snapshot: Snapshot) -> dict[str, float]:
    """Return the normalised entropy of the levels of each pheromone field, by its name.

    It is -(sum of p log p) / log N. N is the number of cells that are not obstacles, and p is the
    level of each of them, divided by the sum of their levels. This is Shannon's entropy [1]_
    divided by its largest value, which is called Pielou's evenness [2]_. All of the pheromone in
    one cell gives 0, equal levels in all cells give 1. The value is nan for a field without
    pheromone, and in a world with one cell.

    .. [1] C. E. Shannon (1948), A mathematical theory of communication, Bell System Technical
       Journal 27, 379-423.
    .. [2] E. C. Pielou (1966), The measurement of diversity in different types of biological
       collections, Journal of Theoretical Biology 13, 131-144.
    """
    is_open = snapshot.ground != OBSTACLE
    cells = int(np.count_nonzero(is_open))
    return {name: evenness(levels[is_open], cells) for name, levels in snapshot.fields.items()}


def evenness(levels: np.ndarray, cells: int) -> float:
    """Return the entropy of levels (n,) divided by the logarithm of `cells`; nan if all are 0."""
    # Few levels differ, and exact sums do not depend on the order of cells.
    different, times = np.unique(levels[levels > 0].astype(float), return_counts=True)
    if cells < 2 or not len(different):
        return math.nan
    pairs = list(zip(different.tolist(), times.tolist(), strict=True))
    total = math.fsum(n * level for level, n in pairs)
    shares = [(level / total, n) for level, n in pairs]
    return max(0.0, -math.fsum(n * (p * math.log(p)) for p, n in shares if p > 0) / math.log(cells))
