"""Measures: named functions of the state of a colony, or of finished runs, and their registry.

To add one to the package, write a function in `built_in.py`, or an entry in `finished.py`. To add
your own measure, call `register` in a notebook or a plugin file.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any

import numpy as np

from taichi_ants.errors import AntsError, check_one_of, expect, shown
from taichi_ants.records import Snapshot
from taichi_ants.registry import Registry

COUNTS, RUN = "counts", "run"  # values of `Measure.of`


@dataclass(frozen=True)
class Measure:
    """A named function, whose argument depends on `of`.

    Attributes:
        name: The name, with the part after a point: "entropy" or "entropy.trail".
        function: A function that returns a number, or numbers by the names of parts.
        unit: The unit of the value, for axes and tables; "" if it has none.
        summary: A short description for lists.
        of: The argument of the function. None: the `Snapshot` of a world, with read-only arrays in
            a run. "counts": the counts of an episode by name, integers in `Snapshot.counts` and
            arrays of episodes in finished runs, so the measure works for lone ants, too. "run": a
            `Run`; the value is then float64 (...) with the number of each run.
        episodes: The fewest episodes of training that a measure of a run needs.

    >>> measures.get("deliveries").read(colony.snapshot())
    {'deliveries': 0.0}
    """

    name: str
    function: Callable[..., Any]
    unit: str = ""
    summary: str = ""
    of: str | None = None
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

    def check_state(self, where: str) -> None:
        """Raise AntsError unless it reads the state of a colony, which the caller has."""
        if self.of == RUN:
            raise AntsError(
                f"{where} is {self.name!r}, which needs finished runs; choose a measure of a state."
            )

    def __call__(self, snapshot: Any) -> float:
        """Return the value in a snapshot as one number.

        Raises:
            AntsError: The measure does not read a state, or has several parts.
        """
        self.check_state("the measure")
        numbers = self.read(snapshot)
        if len(numbers) != 1:
            raise AntsError(
                f"the measure {self.name!r} is not a number, but {shown(numbers)}; name one of its "
                "parts after a point, or another measure."
            )
        return next(iter(numbers.values()))

    def read(self, snapshot: Any) -> dict[str, float]:
        """Return the value in a snapshot of a world, or its parts, by their full names.

        Raises:
            AntsError: The function fails or returns something else, or the part does not exist.
        """
        expect("the argument of a measure", snapshot, Snapshot)
        value = self.computed(snapshot.counts if self.of == COUNTS else snapshot)
        _, _, part = self.name.partition(".")
        if part:
            parts = value if isinstance(value, Mapping) else {}
            if part not in parts:
                known = ", ".join(map(str, parts)) or "no parts"
                raise AntsError(f"{self.name!r} is not a part of the measure; it has {known}.")
            value = parts[part]
        elif isinstance(value, Mapping):
            return {f"{self.name}.{part}": self._number(number) for part, number in value.items()}
        return {self.name: self._number(value)}

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
        if value is None:
            return math.nan
        value = value[()] if isinstance(value, np.ndarray) and value.ndim == 0 else value
        if not isinstance(value, (Real, np.bool_)) or math.isinf(value):
            raise AntsError(
                f"the measure {self.name!r} returned {shown(value)}; it must return a finite "
                "number, nan if it has no value, or numbers by the names of parts."
            )
        return float(value)


# `built_in` adds those of the package.
MEASURES: Registry[Measure] = Registry("measure", "taichi_ants.measures.register", {})
names = MEASURES.names


def register(
    name: str,
    function: Callable[..., Any],
    unit: str = "",
    summary: str = "",
    of: str | None = None,
) -> Measure:
    """Return a measure after registering it, in place of your own measure of the same name.

    Args:
        name: A word of letters, digits and _.
        function: A function of a `Snapshot` that returns a number, or numbers by the names of
            parts; see `Measure.of` for the arguments of functions with `of`.
        unit: The unit of the value, for axes and tables.
        summary: A short description.
        of: "counts" for a function of counts, which lone ants have, too; "run" for a function of
            finished runs.

    Raises:
        AntsError: The name is not a word or belongs to a built-in measure, or `of` is wrong.

    >>> measures.register("laden", lambda snapshot: snapshot.ant_carries.mean()).name
    'laden'
    """
    if of is not None:
        check_one_of("of", of, (COUNTS, RUN))
    return MEASURES.add(name, Measure(name, function, unit, summary, of))


def get(name: str | Measure) -> Measure:
    """Return the measure of this name, or of one part: "entropy" or "entropy.trail".

    Call it with a snapshot to get one number: `get("deliveries")(colony.snapshot())`. A `Measure`
    is returned as it is. Raises AntsError, with a list of all names, if there is none.

    >>> measures.get("deliveries")(colony.snapshot()), measures.get("entropy").unit
    (0.0, '')
    """
    if isinstance(name, Measure):
        return name
    whole, _, part = name.partition(".") if isinstance(name, str) else (name, "", "")
    measure = MEASURES.get(whole)
    return replace(measure, name=name) if part else measure
