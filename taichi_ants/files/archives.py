"""Archives of arrays (.npz) with a checksum, and with facts about the arrays as JSON."""

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

MOST_BYTES = 1 << 36  # of a file, unpacked
_CHECKSUM = "checksum"  # the array that holds the checksum of all others
_COMPRESSION = 2  # NumPy's level, 6, takes five times as long to save a tenth of the bytes

Arrays = dict[str, np.ndarray]


def write(path: files.PathLike, arrays: Mapping[str, npt.ArrayLike], compress: bool = True) -> None:
    """Write named arrays and their checksum; equal arrays give equal bytes.

    TypeError if an array holds Python objects.
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
    """Read all arrays of an .npz file, without executing anything that it holds.

    Its bytes can be given as `content`, then `path` is its name in messages. File and arrays may
    have `most` bytes each. If it is `foreign`, it needs no checksum.
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
                        f"{name} unpacks to {size} bytes, and {most} are allowed; name another "
                        "file."
                    )
                arrays = {one.filename[:-4]: _array(archive, one) for one in members}
            written = arrays.pop(_CHECKSUM, None)
            if not (foreign if written is None else str(written) == _checksum(arrays)):
                raise ValueError("the checksum is missing, or another one")
            return arrays
        except (AntsError, OSError):
            raise
        except MemoryError as error:
            raise AntsError(
                f"{name} takes more memory than there is; name a smaller file."
            ) from error
        except Exception as error:  # zipfile, zlib, struct, tokenize ... fail in many ways
            raise AntsError(
                f"{name} is damaged, or not an .npz file of this version; write it again or name "
                "another file."
            ) from error


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> np.ndarray:
    """Return an array, read to the end of its member, where zipfile compares the CRC-32."""
    # Other kinds of compression need memory that no file declares.
    is_known = member.compress_type in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
    if not is_known or not member.filename.endswith(".npy"):
        raise ValueError("it is not an array as NumPy writes one")
    with archive.open(member) as file:
        array = np.lib.format.read_array(file, allow_pickle=False)
        if file.read(1):
            raise ValueError("an array is longer than it declares")
    return array


def _checksum(arrays: Arrays) -> str:
    """Return the SHA-256 of the names, types, shapes and contents of arrays, hexadecimal."""
    digest = hashlib.sha256()
    for name, array in sorted(arrays.items()):
        digest.update(f"{name} {array.dtype.str} {array.shape}\n".encode())
        digest.update(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data)
    return digest.hexdigest()


@dataclass(frozen=True)
class Kind:
    """A kind of .npz file: arrays, and facts about them as JSON.

    Attributes:
        name: The name of its content, such as "colony".
        version: The version of its format; files of other versions are refused.
        writer: The function that writes it, for messages.
        most, foreign: As of `read`.
        most_lists: The largest number of lists in the facts.
    """

    name: str
    version: int
    writer: str
    most: int = MOST_BYTES
    foreign: bool = False
    most_lists: int = MOST_BYTES

    def write(
        self,
        path: files.PathLike,
        facts: Mapping[str, Any],
        arrays: Mapping[str, np.ndarray],
        compress: bool = True,
    ) -> None:
        """Write a file."""
        text = files.to_json({"kind": self.name, "version": self.version, **facts})
        write(path, {**arrays, "facts": np.array(text.encode())}, compress)

    @contextmanager
    def reading(
        self, path: files.PathLike, content: bytes | None = None
    ) -> Iterator[tuple[Arrays, dict[str, Any]]]:
        """Read a file of this kind and version, and build an object from it, as `building` does."""
        arrays = read(path, content, self.most, self.foreign)
        try:
            text = arrays.pop("facts").item()
            text = text.decode() if isinstance(text, bytes) else text
            if text.count("[") > self.most_lists:  # each takes much time and memory
                raise ValueError("too many lists")
            facts = json.loads(text)
            kind, version = facts["kind"], facts["version"]
        except (AttributeError, KeyError, ValueError, TypeError, RecursionError):
            kind = version = None
        if kind != self.name:
            raise AntsError(
                f"{files.named(path)} holds no {self.name} of this version; name a file that "
                f"{self.writer} wrote."
            )
        if version != self.version:
            raise AntsError(
                f"{files.named(path)} holds a {self.name} in version {shown(version)} of its "
                f"format; only version {self.version} can be read, so make the file again."
            )
        with self.building(path):
            yield arrays, facts

    @contextmanager
    def building(self, path: files.PathLike) -> Iterator[None]:
        """Turn all errors that occur while an object is built from a file into AntsErrors."""
        what = f"the {self.name} in {files.named(path)}"
        try:
            yield
        except AntsError as error:
            raise AntsError(f"{what} cannot be used: {error}") from error
        except Exception as error:  # wrong numbers fail in many ways
            text = " ".join(f"{type(error).__name__}: {error}".rstrip(".").split())
            raise AntsError(
                f"{what} is damaged ({text}); name a file that {self.writer} wrote."
            ) from error
