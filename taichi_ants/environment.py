"""Prepares the process for Taichi before anything imports it."""

from __future__ import annotations

import os
import tempfile


def prepare_for_taichi() -> None:
    """Set what Taichi reads from the environment when it is imported, unless the user has set it.

    No banner on standard output, no thread that asks a server for newer versions. Without a HOME
    Taichi aborts, with one that cannot be written it crashes at exit: then HOME becomes a temporary
    folder for this process.
    """
    os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")
    os.environ.setdefault("TI_SKIP_VERSION_CHECK", "ON")
    if not is_writable_folder(os.environ.get("HOME", "")):
        os.environ["HOME"] = fallback_folder()


def is_writable_folder(path: str) -> bool:
    """Whether files can be made there."""
    return bool(path) and os.path.isdir(path) and os.access(path, os.W_OK | os.X_OK)


def fallback_folder() -> str:
    """A folder of this user's among the temporary files."""
    user = os.getuid() if hasattr(os, "getuid") else "user"
    folder = os.path.join(tempfile.gettempdir(), f"taichi_ants-{user}")
    try:
        os.makedirs(folder, mode=0o700, exist_ok=True)
    except OSError:
        folder = ""
    return folder if is_writable_folder(folder) else tempfile.mkdtemp(prefix="taichi_ants-")
