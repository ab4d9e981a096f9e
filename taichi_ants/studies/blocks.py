"""Blocks: finished pieces of work in files, taken again only as what they must be."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from taichi_ants import files
from taichi_ants.files import archives
from taichi_ants.studies.command_line import notice

Outcome = dict[str, np.ndarray]  # by name
_ABOUT = "about"


class Form(NamedTuple):
    """How an array of a block must be.

    Attributes:
        dtype: Its type, or a kind of types.
        shape: Its shape.
        least, most: Between which its numbers lie; all are finite.
    """

    dtype: type
    shape: tuple[int, ...]
    least: float = -math.inf
    most: float = math.inf

    @property
    def bounded(self) -> np.dtype:
        """The type of `files.smallest` that holds all of its numbers, where no end is 32 bits."""
        if self.dtype is not np.integer:
            return np.dtype(self.dtype)
        ends = max(self.least, -(2**31)), min(self.most, 2**31 - 1)
        return files.smallest(np.array(ends, np.int64)).dtype

    @property
    def nbytes(self) -> int:
        """How many it takes at most, of such numbers."""
        return math.prod(self.shape) * self.bounded.itemsize

    def fits(self, array: np.ndarray) -> bool:
        """Whether an array is so."""
        if not np.issubdtype(array.dtype, self.dtype) or array.shape != self.shape:
            return False
        finite = np.isfinite(array).all()
        return bool(finite and (array >= self.least).all() and (array <= self.most).all())


def kept(path: Path, about: Any, forms: Mapping[str, Form], make: Callable[[], Outcome]) -> Outcome:
    """What a block holds; what is missing is made and kept, what is not as it must be, made anew.

    Args:
        path: Of the block (.npz).
        about: All that determines it, as `files.to_json` knows it.
        forms: Of each of its arrays.
        make: Makes them.

    Raises:
        AntsError: It cannot be written.
    """
    digest = hashlib.sha256(files.to_json(about).encode()).hexdigest()
    if path.exists():
        block = _read(path, digest, forms)
        if block is not None:
            return block
        notice(f"{str(path)!r} is damaged or of other work, so it is done anew.")
    made = make()
    archives.write(path, {**made, _ABOUT: np.array(digest)}, compress=False)
    return made


def _read(path: Path, digest: str, forms: Mapping[str, Form]) -> Outcome | None:
    """The arrays of a block, if it is of this work and each has its form."""
    try:
        block = archives.read(path)
        ours = str(block.pop(_ABOUT, "")) == digest
    except ValueError:  # of which AntsError is one
        return None
    fits = block.keys() == forms.keys() and all(forms[n].fits(one) for n, one in block.items())
    return block if ours and fits else None
