"""The class of measures: named functions of the state of a colony."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any

import numpy as np

from taichi_ants.errors import AntsError, shown

# A number, numbers by the names of parts, or an array.
Value = float | Mapping[str, float] | np.ndarray


@dataclass(frozen=True)
class Measure:
    """A named function of the state of one world of a colony.

    Attributes:
        name: The name, with the part after a point: "entropy" or "entropy.trail".
        function: A function of a `Snapshot` that returns a number, numbers by the names of parts,
            or an array. In a run, the arrays of the snapshot are read-only.
        unit: The unit of the value, for axes and tables; "" if it has none.
        summary: A short description for lists.
        of: The name of another measure, whose series the function reads. The function then takes
            the values of that measure in the episode so far, float64 (n,), and the snapshot. None
            for a function of the snapshot alone.
    """

    name: str
    function: Callable[..., Any]
    unit: str = ""
    summary: str = ""
    of: str | None = None

    @property
    def part(self) -> str:
        """The part of the value that the name selects; "" for the whole value."""
        return self.name.partition(".")[2]

    def select(self, part: str) -> Measure:
        """Return the measure of one part of the value."""
        return replace(self, name=f"{self.name.partition('.')[0]}.{part}")

    def __call__(self, snapshot: Any) -> float:
        """Return the value in a snapshot as one number.

        Raises:
            AntsError: The measure needs a series, or its value is an array or has several parts.
        """
        if self.of is not None:
            raise AntsError(
                f"the measure {self.name!r} needs the series of {self.of!r}, not one state; use it "
                "in Colony.run(measures=..., every=...)."
            )
        value = self.value(snapshot)
        if isinstance(value, np.ndarray):
            raise AntsError(
                f"the measure {self.name!r} is an array of shape {value.shape}; choose one that "
                "gives a number."
            )
        if not isinstance(value, Mapping):
            return value
        if len(value) != 1:
            parts = ", ".join(f"{self.name}.{part}" for part in value)
            raise AntsError(
                f"the measure {self.name!r} has {len(value)} parts; name one of {parts}."
            )
        return next(iter(value.values()))

    def value(self, *given: Any) -> Value:
        """Return the value: a float, floats by part, or an array.

        Raises:
            AntsError: The function fails or returns something else, or the part does not exist.
        """
        try:
            value = self.function(*given)
        except AntsError:
            raise
        except Exception as error:
            reason = " ".join(f"{type(error).__name__}: {error}".split())
            raise AntsError(
                f"the measure {self.name!r} failed with {reason}; correct its function."
            ) from error
        if isinstance(value, Mapping):
            if not self.part:
                return {str(part): self._number(one) for part, one in value.items()}
            if self.part not in value:
                parts = ", ".join(map(str, value))
                raise AntsError(f"{self.name!r} is not a part of the measure; it has {parts}.")
            value = value[self.part]
        elif self.part:
            raise AntsError(f"the measure of {self.name!r} has no parts; leave out the point.")
        if isinstance(value, np.ndarray) and value.ndim:
            return value
        return self._number(value)

    def _number(self, value: object) -> float:
        if isinstance(value, np.ndarray) and value.ndim == 0:
            value = value[()]
        if value is None:
            return math.nan
        if not isinstance(value, (Real, np.bool_)):
            raise AntsError(
                f"the measure {self.name!r} returned {shown(value)}; it must return a number, "
                "numbers by the names of parts, or an array."
            )
        number = float(value)
        if math.isinf(number):
            raise AntsError(
                f"the measure {self.name!r} returned {number}; it must return a finite number, or "
                "nan if it has no value."
            )
        return number
