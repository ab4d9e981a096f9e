"""Bundles: files in one zip archive with checksums, which are read without trust in the archive.

The same contents give the same bytes. The index of a bundle has the size and the SHA-256 of each
file, and of itself.
"""

from __future__ import annotations

import hashlib
import json
import stat
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from taichi_ants import files
from taichi_ants.errors import AntsError, shown

INDEX = "archive.json"
MOST_BYTES = 1 << 34  # of all unpacked files, and of the archive
MOST_FILES = 100_000
_MOST_OF_INDEX = 1 << 26
_KIND, _FORMAT = "taichi_ants study", 1
_DATE = (1980, 1, 1, 0, 0, 0)  # of all files, because dates would change the bytes
_COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_ERRORS = (  # that zipfile raises, and errors of values in the index
    *(zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError),
    *(ValueError, LookupError, TypeError, AttributeError),
)
_TYPES = (0, stat.S_IFREG)  # of files; other programs may not store the type
_CHUNK = 1 << 20


def write(path: Path, contents: Mapping[str, Path | str], facts: Mapping[str, Any]) -> None:
    """Write a bundle of files and texts, by their names in the bundle; `facts` go to its index.

    Raises:
        AntsError: A file cannot be read or written, or the bundle is too large to be read again.
    """
    listed: dict[str, dict[str, Any]] = {}

    def save(file: BinaryIO) -> None:
        with zipfile.ZipFile(file, "w") as archive:
            for name, content in sorted(contents.items()):
                listed[name] = _write_file(archive, name, content)
            index = {"kind": _KIND, "format": _FORMAT, **facts, "files": listed}
            index["checksum"] = files.checksum_of_json(index)
            with archive.open(_entry(INDEX), "w") as entry:
                entry.write(files.to_json(index, indent=2).encode())

    texts = sum(len(one.encode()) for one in contents.values() if isinstance(one, str))
    size = texts + sum(one.stat().st_size for one in contents.values() if isinstance(one, Path))
    if size > MOST_BYTES or len(contents) > MOST_FILES:
        raise AntsError(
            f"an archive may have {MOST_FILES} files of {MOST_BYTES} bytes together, and this one "
            f"would have {len(contents)} of {size}; archive parts of the study."
        )
    files.write_atomically(path, save)


def _write_file(archive: zipfile.ZipFile, name: str, content: Path | str) -> dict[str, Any]:
    """Add a file or a text; return its size and checksum."""
    digest, size = hashlib.sha256(), 0
    with archive.open(_entry(name), "w", force_zip64=True) as entry:
        if isinstance(content, str):
            digest.update(content.encode())
            size = entry.write(content.encode())
        else:
            with files.opened(content) as source:
                while chunk := source.read(_CHUNK):
                    digest.update(chunk)
                    size += entry.write(chunk)
    return {"bytes": size, "sha256": digest.hexdigest()}


def _entry(name: str) -> zipfile.ZipInfo:
    entry = zipfile.ZipInfo(name, _DATE)
    entry.compress_type, entry.create_system = zipfile.ZIP_DEFLATED, 3
    entry.external_attr = (stat.S_IFREG | 0o644) << 16
    return entry


class Bundle:
    """An open bundle whose names, sizes and checksums have been checked.

    `facts` are those of its index; `names` are the names of its files.
    """

    def __init__(self, path: Path, archive: zipfile.ZipFile) -> None:
        self.path, self._archive = path, archive
        self._check_members()
        self.facts = self._index()
        self._listed: dict[str, Any] = self.facts["files"]
        self.names = sorted(self._listed)
        self._check_files()

    def _check_members(self) -> None:
        """Check all that can be checked before anything is unpacked."""
        members, name = self._archive.infolist(), files.named(self.path)
        size = sum(one.file_size for one in members)
        if size > MOST_BYTES or len(members) > MOST_FILES + 1:
            raise AntsError(
                f"{name} unpacks to {len(members)} files of {size} bytes together, and at most "
                f"{MOST_FILES} of {MOST_BYTES} are allowed; name another file."
            )
        for one in members:
            mode = one.external_attr >> 16
            if not _is_inside(one.filename) or one.orig_filename != one.filename:
                raise AntsError(
                    f"{name} contains the path {shown(one.orig_filename)}, which leads out of a "
                    "folder, so it is not from `taichi-ants archive`; do not use it."
                )
            if one.compress_type not in _COMPRESSIONS or stat.S_IFMT(mode) not in _TYPES:
                raise ValueError(f"{one.filename} is not a file as this package writes them")
        if len({one.filename for one in members}) < len(members):
            raise ValueError("two files have the same name")

    def _index(self) -> dict[str, Any]:
        if INDEX not in self._archive.namelist():
            raise AntsError(
                f"{files.named(self.path)} is a zip file, but not an archive of a study; name a "
                "file that `taichi-ants archive` wrote."
            )
        if self._archive.getinfo(INDEX).file_size > _MOST_OF_INDEX:
            raise ValueError("the index is too large")
        index = json.loads(self._archive.read(INDEX))
        if index["kind"] != _KIND or index["format"] != _FORMAT:
            raise AntsError(
                f"{files.named(self.path)} has format {shown(index['format'])} of "
                f"{shown(index['kind'])}, and only format {_FORMAT} of {_KIND!r} can be read; use "
                "the version of the package that wrote it."
            )
        if index.pop("checksum") != files.checksum_of_json(index):
            raise ValueError("the index differs from its checksum")
        return index

    def _check_files(self) -> None:
        there = {*self._archive.namelist()} - {INDEX}
        for name in sorted(there ^ self._listed.keys()):
            what = "is not in its index" if name in there else "is missing"
            raise ValueError(f"the file {name!r} {what}")
        for name, facts in self._listed.items():
            digest = hashlib.sha256()
            self._each_chunk(name, digest.update)
            if digest.hexdigest() != facts["sha256"]:
                raise ValueError(f"the file {name!r} differs from its checksum")

    def _each_chunk(self, name: str, do: Callable[[bytes], object]) -> None:
        """Call a function with all parts of a file, at most the bytes that the index declares."""
        left = self._listed[name]["bytes"]
        with self._archive.open(name) as file:
            while chunk := file.read(_CHUNK):
                left -= len(chunk)
                if left < 0:
                    raise ValueError(f"the file {name!r} is longer than declared")
                do(chunk)
        if left:
            raise ValueError(f"the file {name!r} is shorter than declared")

    def checksum_of(self, name: str) -> str:
        """Return the hexadecimal SHA-256 of a file."""
        return self._listed[name]["sha256"]

    def read(self, name: str) -> bytes:
        """Return the content of a file."""
        parts: list[bytes] = []
        self._each_chunk(name, parts.append)
        return b"".join(parts)

    def unpack(self, name: str, target: Path) -> Path:
        """Return a path after writing a file to it; its folder is created."""
        files.check_writable_folder(target.parent)
        files.write_atomically(target, lambda file: self._each_chunk(name, file.write))
        return target

    def open(self, name: str) -> BinaryIO:
        """Return a file, open for reading."""
        return self._archive.open(name)  # type: ignore[return-value]


def _is_inside(name: str) -> bool:
    """Return whether a name is a path below a folder, on all operating systems."""
    parts = name.split("/")
    return not any(mark in name for mark in "\\:\0") and not {"", ".", ".."}.intersection(parts)


@contextmanager
def reading(path: Path) -> Iterator[Bundle]:
    """Yield a bundle after all checks.

    Raises:
        AntsError: The file is not a bundle, is damaged, is too large, or has unsafe paths.
    """
    with files.opened(path, MOST_BYTES) as file:
        if not zipfile.is_zipfile(file):
            raise AntsError(
                f"{files.named(path)} is not an archive of a study, or its end is missing; name a "
                "file that `taichi-ants archive` wrote."
            )
        try:
            archive = zipfile.ZipFile(file)
            bundle = Bundle(path, archive)
        except AntsError:
            raise
        except _ERRORS as error:
            text = " ".join(str(error).split()).rstrip(".") or type(error).__name__
            raise AntsError(
                f"{files.named(path)} is damaged ({text}); get another copy of it."
            ) from error
        with archive:
            yield bundle


def first_difference(one: BinaryIO, other: BinaryIO) -> str:
    """Return where two open files differ first, in words; "" if they are equal."""
    place, line = 0, 1
    while True:
        first, second = one.read(_CHUNK), other.read(_CHUNK)
        if first == second:
            if not first:
                return ""
            place, line = place + len(first), line + first.count(b"\n")
            continue
        same = next(
            (n for n, (a, b) in enumerate(zip(first, second, strict=False)) if a != b),
            min(len(first), len(second)),
        )
        line += first[:same].count(b"\n")
        ends = "" if same < min(len(first), len(second)) else ", where one file ends"
        return f"first difference at byte {place + same}, line {line}{ends}"
