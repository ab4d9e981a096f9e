"""The arrays of a colony in the memory of a device, such as a GPU, while ticks run.

A launch costs microseconds for each argument, and a GPU allows 64. So the device has one array for
each type of numbers, in which all arrays of this type follow each other. The first entries are what
kernels read as numbers: those of the model, the place of each array, and its shape.
"""

from collections.abc import Iterable, Iterator, Mapping, MutableMapping
from functools import cache
from typing import Any, NamedTuple
from weakref import ref

import numpy as np
import taichi as ti
from taichi.lang.impl import expr_init, subscript

from taichi_ants import runtime
from taichi_ants.engines.launch import kind_of
from taichi_ants.errors import AntsError
from taichi_ants.kernel_functions import Named, while_compiling

# The types of numbers, in the order of the arguments of kernels.
KINDS = {"i8": np.int8, "u8": np.uint8, "i32": np.int32, "i64": np.int64, "u64": np.uint64}
KINDS |= {"f32": np.float32, "f64": np.float64}
MEMORY = {kind: ti.types.ndarray(dtype=getattr(ti, kind), ndim=1) for kind in KINDS}
_LINE = 128  # an array begins at a multiple of this, as GPUs read memory in lines of 128 bytes
_MOST_NUMBERS = 2**31 - 1  # kernels use 32-bit indices
_OF_THREADS = "orders", "barrier"  # which only kernels of other schedules read


class Contents(NamedTuple):
    """The numbers that kernels read, by name and kind, and the arrays: name, kind, dimensions."""

    numbers: tuple[tuple[str, str], ...]
    arrays: tuple[tuple[str, str, int], ...]

    def heads(self) -> dict[str, list[str]]:
        """Return the names of the numbers at the start of the memory of each kind.

        Those of an array are `NAME.place`, and `NAME.0`, `NAME.1` of its shape.
        """
        heads: dict[str, list[str]] = {kind: [] for kind in KINDS}
        for name, kind in self.numbers:
            heads[kind].append(name)
        for name, _, ndim in self.arrays:
            heads["i32"] += [f"{name}.place", *(f"{name}.{axis}" for axis in range(ndim))]
        return heads


class _Held:
    """An array in kernels: the part of a memory that begins at a place."""

    def __init__(self, memory: Any, place: Any, shape: tuple[Any, ...]) -> None:
        self.memory, self.place, self.shape = memory, place, shape

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, tuple):
            row, column = index
            index = row * self.shape[1] + column
        return subscript(None, self.memory, self.place + index)


@while_compiling
def number_of(contents: Contents, i32: Any, name: str) -> Any:
    """Return a whole number from the memory, while a kernel compiles."""
    return subscript(None, i32, contents.heads()["i32"].index(name))


@while_compiling
def view_of(contents: Contents, *memories: Any) -> Named:
    """Return the arrays and numbers by name, as rules read them, while a kernel compiles."""
    of_kinds = dict(zip(KINDS, memories, strict=True))
    # Read once into variables, because a compiler reads memory again after each write into it.
    known = {
        name: expr_init(subscript(None, of_kinds[kind], place))
        for kind, names in contents.heads().items()
        for place, name in enumerate(names)
    }
    for name, kind, ndim in contents.arrays:
        shape = tuple(known[f"{name}.{axis}"] for axis in range(ndim))
        known[name] = _Held(of_kinds[kind], known[f"{name}.place"], shape)
    return Named(known.__getitem__)


@cache
def _copies(kind: str) -> tuple[Any, Any]:
    """Return kernels that copy an array into a memory, from a place on, and out of it."""
    held, given = MEMORY[kind], ti.types.ndarray(dtype=getattr(ti, kind), ndim=1)

    @ti.kernel
    def copy_in(memory: held, place: ti.i32, array: given):  # type: ignore[valid-type]
        for i in range(array.shape[0]):
            memory[place + i] = array[i]

    @ti.kernel
    def copy_out(memory: held, place: ti.i32, array: given):  # type: ignore[valid-type]
        for i in range(array.shape[0]):
            array[i] = memory[place + i]

    return copy_in, copy_out


class DeviceArrays(MutableMapping[str, np.ndarray]):
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
        self.update(arrays or {})

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

    def __delitem__(self, name: str) -> None:
        self._fetch([*self._newer])
        self._memories = {}
        del self._arrays[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def __ior__(self, arrays: Any) -> Any:
        self.update(arrays)
        return self

    def __reduce__(self) -> Any:
        """Return a copy with the same NumPy arrays, for copies and pickles."""
        return DeviceArrays, ({**self},)

    def on_device(self, numbers: Mapping[str, Any]) -> tuple[Contents, tuple[Any, ...]]:
        """Return what kernels find on the device, and its memories, up to date.

        After the launch, call `note_launch`.

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
        for name in self._changed.difference(_OF_THREADS):
            self._copy(0, name)
        self._changed.clear()
        return self._contents, tuple(self._memories.values())

    def note_launch(self) -> None:
        """Take notice that kernels may have changed all arrays on the device."""
        self._newer = self._places.keys() - self._changed

    def _fetch(self, names: Iterable[str]) -> None:
        """Copy some arrays from the device, if they are newer there."""
        for name in self._newer.intersection(names):
            self._check_not_lost()
            self._copy(1, name)
            self._newer.discard(name)

    def _check_not_lost(self) -> None:
        if self._newer and self._taichi() is not ti.lang.impl.get_runtime():
            raise AntsError(
                "Taichi was reset or restarted, which destroys the state of a colony on a GPU; "
                "save the colony before, and load it afterwards."
            )

    def _copy(self, out: int, name: str) -> None:
        kind, place = self._places[name]
        _copies(kind)[out](self._memories[kind], place, self._arrays[name].reshape(-1))

    def _lay_out(self, numbers: Mapping[str, Any]) -> None:
        """Make memories with room for all numbers and arrays."""
        ours = {name: one for name, one in self._arrays.items() if name not in _OF_THREADS}
        self._contents = Contents(
            tuple((name, kind_of(number)[0]) for name, number in numbers.items()),
            tuple((name, *kind_of(array)) for name, array in ours.items()),
        )
        ends = {kind: len(names) for kind, names in self._contents.heads().items()}
        self._places: dict[str, tuple[str, int]] = {}
        for name, kind, _ in self._contents.arrays:
            place = -(-ends[kind] // _LINE) * _LINE
            self._places[name], ends[kind] = (kind, place), place + ours[name].size
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
        self._changed.update(ours)

    def _write_numbers(self, numbers: Mapping[str, Any]) -> None:
        """Write the numbers of kernels to the device, and the places and shapes of arrays."""
        self._numbers = known = dict(numbers)
        of_arrays: dict[str, int] = {}
        for name, (_, place) in self._places.items():
            shape = self._arrays[name].shape
            of_arrays |= {f"{name}.{axis}": n for axis, n in enumerate(shape)}
            of_arrays[f"{name}.place"] = place
        for kind, names in self._contents.heads().items():
            head = np.array([{**known, **of_arrays}[name] for name in names], KINDS[kind])
            if names:
                _copies(kind)[0](self._memories[kind], 0, head)
