"""Argument packs: all arrays and numbers of a kernel as one argument, declared by what they are."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any
from weakref import WeakKeyDictionary, finalize, ref

import numpy as np
import taichi as ti
from taichi.lang.argpack import ArgPack

from taichi_ants import runtime


class Arguments:
    """Arrays and numbers, as the one argument by which kernels find them by their names.

    It takes over a millisecond to make a pack, so that it is kept until its Taichi ends.
    """

    def __init__(self) -> None:
        self._pack: Any = None
        self._values: dict[str, Any] = {}
        self._taichi: Any = lambda: None  # that the pack was made in, as a weak reference

    @staticmethod
    def type_of(values: Mapping[str, Any]) -> Any:
        """The type of the pack of these values, to annotate the kernel's argument.

        NumPy arrays, on which kernels work in place; whole numbers, for kernels i32, or u64 if they
        are `np.uint64`; and floats, for kernels f32.
        """
        return _pack_type(tuple((name, _kind(value)) for name, value in values.items()))

    def pack(self, values: Mapping[str, Any]) -> Any:
        """The pack of these values; names and types are the same in each call."""
        kind = self.type_of(values)
        taichi = ti.lang.impl.get_runtime()
        if self._taichi() is not taichi:
            self._values, self._taichi = dict(values), ref(taichi)
            # As `kind(**values)`, which makes two packs.
            self._pack = _Pack(kind.members, kind.dtype, dict(values))
            memory = self._pack._ArgPack__argpack
            finalize(self._pack, _delete, self._taichi, memory).atexit = False
        for name, value in values.items():
            known = self._values[name]
            # Each number that is told again would cost Taichi some bytes for good.
            if known is not value and (isinstance(value, np.ndarray) or known != value):
                self._pack[name] = self._values[name] = value
        return self._pack


class Launch:
    """A kernel of one argument pack, launched again and again.

    For each launch Taichi looks at every array anew, 10 microseconds each; here, on the CPU, once.
    """

    def __init__(self, kernel: Callable[[Any], None]) -> None:
        self._kernel, self._arguments = kernel, Arguments()
        self._taichi: Any = lambda: None  # in which the launch was prepared
        # No reference to its program, which would outlive a reset of Taichi.
        self._compiled: Any = None
        self._context: Any = None
        self._known: dict[str, Any] = {}  # the values that it has

    def __call__(self, values: Mapping[str, Any]) -> None:
        """Launch on these values, arrays C-contiguous; names and types stay the same."""
        if self._taichi() is not ti.lang.impl.get_runtime():
            runtime.start()  # somebody may have reset Taichi
            self._prepare(values)
        known = self._known
        for name, value in values.items():
            if known[name] is not value:
                self._set(values)
                break
        if self._compiled is None:
            self._kernel(self._arguments.pack(values))
        else:
            ti.lang.impl.get_runtime().prog.launch_kernel(self._compiled, self._context)

    def _prepare(self, values: Mapping[str, Any]) -> None:
        """Compile the kernel, as Taichi would; elsewhere than on the CPU Taichi launches it."""
        taichi = ti.lang.impl.get_runtime()
        kernel, program = self._kernel._primal, taichi.prog  # type: ignore[attr-defined]
        pack = self._arguments.pack(values)
        with runtime.quiet():
            one = kernel.compiled_kernels[kernel.ensure_compiled(pack)]
            compiled = program.compile_kernel(program.config(), program.get_device_caps(), one)
        self._context = one.make_launch_context()
        self._context.set_arg_argpack((0,), pack._ArgPack__argpack)
        on_cpu = program.config().arch in (ti.x64, ti.arm64)
        self._compiled = compiled if on_cpu else None  # else arrays move for each launch
        self._taichi, self._known = ref(taichi), dict.fromkeys(values)

    def _set(self, values: Mapping[str, Any]) -> None:
        """Tell what has changed; the arrays of a pack are arguments of their own behind it."""
        self._arguments.pack(values)
        arrays = [name for name, value in values.items() if isinstance(value, np.ndarray)]
        for number, name in enumerate(arrays):
            array = values[name]
            if self._known[name] is not array:
                self._context.set_arg_external_array_with_shape(
                    (1 + number,), array.ctypes.data, array.nbytes, array.shape, 0
                )
        self._known = dict(values)


_LAUNCHED: WeakKeyDictionary[Any, set] = WeakKeyDictionary()


def compile_once(kernel: Callable[[Any], None], nothing: Callable[[], Any]) -> None:
    """Launch a kernel on arguments that are no work, unless the Taichi that runs has done so."""
    launched = _LAUNCHED.setdefault(ti.lang.impl.get_runtime(), set())
    if kernel not in launched:
        with runtime.quiet():
            kernel(nothing())
        launched.add(kernel)


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
