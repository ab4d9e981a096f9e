"""The class of measures: named functions of the state of a colony, or of finished runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.errors import AntsError, shown

if TYPE_CHECKING:
    from taichi_ants.task import Task
    from taichi_ants.worlds.world import World

COUNTS, RUN = "counts", "run"  # values of `of` that do not name a measure
# A number, numbers by the names of parts, or an array.
Value = float | Mapping[str, float] | np.ndarray


@dataclass(frozen=True)
class Measure:
    """A named function, whose argument depends on `of`.

    Attributes:
        name: The name, with the part after a point: "entropy" or "entropy.trail".
        function: A function that returns a number, numbers by the names of parts, or an array.
        unit: The unit of the value, for axes and tables; "" if it has none.
        summary: A short description for lists.
        of: The arguments of the function. None: the `Snapshot` of a world, with read-only arrays in
            a run. "counts": the counts of an episode by name, integers in `Snapshot.counts` and
            arrays of episodes in finished runs, so the measure works for lone ants, too. The name
            of another measure: its values in the episode so far, float64 (n,), and the snapshot.
            "run": a `Run`; the value is then float64 (...) with the number of each run.
        parts: A function of a world and a task that returns the names of the parts.
        is_array: Whether the value is an array.
        episodes: The fewest episodes of training that a measure of a run needs.
    """

    name: str
    function: Callable[..., Any]
    unit: str = ""
    summary: str = ""
    of: str | None = None
    parts: Callable[[World, Task], tuple[str, ...]] = lambda world, task: ()
    is_array: bool = False
    episodes: int = 0

    @property
    def label(self) -> str:
        """The text for axes and tables of finished runs."""
        words = self.summary or self.name.replace("_", " ")
        return f"{words} ({self.unit})" if self.unit and self.of != RUN else words

    @property
    def uses_iqm(self) -> bool:
        """Whether tables of finished runs have an IQM; shares and counts have only a mean."""
        return self.of == RUN and self.unit in ("reward", "steps")

    def check_single_state(self, where: str) -> None:
        """Raise AntsError if it does not read a single state, which the caller has."""
        if self.of not in (None, COUNTS):
            needs = "finished runs" if self.of == RUN else f"the series of {self.of!r}"
            raise AntsError(
                f"{where} is {self.name!r}, which needs {needs}; choose a measure of a single "
                "state."
            )

    def __call__(self, snapshot: Any) -> float:
        """Return the value in a snapshot as one number.

        Raises:
            AntsError: The measure does not read one state, is an array, or has several parts.
        """
        self.check_single_state("the measure")
        value = self.read(snapshot)
        if isinstance(value, Mapping) and len(value) == 1:
            (value,) = value.values()
        if not isinstance(value, float):
            raise AntsError(
                f"the measure {self.name!r} is not a number, but {shown(value)}; name one of its "
                "parts after a point, or another measure."
            )
        return value

    def read(self, snapshot: Any, values: np.ndarray | None = None) -> Value:
        """Return the value in a state: a float, floats by part, or an array.

        `values` is the series of the measure that `of` names.

        Raises:
            AntsError: The function fails or returns something else, or the part does not exist.
        """
        arguments = {None: [snapshot], COUNTS: [snapshot.counts]}.get(self.of, [values, snapshot])
        value = self.computed(*arguments)
        _, _, part = self.name.partition(".")
        if part:
            parts = value if isinstance(value, Mapping) else {}
            if part not in parts:
                known = ", ".join(map(str, parts)) or "no parts"
                raise AntsError(f"{self.name!r} is not a part of the measure; it has {known}.")
            value = parts[part]
        if isinstance(value, Mapping):
            return {str(part): self._number(number) for part, number in value.items()}
        if isinstance(value, np.ndarray) and value.ndim:
            return value
        return self._number(value)

    def computed(self, *arguments: Any) -> Any:
        """Return what the function returns; AntsError if it fails."""
        try:
            return self.function(*arguments)
        except AntsError:
            raise
        except Exception as error:
            reason = " ".join(f"{type(error).__name__}: {error}".split())
            raise AntsError(
                f"the measure {self.name!r} failed with {reason}; correct its function."
            ) from error

    def _number(self, value: object) -> float:
        if isinstance(value, np.ndarray) and value.ndim == 0:
            value = value[()]
        if value is None:
            return math.nan
        if not isinstance(value, (Real, np.bool_)) or math.isinf(value):
            raise AntsError(
                f"the measure {self.name!r} returned {shown(value)}; it must return a finite "
                "number, nan if it has no value, numbers by the names of parts, or an array."
            )
        return float(value)
