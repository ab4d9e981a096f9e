"""Designs: which points of ranges of settings a sweep runs.

A setting of a sweep file has a list of values, or a range: `{ from = 10, to = 99, scale = "log" }`.
A grid combines all values. SciPy and SALib draw the points of other designs from the unit cube,
whose shares become values. A point depends only on the design, its seed, and its number.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from taichi_ants.errors import AntsError, check_one_of, checked_flag, checked_whole, imported, shown

GRID, LATIN_HYPERCUBE, SOBOL, RANDOM = DESIGNS = ("grid", "latin_hypercube", "sobol", "random")
KEYS = ("design", "samples", "design_seed", "sensitivity")


class Range(NamedTuple):
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
        for key in table:
            check_one_of(f"a key of the range {name}", key, ("from", "to", "scale"))
        check_one_of(f"{name}.scale", table.get("scale", "linear"), ("linear", "log"))
        log, kinds = table.get("scale") == "log", (int,) if whole else (int, float)
        ends: Any = table.get("from"), table.get("to")
        low, high = ends
        are_numbers = all(type(end) in kinds and abs(end) <= 2**53 for end in ends)
        if not (are_numbers and low < high and (low > 0 or not log)):
            kind, above = "whole number" if whole else "number", ", above 0 for the scale log" * log
            raise AntsError(
                f"{name} is from {shown(low)} to {shown(high)}; both must be a {kind}, and the "
                f"first the smaller one{above}."
            )
        return cls(low if whole else float(low), high if whole else float(high), log, whole)

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


class Choices(NamedTuple):
    """A list of values that are equally frequent."""

    choices: tuple[Any, ...]

    def at(self, share: float) -> Any:
        """Return the value at a share of the list, 0 to 1."""
        return self.choices[min(int(share * len(self.choices)), len(self.choices) - 1)]


Axis = Range | Choices


def axes_of(tree: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the settings in nested tables: full names, with a list of values or a range's table."""
    for name, value in tree.items():
        path = f"{before}.{name}" if before else name
        if isinstance(value, Mapping) and value and not value.keys() & {"from", "to"}:
            yield from axes_of(value, path)
        else:
            yield path, value if isinstance(value, (Mapping, list)) else [value]


def varying(axes: Mapping[str, Axis]) -> dict[str, Axis]:
    """Return the axes that have more than one value."""
    return {n: a for n, a in axes.items() if isinstance(a, Range) or len(a.choices) > 1}


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
            for key in file.keys() & KEYS[1:]:
                raise AntsError(f"{key} is for the designs {', '.join(DESIGNS[1:])}; set design.")
            return cls()
        samples = checked_whole("samples", file.get("samples"), 1, 100_000)
        seed = checked_whole("design_seed", file.get("design_seed", 0), 0, 2**63 - 1)
        sensitivity = checked_flag("sensitivity", file.get("sensitivity", False))
        if sensitivity:
            imported("sensitivity = true", "SALib", "sensitivity")
            if kind != SOBOL or samples < 2 or samples & (samples - 1):
                raise AntsError(
                    f"sensitivity = true with the design {kind!r} and samples = {samples}; it "
                    'requires design = "sobol" and a power of 2, such as 64.'
                )
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
        """Return the points: a value of each axis by name; AntsError if axes do not suit."""
        drawn = varying(axes)
        if self.kind == GRID:
            lists = []
            for name, axis in axes.items():
                if isinstance(axis, Range):
                    raise AntsError(f"{name} is a range, but a grid needs lists; set design.")
                lists.append(axis.choices)
            return [dict(zip(axes, row, strict=True)) for row in itertools.product(*lists)]
        if not drawn:
            raise AntsError(f"[vary] has single values only; the design {self.kind!r} needs more.")
        fixed = {name: axis.at(0.0) for name, axis in axes.items()}
        return [
            fixed | {name: drawn[name].at(share) for name, share in zip(drawn, row, strict=True)}
            for row in self.shares(len(drawn)).tolist()
        ]

    def shares(self, dimensions: int) -> np.ndarray:
        """Return points of the unit cube, float64 (points, dimensions), for other than grids."""
        from scipy.stats import qmc

        assert self.samples is not None
        if self.kind == RANDOM:
            return np.random.default_rng(self.seed).random((self.samples, dimensions))
        if self.sensitivity:
            from SALib.sample import sobol

            problem = {"num_vars": dimensions, "bounds": [[0, 1]] * dimensions}
            problem["names"] = [str(number) for number in range(dimensions)]
            return sobol.sample(problem, self.samples, calc_second_order=False, seed=self.seed)
        if self.kind == LATIN_HYPERCUBE:
            return qmc.LatinHypercube(dimensions, seed=self.seed).random(self.samples)
        # `random` warns unless the number is a power of 2, so the sequence is cut.
        whole = math.ceil(math.log2(self.samples))
        return qmc.Sobol(dimensions, seed=self.seed).random_base2(whole)[: self.samples]
