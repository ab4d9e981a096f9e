"""Writing and reading archives of arrays."""

from __future__ import annotations

import pickle
import zipfile
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np
import pytest

from taichi_ants import archives
from taichi_ants.errors import AntsError


def test_arrays_read_back(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    arrays = {"x": np.arange(6, dtype=np.int16).reshape(2, 3), "text": np.array("é")}
    archives.write(path, arrays)
    read = archives.read(path)
    assert set(read) == {"x", "text"}
    np.testing.assert_array_equal(read["x"], arrays["x"])
    assert read["x"].dtype == np.int16
    assert read["text"][()] == "é"


def test_equal_arrays_give_equal_bytes(tmp_path: Path) -> None:
    for name in ("a.npz", "b.npz"):
        archives.write(tmp_path / name, {"x": np.arange(100)})
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_python_objects_are_not_written(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="'x' holds Python objects"):
        archives.write(tmp_path / "a.npz", {"x": np.array([object()])})
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
        archives.read(path)
    with pytest.raises(AntsError, match="damaged or not"):
        archives.read(path, foreign=True)
    path.write_bytes(pickle.dumps(Trap(sprung)))
    with pytest.raises(AntsError, match="damaged or not"):
        archives.read(path)
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
        archives.read(path, foreign=True)
    assert str(path) in str(raised.value)


def flipped(content: bytes, places: Iterable[int]) -> Iterator[bytes]:
    """The content with each bit of some bytes flipped, one after the other."""
    for place in places:
        for bit in range(8):
            yield content[:place] + bytes([content[place] ^ 1 << bit]) + content[place + 1 :]


@pytest.mark.filterwarnings("ignore")  # of damaged types
@pytest.mark.parametrize("compress", [False, True])
def test_a_flipped_bit_in_the_header_of_an_array_is_noticed(compress: bool, tmp_path: Path) -> None:
    """One that makes the header shorter shifts the data, whose checksum stands at their end."""
    path, numbers = tmp_path / "a.npz", np.random.default_rng(0).random(3000)
    (np.savez_compressed if compress else np.savez)(path, x=numbers)
    content = path.read_bytes()
    for damaged in flipped(content, range(200)):
        try:
            read = archives.read(path, damaged, foreign=True)
        except AntsError:
            continue
        np.testing.assert_array_equal(read["x"], numbers)
    archives.write(path, {"x": numbers}, compress)
    for damaged in flipped(path.read_bytes(), range(200)):
        with pytest.raises(AntsError, match="damaged"):
            archives.read(path, damaged)


def test_only_files_of_ours_are_read_unless_others_are_asked_for(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", x=1)
    with pytest.raises(
        AntsError, match=r"not an \.npz file that this version wrote; write it again"
    ):
        archives.read(tmp_path / "a.npz")
    assert archives.read(tmp_path / "a.npz", foreign=True) == {"x": 1}


def test_others_read_our_files(tmp_path: Path) -> None:
    archives.write(tmp_path / "a.npz", {"x": np.arange(3)})
    with np.load(tmp_path / "a.npz") as archive:
        assert archive["x"].tolist() == [0, 1, 2]


@pytest.fixture
def no_array(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*arguments: object, **options: object) -> None:
        raise AssertionError("an array was unpacked")

    monkeypatch.setattr("numpy.lib.format.read_array", refuse)


@pytest.mark.usefixtures("no_array")
def test_what_would_take_too_much_memory_is_not_unpacked(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    archives.write(path, {"x": np.zeros(10**6)})
    assert path.stat().st_size < 100_000
    with pytest.raises(AntsError, match=r"a\.npz' unpacks to 8000128 bytes, and 7999999 are"):
        archives.read(path, most=7_999_999)
    with pytest.raises(AntsError, match=r"it has .* bytes, and 1000 are allowed"):
        archives.read(path, most=1000)


def test_an_array_that_is_larger_than_it_declares_is_refused(tmp_path: Path) -> None:
    """And no more of it is unpacked than it declares."""
    path = tmp_path / "a.npz"
    np.savez_compressed(path, x=np.zeros(10**6))
    content = path.read_bytes()
    assert content.count((8_000_128).to_bytes(4, "little")) == 2
    path.write_bytes(content.replace((8_000_128).to_bytes(4, "little"), bytes([0, 2, 0, 0])))
    with pytest.raises(AntsError, match="damaged"):
        archives.read(path, foreign=True)


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_only_what_numpy_packs_is_unpacked(method: int, tmp_path: Path) -> None:
    """Others need memory that no file declares."""
    path = tmp_path / "a.npz"
    np.save(tmp_path / "x.npy", np.zeros(3))
    with zipfile.ZipFile(path, "w", method) as archive:
        archive.write(tmp_path / "x.npy", "x.npy")
    with pytest.raises(AntsError, match="damaged"):
        archives.read(path, foreign=True)


def test_memory_that_there_is_not_is_no_damage(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*arguments: object, **options: object) -> None:
        raise MemoryError

    archives.write(tmp_path / "a.npz", {"x": np.zeros(3)})
    monkeypatch.setattr("numpy.lib.format.read_array", refuse)
    with pytest.raises(AntsError, match=r"a\.npz' takes more memory than there is; "):
        archives.read(tmp_path / "a.npz")


@pytest.mark.parametrize("foreign", [False, True])
def test_a_flipped_bit_or_a_cut_anywhere_in_our_own_file_is_noticed(
    foreign: bool, tmp_path: Path
) -> None:
    """The label of the checksum and the length of the comment included."""
    path = tmp_path / "a.npz"
    archives.write(path, {"x": np.arange(40)})
    content = path.read_bytes()
    for damaged in (
        *flipped(content, range(len(content))),
        *(content[:length] for length in range(len(content))),
    ):
        with pytest.raises(AntsError, match="damaged"):
            archives.read(path, damaged, foreign=foreign)


def test_an_archive_of_others_has_no_comment(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, x=np.arange(3))
    assert archives.read(path, foreign=True)["x"].tolist() == [0, 1, 2]
    with zipfile.ZipFile(path, "a") as archive:
        archive.comment = b"made by others"
    with pytest.raises(AntsError, match="damaged"):
        archives.read(path, foreign=True)
