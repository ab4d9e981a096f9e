"""Sensitivity indices of Sobol, by the estimators of Saltelli et al. (2010).

The first-order index is the share of a measure's variance that a setting makes by itself, and the
total index adds what it makes together with others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from taichi_ants.analysis.statistics import RANDOM_SEED, all_equal, known_means
from taichi_ants.analysis.tables import Table, number, plain_text

_NORMAL_95 = 1.959963984540054  # half of the width of an interval, in standard deviations
COLUMNS = ("measure", "setting", "first_order", "first_order_low", "first_order_high",
    "total", "total_low", "total_high")  # of the table of indices  # fmt: skip


def indices(measure: str, names: Sequence[str], values: np.ndarray) -> list[dict[str, Any]]:
    """Return the indices of settings as rows with `COLUMNS`, with 95 % intervals from a bootstrap.

    `values` of the measure are float64 (points, seeds), for the points of Saltelli's scheme. Seeds
    without a value (nan) do not count. The list is empty if a point has no value at all, or all
    means over seeds are equal.
    """
    means = known_means(values)
    if np.isnan(means).any() or all_equal(means[None])[0]:
        return []
    first, *between, last = ((means - means.mean()) / means.std()).reshape(-1, len(names) + 2).T
    draws = np.random.default_rng(RANDOM_SEED).integers(len(first), size=(len(first), 1000))
    rows = []
    for name, mixed in zip(names, between, strict=True):
        found = _indices(first, mixed, last)
        half = _NORMAL_95 * _indices(first[draws], mixed[draws], last[draws]).std(axis=1, ddof=1)
        ends = np.stack([found, found - half, found + half], axis=1).ravel().tolist()
        rows.append(dict(zip(COLUMNS, (measure, name, *ends), strict=True)))
    return rows


def _indices(first: np.ndarray, mixed: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Return first-order and total index of the setting that `mixed` has from `last`."""
    alone = np.mean(last * (mixed - first), axis=0), 0.5 * np.mean((first - mixed) ** 2, axis=0)
    return np.array(alone) / np.var(np.concatenate([first, last]), axis=0)


def report(rows: Sequence[Mapping[str, Any]], seeds: int) -> str:
    """Return rows of indices as a table for a terminal."""
    lines = [[n if isinstance(n, str) else number(n, 2) for n in row.values()] for row in rows]
    notes = [f"Indices of means over {seeds} seeds, whose remaining change is in each total."]
    return plain_text([Table("", COLUMNS, lines, notes, text_columns=2)], 200)
