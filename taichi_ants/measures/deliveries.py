"""Deliveries of food: their number, the time of the first one, and the efficiency."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from taichi_ants.engines.records import Snapshot


def deliveries(snapshot: Snapshot) -> int:
    """Return the number of deliveries since the start of the episode."""
    return snapshot.counts["deliveries"]


def new_deliveries(values: np.ndarray, snapshot: Snapshot) -> float:
    """Return the number of deliveries since the last row of the series; see `deliveries`."""
    return values[-1] - values[-2] if len(values) > 1 else values[-1]


def first_delivery(snapshot: Snapshot) -> int:
    """Return the first passage time: the ticks up to the first delivery of the episode.

    Before the first delivery it is the number of ticks so far. Means over episodes are therefore
    restricted means (of survival analysis), which are at most the true ones.
    """
    counts = snapshot.counts
    return counts["ticks"] if counts["first_delivery"] < 0 else counts["first_delivery"]


def efficiency(snapshot: Snapshot) -> float:
    """Return the deliveries of the episode per tick and ant that lives now; nan without any."""
    counts = snapshot.counts
    spent = counts["ticks"] * len(snapshot.ant_cells)
    return counts["deliveries"] / spent if spent else math.nan
