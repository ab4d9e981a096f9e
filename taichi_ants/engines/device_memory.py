"""Copies between NumPy arrays and the memory of a device, such as a GPU.

Taichi itself would copy each NumPy array into fresh memory and back at every launch, whether or not
the kernel reads or changes it.
"""

from __future__ import annotations

import ctypes
import sys
from functools import cache
from typing import Any
from weakref import ref

import numpy as np
import taichi as ti

from taichi_ants.errors import AntsError

_MULTIPROCESSORS = 16  # CU_DEVICE_ATTRIBUTE_MULTIPROCESSOR_COUNT


def room_for(array: np.ndarray) -> ti.Ndarray:
    """Return an array of zeros on the device, of the shape and type of a NumPy array."""
    kind = f"{array.dtype.kind}{8 * array.dtype.itemsize}"
    room = ti.ndarray(getattr(ti, kind), array.shape)
    room.taichi = ref(ti.lang.impl.get_runtime())
    return room


def on_device(array: np.ndarray) -> ti.Ndarray:
    """Return a copy of an array that stays on the device between launches."""
    copy_in(array, copy := room_for(array))
    return copy


def copy_in(array: np.ndarray, memory: ti.Ndarray, place: int = 0) -> None:
    """Copy an array, C-contiguous, into the memory from a place on."""
    _copy(_address(memory, place, array), array.ctypes.data, array.nbytes, "cuMemcpyHtoD_v2")


def copy_out(memory: ti.Ndarray, array: np.ndarray, place: int = 0) -> None:
    """Fill an array, C-contiguous, from a place in the memory on."""
    _copy(array.ctypes.data, _address(memory, place, array), array.nbytes, "cuMemcpyDtoH_v2")


def _address(memory: ti.Ndarray, place: int, array: np.ndarray) -> int:
    program = ti.lang.impl.get_runtime().prog
    program.synchronize()
    return program.get_ndarray_data_ptr_as_int(memory.arr) + place * array.itemsize


def _copy(to: int, source: int, size: int, function: str) -> None:
    if ti.lang.impl.current_cfg().arch != ti.cuda:
        ctypes.memmove(to, source, size)
        return
    # Taichi has made the context of the GPU the current one.
    copy = getattr(_driver(), function)
    status = copy(ctypes.c_void_p(to), ctypes.c_void_p(source), ctypes.c_size_t(size))
    if status:
        raise AntsError(f"the GPU cannot copy {size} bytes: its driver reports error {status}.")


def multiprocessors() -> int:
    """Return the number of multiprocessors of the GPU on which Taichi runs, or 0 on a CPU."""
    device, number = ctypes.c_int(), ctypes.c_int()
    if ti.lang.impl.current_cfg().arch == ti.cuda:
        _driver().cuCtxGetDevice(ctypes.byref(device))
        _driver().cuDeviceGetAttribute(ctypes.byref(number), _MULTIPROCESSORS, device)
    return number.value


@cache
def _driver() -> Any:
    """Return the driver of the GPU, which Taichi has loaded."""
    return ctypes.CDLL("nvcuda.dll" if sys.platform == "win32" else "libcuda.so")
