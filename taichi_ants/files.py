"""Files of results: written whole or not at all, read with errors that name the file."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import math
import os
import secrets
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from taichi_ants.errors import AntsError, shown

PathLike = str | os.PathLike[str]

_TOKEN = 8  # bytes in the name of a file that is being written
_SEAL = "sha256"  # the array that holds the hash of the others


def checked_path(path: PathLike) -> str:
    """The name of a file. Numbers are none: they would be taken for files that are open already.

    Raises:
        AntsError: It is no text and no path.
    """
    name = os.fspath(path) if isinstance(path, os.PathLike) else path
    if not isinstance(name, str):
        raise AntsError(f"the path is {shown(path)}; it must be the name of a file.")
    return name


def write_atomically(path: PathLike, writer: Callable[[BinaryIO], None]) -> None:
    """Write a file so that readers see the old content or all of the new one, never a part.

    Args:
        path: The file. One that exists is replaced; a symbolic link is followed.
        writer: Called once with a binary file to write to. It lies in the same folder until it is
            complete and is removed if the writer raises.

    Raises:
        AntsError: The file cannot be written. Other exceptions of the writer pass through.
    """
    name = checked_path(path)
    if "\0" in name:
        raise AntsError(f"{_named(name)} contains a null character; name a file to write to.")
    temporary: Path | None = None
    try:
        target = Path(os.path.realpath(name))
        # Replacing a device, a pipe or a folder would destroy it or fail.
        if target.exists() and not target.is_file():
            raise AntsError(f"{_named(name)} is not a regular file; name a file to write to.")
        # Not derived from the file's name: it fits even if that one has the greatest length.
        temporary = target.parent / f".{secrets.token_hex(_TOKEN)}.tmp"
        with open(temporary, "xb") as file:
            writer(file)
        os.replace(temporary, target)
    except (OSError, UnicodeError) as error:
        raise AntsError(
            f"cannot write {_named(name)}: {_reason(error)}; choose another place."
        ) from error
    finally:
        if temporary is not None:
            with suppress(OSError):
                temporary.unlink()


def left_overs(folder: Path) -> list[Path]:
    """Files in a folder that `write_atomically` has not completed, since the process was killed."""
    digits = "[0-9a-f]" * (2 * _TOKEN)
    return list(folder.glob(f".{digits}.tmp"))


def file_hash(path: PathLike) -> str:
    """The SHA-256 of a file's bytes, in hexadecimal; OSError if it cannot be read."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def write_text(path: PathLike, text: str) -> None:
    """Write text as UTF-8 with the line ends that it has; raises as `write_atomically` does."""

    def write_content(file: BinaryIO) -> None:
        file.write(text.encode("utf-8"))

    write_atomically(path, write_content)


def read_text(path: PathLike) -> str:
    """Read text that `write_text` has written.

    Raises:
        AntsError: The file cannot be read, or holds no text.
    """
    try:
        return Path(checked_path(path)).read_text("utf-8")
    except (OSError, UnicodeError) as error:
        raise AntsError(
            f"cannot read {os.fspath(path)!r}: {_reason(error)}; give --force to write it again."
        ) from error


def write_json(path: PathLike, value: Any) -> None:
    """Write a value as indented JSON; raises as `write_atomically` does.

    NumPy scalars and arrays become numbers and lists, tuples lists, paths text. JSON knows no
    infinite number and no NaN, they become null.
    """
    write_text(path, to_json(value, indent=2) + "\n")


def to_json(value: Any, indent: int | None = None) -> str:
    """The JSON text of a value, converted as `write_json` says; TypeError for other types."""
    return json.dumps(_plain(value), indent=indent, ensure_ascii=False, allow_nan=False)


def write_csv(path: PathLike, rows: Iterable[Mapping[str, Any]], columns: Sequence[str]) -> None:
    """Write rows as comma-separated values with a header; raises as `write_atomically` does.

    Args:
        path: The file.
        rows: Any values that have a text; floats are written so that they read back exactly.
            None, NaN and missing keys become an empty field, a key that is no column is a
            ValueError.
        columns: The keys to write, in this order.
    """
    text = io.StringIO()
    table = csv.DictWriter(text, fieldnames=columns, restval="", lineterminator="\n")
    table.writeheader()
    for row in rows:
        scalars = {key: _plain_scalar(value) for key, value in row.items()}
        table.writerow({key: None if value != value else value for key, value in scalars.items()})
    write_text(path, text.getvalue())


def write_npz(path: PathLike, arrays: Mapping[str, npt.ArrayLike], compress: bool = True) -> None:
    """Write named arrays as an .npz; raises as `write_atomically` does.

    Equal arrays give equal bytes. ValueError if one holds Python objects, which a reader that is
    careful refuses to load.
    """
    converted = {name: np.asarray(array) for name, array in arrays.items()}
    for name, array in converted.items():
        if array.dtype.hasobject:
            raise ValueError(f"array {name!r} holds Python objects")
    save: Callable[..., None] = np.savez_compressed if compress else np.savez
    write_atomically(path, lambda file: save(file, **converted))


def write_sealed_npz(path: PathLike, arrays: Mapping[str, np.ndarray]) -> None:
    """Write named arrays, and the hash of them all, as an .npz for `read_sealed_npz`."""
    write_npz(path, {**arrays, _SEAL: _seal(path, arrays)}, compress=False)


def read_sealed_npz(path: PathLike) -> dict[str, np.ndarray]:
    """Read what `write_sealed_npz` has written.

    Raises:
        AntsError: As `read_npz`, or these are not the arrays that were written to this file.
    """
    arrays = read_npz(path)
    seal = arrays.pop(_SEAL, None)
    if seal is None or not np.array_equal(seal, _seal(path, arrays)):
        raise AntsError(f"{str(path)!r} was altered since it was written; remove it.")
    return arrays


def _seal(path: PathLike, arrays: Mapping[str, np.ndarray]) -> np.ndarray:
    """The SHA-256 of named arrays and of the name of their file, uint8 (32,)."""
    digest = hashlib.sha256(Path(path).name.encode())
    for name, array in sorted(arrays.items()):
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return np.frombuffer(digest.digest(), dtype=np.uint8)


def smallest(array: np.ndarray) -> np.ndarray:
    """The same integers in the smallest type that holds them."""
    low, high = int(array.min(initial=0)), int(array.max(initial=0))
    return array.astype(np.promote_types(np.min_scalar_type(low), np.min_scalar_type(high)))


def read_npz(path: PathLike) -> dict[str, np.ndarray]:
    """Read all arrays of an .npz file into memory, without executing anything that it holds.

    Raises:
        AntsError: The file is missing, unreadable, damaged, or no .npz of plain arrays.
    """
    try:
        with open(checked_path(path), "rb") as file:
            archive = np.load(file, allow_pickle=False)
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise ValueError("it holds a single array")
            with archive:
                arrays = {name: archive[name] for name in archive.files}
    except OSError as error:
        raise AntsError(f"cannot read {_named(path)}: {_reason(error)}.") from error
    except AntsError:
        raise
    # A damaged archive fails in many ways (zipfile, zlib, struct, tokenize, memory ...).
    except Exception as error:
        raise AntsError(
            f"{_named(path)} is damaged or not an .npz file; write it again or name another file."
        ) from error
    if not all(isinstance(array, np.ndarray) for array in arrays.values()):
        raise AntsError(f"{_named(path)} holds more than arrays; name an .npz file.")
    return arrays


def check_writable_folder(path: PathLike) -> Path:
    """Make sure that a folder exists and that files can be written to it, creating it if needed.

    It makes a file without a name, of which nothing can be left, since permission bits alone do not
    tell (root passes them, a read-only mount does not). If the check fails, folders that it created
    are removed.

    Returns:
        The folder.

    Raises:
        AntsError: The folder cannot be created or written to.
    """
    folder = Path(checked_path(path))
    created: list[Path] = []
    try:
        _create_folders(folder, created)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except (OSError, ValueError) as error:
        with suppress(OSError):
            for made in reversed(created):
                made.rmdir()
        raise AntsError(
            f"cannot write to the folder {_named(path)}: {_reason(error)}; choose another folder."
        ) from error
    return folder


def _create_folders(folder: Path, created: list[Path]) -> None:
    """Create a folder and its missing parents, noting each one as soon as it is made."""
    missing = []
    for part in (folder, *folder.parents):
        if part.is_dir():
            break
        missing.append(part)
    for part in reversed(missing):
        _create_folder(part, created)


def _create_folder(folder: Path, created: list[Path]) -> None:
    try:
        folder.mkdir()
    except FileExistsError:
        # Another process may have made it in the meantime; anything else is in the way.
        if not folder.is_dir():
            raise
    else:
        created.append(folder)


def _named(path: PathLike) -> str:
    """A path for a message, whole unless it is longer than most systems allow."""
    return shown(str(path), 400)


def _reason(error: Exception) -> str:
    """A short reason in lower case, without the path and the number that OSError adds."""
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return text[:1].lower() + text[1:]


def _plain_scalar(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def _plain(value: Any) -> Any:
    """Convert to what JSON knows; other types are left to json to refuse."""
    value = _plain_scalar(value)
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return value
