"""Launches of kernels on argument packs: arrays and numbers as one argument."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any
from weakref import finalize, ref

import numpy as np
import taichi as ti
from taichi.lang.argpack import ArgPack

from taichi_ants import runtime


class Launch:
    """A kernel whose one argument is a pack, in which it finds values by their names.

    For each launch Taichi looks at every array anew, 10 microseconds each; here, on the CPU, once.
    It takes over a millisecond to make a pack, so that it is kept until its Taichi ends.

    `kernel_of` returns the kernel of a type of pack: with NumPy arrays, on which kernels work in
    place; whole numbers, i32, or u64 if they are `np.uint64`; and floats, f32.
    """

    def __init__(self, kernel_of: Callable[[Any], Callable[[Any], None]]) -> None:
        self._kernel_of = kernel_of
        self._taichi: Any = lambda: None  # in which the launch was prepared
        # No reference to its program, which would outlive a reset of Taichi.
        self._compiled: Any = None
        self._kernel: Any
        self._context: Any
        self._pack: Any
        self._known: dict[str, Any] = {}  # the values that the pack and the context have

    def __call__(self, values: Mapping[str, Any]) -> None:
        """Launch on these values, arrays C-contiguous; names and types stay the same."""
        if self._taichi() is not ti.lang.impl.get_runtime():
            runtime.start()  # somebody may have reset Taichi
            self._prepare(values)
        for name, value in values.items():
            if self._known[name] is not value:
                self._set(name, value)
        if self._compiled is None:
            self._kernel(self._pack)
        else:
            ti.lang.impl.get_runtime().prog.launch_kernel(self._compiled, self._context)

    def _prepare(self, values: Mapping[str, Any]) -> None:
        """Compile the kernel, as Taichi would; elsewhere than on the CPU Taichi launches it."""
        kind = _pack_type(tuple((name, _kind(value)) for name, value in values.items()))
        self._kernel = self._kernel_of(kind)
        taichi = ti.lang.impl.get_runtime()
        program, kernel = taichi.prog, self._kernel._primal
        # As `kind(**values)`, which makes two packs.
        self._pack = pack = _Pack(kind.members, kind.dtype, dict(values))
        memory = pack._ArgPack__argpack
        finalize(pack, _delete, ref(taichi), memory).atexit = False
        with runtime.quiet():
            one = kernel.compiled_kernels[kernel.ensure_compiled(pack)]
            compiled = program.compile_kernel(program.config(), program.get_device_caps(), one)
        self._context = one.make_launch_context()
        self._context.set_arg_argpack((0,), memory)
        on_cpu = program.config().arch in (ti.x64, ti.arm64)
        self._compiled = compiled if on_cpu else None  # else arrays move for each launch
        # Arrays of a pack are arguments of their own behind it, which the context lacks.
        arrays = [name for name, value in values.items() if isinstance(value, np.ndarray)]
        self._places = {name: (1 + number,) for number, name in enumerate(arrays)}
        self._known = dict.fromkeys(values)
        self._taichi = ref(taichi)

    def _set(self, name: str, value: Any) -> None:
        """Tell Taichi of a value that may have changed."""
        # Each value that is told again would cost Taichi some bytes for good.
        known = self._pack[name]
        if known is not value and (isinstance(value, np.ndarray) or known != value):
            self._pack[name] = value
        if isinstance(value, np.ndarray):
            self._context.set_arg_external_array_with_shape(
                self._places[name], value.ctypes.data, value.nbytes, value.shape, 0
            )
        self._known[name] = value


class _Pack(ArgPack):
    """A pack whose memory is deleted by `_delete`."""

    def __del__(self) -> None:
        """Not as Taichi, which would delete that of a program that is gone, and end the process."""


def _delete(taichi: ref, memory: Any) -> None:
    """Delete the memory of a pack, if the Taichi that it was made in still runs."""
    running = ti.lang.impl.get_runtime()
    program = getattr(running, "prog", None)
    if taichi() is running and program is not None:
        program.delete_argpack(memory)


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
