"""What the engines return: named arrays that print on one screen and can be compared."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from taichi_ants.errors import shown
from taichi_ants.grid.hexgrid import AxialGrid


class Record:
    """Base of dataclasses of arrays; to be used with `eq=False, repr=False`.

    Two are equal if all their fields are that are not marked `compare=False`: arrays by type, shape
    and content, where NaN equals NaN. Arrays can be written to, so records have no hash.
    """

    __hash__ = None  # type: ignore[assignment]

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        names = [field.name for field in fields(self) if field.compare]  # type: ignore[arg-type]
        return all(same(getattr(self, name), getattr(other, name)) for name in names)

    def __repr__(self) -> str:
        names = [field.name for field in fields(self) if field.repr]  # type: ignore[arg-type]
        lines = [f"    {name}: {_described(getattr(self, name))}" for name in names]
        return "\n".join([f"{type(self).__name__}(", *lines, ")"])


@dataclass(frozen=True, eq=False, repr=False)
class Snapshot(Record):
    """One world at one moment, as `taichi_ants.rendering` draws it.

    Attributes:
        ground: uint8 (grid.size,), EMPTY, OBSTACLE, FOOD or QUEEN; EMPTY under ants.
        trail: int32 or float32 (grid.size,), trail levels.
        ant_cells, ant_headings: int32 (n,), flat indices of the living ants, and 0 to 5.
        ant_carries: bool (n,).
    """

    grid: AxialGrid
    ground: np.ndarray
    trail: np.ndarray
    ant_cells: np.ndarray
    ant_headings: np.ndarray
    ant_carries: np.ndarray


def same(one: object, other: object) -> bool:
    """Whether two values, arrays or not, are equal; NaN equals NaN in arrays."""
    if not isinstance(one, np.ndarray) or not isinstance(other, np.ndarray):
        return not isinstance(one, np.ndarray) and type(one) is type(other) and one == other
    floats = one.dtype.kind == "f"
    return one.dtype == other.dtype and np.array_equal(one, other, equal_nan=floats)


def _described(value: object) -> str:
    """An array by its type, shape and range; a record indented; all else as messages show it."""
    if isinstance(value, Record):
        return repr(value).replace("\n", "\n    ")
    if not isinstance(value, np.ndarray):
        return shown(value)
    form = f"{value.dtype} {value.shape}"
    if not value.size:
        return form
    numbers = value.astype(np.int8) if value.dtype == bool else value
    low, high, mean = numbers.min(), numbers.max(), numbers.mean(dtype=np.float64)
    return f"{form}, mean {mean:.4g}, from {low:.6g} to {high:.6g}"
