"""Archives of arrays (.npz) with a checksum and JSON metadata."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from typing import Any, BinaryIO
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile

import numpy as np
import numpy.typing as npt

from taichi_ants import files
from taichi_ants.errors import AntsError

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
    how = ZIP_DEFLATED if compress else ZIP_STORED

    def save(file: BinaryIO) -> None:
        with ZipFile(file, "w", how, compresslevel=_COMPRESSION) as archive:
            for name, array in content.items():
                with archive.open(f"{name}.npy", "w", force_zip64=True) as entry:
                    np.lib.format.write_array(entry, array, allow_pickle=False)

    files.write_atomically(path, save)


def read(
    path: files.PathLike, content: bytes | None = None, most: int = MOST_BYTES, sealed: bool = False
) -> Arrays:
    """Return all arrays of an .npz file, without executing anything in it.

    With `content`, the bytes of the file, `path` is its name in messages. `most` limits the bytes
    of the file, and of its unpacked arrays. With `sealed`, a file without a checksum is refused.
    """
    source = files.opened(path, most) if content is None else nullcontext(io.BytesIO(content))
    name = files.named(path)
    with source as file:
        try:
            with np.load(file, allow_pickle=False) as archive:
                members = archive.zip.infolist()
                size = sum(member.file_size for member in members)
                if size > most:
                    raise AntsError(
                        f"{name} unpacks to {size} bytes, and at most {most} are allowed; name "
                        "another file."
                    )
                # Other compressions can need memory that the file does not declare.
                if {member.compress_type for member in members} - {ZIP_STORED, ZIP_DEFLATED}:
                    raise ValueError("it is not an archive that NumPy wrote")
                arrays = dict(archive)  # zipfile checks their CRC-32
            written = arrays.pop(_CHECKSUM, None)
            if sealed if written is None else str(written) != _checksum(arrays):
                raise ValueError("the checksum is missing or differs")
            return arrays
        except (AntsError, OSError, MemoryError):
            raise
        except Exception as error:  # zipfile, zlib, struct and tokenize raise many kinds
            raise AntsError(
                f"{name} is damaged, or not an .npz file of this version; write it again, or name "
                "another file."
            ) from error


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
        most, sealed: See `read`; `sealed` is for files with indices of kernels.
    """

    name: str
    version: int
    writer: str
    most: int = MOST_BYTES
    sealed: bool = False

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
        arrays = read(path, content, self.most, self.sealed)
        try:
            facts = json.loads(arrays.pop("facts").item())
            kind, version = facts["kind"], facts["version"]
        except (AttributeError, KeyError, ValueError, TypeError, RecursionError):
            kind = version = None
        if (kind, version) != (self.name, self.version):
            raise AntsError(
                f"{files.named(path)} does not contain a {self.name} in version {self.version} of "
                f"its format; name a file that {self.writer} wrote."
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
