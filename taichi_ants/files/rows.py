"""Arrays that can be larger than memory: they lie on disk, and are read a row at a time."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from taichi_ants import files


class Rows:
    """An array on disk: `rows[i]`, all that has the first index i, is read only when it is used.

    It is filled once, from its first number to its last. Its file has no name, so that it is gone
    with the object, and with the process even if that is killed.

    Args:
        folder: A folder on whose disk it lies.
        shape: Of the array, none of its numbers 0.
        dtype: The type of its integers.

    Raises:
        AntsError: Nothing can be written there.
    """

    def __init__(self, folder: Path, shape: tuple[int, ...], dtype: npt.DTypeLike) -> None:
        self.shape, self.dtype = shape, np.dtype(dtype)
        self._folder = folder
        with files.writing(folder):
            self._file = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115

    @property
    def size(self) -> int:
        """How many numbers it has."""
        return math.prod(self.shape)

    @property
    def nbytes(self) -> int:
        """How many bytes it takes on disk."""
        return self.size * self.dtype.itemsize

    def append(self, part: np.ndarray) -> None:
        """Write the next numbers, of any shape.

        Raises:
            AntsError: They cannot be written.
            ValueError: They do not fit into the type.
        """
        if (
            np.array([part.min(), part.max()]).astype(self.dtype) != [part.min(), part.max()]
        ).any():
            raise ValueError(f"numbers from {part.min()} to {part.max()} are no {self.dtype}")
        with files.writing(self._folder):
            self._file.write(np.ascontiguousarray(part, self.dtype).data)
            self._file.flush()

    @classmethod
    def load(cls, file: IO[bytes], folder: Path) -> Rows | None:
        """The integers of an .npy; None, and nothing read but its header, of fewer than three axes.

        Raises:
            ValueError: It is damaged.
            AntsError: They cannot be written to the folder.
        """
        np.lib.format.read_magic(file)
        shape, _, dtype = np.lib.format.read_array_header_1_0(file)
        if len(shape) < 3:
            return None
        rows, length = cls(folder, shape, dtype), math.prod(shape[1:])
        for _ in range(len(rows)):
            rows.append(np.frombuffer(file.read(length * dtype.itemsize), dtype, length))
        if file.read(1):
            raise ValueError("an array is longer than it declares")
        return rows

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, row: int) -> np.ndarray:
        at = range(len(self))[row] * math.prod(self.shape[1:]) * self.dtype.itemsize
        return np.memmap(self._file, self.dtype, "r", at, self.shape[1:])

    def __iter__(self) -> Iterator[np.ndarray]:
        return (self[row] for row in range(len(self)))

    def __reduce__(self) -> tuple[Any, ...]:
        """As the array, for another process; it must fit into memory then."""
        return np.stack, ([*map(np.array, self)],)

    def save(self, file: IO[bytes]) -> None:
        """Write it as an .npy, as NumPy writes such an array."""
        facts = {"descr": self.dtype.str, "fortran_order": False, "shape": self.shape}
        np.lib.format.write_array_header_1_0(file, facts)
        for row in self:
            file.write(row.data)
