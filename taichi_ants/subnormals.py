"""Subnormal numbers: kernels flush them to zero, the caller's own arithmetic does not.

On x86-64, Taichi sets the processor's flag for this in the thread that starts it and in its own
threads. Kernels also compute in the calling thread, so the flag is set there while they run.
"""

from __future__ import annotations

import ctypes
import platform
from typing import Any

_FLUSHES = 5, 0x80  # a byte of `femode_t` and the bit in it: "flush to zero" of MXCSR


def _modes() -> tuple[Any, Any]:
    """Return the functions that read and set the modes of this thread's floats, if it has any."""
    try:
        if platform.machine() != "x86_64":
            raise OSError
        library = ctypes.PyDLL("libm.so.6")
        several = library.fegetmode, library.fesetmode
    except (OSError, AttributeError):  # no such flag, or another C library
        return (lambda modes: None,) * 2
    for one in several:
        one.argtypes = (ctypes.c_void_p,)
    return several


_read, _set = _modes()


class Flushing:
    """A context in which this thread flushes subnormal numbers to zero, as those of Taichi do."""

    def __init__(self) -> None:
        self._buffers = kept, flushing = (ctypes.c_ubyte * 16)(), (ctypes.c_ubyte * 16)()
        self._kept, self._flushing = map(ctypes.addressof, self._buffers)
        _read(self._kept)
        flushing[:] = kept[:]
        flushing[_FLUSHES[0]] |= _FLUSHES[1]

    def __enter__(self) -> None:
        _read(self._kept)
        _set(self._flushing)

    def __exit__(self, *_: object) -> None:
        _set(self._kept)
