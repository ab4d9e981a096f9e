"""Views of ants and nests, through which hooks of features read and write their values by name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from taichi.lang.impl import subscript

from taichi_ants.engines.colony import columns
from taichi_ants.engines.colony.layout import COLUMNS, NestRow, WorldRow
from taichi_ants.features import numbers_of_castes
from taichi_ants.features.feature import NEST
from taichi_ants.kernel_functions import while_compiling
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


class View:
    """An ant or a nest of a world, while a kernel compiles.

    An attribute is an entry of an array, which can be assigned: by the slot of the ant, or by its
    nest, world or caste. `task` has the settings that features declare as numbers, for example
    `task.labour.demand`. Other names are those of the arrays and numbers of kernels.
    """

    _data_oriented = True  # Taichi requires it of objects whose attributes kernels read

    def __init__(self, c: Any, v: Any, w: Any, nest: Any = None, ant: Any = None) -> None:
        self._c, self._v, self._w, self._nest, self._ant = c, v, w, nest, ant

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):  # of Python
            raise AttributeError(name)
        c, names = self._c, self._v.names
        if name == "task":
            return TaskNumbers(c, names.numbers)
        if name not in names.entries:
            return getattr(c, name)
        array, per, row = names.entries[name]
        index = self._index(per)
        at = (index,) if row is None else (row, index)
        return subscript(None, getattr(c, array), *at)

    def _index(self, per: str) -> Any:
        c, v = self._c, self._v
        if per == WORLD:
            return self._w
        if per == ANT:
            return self._ant
        if per == CASTE:
            return columns.trait(c.caste, self._ant)
        nest = columns.nest_of(c, v, self._ant) if self._nest is None else self._nest
        return self._w * v.n_nests + nest


class TaskNumbers:
    """The groups of settings of a task that hooks read, while a kernel compiles."""

    _data_oriented = True

    def __init__(self, c: Any, names: Mapping[str, tuple[str, ...]]) -> None:
        self._c, self._names = c, names

    def __getattr__(self, group: str) -> Any:
        if group not in self._names:
            raise AttributeError(group)
        return Numbers(getattr(self._c, f"{group}_numbers"), self._names[group])


class Numbers:
    """The numbers of a group of settings, while a kernel compiles."""

    _data_oriented = True

    def __init__(self, array: Any, names: tuple[str, ...]) -> None:
        self._array, self._names = array, names

    def __getattr__(self, name: str) -> Any:
        if name not in self._names:
            raise AttributeError(name)
        return subscript(None, self._array, self._names.index(name))


@while_compiling
def ant_view(c: Any, v: Any, w: Any, ant: Any) -> View:
    """Return the view of an ant."""
    return View(c, v, w, ant=ant)


@while_compiling
def nest_view(c: Any, v: Any, w: Any, nest: Any) -> View:
    """Return the view of a nest."""
    return View(c, v, w, nest=nest)
