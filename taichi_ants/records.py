"""Records: named arrays, with short output and comparison by content."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from taichi_ants.errors import shown


class Record:
    """Base of dataclasses of arrays, which use `eq=False, repr=False`.

    Two records are equal if all fields without `compare=False` are equal: arrays by type, shape and
    content, where NaN equals NaN. Records have no hash, because their arrays are writable.
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


def same(one: object, other: object) -> bool:
    """Return whether two values, arrays or not, are equal; NaN equals NaN in arrays."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(same(one[name], other[name]) for name in one)
    if not isinstance(one, np.ndarray) or not isinstance(other, np.ndarray):
        return not isinstance(one, np.ndarray) and type(one) is type(other) and one == other
    floats = one.dtype.kind == "f"
    return one.dtype == other.dtype and np.array_equal(one, other, equal_nan=floats)


def _described(value: object) -> str:
    """Return a summary of an array, an indented record, or another value as messages show it."""
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
