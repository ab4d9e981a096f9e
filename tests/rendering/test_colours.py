"""The ramp is perceptually uniform, and the colours stay apart for everybody."""

import itertools
import re

import numpy as np
import pytest
import vision
from vision import DEFICIENCIES, lab

from taichi_ants.analysis.style import COLOURS
from taichi_ants.rendering import colours
from taichi_ants.task.constants import MAX_FOOD_KINDS, MAX_NESTS
from taichi_ants.viewer.page import part

# CIELAB pairs and their CIEDE2000 from Sharma, Wu and Dalal (2005), table 1: blues, greys, hues
# and large differences.
SHARMA = [
    ((50, 2.6772, -79.7751), (50, 0, -82.7485), 2.0425),
    ((50, 0, 0), (50, -1, 2), 2.3669),
    ((50, 2.5, 0), (73, 25, -18), 27.1492),
    ((60.2574, -34.0099, 36.2677), (60.4626, -34.1751, 39.4387), 1.2644),
    ((2.0776, 0.0795, -1.1350), (0.9033, -0.0636, -0.5514), 0.9082),
]


@pytest.mark.parametrize(("one", "other", "difference"), SHARMA)
def test_ciede2000_is_that_of_the_published_pairs(one, other, difference) -> None:
    assert vision.ciede2000(one, other) == pytest.approx(difference, abs=6e-5)
    assert vision.ciede2000(other, one) == pytest.approx(difference, abs=6e-5)


@pytest.mark.parametrize("deficiency", DEFICIENCIES)
def test_the_ramp_grows_evenly_darker(deficiency) -> None:
    lightness = lab(colours.TRAIL_RAMP, deficiency)[::15, 0]
    steps = -np.diff(lightness)
    assert (steps > 0).all()
    assert steps.max() < 2.2 * steps.mean()
    assert steps.min() > 0.35 * steps.mean()
    assert lightness[0] - lightness[-1] > 45


def theme_of(number: int) -> dict[str, list[int]]:
    """The colours of a theme of the pages, by name; the light ones are those of the pictures."""
    block = part("colours.css").split("}")[number]
    found = re.findall(r"--([a-z-]+): (#[^;]+);", block)
    return {name: [int(word[1:], 16) for word in value.split()] for name, value in found}


def close(ones: list[int], others: list[int], least: float = 10) -> list[tuple[str, str, float]]:
    """The pairs of different colours that are closer than `least` for somebody."""
    pairs = [(one, other) for one in ones for other in others if one != other]
    near = vision.apart(*np.array(pairs).T)
    return [(f"{a:06x}", f"{b:06x}", d) for (a, b), d in zip(pairs, near, strict=True) if d < least]


@pytest.mark.parametrize("theme", [0, 1], ids=["light", "dark"])
def test_all_that_can_meet_stays_apart(theme) -> None:
    """For everybody, in a page and in a picture.

    The backgrounds of food and queen differ by what is drawn on them, and loads of further kinds of
    food from ants of further nests by their place.
    """
    of = theme_of(theme)
    samples = steps_of(of["trail"])
    grounds = [*of["empty"], *of["rock"], *samples]
    assert not close(of["empty"] + of["rock"], grounds)
    assert not close(of["page"], of["rock"] + samples)
    nests = of["queen"] + of["ant"] + of["nests"]
    assert len(of["nests"]) == MAX_NESTS - 1
    assert not close(nests, nests + grounds + of["loaded-dot"])
    assert not close(of["queen"] + of["nests"], of["queen-floor"])
    foods = of["food"] + of["foods"]
    assert len(foods) == MAX_FOOD_KINDS
    assert not close(foods, foods + of["food-floor"] + of["empty"] + of["ant"])
    assert not close(of["foods"], of["loaded-dot"])
    assert not close(of["food"] + of["loaded-dot"], grounds)
    # These have an edge in another colour, which is seen where the mark itself is not.
    for mark in (of["chosen"], of["mark"], of["ink"], of["ant"], of["nests"]):
        assert not close(mark, of["halo"])
    assert not close(of["halo"], samples)


def contrasts(ones: list[int], others: list[int]) -> np.ndarray:
    """The contrast of WCAG 2 of each colour with each other."""
    parts = [colours.channels(np.array(words)) / 255 for words in (ones, others)]
    linear = [np.where(p <= 0.04045, p / 12.92, ((p + 0.055) / 1.055) ** 2.4) for p in parts]
    light, other = (one @ (0.2126, 0.7152, 0.0722) + 0.05 for one in linear)
    ratio = light[:, None] / other
    return np.maximum(ratio, 1 / ratio)


@pytest.mark.parametrize("theme", [0, 1], ids=["light", "dark"])
def test_text_can_be_read_and_ants_stand_out(theme) -> None:
    of = theme_of(theme)
    for ink in ("ink", "faint", "chosen", "good", "bad"):
        assert contrasts(of[ink], of["card"]) > 4.5, ink
    # Where the trail comes near the colour of ants, the edge around them sets them apart.
    assert (contrasts(of["ant"] + of["halo"], of["empty"] + of["trail"]).max(axis=0) > 3).all()
    # Food in small cells is a dot with a ring.
    assert (contrasts(of["food"] + of["food-floor"], of["trail"]).max(axis=0) > 1.75).all()
    assert contrasts(of["food"], of["food-floor"]) > 2.9
    assert (np.diff(contrasts(of["trail"], of["page"])[:, 0]) > 0).all()


def steps_of(samples: list[int]) -> list[int]:
    """Colours of a ramp with four steps between its samples."""
    parts = colours.channels(np.array(samples)).T
    places = np.linspace(0, len(samples) - 1, 4 * len(samples) - 3)
    steps = np.rint([np.interp(places, range(len(samples)), part) for part in parts])
    return (steps.T.astype(int) @ (1 << 16, 1 << 8, 1)).tolist()


def test_pictures_have_the_light_colours_of_pages() -> None:
    """All of them, so what holds for one holds for the other."""
    light = theme_of(0)
    named = {
        **{"page": colours.PAGE, "empty": colours.CELL_EMPTY, "rock": colours.CELL_OBSTACLE},
        **{"food-floor": colours.FLOOR_FOOD, "queen-floor": colours.FLOOR_QUEEN},
        **{"ink": colours.INK, "rule": colours.RULE, "chosen": colours.CHOSEN},
    }
    assert {name: light[name] for name in named} == {name: [word] for name, word in named.items()}
    assert light["queen"] + light["nests"] == colours.QUEENS.tolist()
    assert light["ant"] + light["nests"] == colours.ANTS.tolist()
    assert light["food"] + light["foods"] == colours.FOODS.tolist()
    assert light["loaded-dot"] == [colours.FOOD_DOT]
    assert colours.TRAIL_RAMP[np.linspace(0, 255, 9).round().astype(int)].tolist() == light["trail"]


def test_drawings_and_fields_stay_apart_in_pictures() -> None:
    """Where only pictures have colours: floors of each nest and kind, and further fields."""
    assert (vision.apart(colours.QUEENS, colours.QUEEN_FLOORS) > 10).all()
    assert (vision.apart(colours.FOODS, colours.FOOD_FLOORS) > 10).all()
    fields = [int(colours.field_ramp(number)[-1]) for number in range(colours.N_FIELDS)]
    grounds = [colours.CELL_EMPTY, colours.CELL_OBSTACLE, *colours.TRAIL_RAMP[::8].tolist()]
    assert not close(fields, fields + grounds + [colours.ANT])
    weakest = [int(colours.field_ramp(number)[0]) for number in range(colours.N_FIELDS)]
    assert not close(weakest, [colours.CELL_EMPTY])


@pytest.mark.parametrize("deficiency", DEFICIENCIES)
def test_lines_of_the_figures_stay_apart(deficiency) -> None:
    """Of the comparison and of the colony; with more lines, markers tell them apart, too."""
    seen = lab([int(colour[1:], 16) for colour in COLOURS[:5]], deficiency)
    for first, second in itertools.combinations(seen, 2):
        assert np.linalg.norm(first - second) > 24
