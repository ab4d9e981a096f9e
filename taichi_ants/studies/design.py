"""Designs: which points of ranges of settings a sweep runs.

A setting of a sweep file has a list of values, or a range: `{ from = 10, to = 99, scale = "log" }`.
A grid combines all values. The other designs draw points from the unit cube, whose shares become
values. A point depends only on the design, its seed, and the number of the point.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants.errors import AntsError, check_one_of, checked_flag, checked_whole, imported, shown
from taichi_ants.files.results import UNFINISHED, manifest_in

GRID, LATIN_HYPERCUBE, SOBOL, RANDOM = DESIGNS = ("grid", "latin_hypercube", "sobol", "random")
KEYS = ("design", "samples", "design_seed", "sensitivity")
SCALES = ("linear", "log")
_OF_RANGE = ("from", "to", "scale", "whole", "steps")
_MOST = 100_000  # samples, and values of a range in a grid


@dataclass(frozen=True)
class Range:
    """A range of numbers with both ends.

    Attributes:
        log: Whether equal factors, not equal differences, are equally frequent.
        whole: Whether it has whole numbers only, as int.
        steps: The number of values in a grid; None for other designs.
    """

    low: float
    high: float
    log: bool = False
    whole: bool = False
    steps: int | None = None

    @classmethod
    def of(cls, name: str, table: Mapping[str, Any], whole: bool) -> Range:
        """Return the range in a table; `whole` applies if the table does not have the key.

        Raises:
            AntsError: A key or a value is not allowed; the message begins with `name`.
        """
        for key in table:
            if key not in _OF_RANGE:
                raise AntsError(
                    f"{name} has the key {key!r}, but a range has only {', '.join(_OF_RANGE)}."
                )
        whole = checked_flag(f"{name}.whole", table.get("whole", whole))
        ends = [_end(f"{name}.{key}", table.get(key), whole) for key in _OF_RANGE[:2]]
        if not ends[0] < ends[1]:
            raise AntsError(
                f"{name} goes from {shown(ends[0])} to {shown(ends[1])}; `from` must be below `to`."
            )
        scale = table.get("scale", SCALES[0])
        check_one_of(f"{name}.scale", scale, SCALES)
        log = scale == "log"
        if log and ends[0] <= 0:
            raise AntsError(
                f"{name}.from is {shown(ends[0])}, but a logarithmic scale has no 0 and no "
                'negative numbers; start above 0, or use scale = "linear".'
            )
        steps = table.get("steps")
        if steps is not None:
            steps = checked_whole(f"{name}.steps", steps, 2, _MOST)
        return cls(ends[0], ends[1], log, whole, steps)

    def at(self, share: float) -> float | int:
        """Return the value at a share of the range, 0 to 1; whole numbers have equal parts."""
        margin = 0.5 if self.whole else 0.0
        low, high = self.low - margin, self.high + margin
        if self.log:
            value = math.exp(math.log(low) * (1 - share) + math.log(high) * share)
        else:
            value = low * (1 - share) + high * share
        value = math.floor(value + 0.5) if self.whole else value
        return min(max(value, self.low), self.high)

    def values(self) -> list[float | int]:
        """Return `steps` values from one end to the other, without repetitions."""
        steps = self.steps or 0
        ends = Range(self.low, self.high, self.log)  # a grid of whole numbers includes both ends
        several = [ends.at(step / (steps - 1)) for step in range(steps)]
        return list(dict.fromkeys(map(round, several) if self.whole else several))


@dataclass(frozen=True)
class Choices:
    """A list of values that are equally frequent."""

    several: tuple[Any, ...]

    def at(self, share: float) -> Any:
        """Return the value at a share of the list, 0 to 1."""
        return self.several[min(int(share * len(self.several)), len(self.several) - 1)]


Axis = Range | Choices


def axes_of(tree: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the settings in nested tables: full names, with a list of values or a range's table."""
    for name, value in tree.items():
        path = f"{before}.{name}" if before else name
        if isinstance(value, Mapping) and value and not value.keys() & set(_OF_RANGE[:2]):
            yield from axes_of(value, path)
        else:
            yield path, value if isinstance(value, (Mapping, list)) else [value]


@dataclass(frozen=True)
class Design:
    """The design of a sweep.

    Attributes:
        samples: The number of points. With `sensitivity`, the number of base points, each of which
            has a point for each setting that varies and two more. None for a grid.
        sensitivity: Whether points follow the scheme of Saltelli, from which indices are computed.
    """

    kind: str = GRID
    samples: int | None = None
    seed: int = 0
    sensitivity: bool = False

    @classmethod
    def of(cls, file: Mapping[str, Any]) -> Design:
        """Return the design of a sweep file; AntsError if a key is not allowed."""
        kind = file.get("design", GRID)
        check_one_of("design", kind, DESIGNS)
        if kind == GRID:
            for key in KEYS[1:]:
                if key in file:
                    raise AntsError(
                        f'{key} is {shown(file[key])}, but the design is "grid"; leave it out, or '
                        f"set design to one of {', '.join(DESIGNS[1:])}."
                    )
            return cls()
        if "samples" not in file:
            raise AntsError(f"samples is missing; the design {kind!r} needs a number of points.")
        samples = checked_whole("samples", file["samples"], 1, _MOST)
        seed = checked_whole("design_seed", file.get("design_seed", 0), 0, 2**63 - 1)
        sensitivity = checked_flag("sensitivity", file.get("sensitivity", False))
        if sensitivity and kind != SOBOL:
            raise AntsError(f'sensitivity requires design = "sobol", but design is {kind!r}.')
        if sensitivity and (samples < 2 or samples & (samples - 1)):
            raise AntsError(
                f"samples is {samples}; with sensitivity it must be a power of 2, for example 64."
            )
        if sensitivity:
            imported("sensitivity = true", "SALib", "sensitivity")
        return cls(kind, samples, seed, sensitivity)

    def facts(self) -> dict[str, Any]:
        """Return what determines the points besides the settings; empty for a grid.

        The number of samples belongs to it only if more samples would change the first points.
        """
        if self.kind == GRID:
            return {}
        fixed = {"samples": self.samples} if self.kind == LATIN_HYPERCUBE else {}
        more = {"sensitivity": True} if self.sensitivity else {}
        return {"design": {"design": self.kind, "design_seed": self.seed, **fixed, **more}}

    def rows(self, axes: Mapping[str, Axis]) -> list[dict[str, Any]]:
        """Return the points: a value of each axis by name."""
        if self.kind == GRID:
            several = [_grid_values(name, axis) for name, axis in axes.items()]
            return [dict(zip(axes, row, strict=True)) for row in itertools.product(*several)]
        for name, axis in axes.items():
            if isinstance(axis, Range) and axis.steps:
                raise AntsError(
                    f"{name}.steps is {axis.steps}, but the design is {self.kind!r}; leave it out."
                )
        drawn = varying(axes)
        if not drawn:
            raise AntsError(
                f"[vary] has single values only; the design {self.kind!r} needs ranges."
            )
        shares = self.shares(len(drawn)).tolist()
        fixed = {name: axis.at(0.0) for name, axis in axes.items() if name not in drawn}
        points = [
            {name: axis.at(share) for (name, axis), share in zip(drawn.items(), row, strict=True)}
            for row in shares
        ]
        return [{name: (fixed | point)[name] for name in axes} for point in points]

    def shares(self, dimensions: int) -> np.ndarray:
        """Return points of the unit cube, float64 (points, dimensions), for other than grids."""
        assert self.samples is not None
        if self.kind == RANDOM:
            return np.random.default_rng(self.seed).random((self.samples, dimensions))
        if self.sensitivity:
            from SALib.sample import sobol

            problem = {
                "num_vars": dimensions,
                "names": [str(n) for n in range(dimensions)],
                "bounds": [[0, 1]] * dimensions,
            }
            return sobol.sample(problem, self.samples, calc_second_order=False, seed=self.seed)
        from scipy.stats import qmc

        if self.kind == LATIN_HYPERCUBE:
            return qmc.LatinHypercube(dimensions, seed=self.seed).random(self.samples)
        # `random` warns unless the number is a power of 2, so the sequence is cut.
        whole = math.ceil(math.log2(self.samples))
        return qmc.Sobol(dimensions, seed=self.seed).random_base2(whole)[: self.samples]

    def check_folder(self, out: Path) -> None:
        """Refuse a folder that has a Latin hypercube of another size, which cannot be extended.

        Raises:
            AntsError: The folder has such results, finished or not, or a damaged manifest.
        """
        for place in (out, out / UNFINISHED):
            manifest = manifest_in(place) if self.kind == LATIN_HYPERCUBE else None
            other = (manifest or {"settings": {}})["settings"].get("design") or {}
            if other.get("design") == self.kind and other["samples"] != self.samples:
                raise AntsError(
                    f"{str(out)!r} contains a Latin hypercube of {other['samples']} samples, which "
                    f"cannot be extended to {self.samples} because all points change; choose "
                    'another --out, or use design = "sobol" or "random", which can be extended.'
                )


def varying(axes: Mapping[str, Axis]) -> dict[str, Axis]:
    """Return the axes that have more than one value."""
    return {n: one for n, one in axes.items() if isinstance(one, Range) or len(one.several) > 1}


def logarithmic(axes: Mapping[str, Axis]) -> set[str]:
    """Return the names of the axes that have a logarithmic scale."""
    return {name for name, one in axes.items() if isinstance(one, Range) and one.log}


def _grid_values(name: str, axis: Axis) -> Sequence[Any]:
    if isinstance(axis, Choices):
        return axis.several
    if axis.steps is None:
        raise AntsError(
            f"{name} is a range without steps; add steps = 5, for example, or set design to one of "
            f"{', '.join(DESIGNS[1:])}."
        )
    return axis.values()


def _end(name: str, value: Any, whole: bool) -> float | int:
    if value is None:
        raise AntsError(f"{name} is missing; a range has both `from` and `to`.")
    if whole:
        return checked_whole(name, value, -(2**53), 2**53)
    if type(value) not in (int, float) or not math.isfinite(value):
        raise AntsError(f"{name} is {shown(value)}; it must be a finite number.")
    return float(value)
