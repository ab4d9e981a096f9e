"""Views of ants and nests, through which hooks of features read and write their values by name."""

from __future__ import annotations

from typing import Any

from taichi.lang.impl import subscript

from taichi_ants.engines.colony import columns
from taichi_ants.engines.colony.layout import COLUMNS, NestRow, WorldRow
from taichi_ants.features import numbers_of_castes
from taichi_ants.features.cues import CUES
from taichi_ants.features.feature import ANT, CASTE, NEST
from taichi_ants.kernel_functions import Named, while_compiling
from taichi_ants.task.model import Model

WORLD, MAP = "world", "map"


def entries_of(model: Model) -> dict[str, tuple[str, str, int | None]]:
    """Return what names mean to the hooks of a model: an array, per what, and the row in it."""
    used = model.features
    of_castes = numbers_of_castes(used) if model.n_castes else {}
    arrays = [array for feature in used for array in feature.arrays]
    return {
        **{name: (name, ANT, None) for name in COLUMNS},
        "stream": ("streams", ANT, None),
        "seed": ("seeds", WORLD, None),
        **{row.name.lower(): ("worlds", WORLD, row) for row in WorldRow},
        **{row.name.lower(): ("nests", NEST, row) for row in NestRow},
        **{name: ("castes", CASTE, row) for row, name in enumerate(of_castes)},
        **{array.name: (array.name, array.per, None) for array in arrays},
        **{name: (name, MAP, None) for cue in CUES.values() for name in cue.arrays},
    }


def _view(c: Any, v: Any, w: Any, nest: Any = None, ant: Any = None) -> Named:
    """Return the view of an ant or a nest of a world, while a kernel compiles.

    An attribute is an entry of an array, which can be assigned: by the slot of the ant, or by its
    nest, world or caste. `task` has the settings that features declare as numbers, for example
    `task.labour.demand`, and `place` is the index of the ant's cell in arrays by cell. Other names
    are those of the arrays and numbers of kernels.
    """

    def index(per: str) -> Any:
        if per == WORLD:
            return w
        if per == ANT:
            return ant
        if per == MAP:
            return columns.own_map(c, v, w, ant)
        if per == CASTE:
            return columns.trait(c.caste, ant)
        number = columns.nest_of(c, v, ant) if nest is None else nest
        return w * v.n_nests + number

    def group(name: str) -> Named:
        (numbers,) = [f.numbers for f in v.features if f.group == name and f.numbers]
        array = getattr(c, f"{name}_numbers")
        return Named(lambda setting: subscript(None, array, numbers.index(setting)))

    def read(name: str) -> Any:
        if name == "task":
            return Named(group)
        if name == "place":
            return w * c.size + subscript(None, c.cell, ant)
        if name not in v.entries:
            return getattr(c, name)
        array, per, row = v.entries[name]
        at = (index(per),) if row is None else (row, index(per))
        return subscript(None, getattr(c, array), *at)

    return Named(read)


ant_view = while_compiling(lambda c, v, w, ant: _view(c, v, w, ant=ant))
nest_view = while_compiling(lambda c, v, w, nest: _view(c, v, w, nest=nest))
