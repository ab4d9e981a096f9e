"""Blocks: kept where they are what they must be, done anew with a word where they are not."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants.files import archives
from taichi_ants.studies.blocks import kept

MADE = {
    "steps": np.array([[1, 2, 3], [7, 8, 9]], np.uint8),
    "q_values": np.linspace(-1, 1, 40, dtype=np.float32).reshape(2, 4, 5),
    "seconds": np.array([0.0, 2.5]),
}
ABOUT: dict[str, Any] = {"seeds": (0, 1), "rate": 0.5}


def block(path: Path, about: Mapping[str, Any] = ABOUT) -> bool:
    """Whether a block had to be made; it is as it must be in any case."""
    made = []

    def make() -> dict[str, np.ndarray]:
        made.append(True)
        return MADE

    found = kept(path, about, make)
    assert found.keys() == MADE.keys()
    for name, array in found.items():
        assert array.dtype == MADE[name].dtype
        np.testing.assert_array_equal(array, MADE[name])
    return bool(made)


def test_a_block_is_made_once_without_a_word(tmp_path, capsys):
    assert block(tmp_path / "0.npz")
    assert not block(tmp_path / "0.npz")
    assert capsys.readouterr() == ("", "")


def test_a_block_of_other_work_is_done_anew(tmp_path, capsys):
    block(tmp_path / "0.npz", {**ABOUT, "rate": 0.25})
    assert block(tmp_path / "0.npz")
    assert capsys.readouterr().err


def test_a_damaged_block_is_done_anew(tmp_path, capsys):
    path = tmp_path / "0.npz"
    block(path)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    assert block(path)
    assert (
        capsys.readouterr().err
        == f"{str(path)!r} is damaged or has other settings, so it is computed again.\n"
    )
    assert not block(path)


def test_a_block_that_others_wrote_is_done_anew(tmp_path, capsys):
    block(tmp_path / "0.npz")
    np.savez(tmp_path / "0.npz", **archives.read(tmp_path / "0.npz"))
    assert block(tmp_path / "0.npz")
    assert capsys.readouterr().err
