"""Preparation of the process for Taichi, before Taichi is imported."""

from __future__ import annotations

import os
import sys
import warnings
from contextlib import suppress
from functools import cache


def prepare_for_taichi() -> None:
    """Set the environment variables that Taichi reads at import, unless the user has set them.

    This turns off its banner, its version check, its warning about a deprecated function, and its
    notebook message. Taichi aborts without a HOME, and crashes at exit if HOME is not writable, so
    HOME then becomes a temporary folder for this process.
    """
    warnings.filterwarnings("ignore", ".*getlocale", DeprecationWarning, r"taichi\._lib\.utils")
    if hasattr(os, "register_at_fork"):
        os.register_at_fork(after_in_child=_mark_forked_taichi)
    os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")
    os.environ.setdefault("TI_SKIP_VERSION_CHECK", "ON")
    os.environ.setdefault("TI_ENABLE_PYBUF", "0")
    if not is_writable_folder(os.environ.get("HOME", "")):
        os.environ["HOME"] = fallback_folder()


def _mark_forked_taichi() -> None:
    """Mark the parent's Taichi in a forked process, which does not have Taichi's threads."""
    with suppress(KeyError, AttributeError):  # Taichi is not, or not completely, imported
        sys.modules["taichi"].lang.impl.get_runtime().is_forked = True


def is_writable_folder(path: str) -> bool:
    """Return whether the path is a folder in which this process can create files."""
    return os.path.isdir(path) and os.access(path, os.W_OK | os.X_OK)


@cache
def fallback_folder() -> str:
    """Return a new temporary folder, in which other users cannot plant kernels."""
    import tempfile

    return tempfile.mkdtemp(prefix="taichi_ants-")
