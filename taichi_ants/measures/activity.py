"""The moves of ants: blocked ones, the share of ants that move, and its variance over time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.measures.ants import share_of
from taichi_ants.task.events import Event

if TYPE_CHECKING:
    from taichi_ants.engines.records import Snapshot


def blocked_share(snapshot: Snapshot) -> float:
    """Return the share of the moves of the episode that failed; nan before the first move."""
    counts = snapshot.counts
    return counts["blocked"] / counts["moves"] if counts["moves"] else math.nan


def activity(snapshot: Snapshot) -> float:
    """Return the share of the ants that entered a cell by their own move in the last tick.

    Ants that were pushed do not count. The value is nan without ants.
    """
    events = snapshot.ant_events
    return share_of((events == Event.ENTERED_EMPTY) | (events == Event.ENTERED_CUE))


def synchrony(values: np.ndarray, snapshot: Snapshot) -> float:
    """Return how much more the `activity` varies over time than that of independent ants.

    It is n v / (m (1 - m)), the binomial index of dispersion, for n living ants. The mean m and the
    variance v are those of the activity in the rows of the episode so far, without rows in which no
    ant lives. The variance is divided by their number. Independent ants with equal, constant
    activity give about 1. Ants that all move or rest together give n. Studies of activity cycles
    in ants, such as Cole [1]_, look at the same series, the share of active ants. The value is nan
    with fewer than two such rows, without ants, and if m is 0 or 1.

    .. [1] B. J. Cole (1991), Short-term activity cycles in ants: generation of periodicity by
       worker interaction, American Naturalist 137, 244-259.
    """
    shares, n = values[~np.isnan(values)].tolist(), len(snapshot.ant_cells)
    if len(shares) < 2:
        return math.nan
    mean = math.fsum(shares) / len(shares)
    if not n or not 0 < mean < 1:
        return math.nan
    variance = math.fsum((one - mean) ** 2 for one in shares) / len(shares)
    return n * variance / (mean * (1 - mean))
