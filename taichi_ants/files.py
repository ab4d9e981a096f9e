"""Files of results: written whole or not at all, read with errors that name the file."""

from __future__ import annotations

import csv
import io
import json
import os
import secrets
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from taichi_ants.errors import AntsError, expect, shown

PathLike = str | os.PathLike[str]


def write_atomically(path: PathLike, writer: Callable[[BinaryIO], None]) -> None:
    """Write a file so that readers see the old content or all of the new one, never a part.

    Args:
        path: The file. One that exists is replaced; a symbolic link is followed.
        writer: Called once with a binary file to write to. It lies in the same folder until it is
            complete and is removed if the writer raises.

    Raises:
        AntsError: The file cannot be written. Other exceptions of the writer pass through.
    """
    expect("path", path, str, os.PathLike)
    if "\0" in os.fspath(path):
        raise AntsError(f"{_named(path)} contains a null character; name a file to write to.")
    temporary: Path | None = None
    try:
        target = Path(os.path.realpath(path))
        # Replacing a device, a pipe or a folder would destroy it or fail.
        if target.exists() and not target.is_file():
            raise AntsError(f"{_named(path)} is not a regular file; name a file to write to.")
        # Not derived from the file's name: it fits even if that one has the greatest length.
        temporary = target.parent / f".{secrets.token_hex(8)}.tmp"
        with open(temporary, "xb") as file:
            writer(file)
        os.replace(temporary, target)
    except (OSError, UnicodeError) as error:
        raise AntsError(
            f"cannot write {_named(path)}: {_reason(error)}; choose another place."
        ) from error
    finally:
        if temporary is not None:
            with suppress(OSError):
                temporary.unlink()


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
            ValueError.
        columns: The keys to write, in this order.
    """
    text = io.StringIO()
    table = csv.DictWriter(text, fieldnames=columns, restval="", lineterminator="\n")
    table.writeheader()
    for row in rows:
        plain = {key: _plain_scalar(value) for key, value in row.items()}
        table.writerow({key: None if value != value else value for key, value in plain.items()})
    write_text(path, text.getvalue())


def read_csv(path: PathLike) -> list[dict[str, Any]]:
    """The rows of a file of `write_csv`: what is a number as a float, an empty field as None.

    Raises:
        AntsError: The file cannot be read.
    """
    try:
        with open(path, newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeError, csv.Error) as error:
        raise AntsError(f"cannot read {_named(path)}: {_reason(error)}.") from error
    return [{name: _number_in(text) for name, text in row.items()} for row in rows]


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


def smallest(array: np.ndarray) -> np.ndarray:
    """The same integers in the smallest type that holds them."""
    low, high = int(array.min(initial=0)), int(array.max(initial=0))
    return array.astype(np.promote_types(np.min_scalar_type(low), np.min_scalar_type(high)))


def read_npz(path: PathLike, content: bytes | None = None) -> dict[str, np.ndarray]:
    """Read all arrays of an .npz file into memory, without executing anything that it holds.

    Args:
        path: The file.
        content: What it holds, if that is known already; `path` is then what messages call it.

    Raises:
        AntsError: The file is missing, unreadable, damaged, or no .npz of plain arrays.
    """
    expect("path", path, str, os.PathLike)
    try:
        with open(path, "rb") if content is None else io.BytesIO(content) as file:
            archive = np.load(file, allow_pickle=False)
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise ValueError("it holds a single array")
            with archive:
                arrays = {name: archive[name] for name in archive.files}
    except OSError as error:
        raise AntsError(f"cannot read {_named(path)}: {_reason(error)}.") from error
    # A damaged archive fails in many ways (zipfile, zlib, struct, tokenize, memory ...).
    except Exception as error:
        raise AntsError(
            f"{_named(path)} is damaged or not an .npz file; write it again or name another file."
        ) from error
    if not all(isinstance(array, np.ndarray) for array in arrays.values()):
        raise AntsError(f"{_named(path)} holds more than arrays; name an .npz file.")
    return arrays


def check_writable_folder(path: PathLike) -> Path:
    """The folder, made if it is missing, if files can be written to it.

    It makes a file without a name, of which nothing can be left, since permission bits alone do not
    tell (root passes them, a read-only mount does not).

    Raises:
        AntsError: The folder cannot be created or written to.
    """
    try:
        folder = Path(path)
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except (OSError, ValueError) as error:
        raise AntsError(
            f"cannot write to the folder {_named(path)}: {_reason(error)}; choose another folder."
        ) from error
    return folder


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
