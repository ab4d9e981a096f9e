"""Sensitivity indices of Sobol: the shares of a measure's variance that single settings make.

The first-order index of a setting is the share that it makes by itself, and the total index adds
what it makes together with others. SALib computes both, with intervals from its bootstrap, from
means over seeds at the points of Saltelli's scheme. What seeds still change in these means looks
like an interaction of all settings, so `seed_share` gives its size.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from taichi_ants.analysis.statistics import RANDOM_SEED, all_equal, known_means
from taichi_ants.analysis.sweeps import short
from taichi_ants.analysis.tables import Table, interval, number, percent, plain_text

RESAMPLES = 1000


class Index(NamedTuple):
    """A row of the table: the indices of one setting for one measure, with 95 % intervals.

    `seed_share`, and the number of points that are left out, are the same for all settings of a
    measure.
    """

    measure: str
    setting: str
    first_order: float
    first_order_low: float
    first_order_high: float
    total: float
    total_low: float
    total_high: float
    seed_share: float
    left_out: int


def indices(measure: str, names: Sequence[str], values: np.ndarray) -> list[Index]:
    """Return the indices of settings, from values of a measure float64 (points, seeds).

    The points are those of Saltelli's scheme without second order: N groups of len(names) + 2 rows.
    Seeds without a value (nan) do not count. Groups in which a point has no value are left out. The
    list is empty if fewer than two remain, or all means over seeds are equal.
    """
    from SALib.analyze import sobol

    means, step = known_means(values), len(names) + 2
    kept = np.repeat(np.isfinite(means).reshape(-1, step).all(axis=1), step)
    means, left_out = means[kept], int((~kept).sum())
    if len(means) < 2 * step or all_equal(means[None])[0]:
        return []
    problem = {"num_vars": len(names), "names": list(names), "bounds": [[0, 1]] * len(names)}
    how = {"calc_second_order": False, "num_resamples": RESAMPLES, "seed": RANDOM_SEED}
    result = sobol.analyze(problem, means, **how)
    share = seed_share(values[kept], len(names))
    columns = (result[name].tolist() for name in ("S1", "S1_conf", "ST", "ST_conf"))
    return [
        Index(measure, name, s1, s1 - a, s1 + a, total, total - b, total + b, share, left_out)
        for name, s1, a, total, b in zip(names, *columns, strict=True)
    ]


def seed_share(values: np.ndarray, n_settings: int) -> float:
    """Return the share of the variance of means over seeds that the seeds make, 0 to 1.

    It is estimated from the points that are drawn independently, the first and the last of each
    group of the scheme. What a seed adds to all points alike does not count, because all points
    have the same seeds. Points at which a seed has no value do not count. Nan for one seed.
    """
    step, seeds = n_settings + 2, values.shape[1]
    drawn = np.concatenate([values[::step], values[step - 1 :: step]])
    drawn = drawn[~np.isnan(drawn).any(axis=1)]
    if seeds < 2 or len(drawn) < 2:
        return float("nan")
    rest = drawn - drawn.mean(axis=1, keepdims=True) - drawn.mean(axis=0) + drawn.mean()
    noise = np.square(rest).sum() / ((len(drawn) - 1) * (seeds - 1)) / seeds
    variance = drawn.mean(axis=1).var(ddof=1)
    return min(1.0, float(noise / variance)) if variance > 0 else float("nan")


def report(indices: Mapping[str, Sequence[Index]], seeds: int) -> str:
    """Return the indices by measure as tables for a terminal, the largest total index first."""
    blocks: list[str | Table] = []
    for measure, rows in indices.items():
        if not rows:
            words = "has no indices: it has values at too few points, or is constant."
            blocks.append(f"{measure} {words}")
            continue
        lines = [
            [
                short(row.setting, [other.setting for other in rows]),
                f"{number(row[2], 2)} {interval(*row[3:5], 2)}",
                f"{number(row[5], 2)} {interval(*row[6:8], 2)}",
            ]
            for row in sorted(rows, key=lambda row: -row.total)
        ]
        share, left_out = percent(rows[0].seed_share), rows[0].left_out
        note = f"Means over {seeds} seeds; seeds make {share} of their variance, in each total "
        note += "index."
        if left_out:
            note += f" {left_out} points are left out, because one of their group has no value."
        blocks.append(Table("", [measure, "first order", "total"], lines, [note]))
    return plain_text(blocks, 120)
