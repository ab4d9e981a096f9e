"""The registry of measures.

To add one to the package, write a function in a file of this folder and add it to `BUILT_IN`. To
add your own measure, call `register` in a notebook or a plugin file.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from taichi_ants.errors import AntsError, expect, shown
from taichi_ants.measures import activity, ants, deliveries, paths, trails
from taichi_ants.measures.measure import Measure
from taichi_ants.registry import Registry
from taichi_ants.task.field import TRAIL

if TYPE_CHECKING:
    from taichi_ants.task import Task
    from taichi_ants.worlds.world import World


def _built_in(function: Callable[..., Any], unit: str, summary: str, of: str | None = None) -> None:
    BUILT_IN[function.__name__] = Measure(function.__name__, function, unit, summary, of)


BUILT_IN: dict[str, Measure] = {}
_built_in(deliveries.deliveries, "food items", "deliveries since the start of the episode")
_built_in(
    *(deliveries.new_deliveries, "food items", "deliveries since the last row of the series"),
    of="deliveries",
)
_built_in(deliveries.first_delivery, "ticks", "first passage time; if there is none, ticks so far")
_built_in(deliveries.efficiency, "per ant and tick", "deliveries per living ant and tick")
_built_in(paths.path_length, "ticks", "mean ticks with food of a delivered load")
_built_in(paths.path_ratio, "", "path length divided by that of the shortest path")
_built_in(trails.entropy, "", "entropy of each pheromone field, 0 (one cell) to 1 (equal levels)")
_built_in(activity.blocked_share, "", "share of the moves that failed")
_built_in(activity.activity, "", "share of the ants that moved in the last tick")
_built_in(
    *(activity.synchrony, "", "variance of the activity, relative to independent ants"),
    of="activity",
)
_built_in(ants.living, "ants", "number of living ants")
_built_in(ants.waiting_births, "ants", "births that wait for a free cell or slot")
_built_in(ants.carriers, "", "share of the ants that carry food")
_built_in(ants.foraging, "", "share of the ants that forage, which are not idle")
_built_in(ants.distance, "steps", "mean distance of the ants to the nearest queen")
_built_in(ants.regions, "", "share of the ants in each region of the world")
_built_in(ants.occupancy, "ants", "number of ants on each cell (an array)")
ARRAYS = (ants.occupancy.__name__,)  # measures whose value is an array
_PARTS: dict[str, Callable[[World, Task], tuple[str, ...]]] = {
    "entropy": lambda world, task: (TRAIL, *task.fields),
    "regions": lambda world, task: tuple(ants.regions_of(world)),
}
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
        function: A function of a `Snapshot` that returns a number, numbers by the names of parts,
            or an array. With `of`, a function of the values of that measure in the episode so far,
            float64 (n,), and of the snapshot, which returns a number.
        unit: The unit of the value, for axes and tables.
        summary: A short description.
        of: The name of the measure whose series the function reads.

    Raises:
        AntsError: The name is not a word or belongs to a built-in measure, `function` does not take
            these arguments, or `of` is not a measure of the snapshot alone.
    """
    MEASURES.check_new(name)
    for what, text in (("unit", unit), ("summary", summary)):
        expect(what, text, str)
    if of is not None and get(of).of is not None:
        raise AntsError(f"of is {of!r}, which reads a series itself; name a measure that does not.")
    arguments = ["snapshot"] if of is None else ["values", "snapshot"]
    try:
        inspect.signature(function).bind(*arguments)
    except (TypeError, ValueError) as error:
        raise AntsError(
            f"the function of the measure {name!r} is {shown(function)}; it must be a function of "
            f"({', '.join(arguments)})."
        ) from error
    return MEASURES.add(name, Measure(name, function, unit, summary, of))


def get(name: str | Measure) -> Measure:
    """Return the measure of this name, or of one part: "entropy" or "entropy.trail".

    Call it with a snapshot to get one number: `get("deliveries")(colony.snapshot())`. A `Measure`
    is returned as it is.

    Raises:
        AntsError: There is no such measure; the message lists all names.
    """
    if isinstance(name, Measure):
        return name
    whole, _, part = name.partition(".") if isinstance(name, str) else (name, "", "")
    measure = MEASURES.get(whole)
    return measure.select(part) if part else measure


def check_part(name: str, world: World, task: Task, single: bool = False) -> None:
    """Raise AntsError if a built-in measure does not have the part that its name selects.

    With `single`, also if it is not one number, because it has several parts or is an array.
    """
    whole, _, part = name.partition(".")
    if whole not in BUILT_IN:
        return
    parts = _PARTS[whole](world, task) if whole in _PARTS else ()
    allowed = ", ".join(f"{whole}.{one}" for one in parts)
    if part and part not in parts:
        choose = f"choose one of {allowed}" if parts else "it has none, so leave out the point"
        raise AntsError(f"{name!r} is not a part of {whole}; {choose}.")
    if single and not part and len(parts) > 1:
        raise AntsError(f"{name!r} has {len(parts)} parts; name one of {allowed}.")
    if single and whole in ARRAYS:
        raise AntsError(f"{name!r} is an array; choose a measure that is a number.")
