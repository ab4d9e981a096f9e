"""Designs: the points of a sweep, all combinations of lists of values, or draws from ranges."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np

from taichi_ants.errors import AntsError, refuse
from taichi_ants.settings import Flag, Setting, Settings

_GRID, _DRAWN = ("design", "grid"), ("design", "sobol")  # conditions of keys


@dataclass(frozen=True)
class Range:
    """A range of numbers, ends included; `log` makes equal factors equally frequent."""

    low: float
    high: float
    log: bool = False
    whole: bool = False

    @classmethod
    def of(cls, name: str, table: Mapping[str, Any], whole: bool) -> Range:
        """Return the range in a table; AntsError, which begins with `name`, if it is not one."""
        number: type = int if whole else float
        ends: Any = table.get("from"), table.get("to")
        (low, high), scale = ends, table.get("scale", "linear")
        fits = all(type(end) in (int, number) and abs(end) <= 2**53 for end in ends)
        fits = fits and low < high and scale in ("linear", "log")[: 1 + (low > 0)]
        if not fits or table.keys() - {"from", "to", "scale"}:
            numbers = f"{'whole ' * whole}numbers, the first the smaller one"
            keys = f"the keys from and to, which are {numbers}, and perhaps the scale"
            refuse(name, dict(table), f"a range with {keys} linear or, if both are above 0, log")
        return cls(number(low), number(high), scale == "log", whole)


Axis = Range | Sequence[Any]  # of a sequence, all values are equally frequent


def value_at(axis: Axis, share: float) -> Any:
    """Return the value at a share of an axis, 0 to 1; whole numbers of a range have equal parts."""
    if not isinstance(axis, Range):
        return axis[min(int(share * len(axis)), len(axis) - 1)]
    margin = 0.5 if axis.whole else 0.0
    to, back = (math.log, math.exp) if axis.log else (float, float)
    low, high = to(axis.low - margin), to(axis.high + margin)
    value = back(low * (1 - share) + high * share)
    value = math.floor(value + 0.5) if axis.whole else value
    return min(max(value, axis.low), axis.high)


def varying(axes: Mapping[str, Axis]) -> list[str]:
    """Return the names of the axes that have more than one value."""
    return [n for n, axis in axes.items() if isinstance(axis, Range) or len(axis) > 1]


@dataclass(frozen=True)
class Design(Settings):
    """The design of a sweep: keys of its file."""

    design: Annotated[
        Literal["grid", "sobol"], Setting("all combinations of values, or points from ranges")
    ] = "grid"
    samples: Annotated[int | None, Setting("number of points, a power of 2", only=_DRAWN)] = None
    design_seed: Annotated[int, Setting("seed of the points", least=0, only=_DRAWN)] = 0
    sensitivity: Annotated[Flag, Setting("compute sensitivity indices", only=_DRAWN)] = False
    margin: Annotated[
        float, Setting("largest difference that does not matter", least=0, only=_GRID)
    ] = 0.0

    def _faults(self) -> Iterator[str]:
        if self.design == "sobol" and self.samples not in (2**n for n in range(1, 17)):
            yield f"samples is {self.samples}; it must be a power of 2 up to 65536, such as 64."

    def rows(self, axes: Mapping[str, Axis]) -> list[dict[str, Any]]:
        """Return the points: a value of each axis by name; AntsError if axes do not suit.

        A drawn point depends only on the axes that vary, the seed and its number.
        """
        if self.design == "grid":
            if ranges := [name for name, axis in axes.items() if isinstance(axis, Range)]:
                raise AntsError(f"{ranges[0]} is a range, but a grid needs lists; set design.")
            lists: Any = axes.values()
            return [dict(zip(axes, row, strict=True)) for row in itertools.product(*lists)]
        drawn = varying(axes)
        if not drawn:
            raise AntsError("[vary] has single values only; the design 'sobol' needs more.")
        rows = [dict(zip(drawn, row, strict=True)) for row in self.shares(len(drawn)).tolist()]
        return [{n: value_at(axis, row.get(n, 0.0)) for n, axis in axes.items()} for row in rows]

    def shares(self, dimensions: int) -> np.ndarray:
        """Return points of the unit cube, float64 (points, dimensions), of Saltelli's scheme, too.

        That has `dimensions` + 2 points per sample: all from a first, one, or all from a last.
        """
        from scipy.stats import qmc

        sequence = qmc.Sobol(dimensions * (1 + self.sensitivity), seed=self.design_seed)
        drawn = sequence.random(self.samples)
        if not self.sensitivity:
            return drawn
        first, last = np.split(drawn[:, None], 2, axis=2)
        from_last = np.eye(dimensions + 2, dimensions, -1, dtype=bool)
        from_last[-1] = True
        return np.where(from_last, last, first).reshape(-1, dimensions)
