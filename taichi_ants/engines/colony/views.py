"""Views of ants, nests and cells, by which hooks of features read and write values by name."""

from __future__ import annotations

from typing import Any

from taichi.lang.impl import subscript

from taichi_ants.engines.colony import columns
from taichi_ants.engines.colony.layout import COLUMNS, NestRow, WorldRow
from taichi_ants.features import NUMBERS, arrays, numbers_of_castes
from taichi_ants.features.castes import CASTE
from taichi_ants.features.cues import CUES
from taichi_ants.features.feature import ANT, CELL, NEST
from taichi_ants.kernel_functions import Named, while_compiling
from taichi_ants.task.model import Model

WORLD, TASK, MAP = "world", "task", "map"


def entries_of(model: Model) -> dict[str, Any]:
    """Return what names mean to the hooks of a model.

    That is an array, per what, and the row in it; or the start of an array that it does not use.
    """
    of_castes = numbers_of_castes(model.features)
    return {
        **{name: (name, ANT, None) for name in COLUMNS},
        "stream": ("streams", ANT, None),
        "seed": ("seeds", WORLD, None),
        **{row.name.lower(): ("worlds", WORLD, row) for row in WorldRow},
        **{row.name.lower(): ("nests", NEST, row) for row in NestRow},
        **{name: (array, TASK, place) for name, (array, place) in NUMBERS.items()},
        **{name: ("castes", CASTE, row) for row, name in enumerate(of_castes) if model.n_castes},
        **{
            array.name: (array.name, array.per, None) if feature in model.features else array.start
            for feature, array in arrays()
        },
        **{name: (name, MAP, None) for cue in CUES.values() for name in cue.arrays},
    }


def _view(c: Any, v: Any, w: Any, nest: Any = None, ant: Any = None, cell: Any = None) -> Named:
    """Return the view of an ant, a nest or a cell of a world, while a kernel compiles.

    An attribute is an entry of an array, which can be assigned: by the slot of the ant, or by its
    nest, world or caste. Without `w`, the world is that of the ant. `task` has the settings that
    features declare as numbers, for example `task.labour.demand`, and `place` is the index of the
    ant's cell in arrays by cell. Other names are those of the arrays and numbers of kernels.
    """
    if w is None and ant is not None:
        w = ant // c.n_slots

    def index(per: str) -> Any:
        if per == WORLD:
            return w
        if per in (ANT, CELL):
            return ant if per == ANT else cell
        if per == CASTE:
            return columns.trait(c.caste, ant)
        of_nest = w * v.n_nests + (columns.nest_of(c, v, ant) if nest is None else nest)
        return of_nest * c.size + subscript(None, c.cell, ant) if per == MAP else of_nest

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
        if not isinstance(v.entries[name], tuple):
            return v.entries[name]
        array, per, row = v.entries[name]
        at = () if per == TASK else (index(per),)
        return subscript(None, getattr(c, array), *(at if row is None else (row, *at)))

    return Named(read)


ant_view = while_compiling(lambda c, v, w, ant: _view(c, v, w, ant=ant))
nest_view = while_compiling(lambda c, v, w, nest: _view(c, v, w, nest=nest))
cell_view = while_compiling(lambda c, v, cell: _view(c, v, None, cell=cell))
