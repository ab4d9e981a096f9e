"""The registry of measures.

To add one to the package, write a function in `built_in.py`, or an entry in `finished.py`. To add
your own measure, call `register` in a notebook or a plugin file.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from taichi_ants.errors import check_one_of
from taichi_ants.measures.built_in import BUILT_IN
from taichi_ants.measures.measure import COUNTS, RUN, Measure
from taichi_ants.registry import Registry

MEASURES: Registry[Measure] = Registry("measure", "taichi_ants.measures.register", BUILT_IN)
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
    """
    if of is not None:
        check_one_of("of", of, (COUNTS, RUN))
    return MEASURES.add(name, Measure(name, function, unit, summary, of))


def get(name: str | Measure) -> Measure:
    """Return the measure of this name, or of one part: "entropy" or "entropy.trail".

    Call it with a snapshot to get one number: `get("deliveries")(colony.snapshot())`. A `Measure`
    is returned as it is. Raises AntsError, with a list of all names, if there is none.
    """
    if isinstance(name, Measure):
        return name
    whole, _, part = name.partition(".") if isinstance(name, str) else (name, "", "")
    measure = MEASURES.get(whole)
    return replace(measure, name=name) if part else measure
