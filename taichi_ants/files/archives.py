"""Archives of arrays (.npz) with a checksum and JSON metadata."""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from taichi_ants import files
from taichi_ants.errors import AntsError, shown

MOST_BYTES = 1 << 36  # the largest unpacked size of a file
_CHECKSUM = "checksum"  # the array with the checksum of all other arrays
_COMPRESSION = 2  # NumPy's level, 6, takes five times as long and saves a tenth of the bytes

Arrays = dict[str, np.ndarray]


def write(path: files.PathLike, arrays: Mapping[str, npt.ArrayLike], compress: bool = True) -> None:
    """Write named arrays and their checksum; equal arrays give equal bytes.

    Raises TypeError if an array holds Python objects.
    """
    content = {name: np.asarray(array) for name, array in arrays.items()}
    content[_CHECKSUM] = np.array(_checksum(content))
    how = zipfile.ZIP_DEFLATED if compress else zipfile.ZIP_STORED

    def save(file: BinaryIO) -> None:
        with zipfile.ZipFile(file, "w", how, compresslevel=_COMPRESSION) as archive:
            for name, array in content.items():
                with archive.open(f"{name}.npy", "w", force_zip64=True) as entry:
                    np.lib.format.write_array(entry, array, allow_pickle=False)

    files.write_atomically(path, save)


def read(
    path: files.PathLike,
    content: bytes | None = None,
    most: int = MOST_BYTES,
    foreign: bool = False,
) -> Arrays:
    """Return all arrays of an .npz file, without executing anything in it.

    Args:
        path: The file, or its name in messages if `content` is given.
        content: The bytes of the file.
        most: The largest number of bytes of the file, and of its unpacked arrays.
        foreign: Whether to accept a file without a checksum, from other software.
    """
    source = files.opened(path, most) if content is None else nullcontext(io.BytesIO(content))
    name = files.named(path)
    with source as file:
        try:
            with zipfile.ZipFile(file) as archive:
                members = archive.infolist()
                size = sum(member.file_size for member in members)
                if size > most:
                    raise AntsError(
                        f"{name} unpacks to {size} bytes, and at most {most} are allowed; name "
                        "another file."
                    )
                arrays = {entry.filename[:-4]: _array(archive, entry) for entry in members}
            written = arrays.pop(_CHECKSUM, None)
            if not (foreign if written is None else str(written) == _checksum(arrays)):
                raise ValueError("the checksum is missing or differs")
            return arrays
        except (AntsError, OSError):
            raise
        except MemoryError as error:
            raise AntsError(
                f"{name} needs more memory than is available; name a smaller file."
            ) from error
        except Exception as error:  # zipfile, zlib, struct and tokenize raise many kinds
            raise AntsError(
                f"{name} is damaged, or not an .npz file of this version; write it again, or name "
                "another file."
            ) from error


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> np.ndarray:
    """Return an array; reads to the end of its member, where zipfile checks the CRC-32."""
    # Other compressions can need memory that the file does not declare.
    is_known = member.compress_type in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
    if not is_known or not member.filename.endswith(".npy"):
        raise ValueError("it is not an array that NumPy wrote")
    with archive.open(member) as file:
        array = np.lib.format.read_array(file, allow_pickle=False)
        if file.read(1):
            raise ValueError("an array is longer than its header declares")
    return array


def _checksum(arrays: Arrays) -> str:
    """Return the hexadecimal SHA-256 of the names, types, shapes and contents of arrays."""
    digest = hashlib.sha256()
    for name, array in sorted(arrays.items()):
        digest.update(f"{name} {array.dtype.str} {array.shape}\n".encode())
        digest.update(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data)
    return digest.hexdigest()


@dataclass(frozen=True)
class Kind:
    """A kind of .npz file: arrays, and metadata ("facts") as JSON.

    Attributes:
        name: The name of the content, for example "colony".
        version: The version of the format; reading refuses all other versions.
        writer: The function that writes such files, for messages.
        most, foreign: See `read`.
    """

    name: str
    version: int
    writer: str
    most: int = MOST_BYTES
    foreign: bool = False

    def write(
        self,
        path: files.PathLike,
        facts: Mapping[str, Any],
        arrays: Mapping[str, np.ndarray],
        compress: bool = True,
    ) -> None:
        """Write a file of this kind from facts and arrays; raises as the function `write` does."""
        text = files.to_json({"kind": self.name, "version": self.version, **facts})
        write(path, {**arrays, "facts": np.array(text.encode())}, compress)

    @contextmanager
    def reading(
        self, path: files.PathLike, content: bytes | None = None
    ) -> Iterator[tuple[Arrays, dict[str, Any]]]:
        """Yield the arrays and facts of a file to a block, whose errors become an AntsError."""
        arrays = read(path, content, self.most, self.foreign)
        try:
            text = arrays.pop("facts").item()
            text = text.decode() if isinstance(text, bytes) else text
            facts = json.loads(text)
            kind, version = facts["kind"], facts["version"]
        except (AttributeError, KeyError, ValueError, TypeError, RecursionError):
            kind = version = None
        if kind != self.name:
            raise AntsError(
                f"{files.named(path)} does not contain a {self.name} of this version; name a file "
                f"that {self.writer} wrote."
            )
        if version != self.version:
            raise AntsError(
                f"{files.named(path)} contains a {self.name} in version {shown(version)} of its "
                f"format; only version {self.version} can be read, so create the file again."
            )
        with self.building(path):
            yield arrays, facts

    @contextmanager
    def building(self, path: files.PathLike) -> Iterator[None]:
        """Yield to a block that builds an object from a file; its errors become an AntsError."""
        what = f"the {self.name} in {files.named(path)}"
        try:
            yield
        except AntsError as error:
            raise AntsError(f"{what} cannot be used: {error}") from error
        except Exception as error:  # wrong numbers raise many kinds of exceptions
            text = " ".join(f"{type(error).__name__}: {error}".rstrip(".").split())
            raise AntsError(
                f"{what} is damaged ({text}); name a file that {self.writer} wrote."
            ) from error
