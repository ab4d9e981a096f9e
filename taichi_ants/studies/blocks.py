"""Blocks: files with finished parts of a study, found by the points and seeds that they hold."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from taichi_ants import files
from taichi_ants.files import archives
from taichi_ants.studies.command_line import notice

Outcome = dict[str, np.ndarray]  # by name
_ABOUT = "about"


class _Held(NamedTuple):
    """The content of a file for a point: its row, the columns of seeds, the names of arrays."""

    path: Path
    row: int
    seeds: dict[str, int]
    arrays: tuple[str, ...]


class Blocks:
    """The finished blocks in a folder.

    Points have keys and seeds have names, which are texts; equal texts mean equal outcomes. Two
    processes may write to the same folder. If not `drops`, damaged files are ignored instead of
    removed.
    """

    def __init__(self, folder: Path, drops: bool = True) -> None:
        self.folder = folder
        self._held: dict[str, list[_Held]] = {}
        self._columns: dict[tuple[str, ...], dict[str, int]] = {}
        self._arrays: dict[tuple[str, ...], tuple[str, ...]] = {}
        self._last: tuple[Path | None, Outcome] = None, {}
        for path in sorted(folder.glob("block-*.npz")):
            header = _header(path)
            if path == self._path(header):
                self._note(path, **json.loads(header))
            elif drops:
                self._drop(path)

    def __iter__(self) -> Iterator[tuple[list[str], list[str], Outcome]]:
        """Yield the points, seeds and arrays (points, seeds, ...) of each block.

        Removes damaged files, with a notice.
        """
        found: dict[Path, dict[str, _Held]] = {}
        for key, several in self._held.items():
            for one in several:
                found.setdefault(one.path, {})[key] = one
        for path in sorted(found):
            points = found[path]
            try:
                outcome = self._read(path)
            except ValueError:  # includes AntsError
                for key, one in points.items():
                    self._held[key].remove(one)
                self._drop(path)
                continue
            yield list(points), list(next(iter(points.values())).seeds), outcome

    def damaged(self) -> list[Path]:
        """Return the files in the folder that are not whole blocks; reads all of them."""
        return [one for one in sorted(self.folder.glob("block-*.npz")) if not self._is_whole(one)]

    def _is_whole(self, path: Path) -> bool:
        with suppress(ValueError):  # includes AntsError
            return path == self._path(_header(path)) and bool(read(path))
        return False

    def add(self, points: Sequence[str], seeds: Sequence[str], outcome: Outcome) -> None:
        """Write a block, arrays (points, seeds, ...); AntsError if it cannot be written."""
        what = {"points": list(points), "seeds": list(seeds), "arrays": sorted(outcome)}
        header = files.to_json(what)
        path = self._path(header)
        archives.write(path, {**outcome, _ABOUT: np.array(header)}, compress=False)
        self._note(path, **what)

    def has(self, point: str, seed: str, array: str | None = None) -> bool:
        """Return whether a block has the outcome of a point and a seed, or one of its arrays."""
        return any(seed in one.seeds for one in self._of(point, array))

    def path_of(self, point: str, seed: str) -> Path | None:
        """Return the file with the outcome of a point and a seed; None without any."""
        return next((one.path for one in self._of(point, None) if seed in one.seeds), None)

    def read(self, point: str, seeds: Sequence[str], array: str | None = None) -> Outcome:
        """Return the arrays (seeds, ...) of a point from blocks with `array`, or from any.

        Raises:
            AntsError: A block cannot be read.
            KeyError: No block has the outcome of a seed.
        """
        parts: list[Outcome] = []
        where: dict[str, int] = {}
        for path, row, held, _ in self._of(point, array):
            new = [seed for seed in seeds if seed in held and seed not in where]
            if new:
                columns = [held[seed] for seed in new]
                parts.append({n: array[row, columns] for n, array in self._read(path).items()})
                where |= {seed: len(where) + n for n, seed in enumerate(new)}
        order = [where[seed] for seed in seeds]
        names = [name for name in parts[0] if all(name in one for one in parts)]
        return {name: np.concatenate([one[name] for one in parts])[order] for name in names}

    def _of(self, point: str, array: str | None) -> Iterator[_Held]:
        return (one for one in self._held.get(point, ()) if array is None or array in one.arrays)

    def _read(self, path: Path) -> Outcome:
        if self._last[0] != path:
            self._last = None, {}  # so that two are never in memory
            self._last = path, read(path)
        return self._last[1]

    def _path(self, header: str) -> Path:
        return self.folder / f"block-{hashlib.sha256(header.encode()).hexdigest()[:32]}.npz"

    def _note(self, path: Path, points: list[str], seeds: list[str], arrays: list[str]) -> None:
        # Blocks share what they have in common, to save memory.
        columns = self._columns.setdefault(tuple(seeds), {})
        columns.update((seed, n) for n, seed in enumerate(seeds))
        names = self._arrays.setdefault(tuple(arrays), tuple(arrays))
        for row, point in enumerate(points):
            self._held.setdefault(point, []).append(_Held(path, row, columns, names))

    def _drop(self, path: Path) -> None:
        notice(f"{str(path)!r} is damaged or has other settings, so it is computed again.")
        with files.writing(path):
            path.unlink(missing_ok=True)


def _header(path: Path) -> str:
    """Return the header of a block, without reading its arrays; "" if it is damaged."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            return str(archive[_ABOUT])
    except Exception:  # zipfile, zlib and NumPy raise many kinds
        return ""


def kept(path: Path, about: Any, make: Callable[[], Outcome]) -> Outcome:
    """Return the arrays of a file (.npz); make and save them if they are missing or damaged.

    `about` is everything that determines them. Raises AntsError if the file cannot be written.
    """
    digest = hashlib.sha256(files.to_json(about).encode()).hexdigest()
    if path.exists():
        try:
            block = archives.read(path)
        except ValueError:  # includes AntsError
            block = {}
        if str(block.pop(_ABOUT, "")) == digest:
            return block
        notice(f"{str(path)!r} is damaged or has other settings, so it is computed again.")
    made = make()
    archives.write(path, {**made, _ABOUT: np.array(digest)}, compress=False)
    return made


def read(path: Path) -> Outcome:
    """Return the arrays of a finished block; raise AntsError if it cannot be read."""
    return {name: array for name, array in archives.read(path).items() if name != _ABOUT}
