"""Prepares the process for Taichi before anything imports it."""

from __future__ import annotations

import os
import sys
import warnings
from contextlib import suppress


def prepare_for_taichi() -> None:
    """Set what Taichi reads from the environment when it is imported, unless the user has set it.

    No banner, no search for newer versions, no warning about an old function that Taichi calls, no
    message that this is a notebook. Without a HOME Taichi aborts, with one that cannot be written
    it crashes at exit: then HOME becomes a temporary folder for this process.
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
    """In a forked process, mark a Taichi that runs in the parent: its threads are not here."""
    with suppress(KeyError, AttributeError):  # Taichi is not imported, or not to its end
        sys.modules["taichi"].lang.impl.get_runtime().is_forked = True


def is_writable_folder(path: str) -> bool:
    """Whether there is a folder in which files can be made."""
    return os.path.isdir(path) and os.access(path, os.W_OK | os.X_OK)


def fallback_folder() -> str:
    """A folder among the temporary files that belongs to this user."""
    import tempfile

    user = os.getuid() if hasattr(os, "getuid") else 0
    folder = os.path.join(tempfile.gettempdir(), f"taichi_ants-{user}")
    with suppress(OSError):
        os.makedirs(folder, mode=0o700, exist_ok=True)
    if is_writable_folder(folder) and os.lstat(folder).st_uid == user:
        return folder
    return tempfile.mkdtemp(prefix="taichi_ants-")  # others could have put kernels in the usual one
