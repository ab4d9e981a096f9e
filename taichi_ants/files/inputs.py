"""The files that a study reads before it starts: a record of them, and copies in their place."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from taichi_ants.errors import AntsError, shown

_record: dict[str, bytes] | None = None
_copies: Mapping[str, Path] | None = None


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
    """Yield to a block in which this package reads copies instead of the files of these paths.

    Other files cannot be read while `recorded` records them.
    """
    global _copies
    before, _copies = _copies, copies
    try:
        yield
    finally:
        _copies = before


def place_of(path: str | os.PathLike[str]) -> str | os.PathLike[str]:
    """Return the path of the copy to read instead of a file, or the path itself.

    Raises:
        AntsError: The file is one of those that a study reads, and only copies of others are
            allowed.
    """
    copy = (_copies or {}).get(os.fspath(path))
    if copy is None and _copies is not None and _record is not None:
        raise AntsError(
            f"the study reads {shown(os.fspath(path), 400)}, which its archive does not contain; "
            "get another copy of the archive."
        )
    return copy or path


def note(path: str | os.PathLike[str], file: BinaryIO) -> None:
    """Add an opened file to the record, if there is one."""
    if _record is not None:
        _record[os.fspath(path)] = file.read()
        file.seek(0)
