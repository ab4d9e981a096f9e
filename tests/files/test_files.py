"""Writing files whole or not at all."""

import csv
import errno
import os
import tempfile
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pytest

from taichi_ants import files
from taichi_ants.errors import AntsError


def names(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir())


def test_a_file_is_written_and_replaced(tmp_path: Path) -> None:
    path = tmp_path / "new" / "folder" / "a.bin"
    for content in (b"one", b"two, longer"):
        files.write_atomically(path, lambda file, content=content: file.write(content))
        assert path.read_bytes() == content
    assert names(path.parent) == ["a.bin"]


@pytest.mark.parametrize(
    ("error", "raised", "said"),
    [
        (KeyError("broken"), KeyError, "broken"),
        (KeyboardInterrupt(), KeyboardInterrupt, "^$"),
        (OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), AntsError, "a.bin': no space left"),
    ],
)
def test_a_failing_writer_leaves_the_old_file_and_nothing_else(
    error: BaseException, raised: type, said: str, tmp_path: Path
) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(b"old")

    def writer(file: BinaryIO) -> None:
        file.write(b"half of the n")
        raise error

    with pytest.raises(raised, match=said):
        files.write_atomically(path, writer)
    assert path.read_bytes() == b"old"
    assert names(tmp_path) == ["a.bin"]


def test_a_replacement_that_fails_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def replace(source: str, target: str) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(os, "replace", replace)
    with pytest.raises(AntsError, match="read-only file system"):
        files.write_text(tmp_path / "a.txt", "text")
    assert names(tmp_path) == []


def test_a_symbolic_link_is_followed(tmp_path: Path) -> None:
    target = tmp_path / "target.txt"
    target.write_text("old")
    link = tmp_path / "link.txt"
    link.symlink_to(target)
    files.write_text(link, "new")
    assert link.is_symlink()
    assert target.read_text() == "new"


def test_a_new_file_has_the_permissions_of_any_new_file(tmp_path: Path) -> None:
    (tmp_path / "plain").write_text("text")
    files.write_text(tmp_path / "atomic", "text")
    modes = [(tmp_path / name).stat().st_mode for name in ("plain", "atomic")]
    assert modes[0] == modes[1]


@pytest.mark.parametrize("name", ["old", "new", "new/folder/file", "link", "loop"])
def test_a_file_that_can_be_written_is_let_be(tmp_path: Path, name: str) -> None:
    (tmp_path / "old").write_text("old")
    (tmp_path / "link").symlink_to(tmp_path / "to be made")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    before = names(tmp_path)
    assert files.check_writable_file(tmp_path / name) == tmp_path / name
    assert names(tmp_path) == before
    assert (tmp_path / "old").read_text() == "old"


BAD_TARGETS = {
    "folder": "not a regular file",
    "": "not a regular file",
    "new/": "not a regular file",
    "pipe": "not a regular file",
    "/dev/null": "not a regular file",
    "file/below": "not a directory",
    "/proc/file": "no such file or directory",
    "n" * 256: "too long",
    "a\0b": "null (byte|character)",
}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
@pytest.mark.parametrize("name", BAD_TARGETS)
def test_a_file_that_cannot_be_written_is_told_before_the_work(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("content")
    os.mkfifo(tmp_path / "pipe")
    monkeypatch.chdir(tmp_path)
    before = names(tmp_path)
    with pytest.raises(AntsError, match=BAD_TARGETS[name]) as early:
        files.check_writable_file(name)
    with pytest.raises(AntsError) as late:
        files.write_text(name, "text")
    assert str(early.value) == str(late.value)
    assert names(tmp_path) == before


def test_a_disk_that_is_full_is_told_before_the_work(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(tempfile, "TemporaryFile", lambda dir: open("/dev/full", "wb"))  # noqa: SIM115
    with pytest.raises(AntsError, match="no space left on device"):
        files.check_writable_file(tmp_path / "new")


def test_text_is_utf_8_with_its_own_line_ends(tmp_path: Path) -> None:
    files.write_text(tmp_path / "a.txt", "é\nb\r\n")
    assert (tmp_path / "a.txt").read_bytes() == b"\xc3\xa9\nb\r\n"


def test_json_of_arrays_and_paths() -> None:
    value = {
        "integer": np.int32(3),
        "float": np.float32(0.5),
        "flag": np.bool_(True),
        "array": np.array([[1.0, 2.0]]),
        "tuple": (1, None),
        "path": Path("a/b"),
        "text": "é",
    }
    assert files.to_json(value) == (
        '{"integer": 3, "float": 0.5, "flag": true, "array": [[1.0, 2.0]], "tuple": [1, null], '
        '"path": "a/b", "text": "é"}'
    )
    with pytest.raises(TypeError):
        files.to_json({"a": object()})


def test_csv_reads_back(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    rows = [
        {"b": 0.1 + 0.2, "a": 'with, comma and "quotes"\nand a line'},
        {"a": None, "b": np.float64(1e-300)},
        {"b": np.float32(0.1)},
        {"a": float("nan"), "b": 2},
    ]
    files.write_csv(path, rows, ["a", "b"])
    assert path.read_bytes().startswith(b"a,b\n")
    with open(path, newline="", encoding="utf-8") as file:
        read = list(csv.DictReader(file))
    assert [row["a"] for row in read] == ['with, comma and "quotes"\nand a line', "", "", ""]
    assert [float(row["b"]) for row in read] == [0.1 + 0.2, 1e-300, float(np.float32(0.1)), 2]


def test_text_is_read_with_any_line_ends(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_bytes("é\r\nb\rc\n".encode())
    assert files.read_text(tmp_path / "a.txt") == "é\nb\nc\n"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"\xff", "is not UTF-8 text; name another file."),
        (b"12345678 ", "it has 9 bytes, and at most 8 are allowed; name another file."),
    ],
)
def test_text_that_is_none_or_too_long_is_refused(
    content: bytes, said: str, tmp_path: Path
) -> None:
    (tmp_path / "a.txt").write_bytes(content)
    with pytest.raises(AntsError) as caught:
        files.read_text(tmp_path / "a.txt", most=8)
    assert str(tmp_path / "a.txt") in str(caught.value)
    assert str(caught.value).endswith(said)


@pytest.mark.parametrize("path", ["a\0b", "n" * 5000, "\udc80/\ud800"])
def test_a_name_that_no_file_has_is_refused(path: str) -> None:
    with pytest.raises(AntsError, match="cannot read"):
        files.read_text(path)
