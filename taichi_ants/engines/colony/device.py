"""The arrays of a colony that are on a device, such as a GPU, while ticks run; see `memory`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any
from weakref import ref

import numpy as np
import taichi as ti

from taichi_ants import runtime
from taichi_ants.engines.colony.memory import Contents
from taichi_ants.engines.device_memory import copy_in, copy_out
from taichi_ants.engines.launch import type_of
from taichi_ants.errors import AntsError

_LINE = 128  # an array begins at a multiple of this, as GPUs read memory in lines of 128 bytes
_MOST_NUMBERS = 2**31 - 1  # kernels use 32-bit indices


class DeviceArrays(Mapping[str, np.ndarray]):
    """NumPy arrays by name, of which kernels change copies on a device.

    An array that is read is copied from the device first, and to the device before the next launch,
    because the reader may change it. So do not keep an array, or a view of it, across a launch.
    """

    def __init__(self, arrays: Mapping[str, np.ndarray] | None = None) -> None:
        self._arrays: dict[str, np.ndarray] = {}
        self._changed: set[str] = set()  # to be copied to the device
        self._newer: set[str] = set()  # on the device
        self._memories: dict[str, Any] = {}  # none: to be laid out
        self._taichi: Any = lambda: None  # the Taichi runtime that has the memories
        self |= arrays or {}

    def __getitem__(self, name: str) -> np.ndarray:
        array = self._arrays[name]
        self._fetch([name])
        self._changed.add(name)
        return array

    def __setitem__(self, name: str, array: np.ndarray) -> None:
        array, kept = np.ascontiguousarray(array), self._arrays.get(name)
        if kept is None or (kept.dtype, kept.shape) != (array.dtype, array.shape):
            self._fetch([*self._newer])
            self._memories = {}
        self._arrays[name] = array
        self._newer.discard(name)
        self._changed.add(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def __ior__(self, arrays: Any) -> Any:
        for name, array in arrays.items():
            self[name] = array
        return self

    def __reduce__(self) -> Any:
        """Return a copy with the same NumPy arrays, for copies and pickles."""
        return DeviceArrays, ({**self},)

    def on_device(self, numbers: Mapping[str, Any]) -> tuple[Contents, dict[str, Any]]:
        """Return what kernels find on the device, and its memories by kind, for launches now.

        Raises:
            AntsError: The colony is too large, or Taichi was reset after the last launch.
        """
        if self._taichi() is not ti.lang.impl.get_runtime():
            runtime.start()
            self._check_not_lost()
            self._memories, self._taichi = {}, ref(ti.lang.impl.get_runtime())
        if not self._memories:
            self._lay_out(numbers)
        if numbers != self._numbers:
            self._write_numbers(numbers)
        for name in self._changed:
            kind, place = self._places[name]
            copy_in(self._arrays[name], self._memories[kind], place)
        self._changed.clear()
        self._newer = {*self._places}
        # Taichi crashes without a number; this one is that of `arithmetic.guards`.
        return self._contents, self._memories | {"zero": 0}

    def _fetch(self, names: Iterable[str]) -> None:
        """Copy some arrays from the device, if they are newer there."""
        for name in self._newer.intersection(names):
            self._check_not_lost()
            kind, place = self._places[name]
            copy_out(self._memories[kind], self._arrays[name], place)
            self._newer.discard(name)

    def _check_not_lost(self) -> None:
        if self._newer and self._taichi() is not ti.lang.impl.get_runtime():
            raise AntsError(
                "Taichi was reset or restarted, which destroys the state of a colony on a GPU; "
                "save the colony before, and load it afterwards."
            )

    def _lay_out(self, numbers: Mapping[str, Any]) -> None:
        """Make memories with room for all numbers and arrays."""
        self._contents = Contents(
            tuple((name, type_of(number)[0]) for name, number in numbers.items()),
            tuple((name, *type_of(array)) for name, array in self._arrays.items()),
        )
        ends = {kind: len(names) for kind, names in self._contents.heads().items()}
        self._places: dict[str, tuple[str, int]] = {}
        for name, kind, _ in self._contents.arrays:
            place = -(-ends[kind] // _LINE) * _LINE
            self._places[name], ends[kind] = (kind, place), place + self._arrays[name].size
        for kind, end in ends.items():
            if end > _MOST_NUMBERS:
                raise AntsError(
                    f"the colony has {end} numbers of type {kind}, but at most {_MOST_NUMBERS} fit "
                    "a GPU; choose fewer ants or worlds."
                )
        self._memories = {
            kind: ti.ndarray(getattr(ti, kind), max(1, end)) for kind, end in ends.items()
        }
        self._numbers: dict[str, Any] = {}
        self._changed.update(self._arrays)

    def _write_numbers(self, numbers: Mapping[str, Any]) -> None:
        """Write the numbers of kernels to the device, and the places and shapes of arrays."""
        self._numbers = known = dict(numbers)
        of_arrays: dict[str, int] = {}
        for name, (_, place) in self._places.items():
            shape = self._arrays[name].shape
            of_arrays |= {f"{name}.{axis}": n for axis, n in enumerate(shape)}
            of_arrays[f"{name}.place"] = place
        for kind, names in self._contents.heads().items():
            dtype = f"{kind[0]}{int(kind[1:]) // 8}"
            head = np.array([{**known, **of_arrays}[name] for name in names], dtype)
            if names:
                copy_in(head, self._memories[kind])
