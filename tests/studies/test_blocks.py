"""Blocks: kept where they are what they must be, done anew with a word where they are not."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from taichi_ants.files import archives
from taichi_ants.studies.blocks import Form, kept

FORMS = {
    "steps": Form(np.integer, (2, 3), 1, 9),
    "q_values": Form(np.float32, (2, 4, 5)),
    "seconds": Form(np.float64, (2,), 0),
}
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

    found = kept(path, about, FORMS, make)
    assert found.keys() == MADE.keys()
    for name, array in found.items():
        assert array.dtype == MADE[name].dtype
        np.testing.assert_array_equal(array, MADE[name])
    return bool(made)


def test_a_block_is_made_once_without_a_word(tmp_path, capsys):
    assert block(tmp_path / "0.npz")
    assert not block(tmp_path / "0.npz")
    assert capsys.readouterr() == ("", "")


def with_value(name: str, value: float) -> dict[str, np.ndarray]:
    array = MADE[name].astype(np.int16) if name == "steps" else MADE[name].copy()
    array.flat[1] = value
    return {name: array}


WRONG = {
    "not a number": with_value("q_values", np.nan),
    "infinite": with_value("q_values", -np.inf),
    "time without end": with_value("seconds", np.inf),
    "negative": with_value("steps", -1),
    "too small": with_value("steps", 0),
    "too large": with_value("steps", 10),
    "less than nothing": with_value("seconds", -0.5),
    "text": {"steps": np.full((2, 3), "2")},
    "floats": {"steps": MADE["steps"].astype(float)},
    "doubles": {"q_values": MADE["q_values"].astype(float)},
    "complex": {"seconds": MADE["seconds"].astype(complex)},
    "another shape": {"steps": MADE["steps"].T},
    "one number": {"steps": np.array(3)},
    "one more": {"x": np.zeros(3)},
    "of nothing": {"about": np.array("")},
    "about numbers": {"about": np.zeros(3)},
}


@pytest.mark.parametrize("wrong", WRONG)
def test_what_a_block_cannot_be_is_done_anew(wrong, tmp_path, capsys):
    path = tmp_path / "0.npz"
    block(path)
    archives.write(path, {**archives.read(path), **WRONG[wrong]})
    assert block(path)
    assert (
        capsys.readouterr().err
        == f"{str(path)!r} is damaged or of other work, so it is done anew.\n"
    )
    assert not block(path)


@pytest.mark.parametrize("name", [*MADE, "about"])
def test_a_block_that_lacks_something_is_done_anew(name, tmp_path, capsys):
    path = tmp_path / "0.npz"
    block(path)
    archives.write(path, {n: one for n, one in archives.read(path).items() if n != name})
    assert block(path)
    assert capsys.readouterr().err


def test_a_block_of_other_work_is_done_anew(tmp_path, capsys):
    block(tmp_path / "0.npz", {**ABOUT, "rate": 0.25})
    assert block(tmp_path / "0.npz")
    assert capsys.readouterr().err


def test_a_block_that_others_wrote_is_done_anew(tmp_path, capsys):
    block(tmp_path / "0.npz")
    np.savez(tmp_path / "0.npz", **archives.read(tmp_path / "0.npz"))
    assert block(tmp_path / "0.npz")
    assert capsys.readouterr().err


@pytest.mark.parametrize(
    ("least", "most", "bounded"),
    [
        (0, 1, np.uint8),
        (1, 256, np.uint16),
        (-200, 200, np.int16),
        (-6000, 6000, np.int32),
        (0, np.inf, np.uint32),
        (-np.inf, np.inf, np.int64),
    ],
)
def test_a_form_tells_how_much_its_arrays_take_at_most(least, most, bounded):
    form = Form(np.integer, (2, 3), least, most)
    assert form.bounded == bounded
    assert form.nbytes == 6 * np.dtype(bounded).itemsize
    assert Form(np.float32, (4, 5)).nbytes == 80
