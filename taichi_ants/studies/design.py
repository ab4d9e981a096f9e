"""Designs: which points of ranges of settings a sweep runs.

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

from taichi_ants.errors import AntsError, shown
from taichi_ants.settings import Flag, Setting, Settings

_DRAWN = ("design", "sobol")  # the condition of the other keys


@dataclass(frozen=True)
class Range:
    """A range of numbers with both ends; `whole` has whole numbers only, as int.

    With `log`, equal factors are equally frequent, otherwise equal differences.
    """

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

    design: Annotated[
        Literal["grid", "sobol"], Setting("all combinations of values, or points from ranges")
    ] = "grid"
    samples: Annotated[int | None, Setting("number of points, a power of 2", only=_DRAWN)] = None
    design_seed: Annotated[
        int, Setting("seed of the points", least=0, most=2**63 - 1, only=_DRAWN)
    ] = 0
    sensitivity: Annotated[Flag, Setting("compute sensitivity indices", only=_DRAWN)] = False
    margin: Annotated[
        float,
        Setting("largest difference that does not matter", least=0, only=("design", "grid")),
    ] = 0.0

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
