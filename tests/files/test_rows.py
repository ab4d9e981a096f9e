"""Arrays on disk: they are what arrays in memory are, and leave nothing behind."""

from __future__ import annotations

import gc
import io
from pathlib import Path

import numpy as np
import pytest

from taichi_ants import AntsError
from taichi_ants.files import archives
from taichi_ants.files.rows import Rows

NUMBERS = np.random.default_rng(0).integers(-500, 500, size=(4, 3, 7))


def on_disk(folder: Path, array: np.ndarray = NUMBERS, dtype: type = np.int16) -> Rows:
    """The array as rows, written in parts that begin and end anywhere in a row."""
    rows = Rows(folder, array.shape, dtype)
    for part in np.array_split(array.ravel(), 5):
        rows.append(part)
    return rows


def test_rows_are_those_of_the_array(tmp_path: Path) -> None:
    rows = on_disk(tmp_path)
    assert (rows.shape, rows.size, len(rows), rows.nbytes) == ((4, 3, 7), 84, 4, 168)
    np.testing.assert_array_equal(np.stack(list(rows)), NUMBERS)
    np.testing.assert_array_equal(rows[-1], NUMBERS[-1])
    assert rows[2].dtype == np.int16
    with pytest.raises(IndexError):
        rows[4]
    with pytest.raises(ValueError, match="read-only"):
        rows[0][0, 0] = 1


def test_rows_come_back_from_an_archive(tmp_path: Path) -> None:
    few = np.arange(12).reshape(4, 3)
    archives.write(tmp_path / "rows.npz", {"a": on_disk(tmp_path), "few": few})
    archives.write(tmp_path / "array.npz", {"a": NUMBERS.astype(np.int16), "few": few})
    assert (tmp_path / "rows.npz").read_bytes() == (tmp_path / "array.npz").read_bytes()
    read = archives.read(tmp_path / "rows.npz", rows_in=tmp_path)
    assert isinstance(read["a"], Rows)
    np.testing.assert_array_equal(np.stack(list(read["a"])), NUMBERS)
    assert isinstance(read["few"], np.ndarray)
    np.testing.assert_array_equal(read["few"], few)


@pytest.mark.parametrize("change", [lambda all_of_it: all_of_it[:-1], lambda one: one + b"\0"])
def test_an_array_of_another_length_than_it_declares_is_damaged(change, tmp_path: Path) -> None:
    file = io.BytesIO()
    on_disk(tmp_path).save(file)
    with pytest.raises(ValueError, match=r"buffer is smaller|longer than it declares"):
        Rows.load(io.BytesIO(change(file.getvalue())), tmp_path)


def test_numbers_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    rows = Rows(tmp_path, (2, 3), np.uint8)
    for number in (-1, 256):
        with pytest.raises(ValueError, match="are no uint8"):
            rows.append(np.array([number]))


def test_nothing_is_left_behind(tmp_path: Path) -> None:
    rows = on_disk(tmp_path)
    assert list(tmp_path.iterdir()) == []
    row = rows[1]
    del rows
    gc.collect()
    np.testing.assert_array_equal(row, NUMBERS[1])  # a row outlives the rest


def test_a_place_where_nothing_can_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(AntsError, match=r"cannot write '.*nowhere'"):
        Rows(tmp_path / "nowhere", (1, 1), np.uint8)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_disk_that_becomes_full_is_named(tmp_path: Path, monkeypatch) -> None:
    rows = Rows(tmp_path, (2, 100_000), np.uint8)
    with open("/dev/full", "wb", buffering=0) as full:
        monkeypatch.setattr(rows, "_file", full)
        with pytest.raises(AntsError, match=r"cannot write '.*': no space left on device"):
            rows.append(np.zeros(100_000, np.uint8))
