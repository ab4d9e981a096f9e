"""Atomic writing of files, and reading with limits on their size.

All functions raise an AntsError that names the file if it cannot be written or read. `archives`
stores arrays with metadata (.npz), and `tables` writes typed columns. A study records the files
that it reads, so that it can be planned again from copies.
"""

from __future__ import annotations

import codecs
import csv
import errno
import hashlib
import json
import math
import os
import secrets
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from taichi_ants.errors import AntsError, expect, shown

if sys.version_info >= (3, 11):
    import tomllib as tomllib
else:
    import tomli as tomllib  # noqa: F401

PathLike = str | os.PathLike[str]
_record: dict[str, bytes] | None = None  # of the files that a study reads before it starts
_copies: Mapping[str, Path] | None = None  # that are read in place of other files


def write_atomically(path: PathLike, writer: Callable[[BinaryIO], object]) -> None:
    """Write a file so that readers see either the old content or the complete new content.

    Replaces an existing file, follows symbolic links, and creates missing folders. Calls `writer`
    with a binary file and lets its exceptions pass through.
    """
    with writing(path):
        target = _target_of(path)
        if not target.parent.exists():
            target.parent.mkdir(parents=True, exist_ok=True)
        with unfinished(target) as temporary:
            with open(temporary, "wb") as file:
                writer(file)
            os.replace(temporary, target)


@contextmanager
def unfinished(target: Path) -> Iterator[Path]:
    """Yield a free path in the target's folder; the caller moves a complete file to the target.

    A file or folder that is still at this path is removed at the end. Its name begins with a dot.
    """
    temporary = target.parent / f".{secrets.token_hex(8)}.tmp"
    try:
        yield temporary
    finally:
        shutil.rmtree(temporary, ignore_errors=True)  # only removes folders
        with suppress(OSError):
            temporary.unlink()


def check_writable_file(path: PathLike) -> Path:
    """Return the path of a file that `write_atomically` can write; AntsError before long work.

    Creates nothing.
    """
    with writing(path):
        target = _target_of(path)
        folder = next(parent for parent in target.parents if parent.exists())
        # Permission bits do not show a full disk, or bind root.
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(bytes(4096))
    return Path(path)


def write_bytes(path: PathLike, content: bytes) -> None:
    """Write the content of a file."""
    write_atomically(path, lambda file: file.write(content))


def write_text(path: PathLike, text: str) -> None:
    """Write text as UTF-8, with its line ends unchanged."""
    write_bytes(path, text.encode("utf-8"))


def to_json(value: Any, indent: int | None = None) -> str:
    """Return the JSON text of a value, which may contain NumPy scalars, arrays and paths."""
    return json.dumps(value, indent=indent, ensure_ascii=False, default=_plain)


def checksum_of_json(value: Any) -> str:
    """Return the hexadecimal SHA-256 of a value as `to_json` writes it, with sorted keys."""
    plain = json.loads(to_json(value))
    return hashlib.sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, (np.generic, np.ndarray)) else os.fspath(value)


def write_csv(path: PathLike, rows: Iterable[Mapping[str, Any]], columns: Sequence[str]) -> None:
    """Write rows, which map columns to numbers or text, as comma-separated values with a header.

    Takes rows one by one. Floats are written exactly; None, NaN and missing keys as empty fields.
    Raises ValueError if a row has a key that is not a column.
    """

    def save(file: BinaryIO) -> None:
        text = codecs.getwriter("utf-8")(file)
        table = csv.DictWriter(text, fieldnames=columns, restval="", lineterminator="\n")
        table.writeheader()
        for row in rows:
            values = {n: v.item() if isinstance(v, np.generic) else v for n, v in row.items()}
            table.writerow({n: None if v != v else v for n, v in values.items()})

    write_atomically(path, save)


@contextmanager
def opened(path: PathLike, most: float = math.inf) -> Iterator[BinaryIO]:
    """Yield a regular file of at most `most` bytes, open for reading; AntsError for others.

    Pipes could block forever, and devices have no end.
    """
    expect("path", path, str, os.PathLike)
    try:
        # Without O_NONBLOCK, opening a pipe would wait for a writer.
        no_wait = getattr(os, "O_NONBLOCK", 0)
        copy = place_of(path)
        with open(copy, "rb", opener=lambda name, flags: os.open(name, flags | no_wait)) as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode):
                raise OSError("it is a device or a pipe")
            if status.st_size > most:
                raise OSError(f"it has {status.st_size} bytes, and at most {most} are allowed")
            if _record is not None:
                _record[os.fspath(path)] = file.read()
                file.seek(0)
            yield file
    except AntsError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a name that no file has
        raise AntsError(
            f"cannot read {named(path)}: {_reason(error)}; name another file."
        ) from error


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
    """Return a context in which this package reads copies instead of the files of these paths.

    Other files cannot be read while `recorded` records them.
    """
    global _copies
    before, _copies = _copies, copies
    try:
        yield
    finally:
        _copies = before


def place_of(path: PathLike) -> PathLike:
    """Return the copy to read instead of a file, or its path; AntsError if it cannot be read."""
    copy = (_copies or {}).get(os.fspath(path))
    if copy is None and _copies is not None and _record is not None:
        raise AntsError(
            f"the study reads {named(path)}, which its archive does not contain; get another copy "
            "of the archive."
        )
    return copy or path


def read_text(path: PathLike, most: int = 1 << 26) -> str:
    """Return the text of a UTF-8 file of at most `most` bytes; all its line ends become "\\n"."""
    with opened(path, most) as file:
        content = file.read(os.fstat(file.fileno()).st_size)
    try:
        text = content.decode("utf-8").removeprefix("\ufeff")  # which some editors add
        return text.replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeError as error:
        raise AntsError(f"{named(path)} is not UTF-8 text; name another file.") from error


def small(array: np.ndarray) -> np.ndarray:
    """Return integers as the smallest signed type that holds them.

    Signed, so that the type of joined blocks does not depend on how runs were cut into blocks.
    """
    low, high = int(array.min(initial=0)), int(array.max(initial=0))
    return array.astype(np.min_scalar_type(min(low, -1 - high)))


@contextmanager
def writing(path: PathLike) -> Iterator[None]:
    """Return a context that turns errors of the operating system into an AntsError."""
    try:
        yield
    except AntsError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a name that no file has
        full = getattr(error, "errno", None) in (errno.ENOSPC, errno.EDQUOT)
        more = "free some space and run the command again, or " if full else ""
        raise AntsError(
            f"cannot write {named(path)}: {_reason(error)}; {more}choose another place."
        ) from error


def _target_of(path: PathLike) -> Path:
    """Return the file at the end of all links; raise AntsError if it exists and is not regular."""
    expect("path", path, str, os.PathLike)
    target = Path(os.path.realpath(path))
    # Replacing a device, a pipe or a folder would destroy it or fail.
    if str(path).endswith(os.sep) or (target.exists() and not target.is_file()):
        raise AntsError(f"{named(path)} is not a regular file; name a file to write to.")
    return target


def named(path: PathLike) -> str:
    """Return a path as messages show it."""
    return shown(str(path), 400)


def _reason(error: Exception) -> str:
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return text[:1].lower() + text[1:]
