"""Designs: which points of ranges of settings a sweep runs, and the sensitivity indices they give.

A setting of a sweep file has a list of values, or a range: `{ from = 10, to = 99, scale = "log" }`.
A grid combines all values. A Sobol design draws points of the unit cube, whose shares become
values; a point depends only on the settings that vary, the seed of the design, and its number.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np

from taichi_ants.analysis.statistics import RANDOM_SEED, all_equal, known_means
from taichi_ants.analysis.tables import Table, number, plain_text
from taichi_ants.errors import AntsError, shown
from taichi_ants.settings import Flag, Setting, Settings

_DRAWN = ("design", "sobol")  # the condition of the other keys
_NORMAL_95 = 1.959963984540054  # half of the width of an interval, in standard deviations
COLUMNS = ("measure", "setting", "first_order", "first_order_low", "first_order_high",
    "total", "total_low", "total_high")  # of the table of indices  # fmt: skip


@dataclass(frozen=True)
class Range:
    """A range of numbers with both ends; if `whole`, of int; equal factors are equally frequent
    if `log`, else equal differences."""

    low: float
    high: float
    log: bool = False
    whole: bool = False

    @classmethod
    def of(cls, name: str, table: Mapping[str, Any], whole: bool) -> Range:
        """Return the range in a table; AntsError, which begins with `name`, if it is not one."""
        ends: Any = table.get("from"), table.get("to")
        (low, high), scale = ends, table.get("scale", "linear")
        kinds, log = (int,) if whole else (int, float), scale == "log"
        fits = all(type(end) in kinds and abs(end) <= 2**53 for end in ends)
        fits = fits and low < high and (low > 0 if log else scale == "linear")
        if not fits or table.keys() - {"from", "to", "scale"}:
            raise AntsError(
                f"{name} is {shown(dict(table))}; a range has the keys from and to, which are "
                f"{'whole ' * whole}numbers, the first the smaller one, and perhaps the scale "
                "linear or, if both are above 0, log."
            )
        number = int if whole else float
        return cls(number(low), number(high), log, whole)


Axis = Range | Sequence[Any]  # of a sequence, all values are equally frequent


def value_at(axis: Axis, share: float) -> Any:
    """Return the value at a share of an axis, 0 to 1; whole numbers of a range have equal parts."""
    if not isinstance(axis, Range):
        return axis[min(int(share * len(axis)), len(axis) - 1)]
    margin = 0.5 if axis.whole else 0.0
    low, high = axis.low - margin, axis.high + margin
    if axis.log:
        value = math.exp(math.log(low) * (1 - share) + math.log(high) * share)
    else:
        value = low * (1 - share) + high * share
    value = math.floor(value + 0.5) if axis.whole else value
    return min(max(value, axis.low), axis.high)


def settings_in(tree: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the settings in nested tables: full names, with a list of values or a range's table."""
    for name, value in tree.items():
        path = f"{before}.{name}" if before else name
        if isinstance(value, Mapping) and value and not value.keys() & {"from", "to"}:
            yield from settings_in(value, path)
        else:
            yield path, value if isinstance(value, (Mapping, list)) else [value]


def varying(axes: Mapping[str, Axis]) -> dict[str, Axis]:
    """Return the axes that have more than one value."""
    return {n: a for n, a in axes.items() if isinstance(a, Range) or len(a) > 1}


@dataclass(frozen=True)
class Design(Settings):
    """The design of a sweep: keys of its file.

    `margin` is the largest difference in the first measure that is too small to matter.
    With `sensitivity`, points follow the scheme of Saltelli without second order: `samples` groups
    of a point for each setting that varies and two more.
    """

    design: Annotated[Literal["grid", "sobol"], Setting()] = "grid"
    samples: Annotated[int | None, Setting(only=_DRAWN)] = None
    design_seed: Annotated[int, Setting(least=0, most=2**63 - 1, only=_DRAWN)] = 0
    sensitivity: Annotated[Flag, Setting(only=_DRAWN)] = False
    margin: Annotated[float, Setting(least=0, only=("design", "grid"))] = 0.0

    @property
    def is_grid(self) -> bool:
        """Whether points are all combinations of values."""
        return self.design == "grid"

    def _faults(self) -> Iterator[str]:
        if not self.is_grid and self.samples not in (2**n for n in range(1, 17)):
            yield f"samples is {self.samples}; it must be a power of 2 up to 65536, such as 64."

    def rows(self, axes: Mapping[str, Axis]) -> list[dict[str, Any]]:
        """Return the points: a value of each axis by name; AntsError if axes do not suit."""
        if self.is_grid:
            for name, axis in axes.items():
                if isinstance(axis, Range):
                    raise AntsError(f"{name} is a range, but a grid needs lists; set design.")
            lists: Any = axes.values()
            return [dict(zip(axes, row, strict=True)) for row in itertools.product(*lists)]
        drawn = varying(axes)
        if not drawn:
            raise AntsError("[vary] has single values only; the design 'sobol' needs more.")
        rows = []
        for shares in self.shares(len(drawn)).tolist():
            share_of = dict(zip(drawn, shares, strict=True))
            rows.append({n: value_at(axis, share_of.get(n, 0.0)) for n, axis in axes.items()})
        return rows

    def shares(self, dimensions: int) -> np.ndarray:
        """Return points of the unit cube, float64 (points, dimensions), for other than grids."""
        from scipy.stats import qmc

        sequence = qmc.Sobol(dimensions * (1 + self.sensitivity), seed=self.design_seed)
        drawn = sequence.random(self.samples)
        if not self.sensitivity:
            return drawn
        first, last = np.split(drawn[:, None], 2, axis=2)
        from_last = np.eye(dimensions + 2, dimensions, -1, dtype=bool)
        from_last[-1] = True
        return np.where(from_last, last, first).reshape(-1, dimensions)


def indices(measure: str, names: Sequence[str], values: np.ndarray) -> list[dict[str, Any]]:
    """Return the indices of settings as rows with `COLUMNS`, with 95 % intervals from a bootstrap.

    The estimators are those of Saltelli et al. (2010). `values` of the measure are float64 (points,
    seeds), for the points of Saltelli's scheme. Seeds without a value (nan) do not count. The list
    is empty if a point has no value at all, or all means over seeds are equal.
    """
    means = known_means(values)
    if np.isnan(means).any() or all_equal(means[None])[0]:
        return []
    first, *between, last = ((means - means.mean()) / means.std()).reshape(-1, len(names) + 2).T
    draws = np.random.default_rng(RANDOM_SEED).integers(len(first), size=(len(first), 1000))
    rows = []
    for name, mixed in zip(names, between, strict=True):
        found, resampled = (
            _indices(first, mixed, last),
            _indices(*(y[draws] for y in (first, mixed, last))),
        )
        ends = []
        for index, of_resamples in zip(found, resampled, strict=True):
            half = _NORMAL_95 * of_resamples.std(ddof=1)
            ends += [float(each) for each in (index, index - half, index + half)]
        rows.append(dict(zip(COLUMNS, (measure, name, *ends), strict=True)))
    return rows


def _indices(first: np.ndarray, mixed: np.ndarray, last: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return first-order and total index of the setting that `mixed` has from `last`."""
    variance = np.var(np.concatenate([first, last]), axis=0)
    alone = np.mean(last * (mixed - first), axis=0) / variance
    return alone, 0.5 * np.mean((first - mixed) ** 2, axis=0) / variance


def report(rows: Sequence[Mapping[str, Any]], seeds: int) -> str:
    """Return rows of indices as a table for a terminal."""
    lines = [[n if isinstance(n, str) else number(n, 2) for n in row.values()] for row in rows]
    notes = [f"Indices of means over {seeds} seeds, whose remaining change is in each total."]
    return plain_text([Table("", COLUMNS, lines, notes, text_columns=2)], 200)
