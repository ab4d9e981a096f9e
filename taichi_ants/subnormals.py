"""Subnormal numbers: kernels flush them to zero, the caller's own arithmetic does not.

On x86-64, Taichi sets the processor's flag for this in the thread that starts it and in its own
threads. Kernels also compute in the calling thread, so the flag is set there while they run.
"""

import ctypes
import platform
from typing import Any

_Modes = ctypes.c_uint32 * 4  # C's `femode_t`; the second number is MXCSR
_FLUSH_TO_ZERO = 1 << 15
_read: Any = lambda modes: None  # noqa: E731
_set: Any = _read
if platform.machine() == "x86_64" and platform.libc_ver()[0] == "glibc":
    _read, _set = (getattr(ctypes.PyDLL("libm.so.6"), f"fe{does}mode") for does in ("get", "set"))


class Flushing:
    """A context in which this thread flushes subnormal numbers to zero, as those of Taichi do."""

    def __init__(self) -> None:
        self._kept, self._flushing = _Modes(), _Modes()
        _read(self._flushing)
        self._flushing[1] |= _FLUSH_TO_ZERO

    def __enter__(self) -> None:
        _read(self._kept)
        _set(self._flushing)

    def __exit__(self, *_: object) -> None:
        _set(self._kept)
