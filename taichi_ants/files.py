"""Files: written whole or not at all, read with limits, and errors that name the file."""

from __future__ import annotations

import codecs
import csv
import hashlib
import io
import json
import math
import os
import secrets
import shutil
import stat
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from taichi_ants.errors import AntsError, expect, shown

PathLike = str | os.PathLike[str]
_HEX = 16 * "[0-9a-f]"
HALF_WRITTEN = f".{_HEX}.{_HEX}.tmp"  # how a file is called until it is whole
_SECONDS_TO_LOCK = 1.0  # within which one that is made is locked, see `unfinished`


def write_atomically(path: PathLike, writer: Callable[[BinaryIO], None]) -> None:
    """Write a file so that readers see the old content or all of the new one, never a part.

    Args:
        path: The file. One that exists is replaced; a symbolic link is followed.
        writer: Called once with a binary file to write to. It lies in the same folder until it is
            complete and is removed if the writer raises, see `unfinished`.

    Raises:
        AntsError: The file cannot be written. Other exceptions of the writer pass through.
    """
    with writing(path):
        target = _target_of(path)
        with unfinished(target, partial(Path.touch, exist_ok=False)) as place:
            with open(place, "wb") as file:
                writer(file)
            os.replace(place, target)


@contextmanager
def unfinished(target: Path, make: Callable[[Path], object]) -> Iterator[Path]:
    """A place for what is not whole yet, to be moved to its target when it is.

    What is still there at the end is removed. A process that is killed cannot do that. So who
    writes holds a lock, and what nobody holds is removed when the same target is written again.

    Args:
        target: The file or folder; its own folder exists.
        make: Makes the file or the folder in the place, which lies beside the target.
    """
    # Not the name itself: this one fits even if that has the greatest length.
    name = hashlib.sha256(os.fsencode(target.name)).hexdigest()[:16]
    for left in target.parent.glob(f".{name}.{_HEX}.tmp"):
        with suppress(OSError), _locked(left) as is_free:
            if is_free and time.time() - left.stat().st_mtime > _SECONDS_TO_LOCK:
                _remove(left)
    place = target.parent / f".{name}.{secrets.token_hex(8)}.tmp"
    try:
        make(place)
        with _locked(place):
            yield place
    finally:
        with suppress(OSError):
            _remove(place)


@contextmanager
def _locked(path: Path) -> Iterator[bool]:
    """Lock a file or folder; whether that can be done here, and nobody else has done it."""
    descriptor, is_locked = None, False
    try:
        with suppress(OSError, ImportError):  # on Windows, or on a network's disk
            import fcntl

            descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            is_locked = True
        yield is_locked
    finally:
        if descriptor is not None:
            os.close(descriptor)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink()


def check_writable_file(path: PathLike) -> Path:
    """The path, if `write_atomically` can write a file there: to be called before long work.

    Nothing is written or made, and what is there stays. The folder of the file may be missing, if
    it can be made; that of what a symbolic link names may not.

    Raises:
        AntsError: The path is one of a folder, a device or a pipe, or nothing can be written there.
    """
    with writing(path):
        target = _target_of(path)
        folder = target.parent
        if not os.path.islink(path):
            folder = next(one for one in target.parents if one.exists())
        _try_to_write(folder)
    return Path(path)


def write_text(path: PathLike, text: str) -> None:
    """Write text as UTF-8 with the line ends that it has; raises as `write_atomically` does."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: PathLike, content: bytes) -> None:
    """Write a file; raises as `write_atomically` does."""

    def write(file: BinaryIO) -> None:
        file.write(content)

    write_atomically(path, write)


def write_json(path: PathLike, value: Any) -> None:
    """Write what `to_json` knows, indented; raises as `write_atomically` does."""
    write_text(path, to_json(value, indent=2) + "\n")


def to_json(value: Any, indent: int | None = None) -> str:
    """The JSON text of a value; NumPy's scalars and arrays, tuples and paths are known too."""
    return json.dumps(value, indent=indent, ensure_ascii=False, default=_plain)


def write_csv(path: PathLike, rows: Iterable[Mapping[str, Any]], columns: Sequence[str]) -> None:
    """Write rows as comma-separated values with a header; raises as `write_atomically` does.

    Args:
        path: The file.
        rows: Any values that have a text; floats are written so that they read back exactly.
            None, NaN and missing keys become an empty field, a key that is no column is a
            ValueError. They are taken one by one, so there can be more than fit into memory.
        columns: The keys to write, in this order.
    """

    def write(file: BinaryIO) -> None:
        text = codecs.getwriter("utf-8")(file)
        table = csv.DictWriter(text, fieldnames=columns, restval="", lineterminator="\n")
        table.writeheader()
        for row in rows:
            plain = {key: _plain_scalar(value) for key, value in row.items()}
            table.writerow({key: None if value != value else value for key, value in plain.items()})

    write_atomically(path, write)


@contextmanager
def opened(path: PathLike, most: float = math.inf) -> Iterator[BinaryIO]:
    """A file to read from, if it is a regular one of at most `most` bytes.

    A pipe could wait forever, and a device has no end.

    Raises:
        AntsError: It cannot be read, or is none; also where reading it fails later.
    """
    expect("path", path, str, os.PathLike)
    try:
        if "\0" in os.fspath(path):
            raise OSError("it contains a null character")
        with open(path, "rb", opener=_without_waiting) as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode):
                raise OSError("it is a device or a pipe")
            if status.st_size > most:
                raise OSError(f"it has {status.st_size} bytes, and {most} are allowed")
            yield file
    except (OSError, UnicodeEncodeError) as error:
        raise AntsError(
            f"cannot read {_named(path)}: {_reason(error)}; name another file."
        ) from error


def _without_waiting(path: str, flags: int) -> int:
    """Opens a pipe at once, even if nobody writes to it."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def read_text(path: PathLike, most: int = 1 << 26) -> str:
    """The text of a file in UTF-8, lines ending with a line feed.

    Raises:
        AntsError: It cannot be read, has more bytes than `most`, or is no text.
    """
    with opened(path, most) as file:
        content = file.read(os.fstat(file.fileno()).st_size)
    try:
        return content.decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeError as error:
        raise AntsError(f"{_named(path)} is no text in UTF-8; name another file.") from error


def read_json(path: PathLike) -> Any:
    """What a JSON file holds.

    Raises:
        AntsError: It cannot be read, or is none.
    """
    try:
        return json.loads(read_text(path))
    except RecursionError as error:
        raise AntsError(f"{_named(path)} is nested too deep; name another file.") from error
    except ValueError as error:
        if isinstance(error, AntsError):
            raise
        raise AntsError(f"{_named(path)} is no JSON ({error}); name another file.") from error


def read_csv(path: PathLike) -> list[dict[str, Any]]:
    """The rows of a file of `write_csv`: what is a number as a float, an empty field as None.

    Raises:
        AntsError: The file cannot be read.
    """
    try:
        header, *lines = csv.reader(io.StringIO(read_text(path, 1 << 30)))
        rows = [zip(header, line, strict=True) for line in lines if line]
        return [{name: _number_in(text) for name, text in row} for row in rows]
    except (csv.Error, ValueError) as error:
        if isinstance(error, AntsError):
            raise
        raise AntsError(f"{_named(path)} is no table; name another file.") from error


def hash_of(file: BinaryIO, size: int | None = None) -> str:
    """The SHA-256 of the first so many bytes of a file, or of all, hexadecimal."""
    digest, left = hashlib.sha256(), file.seek(0, os.SEEK_END) if size is None else size
    file.seek(0)
    while chunk := file.read(min(left, 1 << 20)):
        digest.update(chunk)
        left -= len(chunk)
    return digest.hexdigest()


def smallest(array: np.ndarray) -> np.ndarray:
    """The same integers in the smallest type that holds them."""
    low, high = int(array.min(initial=0)), int(array.max(initial=0))
    return array.astype(np.promote_types(np.min_scalar_type(low), np.min_scalar_type(high)))


def check_writable_folder(path: PathLike, named: PathLike | None = None) -> Path:
    """The folder, made if it is missing, if files can be written to it.

    Args:
        path: The folder.
        named: What the message calls it, such as the folder above it that somebody has chosen.

    Raises:
        AntsError: The folder cannot be created or written to.
    """
    try:
        folder = Path(path)
        folder.mkdir(parents=True, exist_ok=True)
        _try_to_write(folder)
    except (OSError, ValueError) as error:
        raise AntsError(
            f"cannot write to the folder {_named(named or path)}: {_reason(error)}; choose another "
            "folder."
        ) from error
    return folder


def check_room(folder: PathLike, needed: int) -> None:
    """Raises AntsError if a folder's disk has less room than so many bytes: before long work."""
    with writing(folder):
        free = shutil.disk_usage(folder).free
    if needed > free:
        raise AntsError(
            f"this needs {_size(needed)} on the disk of {_named(folder)}, and {_size(free)} are "
            "free; make room there, ask for less, or choose another place."
        )


def _size(n: int) -> str:
    return f"{n / 1e9:.1f} GB" if n >= 1e9 else f"{n / 1e6:.1f} MB"


@contextmanager
def writing(path: PathLike) -> Iterator[None]:
    """What the system has against writing a file or a folder becomes an AntsError that names it."""
    try:
        yield
    except (OSError, UnicodeError) as error:
        raise AntsError(
            f"cannot write {_named(path)}: {_reason(error)}; choose another place."
        ) from error


def _target_of(path: PathLike) -> Path:
    """The regular file that a path names, which need not exist; links are followed."""
    expect("path", path, str, os.PathLike)
    if "\0" in os.fspath(path):
        raise AntsError(f"{_named(path)} contains a null character; name a file to write to.")
    target = Path(os.path.realpath(path))
    # Replacing a device, a pipe or a folder would destroy it or fail.
    if str(path).endswith(os.sep) or (target.exists() and not target.is_file()):
        raise AntsError(f"{_named(path)} is not a regular file; name a file to write to.")
    return target


def _try_to_write(folder: Path) -> None:
    """Write something into a folder, and leave nothing there.

    Permission bits alone do not tell: root passes them, a read-only mount or a full disk does not.
    The file has no name where the system knows such files, so that not even a kill leaves it.
    """
    with tempfile.TemporaryFile(dir=folder) as file:
        file.write(bytes(4096))


def _named(path: PathLike) -> str:
    """A path for a message, whole unless it is longer than most systems allow."""
    return shown(str(path), 400)


def _reason(error: Exception) -> str:
    """A short reason in lower case, without the path and the number that OSError adds."""
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return text[:1].lower() + text[1:]


def _number_in(text: str) -> float | str | None:
    try:
        return float(text)
    except ValueError:
        return text or None


def _plain_scalar(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def _plain(value: Any) -> Any:
    """What JSON knows in place of a value that it does not know."""
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise TypeError(f"{type(value).__name__} has no form in JSON")
