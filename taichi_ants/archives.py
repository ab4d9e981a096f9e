"""Archives of arrays (.npz): written with a checksum, which is compared before anything is read.

The comment of the archive is a label and the hash of all bytes before the hash. A flipped bit in
the label leaves a comment that is not a checksum, and such an archive is refused. Files of other
programs have no comment: their declared sizes and the checksum of each array are compared.
"""

from __future__ import annotations

import io
import os
import zipfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import BinaryIO, TypeVar

import numpy as np
import numpy.typing as npt

from taichi_ants import files
from taichi_ants.errors import AntsError, shown
from taichi_ants.rows import Rows

MOST_BYTES = 1 << 36  # of a file, unpacked
_COMPRESSION = 2  # of 1 (quick) to 9 (small)
_MARK = b"taichi-ants sha256 "
_SEAL_BYTES = len(_MARK) + 64  # with the digest, hexadecimal
_END = b"PK\5\6"  # begins the last 22 bytes of an archive without a comment

Unpacked = TypeVar("Unpacked")


def write(
    path: files.PathLike, arrays: Mapping[str, npt.ArrayLike | Rows], compress: bool = True
) -> None:
    """Write named arrays as a sealed .npz; raises as `files.write_atomically` does.

    Equal arrays give equal bytes; `Rows` have the smallest type. ValueError if one holds Python
    objects, which a reader that is careful refuses to load.
    """
    converted = {n: one if isinstance(one, Rows) else np.asarray(one) for n, one in arrays.items()}
    for name, array in converted.items():
        if array.dtype.hasobject:
            raise ValueError(f"array {name!r} holds Python objects")
    how = zipfile.ZIP_DEFLATED if compress else zipfile.ZIP_STORED

    def save_sealed(file: BinaryIO) -> None:
        # As NumPy, but in a fifth of its time, for a tenth more bytes.
        with zipfile.ZipFile(file, "w", how, compresslevel=_COMPRESSION) as archive:
            for name, array in converted.items():
                with archive.open(f"{name}.npy", "w", force_zip64=True) as entry:
                    if isinstance(array, Rows):
                        array.save(entry)
                    else:
                        np.lib.format.write_array(entry, array, allow_pickle=False)
        file.seek(-2, os.SEEK_END)  # an archive ends with the length of its comment
        file.write(_SEAL_BYTES.to_bytes(2, "little") + _MARK)
        file.flush()
        with open(file.name, "rb") as written:
            digest = files.hash_of(written)
        file.write(digest.encode())

    files.write_atomically(path, save_sealed)


def read(
    path: files.PathLike,
    content: bytes | None = None,
    most: int = MOST_BYTES,
    foreign: bool = False,
) -> dict[str, np.ndarray]:
    """Read all arrays of an .npz file into memory, without executing anything that it holds.

    Args:
        path: The file.
        content: What it holds, if that is known already; `path` is then what messages call it.
        most: How many bytes the file and its arrays may have.
        foreign: Whether a file without a seal is read too.

    Raises:
        AntsError: The file is missing, unreadable, too large, damaged, or no .npz of plain arrays.
    """
    return _read(path, content, most, foreign, _unpacked)


def read_rows(path: files.PathLike, folder: Path) -> dict[str, np.ndarray | Rows]:
    """As `read`, but integers of three axes or more may not fit into memory, and become `Rows`.

    Args:
        path: A file that `write` has written.
        folder: A folder on whose disk these lie.

    Raises:
        AntsError: As `read` says, or the folder cannot be written to.
    """

    def unpack(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> np.ndarray | Rows:
        with archive.open(member) as file:
            return Rows.load(file, folder) or _unpacked(archive, member)

    return _read(path, None, MOST_BYTES, False, unpack)


def _read(
    path: files.PathLike,
    content: bytes | None,
    most: int,
    foreign: bool,
    unpack: Callable[[zipfile.ZipFile, zipfile.ZipInfo], Unpacked],
) -> dict[str, Unpacked]:
    """What `read` says, each array as it is unpacked."""
    given = files.opened(path, most) if content is None else nullcontext(io.BytesIO(content))
    name, ours = shown(str(path), 400), "" if foreign else " that this version wrote"
    with given as file:
        try:
            if not _is_sealed(file) and not foreign:
                raise ValueError("it has no seal")
            with zipfile.ZipFile(file) as archive:
                members = archive.infolist()
                _check_size(members, most, name)
                arrays = {one.filename: unpack(archive, one) for one in members if _is_array(one)}
        except (AntsError, OSError):
            raise
        except MemoryError as error:
            raise AntsError(
                f"{name} takes more memory than there is; name a smaller file."
            ) from error
        # What is damaged fails in many ways (zipfile, zlib, struct, tokenize ...).
        except Exception as error:
            raise AntsError(
                f"{name} is damaged or not an .npz file{ours}; write it again or name another file."
            ) from error
    if len(arrays) < len(members):
        raise AntsError(f"{name} holds more than arrays; name an .npz file.")
    return {one.removesuffix(".npy"): array for one, array in arrays.items()}


def _is_sealed(file: BinaryIO) -> bool:
    """Return whether an archive ends with the checksum of its bytes, or has no comment at all.

    Raises:
        ValueError: The checksum differs, or the archive ends with anything else.
    """
    size = file.seek(0, os.SEEK_END)
    file.seek(max(0, size - _SEAL_BYTES))
    seal = file.read(_SEAL_BYTES)
    if not seal.startswith(_MARK):
        if seal[-22:-18] != _END or seal[-2:] != bytes(2):
            raise ValueError("it ends neither with a checksum nor without a comment")
        return False
    if seal[len(_MARK) :] != files.hash_of(file, size - 64).encode():
        raise ValueError("its bytes are not those that were written")
    return True


def _check_size(members: Sequence[zipfile.ZipInfo], most: int, name: str) -> None:
    """Refuse what declares to be larger; reading a member gives no more than it declares."""
    size = sum(member.file_size for member in members)
    if size > most:
        raise AntsError(
            f"{name} unpacks to {size} bytes, and {most} are allowed; name another file."
        )


def _is_array(member: zipfile.ZipInfo) -> bool:
    return member.filename.endswith(".npy")


def _unpacked(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> np.ndarray:
    """An array, read to the end of its member, where its checksum is compared."""
    if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise ValueError("it is packed in a way in which NumPy packs nothing")
    with archive.open(member) as file:
        array = np.lib.format.read_array(file, allow_pickle=False)
        if file.read(1):
            raise ValueError("an array is longer than it declares")
    return array
