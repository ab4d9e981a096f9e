"""Sensitivity indices of Sobol: the shares of a measure's variance that single settings make.

The first-order index of a setting is the share that it makes by itself, and the total index adds
what it makes together with others. SALib computes both, with intervals from its bootstrap, from
means over seeds at the points of Saltelli's scheme. What seeds still change in these means looks
like an interaction of all settings, so `seed_share` gives its size.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from taichi_ants.analysis import style
from taichi_ants.analysis.statistics import RANDOM_SEED, all_equal, known_means
from taichi_ants.analysis.sweeps import short
from taichi_ants.analysis.tables import Table, interval, number, percent, plain_text, sentence

RESAMPLES = 1000
_WIDTH = 120


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
            words = f"{measure} has no indices: it has values at too few points, or is constant."
            blocks.append(words)
            continue
        names = [row.setting for row in rows]
        lines = [
            [
                short(name, names),
                f"{number(first, 2)} {interval(first_low, first_high, 2)}",
                f"{number(total, 2)} {interval(low, high, 2)}",
            ]
            for _, name, first, first_low, first_high, total, low, high, *_ in sorted(
                rows, key=lambda row: -row.total
            )
        ]
        notes = [_noise(rows[0], seeds)]
        blocks.append(Table("", [measure, "first order", "total"], lines, notes))
    return plain_text(blocks, _WIDTH)


def _noise(row: Index, seeds: int) -> str:
    share, without = percent(row.seed_share), row.left_out
    more = f" {without} points are left out, because one of their group has no value."
    noise = f"Means over {seeds} seeds; seeds make {share} of their variance, in each total index."
    return noise + more * bool(without)


def draw(path: Path, rows: Sequence[Index], words: str, seeds: int) -> None:
    """Draw the indices of a measure, called `words`, as bars, the largest total index on top.

    Raises:
        AntsError: The file (.png) cannot be written.
    """
    rows = sorted(rows, key=lambda row: row.total)
    names, y = [row.setting for row in rows], np.arange(len(rows))
    with style.styled():
        figure = style.new_figure(1.6 + 0.34 * len(rows))
        axes = figure.subplots()
        for first, shift, colour, label in (
            (2, 0.2, style.ORANGE, "First order: alone"),
            (5, -0.2, style.BLUE, "Total: also together with others"),
        ):
            value, low, high = np.array([row[first : first + 3] for row in rows]).T
            axes.barh(y + shift, value, 0.36, color=colour, label=label)
            axes.hlines(y + shift, low, high, color=style.INK, linewidth=1)
        share = rows[0].seed_share
        axes.axvline(share, color=style.GREY, linestyle="--", linewidth=1, label="Share of seeds")
        axes.axvline(0, color=style.INK, linewidth=0.8)
        axes.set_yticks(y, [short(name, names) for name in names])
        axes.grid(visible=False, axis="y")
        axes.set_xlabel(f"Share of the variance of {words}")
        caption = f"95 % intervals by SALib's bootstrap. {_noise(rows[0], seeds)}"
        title = f"{sentence(words)}: sensitivity indices"
        style.frame(figure, title, caption, style.legend_entries([axes]))
    style.save(figure, path)
