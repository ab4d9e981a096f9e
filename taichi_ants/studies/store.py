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
from collections.abc import Iterable, Sequence
from contextlib import suppress
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
    return [array for array in names if array == name or array.startswith(f"{name}.")]


class Stored(NamedTuple):
    """The contents of a file: keys of points, seeds, and names of arrays."""

    path: Path
    points: tuple[str, ...]
    seeds: tuple[int, ...]
    arrays: tuple[str, ...]


class DamagedError(AntsError):
    """A file that cannot be read. It was set aside, so its runs are missing now."""


class Store:
    """The runs in a folder, which need not exist.

    `damaged` are the files that could not be read, and were renamed to `NAME.damaged`.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder / BLOCKS
        self.damaged: list[Path] = []
        self._blocks: dict[str, Stored] = {}  # by file name
        self.refresh()

    def refresh(self) -> None:
        """Take notice of the files that other processes have added or removed."""
        paths = {path.name: path for path in sorted(self.folder.glob("*.npz"))}
        self._blocks = {name: block for name, block in self._blocks.items() if name in paths}
        for name, path in paths.items():
            if name not in self._blocks:
                with suppress(DamagedError):
                    self._blocks[name], _ = self._load(path)

    def where(
        self, points: Sequence[str], seeds: Sequence[int], arrays: Sequence[str]
    ) -> tuple[np.ndarray, list[Stored]]:
        """Return the index of a file with these arrays for each run, and the files.

        The indices are int64 (points, seeds), and -1 for missing runs.
        """
        rows = {key: n for n, key in enumerate(points)}
        columns = {seed: n for n, seed in enumerate(seeds)}
        every = self._blocks.values()
        blocks = [b for b in every if all(parts_of(name, b.arrays) for name in arrays)]
        numbers = np.full((len(points), len(seeds)), -1)
        for number, block in enumerate(blocks):
            p = [rows[key] for key in block.points if key in rows]
            s = [columns[seed] for seed in block.seeds if seed in columns]
            numbers[np.ix_(p, s)] = number
        return numbers, blocks

    def add(self, points: Sequence[str], seeds: Sequence[int], arrays: Arrays) -> None:
        """Write a block of runs; AntsError if it cannot be written."""
        header = json.dumps([list(points), list(seeds), list(arrays)])
        path = self.folder / f"{hashlib.sha256(header.encode()).hexdigest()[:32]}.npz"
        content: dict[str, Any] = {_ABOUT: np.array(header), **arrays}
        files.write_atomically(path, lambda file: np.savez(file, **content))
        self._blocks[path.name] = Stored(path, tuple(points), tuple(seeds), tuple(arrays))

    def read(
        self, points: Sequence[str], seeds: Sequence[int], arrays: Sequence[str], part: bool = False
    ) -> Arrays:
        """Return arrays and their parts, (points, seeds, ...); DamagedError if a file is damaged.

        With `part`, runs can be missing: their floats are nan, and other numbers 0. Without it, a
        missing run is a KeyError.
        """
        numbers, blocks = self.where(points, seeds, arrays)
        if (numbers < 0).any() and not part:
            raise KeyError(f"{(numbers < 0).sum()} runs are missing in {files.named(self.folder)}")
        whole: Arrays = {}
        for number in np.unique(numbers[numbers >= 0]):
            block, (p, s) = blocks[number], np.nonzero(numbers == number)
            row = {key: n for n, key in enumerate(block.points)}
            column = {seed: n for n, seed in enumerate(block.seeds)}
            inside = [row[points[n]] for n in p.tolist()], [column[seeds[n]] for n in s.tolist()]
            for name, array in self._load(block.path, arrays)[1].items():
                if name not in whole:
                    nothing = np.nan if array.dtype.kind == "f" else 0
                    shape = *numbers.shape, *array.shape[2:]
                    whole[name] = np.full(shape, nothing, array.dtype)
                kind = np.promote_types(whole[name].dtype, array.dtype)
                whole[name] = whole[name].astype(kind, copy=False)
                whole[name][p, s] = array[inside]
        return whole

    def _load(self, path: Path, names: Sequence[str] = ()) -> tuple[Stored, Arrays]:
        """Return what a file holds, and some of its arrays; DamagedError after setting it aside."""
        try:
            with files.opened(path) as file, np.load(file, allow_pickle=False) as arrays:
                points, seeds, every = map(tuple, json.loads(str(arrays[_ABOUT])))
                if set(arrays.files) != {_ABOUT, *every}:
                    raise ValueError("arrays are missing")
                parts = [part for name in names for part in parts_of(name, every)]
                # zipfile checks their CRC-32.
                return Stored(path, points, seeds, every), {part: arrays[part] for part in parts}
        except MemoryError:
            raise
        except Exception as error:  # zipfile, zlib and NumPy raise many kinds
            self._blocks.pop(path.name, None)
            self.damaged.append(path)
            with files.writing(path):
                os.replace(path, path.with_suffix(".damaged"))
            raise DamagedError(
                f"{files.named(path)} is damaged, so its runs are missing; run the command again "
                "to compute them."
            ) from error
