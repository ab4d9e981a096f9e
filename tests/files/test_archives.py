"""Writing and reading archives of arrays."""

import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from taichi_ants.errors import AntsError
from taichi_ants.files import archives


def test_equal_arrays_give_equal_bytes(tmp_path: Path) -> None:
    for name in ("a.npz", "b.npz"):
        archives.write(tmp_path / name, {"x": np.arange(100)})
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_python_objects_are_not_written(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="array of references"):
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
    path.write_bytes(pickle.dumps(Trap(sprung)))
    with pytest.raises(AntsError, match="damaged, or not"):
        archives.read(path)
    assert not sprung.exists()


def write_npy(path: Path) -> None:
    with open(path, "wb") as file:
        np.save(file, np.zeros(3))


@pytest.mark.parametrize(
    ("write", "message"),
    [
        (lambda path: None, "no such file"),
        (Path.mkdir, "is a directory"),
        (lambda path: path.write_bytes(b""), "damaged, or not"),
        (write_npy, "damaged, or not"),
    ],
)
def test_what_is_no_archive_is_refused(
    tmp_path: Path, write: Callable[[Path], object], message: str
) -> None:
    path = tmp_path / "a.npz"
    write(path)
    with pytest.raises(AntsError, match=message) as raised:
        archives.read(path)
    assert str(path) in str(raised.value)


@pytest.mark.parametrize(
    "change",
    [{"x": np.arange(1, 4)}, {"x": np.arange(3.0)}, {"x": np.arange(3)[None]}, {"y": 1}, {"x": 0}],
)
def test_an_exchanged_array_is_noticed(change: dict, tmp_path: Path) -> None:
    archives.write(tmp_path / "a.npz", {"x": np.arange(3)})
    with np.load(tmp_path / "a.npz") as archive:
        arrays = dict(archive)
    np.savez(tmp_path / "a.npz", **arrays)
    assert archives.read(tmp_path / "a.npz")["x"].tolist() == [0, 1, 2]
    np.savez(tmp_path / "a.npz", **{**arrays, **change})
    with pytest.raises(AntsError, match="damaged"):
        archives.read(tmp_path / "a.npz")


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
    with pytest.raises(
        AntsError, match=r"a\.npz' unpacks to 8000512 bytes, and at most 7999999 are"
    ):
        archives.read(path, most=7_999_999)
    with pytest.raises(AntsError, match=r"it has .* bytes, and at most 1000 are allowed"):
        archives.read(path, most=1000)


def test_an_array_that_is_larger_than_it_declares_is_refused(tmp_path: Path) -> None:
    """And no more of it is unpacked than it declares."""
    path = tmp_path / "a.npz"
    np.savez_compressed(path, x=np.zeros(10**6))
    content = path.read_bytes()
    assert content.count((8_000_128).to_bytes(4, "little")) >= 2  # one more with Python 3.10
    path.write_bytes(content.replace((8_000_128).to_bytes(4, "little"), bytes([0, 2, 0, 0])))
    with pytest.raises(AntsError, match="damaged"):
        archives.read(path)


KIND = archives.Kind("thing", 3, "Thing.save", most=10_000)


def test_a_kind_of_file_holds_arrays_and_facts(tmp_path: Path) -> None:
    x = np.arange(6, dtype=np.int16).reshape(2, 3)
    KIND.write(tmp_path / "a.npz", {"n": np.int32(3)}, {"x": x, "text": np.array("é")})
    with KIND.reading(tmp_path / "a.npz") as (arrays, facts):
        np.testing.assert_array_equal(arrays["x"], x)
        assert (arrays["x"].dtype, arrays["text"][()], len(arrays)) == (np.int16, "é", 2)
        assert facts == {"kind": "thing", "version": 3, "n": 3}


@pytest.mark.parametrize(
    ("arrays", "said"),
    [
        (
            {"x": 1},
            "in version 3 of its format; name a file that Thing.save wrote.",
        ),
        ({"facts": "{}"}, "does not contain a thing in version 3"),
        ({"facts": 3}, "does not contain a thing in version 3"),
        ({"facts": "[" * 1000}, "does not contain a thing in version 3"),
        ({"facts": '{"kind": "other", "version": 3}'}, "does not contain a thing in version 3"),
        (
            {"facts": '{"kind": "thing", "version": 2}'},
            "does not contain a thing in version 3",
        ),
        ({"x": np.zeros(10_000)}, "unpacks to 80"),
    ],
)
def test_files_of_other_kinds_and_versions_are_refused(
    arrays: dict, said: str, tmp_path: Path
) -> None:
    archives.write(tmp_path / "a.npz", arrays)
    with pytest.raises(AntsError, match=r"a\.npz'") as raised, KIND.reading(tmp_path / "a.npz"):
        pass
    assert said in str(raised.value)


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (KeyError("x"), "is damaged (KeyError: 'x'); name a file that Thing.save wrote."),
        (ValueError("a\nb."), "is damaged (ValueError: a b); name"),
        (AntsError("n is 3; it must be 4."), "cannot be used: n is 3; it must be 4."),
    ],
)
def test_errors_while_an_object_is_built_name_the_file(
    error: Exception, said: str, tmp_path: Path
) -> None:
    KIND.write(tmp_path / "a.npz", {}, {})
    with pytest.raises(AntsError) as raised, KIND.reading(tmp_path / "a.npz"):
        raise error
    assert str(raised.value).startswith(f"the thing in {str(tmp_path / 'a.npz')!r} {said}")
