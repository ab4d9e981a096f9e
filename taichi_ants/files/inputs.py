"""The files that a study reads before it starts: a record of them, and copies in their place."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

_record: dict[str, bytes] | None = None
_copies: dict[str, Path] = {}


@contextmanager
def recorded() -> Iterator[dict[str, bytes]]:
    """Yield a mapping that gets the content of each file that this package reads, by its path."""
    global _record
    before, _record = _record, {}
    try:
        yield _record
    finally:
        _record = before


@contextmanager
def replaced(copies: Mapping[str, Path]) -> Iterator[None]:
    """Yield to a block in which this package reads copies instead of the files of these paths."""
    before = dict(_copies)
    _copies.update(copies)
    try:
        yield
    finally:
        _copies.clear()
        _copies.update(before)


def place_of(path: str | os.PathLike[str]) -> str | os.PathLike[str]:
    """Return the path of the copy to read instead of a file, or the path itself."""
    return _copies.get(os.fspath(path), path)


def note(path: str | os.PathLike[str], file: BinaryIO) -> None:
    """Add an opened file to the record, if there is one."""
    if _record is not None:
        _record[os.fspath(path)] = file.read()
        file.seek(0)
