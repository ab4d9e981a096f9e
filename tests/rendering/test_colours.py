"""The ramp is perceptually uniform, and the colours stay apart for everybody."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from taichi_ants.analysis.style import COLOURS
from taichi_ants.rendering import colours

# Full strength, linear light: Machado, Oliveira and Fernandes (2009).
DEFICIENCIES = {
    "none": np.eye(3),
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritanopia": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
}


def lab(words: object, deficiency: str = "none") -> np.ndarray:
    """CIELAB (..., 3) of colours 0xRRGGBB as somebody sees them."""
    share = colours.channels(np.asarray(words)) / 255
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    linear = np.clip(linear @ np.array(DEFICIENCIES[deficiency]).T, 0, 1)
    to_xyz = np.array(
        [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    )
    ratio = linear @ to_xyz.T / [0.9505, 1.0, 1.089]
    root = np.where(ratio > 0.008856, np.cbrt(ratio), 7.787 * ratio + 16 / 116)
    x, y, z = np.moveaxis(root, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def test_white_black_and_red() -> None:
    """The measure itself, against values from the literature."""
    assert lab(0xFFFFFF) == pytest.approx([100, 0, 0], abs=0.1)
    assert lab(0x000000) == pytest.approx([0, 0, 0], abs=0.1)
    assert lab(0xFF0000) == pytest.approx([53.2, 80.1, 67.2], abs=0.3)


def test_channels() -> None:
    words = np.array([0x010203, 0xFFFEFD, 0])
    assert colours.channels(words).tolist() == [[1, 2, 3], [255, 254, 253], [0, 0, 0]]


@pytest.mark.parametrize("deficiency", DEFICIENCIES)
def test_the_ramp_grows_evenly_darker(deficiency) -> None:
    lightness = lab(colours.TRAIL_RAMP, deficiency)[::15, 0]
    steps = -np.diff(lightness)
    assert (steps > 0).all()
    assert steps.max() < 2.2 * steps.mean()
    assert steps.min() > 0.35 * steps.mean()
    assert lightness[0] - lightness[-1] > 45


@pytest.mark.parametrize("deficiency", DEFICIENCIES)
def test_a_stronger_trail_is_more_striking(deficiency) -> None:
    """Its colour lies further from that of an empty cell; the weakest is still seen."""
    empty = lab(colours.CELL_EMPTY, deficiency)
    striking = np.linalg.norm(lab(colours.TRAIL_RAMP, deficiency) - empty, axis=1)[::15]
    assert (np.diff(striking) > 0.3).all()
    assert 10 < striking[0] < striking[-1] / 2


@pytest.mark.parametrize("deficiency", DEFICIENCIES)
def test_things_stay_apart(deficiency) -> None:
    things = {
        "empty": colours.CELL_EMPTY,
        "obstacle": colours.CELL_OBSTACLE,
        "food": colours.CELL_FOOD,
        "queen": colours.CELL_QUEEN,
        "ant": colours.ANT,
    }
    for (one, first), (other, second) in itertools.combinations(things.items(), 2):
        apart = np.linalg.norm(lab(first, deficiency) - lab(second, deficiency))
        assert apart > 22, (one, other, apart)
    ramp = lab(colours.TRAIL_RAMP, deficiency)
    least = {"empty": 10, "obstacle": 20, "food": 18, "queen": 30, "ant": 35}
    for name, word in things.items():
        apart = np.linalg.norm(ramp - lab(word, deficiency), axis=1).min()
        assert apart > least[name], (name, apart)


@pytest.mark.parametrize("several", [colours.QUEENS, colours.ANTS, colours.FOODS])
def test_nests_and_kinds_of_food_stay_apart(several) -> None:
    """Two at least for people with colour deficiencies, and all for others."""
    for one, other in itertools.combinations(several.tolist(), 2):
        assert np.linalg.norm(lab(one) - lab(other)) > 12, (hex(one), hex(other))
    for deficiency in DEFICIENCIES:
        apart = lab(int(several[0]), deficiency) - lab(int(several[1]), deficiency)
        assert np.linalg.norm(apart) > 12, deficiency


def test_fields_and_kinds_of_food_stay_apart() -> None:
    """All of them, and for people with colour deficiencies the first field and two kinds."""
    fields = [int(colours.field_ramp(number)[-1]) for number in range(4)]
    for field, food in itertools.product(fields, colours.FOODS.tolist()):
        assert np.linalg.norm(lab(field) - lab(food)) > 20, (hex(field), hex(food))
    for deficiency in DEFICIENCIES:
        for food in colours.FOODS[:2].tolist():
            assert np.linalg.norm(lab(fields[0], deficiency) - lab(food, deficiency)) > 20


@pytest.mark.parametrize("deficiency", DEFICIENCIES)
def test_lines_of_the_figures_stay_apart(deficiency) -> None:
    """Of the comparison and of the colony; with more lines, markers tell them apart, too."""
    seen = lab([int(colour[1:], 16) for colour in COLOURS[:5]], deficiency)
    for first, second in itertools.combinations(seen, 2):
        assert np.linalg.norm(first - second) > 24


def test_text_can_be_read() -> None:
    for ink, least in ((colours.INK, 80), (colours.FAINT_INK, 50)):
        assert lab(colours.PAGE)[0] - lab(ink)[0] > least
