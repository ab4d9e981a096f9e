"""The registry of measures.

To add one to the package, write a function in `built_in.py`, or an entry in `finished.py`. To add
your own measure, call `register` in a notebook or a plugin file.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from taichi_ants.errors import AntsError
from taichi_ants.measures.built_in import BUILT_IN
from taichi_ants.measures.measure import COUNTS, RUN, Measure
from taichi_ants.registry import Registry

if TYPE_CHECKING:
    from taichi_ants.task import Task
    from taichi_ants.worlds.world import World

MEASURES: Registry[Measure] = Registry(
    *("measure", "taichi_ants.measures.register", BUILT_IN), reserved=(COUNTS, RUN)
)
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
        function: A function of a `Snapshot` that returns a number, numbers by the names of parts,
            or an array; see `Measure.of` for the arguments of functions with `of`.
        unit: The unit of the value, for axes and tables.
        summary: A short description.
        of: "counts" for a function of counts, which lone ants have, too; the name of a measure for
            a function of its series, which returns a number; "run" for a function of finished runs.

    Raises:
        AntsError: The name is not a word or belongs to a built-in measure, or `of` is not a measure
            of one state.
    """
    MEASURES.check_new(name)
    if of not in (None, COUNTS, RUN):
        get(of).check_single_state("of")
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


def check_part(name: str, world: World, task: Task, single: bool = False) -> None:
    """Raise AntsError if a built-in measure does not have the part that its name selects.

    With `single`, also if it is not one number, because it has several parts or is an array.
    """
    whole, _, part = name.partition(".")
    if whole not in BUILT_IN:
        return
    parts, is_array = BUILT_IN[whole].parts(world, task), BUILT_IN[whole].is_array
    if part not in parts if part else single and (is_array or len(parts) > 1):
        kind = f"a part of {whole}" if part else "one number"
        allowed = ", ".join(f"{whole}.{known}" for known in parts)
        choose = f"one of {allowed}" if allowed else "another measure"
        raise AntsError(f"{name!r} is not {kind}; choose {choose}.")
