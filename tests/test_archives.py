"""Writing and reading archives of arrays."""

from __future__ import annotations

import pickle
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from taichi_ants import files
from taichi_ants.errors import AntsError


def test_arrays_read_back(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    arrays = {"x": np.arange(6, dtype=np.int16).reshape(2, 3), "text": np.array("é")}
    files.write_npz(path, arrays)
    read = files.read_npz(path)
    assert set(read) == {"x", "text"}
    np.testing.assert_array_equal(read["x"], arrays["x"])
    assert read["x"].dtype == np.int16
    assert read["text"][()] == "é"


def test_equal_arrays_give_equal_bytes(tmp_path: Path) -> None:
    for name in ("a.npz", "b.npz"):
        files.write_npz(tmp_path / name, {"x": np.arange(100)})
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_python_objects_are_not_written(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="'x' holds Python objects"):
        files.write_npz(tmp_path / "a.npz", {"x": np.array([object()])})
    assert list(tmp_path.iterdir()) == []


class Trap:
    """Unpickling it creates a file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple:
        return Path.touch, (self.path,)


def test_reading_executes_nothing(tmp_path: Path) -> None:
    sprung = tmp_path / "sprung"
    path = tmp_path / "a.npz"
    np.savez(path, x=np.array([Trap(sprung)], dtype=object))
    with pytest.raises(AntsError, match=r"a\.npz"):
        files.read_npz(path)
    path.write_bytes(pickle.dumps(Trap(sprung)))
    with pytest.raises(AntsError, match="damaged or not"):
        files.read_npz(path)
    assert not sprung.exists()


def write_npy(path: Path) -> None:
    with open(path, "wb") as file:
        np.save(file, np.zeros(3))


def write_other_zip(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("readme.txt", "text")


@pytest.mark.parametrize(
    ("write", "message"),
    [
        (lambda path: None, "no such file"),
        (Path.mkdir, "is a directory"),
        (lambda path: path.write_bytes(b""), "damaged or not"),
        (lambda path: path.write_bytes(b"text"), "damaged or not"),
        (lambda path: path.write_bytes(b"PK\x03\x04" + bytes(100)), "damaged or not"),
        (write_npy, "damaged or not"),
        (write_other_zip, "more than arrays"),
    ],
)
def test_what_is_no_archive_is_refused(
    tmp_path: Path, write: Callable[[Path], object], message: str
) -> None:
    path = tmp_path / "a.npz"
    write(path)
    with pytest.raises(AntsError, match=message) as raised:
        files.read_npz(path)
    assert str(path) in str(raised.value)
