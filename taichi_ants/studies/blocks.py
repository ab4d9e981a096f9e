"""Blocks: files with finished parts of a study, which are reused only for the same work."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants import files
from taichi_ants.files import archives
from taichi_ants.studies.command_line import notice

Outcome = dict[str, np.ndarray]  # by name
_ABOUT = "about"


def kept(path: Path, about: Any, make: Callable[[], Outcome]) -> Outcome:
    """Return the arrays of a block (.npz); make and save them if they are missing or damaged.

    `about` is everything that determines them. Raises AntsError if the file cannot be written.
    """
    digest = hashlib.sha256(files.to_json(about).encode()).hexdigest()
    if path.exists():
        try:
            block = archives.read(path)
        except ValueError:  # includes AntsError
            block = {}
        if str(block.pop(_ABOUT, "")) == digest:
            return block
        notice(f"{str(path)!r} is damaged or has other settings, so it is computed again.")
    made = make()
    archives.write(path, {**made, _ABOUT: np.array(digest)}, compress=False)
    return made


def read(path: Path) -> Outcome:
    """Return the arrays of a finished block; raise AntsError if it cannot be read."""
    return {name: array for name, array in archives.read(path).items() if name != _ABOUT}
