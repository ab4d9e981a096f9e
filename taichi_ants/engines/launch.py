"""Kernel launches with argument packs: arrays and numbers as one argument."""

import re
from collections.abc import Callable, Collection, Iterable, Mapping
from contextlib import nullcontext
from functools import cache
from itertools import accumulate
from typing import Any
from weakref import finalize, ref

import numpy as np
import taichi as ti
from taichi._lib import core
from taichi.lang import impl
from taichi.lang.argpack import ArgPack
from taichi.types import ndarray_type

from taichi_ants import runtime
from taichi_ants.arithmetic.guards import guarded
from taichi_ants.engines.device_memory import copy_in, copy_out, room_for
from taichi_ants.errors import AntsError

_ARRAYS = np.ndarray, ti.Ndarray
_ZERO = "zero"  # the number in packs for the guards
_launch_kernel = core.Program.launch_kernel.__func__  # a call of the method takes 0.06 us longer


class Launch:
    """A kernel whose one argument is a pack of named values, or a single array.

    Taichi spends 10 microseconds per array on each launch. On the CPU this class spends them once.
    A pack takes over a millisecond to make, so it is reused until Taichi is reset. A launch with a
    pack takes 0.3 microseconds longer, so a single value, an array, is passed without one.

    `kernel_of` returns the kernel for a pack type. Packs contain NumPy arrays, which kernels change
    in place; arrays of `ti.ndarray`; whole numbers, as i32, or u64 for `np.uint64`; and floats, as
    f32. For a GPU, kernels are compiled with the guards of `arithmetic.guards`, and each launch
    copies NumPy arrays to the GPU, except those of `outputs`, and `outputs` and the `changed` ones
    back, by default all.
    """

    def __init__(
        self,
        kernel_of: Callable[[Any], Any],
        changed: Collection[str] | None = None,
        outputs: Collection[str] = (),
    ) -> None:
        self._kernel_of, self._outputs = kernel_of, outputs
        self._back = None if changed is None else {*changed, *outputs}
        self._copies: dict[str, Any] = {}  # of NumPy arrays, on a GPU
        self._taichi: Any = lambda: None  # the Taichi runtime for which the launch was prepared
        self._repeats: Any = self._taichi  # the same, if the launch needs nothing else
        # Not a reference to its program, which would outlive a reset of Taichi.
        self._compiled: Any = None
        self._known: dict[str, Any] = {}  # the present values of the pack and the context
        self._flushing, self._leaves = runtime.Flushing(), False

    def __call__(self, values: Mapping[str, Any]) -> None:
        """Launch with these values; names and types are always the same, arrays C-contiguous."""
        if self._taichi() is not impl.get_runtime():
            with runtime.alone:
                runtime.start()  # the caller may have reset Taichi
                check_not_lost(values.values())
                self._prepare(values)
        for name, value in values.items():
            if self._known[name] is not value:
                self._set(name, value)
        self._launch()

    def repeat(self, values: Mapping[str, Any]) -> None:
        """Launch with the values of the last launch, the same objects, without comparing them.

        The kernel must compute with whole numbers only, because subnormal numbers are not flushed.
        Any thread may call this method, because a launch keeps Python's lock.
        """
        running = impl.get_runtime()
        if self._repeats() is running:
            _launch_kernel(running.prog, self._compiled, self._context)
        else:
            with runtime.alone:
                self(values)

    def without_outputs(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Launch likewise, but return the outputs as they are on the GPU; none on a CPU."""
        self._leaves = True
        try:
            self(values)
        finally:
            self._leaves = False
        return {name: self._copies.pop(name) for name in self._outputs if name in self._copies}

    def _launch(self) -> None:
        if self._renews:
            # A launch on a CPU replaces the pointers of `ti.ndarray` in its context.
            self._context = self._new_context()
            for name, place in self._places.items():
                _pass(self._context, place, self._on_device(name))
        with self._flushing:
            impl.get_runtime().prog.launch_kernel(self._compiled, self._context)
        for name, copy in self._copies.items():
            leaves = self._leaves and name in self._outputs
            if not leaves and (self._back is None or name in self._back):
                copy_out(copy, self._known[name])

    def _on_device(self, name: str) -> Any:
        """Return an array, or for a GPU a copy on it of one of NumPy."""
        value = self._known[name]
        if not (self._for_gpu and isinstance(value, np.ndarray)):
            return value
        copy = self._copies.get(name)
        if copy is None or copy.shape != value.shape:
            copy = self._copies[name] = room_for(value)
        if name not in self._outputs:
            copy_in(value, copy)
        return copy

    def _prepare(self, values: Mapping[str, Any]) -> None:
        """Compile the kernel and make its pack, as Taichi does at a launch."""
        self._for_gpu = for_gpu = runtime.compiles_for_gpu()
        self._copies = {}
        self._renews = for_gpu or any(isinstance(value, ti.Ndarray) for value in values.values())
        if for_gpu:
            values = {**values, _ZERO: 0}
        kind = _argument_type(tuple((name, *type_of(value)) for name, value in values.items()))
        taichi = impl.get_runtime()
        program, kernel = taichi.prog, self._kernel_of(kind)._primal
        (argument, *others), self._pack = values.values(), dict(values)
        if others:
            # `kind(**values)` would make two packs.
            self._pack = argument = _Pack(kind, self._pack)
            finalize(argument, _delete, ref(taichi), argument._ArgPack__argpack).atexit = False
        config = program.config()
        try:
            guards = guarded(0, argument.places[-2]) if for_gpu else nullcontext()
            with runtime.quiet(), guards:
                lowered = kernel.compiled_kernels[kernel.ensure_compiled(argument)]
                compiled = program.compile_kernel(config, program.get_device_caps(), lowered)
        except ti.TaichiCompilationError as error:  # only code of plugins causes one
            raise AntsError(
                f"Taichi cannot compile a kernel with your code: {last_line(error)}; try it with "
                "`taichi-ants check FILE`."
            ) from error
        self._lowered, self._compiled = lowered, compiled
        self._context = self._new_context()
        # The context needs the arrays as further arguments after the pack.
        arrays = (name for name, value in values.items() if isinstance(value, _ARRAYS))
        self._places = {name: (number,) for number, name in enumerate(arrays, bool(others))}
        self._known = dict.fromkeys(values)
        self._taichi = ref(taichi)
        self._repeats = self._taichi if not self._renews else lambda: None

    def _new_context(self) -> Any:
        """Return a context for launches with the pack, still without the arrays."""
        context = self._lowered.make_launch_context()
        if isinstance(self._pack, _Pack):
            context.set_arg_argpack((0,), self._pack._ArgPack__argpack)
        return context

    def _set(self, name: str, value: Any) -> None:
        """Pass a value to Taichi; skip the pack if the value has not changed."""
        # Taichi leaks some bytes for each value that is set again.
        known = self._pack[name]
        if known is not value and (isinstance(value, _ARRAYS) or known != value):
            self._pack[name] = value
        if isinstance(value, _ARRAYS) and not self._renews:
            _pass(self._context, self._places[name], value)
        self._known[name] = value


def has_guards(arguments: Any) -> bool:
    """Return whether a kernel with this type of pack is compiled for a GPU."""
    return _ZERO in getattr(arguments, "members", ())


def check_not_lost(values: Iterable[Any]) -> None:
    """Raise AntsError if Taichi was reset after one of the values came to the device."""
    running = impl.get_runtime()
    if any(getattr(value, "taichi", lambda: running)() is not running for value in values):
        raise AntsError(
            "Taichi was reset, which destroys environments on a GPU; create them again."
        )


def call(kernel: Any, *arguments: Any) -> None:
    """Launch a kernel with these arguments and a last one, 0, with which it has guards on a GPU."""
    guards = guarded(len(arguments)) if runtime.compiles_for_gpu() else nullcontext()
    with runtime.quiet(), guards:
        kernel(*arguments, 0)


def _pass(context: Any, place: tuple[int], array: Any) -> None:
    if isinstance(array, np.ndarray):
        address, size = array.ctypes.data, array.nbytes
        context.set_arg_external_array_with_shape(place, address, size, array.shape, 0)
    else:
        context.set_arg_ndarray(place, array.arr)


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
    running = impl.get_runtime()
    program = getattr(running, "prog", None)
    if taichi() is running and program is not None:
        program.delete_argpack(memory)


def type_of(value: Any) -> tuple[str, int]:
    """Return the name of a Taichi type, and the number of dimensions, 0 for a number."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype.kind}{8 * value.dtype.itemsize}", value.ndim
    if isinstance(value, ti.Ndarray):
        return value.dtype.to_string(), len(value.shape)
    if isinstance(value, np.uint64):
        return "u64", 0
    return ("i32" if isinstance(value, (int, np.integer)) else "f32"), 0


@cache
def _argument_type(kinds: tuple[tuple[str, str, int], ...]) -> Any:
    types = {}
    for name, kind, ndim in kinds:
        dtype = getattr(ti, kind)
        types[name] = ti.types.ndarray(dtype=dtype, ndim=ndim) if ndim else dtype
    return ti.types.argpack(**types) if len(types) > 1 else types.popitem()[1]
