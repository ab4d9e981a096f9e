"""Views of ants and nests, through which hooks of features read and write their values by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from taichi.lang.impl import subscript

from taichi_ants.engines.colony import columns
from taichi_ants.engines.colony.layout import COLUMNS, NestRow, WorldRow
from taichi_ants.engines.own_rules import for_kernels
from taichi_ants.features import numbers_of_castes
from taichi_ants.features.feature import NEST
from taichi_ants.task.model import Model

ANT, WORLD, CASTE = "ant", "world", "caste"


class Entry(NamedTuple):
    """What a name means in a view: an array of kernels, the row in it if any, and its index."""

    array: str
    per: str
    row: int | None = None


class Names(NamedTuple):
    """The names that views of a model know: entries of arrays, and numbers of features."""

    entries: Mapping[str, Entry]
    numbers: Mapping[str, tuple[str, ...]]


def names_of(model: Model) -> Names:
    """Return the names that hooks of the features of a model can read and write."""
    used = model.features
    of_castes = numbers_of_castes(used) if model.n_castes else {}
    return Names(
        {
            **{name: Entry(name, ANT) for name in COLUMNS},
            "stream": Entry("streams", ANT),
            "seed": Entry("seeds", WORLD),
            **{row.name.lower(): Entry("worlds", WORLD, row) for row in WorldRow},
            **{row.name.lower(): Entry("nests", NEST, row) for row in NestRow},
            **{name: Entry("castes", CASTE, row) for row, name in enumerate(of_castes)},
            **{
                array.name: Entry(array.name, array.per)
                for feature in used
                for array in feature.arrays
            },
        },
        {feature.group: feature.numbers for feature in used if feature.numbers},
    )


class Named:
    """An object with attributes that a function returns by name, while a kernel compiles."""

    _data_oriented = True  # Taichi requires it of objects whose attributes kernels read

    def __init__(self, read: Callable[[str], Any]) -> None:
        self._read = read

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):  # of Python
            raise AttributeError(name)
        return self._read(name)


def _view(c: Any, v: Any, w: Any, nest: Any = None, ant: Any = None) -> Named:
    """Return the view of an ant or a nest of a world, while a kernel compiles.

    An attribute is an entry of an array, which can be assigned: by the slot of the ant, or by its
    nest, world or caste. `task` has the settings that features declare as numbers, for example
    `task.labour.demand`. Other names are those of the arrays and numbers of kernels.
    """

    def index(per: str) -> Any:
        if per == WORLD:
            return w
        if per == ANT:
            return ant
        if per == CASTE:
            return columns.trait(c.caste, ant)
        number = columns.nest_of(c, v, ant) if nest is None else nest
        return w * v.n_nests + number

    def group(name: str) -> Named:
        numbers, array = v.names.numbers[name], getattr(c, f"{name}_numbers")
        return Named(lambda name: subscript(None, array, numbers.index(name)))

    def read(name: str) -> Any:
        if name == "task":
            return Named(group)
        if name not in v.names.entries:
            return getattr(c, name)
        array, per, row = v.names.entries[name]
        at = (index(per),) if row is None else (row, index(per))
        return subscript(None, getattr(c, array), *at)

    return Named(read)


@for_kernels
def ant_view(c: Any, v: Any, w: Any, ant: Any) -> Named:
    """Return the view of an ant."""
    return _view(c, v, w, ant=ant)


@for_kernels
def nest_view(c: Any, v: Any, w: Any, nest: Any) -> Named:
    """Return the view of a nest."""
    return _view(c, v, w, nest=nest)
