"""Kernel launches with argument packs: arrays and numbers as one argument."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from itertools import accumulate
from typing import Any
from weakref import finalize, ref

import numpy as np
import taichi as ti
from taichi.lang.argpack import ArgPack
from taichi.types import ndarray_type

from taichi_ants import runtime
from taichi_ants.errors import AntsError


class Launch:
    """A kernel whose one argument is a pack of named values.

    Taichi spends 10 microseconds per array on each launch. On the CPU this class spends them once.
    A pack takes over a millisecond to make, so it is reused until Taichi is reset.

    `kernel_of` returns the kernel for a pack type. Packs contain NumPy arrays, which kernels change
    in place; whole numbers, as i32, or u64 for `np.uint64`; and floats, as f32.
    """

    def __init__(self, kernel_of: Callable[[Any], Any]) -> None:
        self._kernel_of = kernel_of
        self._taichi: Any = lambda: None  # the Taichi runtime for which the launch was prepared
        # Not a reference to its program, which would outlive a reset of Taichi.
        self._compiled: Any = None
        self._known: dict[str, Any] = {}  # the present values of the pack and the context
        self._flushing = runtime.Flushing()

    def __call__(self, values: Mapping[str, Any]) -> None:
        """Launch with these values; names and types are always the same, arrays C-contiguous."""
        if self._taichi() is not ti.lang.impl.get_runtime():
            runtime.start()  # the caller may have reset Taichi
            self._prepare(values)
        for name, value in values.items():
            if self._known[name] is not value:
                self._set(name, value)
        self._launch()

    def repeat(self, values: Mapping[str, Any]) -> None:
        """Launch with the values of the last launch, the same objects, without comparing them."""
        if self._taichi() is ti.lang.impl.get_runtime():
            self._launch()
        else:
            self(values)

    def _launch(self) -> None:
        if self._compiled is None:
            self._kernel(self._pack)
        else:
            with self._flushing:
                ti.lang.impl.get_runtime().prog.launch_kernel(self._compiled, self._context)

    def _prepare(self, values: Mapping[str, Any]) -> None:
        """Compile the kernel and make its pack, as Taichi does at a launch."""
        kind = _pack_type(tuple((name, *kind_of(value)) for name, value in values.items()))
        self._kernel = self._kernel_of(kind)
        taichi = ti.lang.impl.get_runtime()
        # `kind(**values)` would make two packs.
        self._pack = pack = _Pack(kind, dict(values))
        memory = pack._ArgPack__argpack
        finalize(pack, _delete, ref(taichi), memory).atexit = False
        lowered, compiled = _compile(self._kernel, pack)
        self._context = lowered.make_launch_context()
        self._context.set_arg_argpack((0,), memory)
        # A GPU copies arrays at each launch.
        self._compiled = compiled if taichi.prog.config().arch in (ti.x64, ti.arm64) else None
        # The context needs the arrays as further arguments after the pack.
        arrays = [name for name, value in values.items() if isinstance(value, np.ndarray)]
        self._places = {name: (1 + number,) for number, name in enumerate(arrays)}
        self._known = dict.fromkeys(values)
        self._taichi = ref(taichi)

    def _set(self, name: str, value: Any) -> None:
        """Pass a value to Taichi; skip the pack if the value has not changed."""
        # Taichi leaks some bytes for each value that is set again.
        known = self._pack[name]
        if known is not value and (isinstance(value, np.ndarray) or known != value):
            self._pack[name] = value
        if isinstance(value, np.ndarray):
            self._context.set_arg_external_array_with_shape(
                self._places[name], value.ctypes.data, value.nbytes, value.shape, 0
            )
        self._known[name] = value


class DeviceLaunch:
    """A kernel whose arguments are a few arrays on the device, `ti.ndarray`."""

    def __init__(self, kernel: Callable[..., None]) -> None:
        self._kernel = kernel
        self._taichi: Any = lambda: None  # the Taichi runtime for which the kernel was compiled
        self._flushing = runtime.Flushing()

    def __call__(self, arrays: Sequence[Any]) -> None:
        """Launch with arrays of the present Taichi runtime; it may return before the end."""
        taichi = ti.lang.impl.get_runtime()
        if self._taichi() is not taichi:
            self._lowered, self._compiled = _compile(self._kernel, *arrays)
            self._taichi = ref(taichi)
        # A context for each launch, because a GPU replaces the addresses in it by its own.
        context = self._lowered.make_launch_context()
        for place, array in enumerate(arrays):
            context.set_arg_ndarray((place,), array.arr)
        with self._flushing:
            taichi.prog.launch_kernel(self._compiled, context)


def _compile(kernel: Any, *arguments: Any) -> tuple[Any, Any]:
    """Return a kernel for these arguments, before and after its compilation by Taichi."""
    program, primal = ti.lang.impl.get_runtime().prog, kernel._primal
    try:
        with runtime.quiet():
            lowered = primal.compiled_kernels[primal.ensure_compiled(*arguments)]
            return lowered, program.compile_kernel(
                program.config(), program.get_device_caps(), lowered
            )
    except ti.TaichiCompilationError as error:  # only code of plugins causes one
        raise AntsError(
            f"Taichi cannot compile a kernel with your code: {last_line(error)}; try it with "
            "`taichi-ants check FILE`."
        ) from error


def last_line(error: Exception) -> str:
    """Return Taichi's error message in one line, without the place in the source."""
    text = str(error)
    outside = re.search(r"Out of bound access to a \[(\d+)\] matrix with index \[(-?\d+)\]", text)
    if outside:
        return "it uses index {1} of a vector of length {0}".format(*outside.groups())
    if "Out of bound" in text:
        return "it uses an index outside an array"
    *_, last = [line for line in text.splitlines() if line.strip()] or [type(error).__name__]
    return last.strip().rstrip(".?").rsplit("Error: ", 1)[-1]


class _Pack(ArgPack):
    """A pack whose memory is deleted by `_delete`, and that takes a fraction of the time to make.

    `places` are the numbers of its entries among those that are not arrays.
    """

    def __init__(self, kind: Any, values: dict[str, Any]) -> None:
        is_number = (not isinstance(t, ndarray_type.NdarrayType) for t in kind.members.values())
        self.places = list(accumulate(is_number, initial=0))
        super().__init__(kind.members, kind.dtype, values)

    def _calc_element_true_index(self, old_index: int) -> int:
        """Return the place of an entry; Taichi's own method makes n lists of n for each of n."""
        return self.places[old_index]

    def __del__(self) -> None:
        """Do nothing, because Taichi's own method crashes if its program no longer exists."""


def _delete(taichi: ref, memory: Any) -> None:
    """Delete the memory of a pack if its Taichi runtime is still active."""
    running = ti.lang.impl.get_runtime()
    program = getattr(running, "prog", None)
    if taichi() is running and program is not None:
        program.delete_argpack(memory)


def kind_of(value: Any) -> tuple[str, int]:
    """Return the name of a Taichi type, and the number of dimensions, 0 for a number."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype.kind}{8 * value.dtype.itemsize}", value.ndim
    if isinstance(value, np.uint64):
        return "u64", 0
    return ("i32" if isinstance(value, (int, np.integer)) else "f32"), 0


@cache
def _pack_type(kinds: tuple[tuple[str, str, int], ...]) -> Any:
    types = {}
    for name, kind, ndim in kinds:
        dtype = getattr(ti, kind)
        types[name] = ti.types.ndarray(dtype=dtype, ndim=ndim) if ndim else dtype
    return ti.types.argpack(**types)
