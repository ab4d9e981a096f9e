"""Argument packs: all arrays and numbers of a kernel as one argument, declared by what they are."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import taichi as ti


class Arguments:
    """Arrays and numbers, as the one argument by which kernels find them by their names.

    To make a pack takes over a millisecond, so that it is kept; it dies with the Taichi that it
    was made in.
    """

    def __init__(self) -> None:
        self._pack: Any = None
        self._values: dict[str, Any] = {}
        self._program: Any = None

    def pack(self, values: Mapping[str, Any]) -> tuple[Any, Any]:
        """The type of the pack, to annotate the kernel's argument, and the pack.

        Args:
            values: By name: NumPy arrays, which kernels work on in place; whole numbers, for
                kernels i32, or u64 if they are `np.uint64`; and floats, for kernels f32. Names and
                types are the same in each call.
        """
        kind = _pack_type(tuple((name, _kind(value)) for name, value in values.items()))
        program = ti.lang.impl.get_runtime().prog
        if self._program is not program:
            self._pack, self._values, self._program = kind(**values), dict(values), program
        for name, value in values.items():
            if self._values[name] is not value:
                self._pack[name] = self._values[name] = value
        return kind, self._pack


def _kind(value: Any) -> tuple[str, int]:
    """The name of a type of Taichi's, and the dimensions of an array, 0 for a number."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype.kind}{8 * value.dtype.itemsize}", value.ndim
    if isinstance(value, np.uint64):
        return "u64", 0
    return ("i32" if isinstance(value, (int, np.integer)) else "f32"), 0


@cache
def _pack_type(kinds: tuple[tuple[str, tuple[str, int]], ...]) -> Any:
    types = {name: (getattr(ti, dtype), ndim) for name, (dtype, ndim) in kinds}
    return ti.types.argpack(
        **{
            name: ti.types.ndarray(dtype=dtype, ndim=ndim) if ndim else dtype
            for name, (dtype, ndim) in types.items()
        }
    )
