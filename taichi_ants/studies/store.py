"""A store: arrays of runs by point and seed, in files that are written once.

A run is the key of a point with a seed. Equal runs have equal arrays in all processes. So files
never change, several processes can add the same run without a lock, and copying the files of
one store to another merges them.

An array can have parts, which are found by its name: "entropy" are "entropy.trail" and
"entropy.home".
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from taichi_ants import files
from taichi_ants.errors import AntsError

BLOCKS = "blocks"  # the folder of the files
_ABOUT = "about"  # the array with the header of a file, in JSON

Arrays = dict[str, np.ndarray]  # by name; in a store each is (points, seeds, ...)


def parts_of(name: str, names: Iterable[str]) -> list[str]:
    """Return those of some names of arrays that are an array, or its parts."""
    return [one for one in names if one == name or one.startswith(f"{name}.")]


class Held(NamedTuple):
    """The contents of a file: keys of points, seeds, and names of arrays."""

    path: Path
    points: tuple[str, ...]
    seeds: tuple[int, ...]
    arrays: tuple[str, ...]

    def has(self, arrays: Iterable[str]) -> bool:
        """Return whether the file has these arrays, or their parts."""
        return all(parts_of(name, self.arrays) for name in arrays)


class DamagedError(AntsError):
    """A file that cannot be read. It was set aside, so its runs are missing now."""


class Store:
    """The runs in a folder, which need not exist.

    Attributes:
        damaged: The files that could not be read, and were renamed to `NAME.damaged`.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder / BLOCKS
        self.damaged: list[Path] = []
        self._held: dict[str, Held] = {}  # by file name
        self.refresh()

    def refresh(self) -> None:
        """Take notice of the files that other processes have added or removed."""
        names = set(os.listdir(self.folder)) if self.folder.is_dir() else set()
        self._held = {name: one for name, one in self._held.items() if name in names}
        for name in sorted(names - self._held.keys()):
            if name.endswith(".npz") and (one := _header(self.folder / name)):
                self._held[name] = one
            elif name.endswith(".npz"):
                self._set_aside(self.folder / name)

    def where(
        self, points: Sequence[str], seeds: Sequence[int], arrays: Sequence[str]
    ) -> tuple[np.ndarray, list[Held]]:
        """Return which file has all of these arrays of each run.

        Returns:
            Indices of files, int64 (points, seeds), -1 for missing runs; and the files.
        """
        rows = {key: n for n, key in enumerate(points)}
        columns = {seed: n for n, seed in enumerate(seeds)}
        held = [one for one in self._held.values() if one.has(arrays)]
        found = np.full((len(points), len(seeds)), -1)
        for number, one in enumerate(held):
            at = [rows[key] for key in one.points if key in rows]
            of = [columns[seed] for seed in one.seeds if seed in columns]
            found[np.ix_(at, of)] = number
        return found, held

    def add(self, points: Sequence[str], seeds: Sequence[int], arrays: Arrays) -> None:
        """Write a block of runs; AntsError if it cannot be written."""
        header = json.dumps([list(points), list(seeds), list(arrays)])
        path = self.folder / f"{hashlib.sha256(header.encode()).hexdigest()[:32]}.npz"
        content: dict[str, Any] = {_ABOUT: np.array(header), **arrays}
        with files.writing(self.folder):
            self.folder.mkdir(parents=True, exist_ok=True)
        files.write_atomically(path, lambda file: np.savez(file, **content))
        self._held[path.name] = Held(path, tuple(points), tuple(seeds), tuple(arrays))

    def read(
        self, points: Sequence[str], seeds: Sequence[int], arrays: Sequence[str], part: bool = False
    ) -> Arrays:
        """Return arrays and their parts, (points, seeds, ...).

        With `part`, runs can be missing: their floats are nan, and other numbers 0.

        Raises:
            DamagedError: A file cannot be read.
            KeyError: Runs are missing.
        """
        places, held = self.where(points, seeds, arrays)
        if (places < 0).any() and not part:
            raise KeyError(f"{(places < 0).sum()} runs are missing in {files.named(self.folder)}")
        found: Arrays = {}
        for number in np.unique(places[places >= 0]):
            one, (at, of) = held[number], np.nonzero(places == number)
            row = {key: n for n, key in enumerate(one.points)}
            column = {seed: n for n, seed in enumerate(one.seeds)}
            own = (
                np.array([row[points[p]] for p in at.tolist()]),
                np.array([column[seeds[s]] for s in of.tolist()]),
            )
            for name, array in self._arrays(one, arrays).items():
                whole = found.get(name)
                if whole is None:
                    nothing = np.nan if array.dtype.kind == "f" else 0
                    whole = np.full((*places.shape, *array.shape[2:]), nothing, array.dtype)
                found[name] = whole.astype(np.promote_types(whole.dtype, array.dtype), copy=False)
                found[name][at, of] = array[own]
        return found

    def _arrays(self, one: Held, names: Sequence[str]) -> Arrays:
        try:
            with _opened(one.path) as file:
                several = (part for name in names for part in parts_of(name, one.arrays))
                return {name: file[name] for name in several}  # zipfile checks their CRC-32
        except MemoryError:
            raise
        except Exception as error:  # zipfile, zlib and NumPy raise many kinds
            self._set_aside(one.path)
            raise DamagedError(
                f"{files.named(one.path)} is damaged, so its runs are missing; run the command "
                "again to compute them."
            ) from error

    def _set_aside(self, path: Path) -> None:
        self._held.pop(path.name, None)
        self.damaged.append(path)
        with files.writing(path):
            os.replace(path, path.with_suffix(".damaged"))


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Yield the arrays of a regular file, which are read when they are asked for."""
    with files.opened(path) as file, np.load(file, allow_pickle=False) as arrays:
        yield arrays


def _header(path: Path) -> Held | None:
    """Return what a file holds; None if it is damaged."""
    try:
        with _opened(path) as file:
            points, seeds, arrays = json.loads(str(file[_ABOUT]))
            is_whole = set(file.files) == {_ABOUT, *arrays}
        return Held(path, tuple(points), tuple(seeds), tuple(arrays)) if is_whole else None
    except Exception:  # zipfile, zlib and NumPy raise many kinds
        return None
