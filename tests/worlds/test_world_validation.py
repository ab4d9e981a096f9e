"""Every way to misdescribe a world is refused with a sentence that names the value."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from taichi_ants.errors import AntsError
from taichi_ants.worlds import World, from_text, to_text

HUGE = 10**5000  # more digits than Python writes


def world(**changes: object) -> World:
    return World(**{"ranges": (5, 5, 5), "queen": (0, 0, 0), **changes})


@pytest.mark.parametrize(
    "ranges",
    [
        (5, 5),
        np.array([5.0, 5, 5]),
        (0, 5, 5),
        (True, 5, 5),
        "555",
        (1, 1, HUGE),
        {"x": 1, "y": 2, "z": 3},
    ],
)
def test_ranges(ranges: object) -> None:
    with pytest.raises(AntsError, match=r"ranges are .*three whole numbers \(X, Y, Z\)"):
        world(ranges=ranges)


def test_several_nests_and_kinds_of_food() -> None:
    one = World((6, 6, 6), [(0, 0, 0), (5, 1, 0)], [((3, 3, 0), 1), (2, 2, 0), ((1, 0, 1), 2)])
    assert one.queen == (0, 0, 0)
    assert one.queens.tolist() == [[0, 0, 0], [5, 1, 0]]
    assert one.foods.tolist() == [[1, 0, 1], [2, 2, 0], [3, 3, 0]]  # kinds are sorted with them
    assert one.food_kinds.tolist() == [2, 0, 1]
    assert (one.n_nests, one.n_food_kinds) == (2, 3)
    assert one == replace(one) == World.from_dict(one.as_dict()) == pickle.loads(pickle.dumps(one))
    assert one != replace(one, other_queens=()) != replace(one, food_kinds=())
    assert from_text(to_text(one)).n_nests == 2
    (here,) = np.nonzero(one.kinds_by_cell() == 2)
    assert one.grid.cells(here).tolist() == [[1, 0, 1]]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"queen": [(0, 0, 0), (0, 0, 0)]}, "queens contain (0, 0, 0) more than once"),
        ({"queen": [(0, i, 0) for i in range(8)]}, "queen has 8 cells; a world has at most 7"),
        ({"queen": [(0, 0, 0), (1, 0)]}, "queen[1] is (1, 0); it must be (x, y, z)"),
        ({"foods": [((1, 0, 0), 8)]}, "food_kinds[0] is 8; it must lie between 0 and 7"),
        ({"foods": [((1, 0, 0), 0.5)]}, "food_kinds[0] is 0.5"),
        ({"foods": [(1, 0, 0)], "food_kinds": [0, 1]}, "food_kinds has 2 entries for 1 food item"),
    ],
)
def test_wrong_nests_and_kinds(changes: dict, message: str) -> None:
    with pytest.raises(AntsError) as caught:
        world(**changes)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    "queen", [(0, 0), (0.0, 0, 0), (np.nan, 0, 0), "000", None, 7, [], np.zeros(3)]
)
def test_the_queen_is_one_cell(queen: object) -> None:
    with pytest.raises(AntsError, match=r"queen is .*one cell \(x, y, z\)"):
        world(queen=queen)


@pytest.mark.parametrize("name", ["foods", "obstacles"])
@pytest.mark.parametrize(
    ("cells", "named"),
    [
        ([(1, 0, 0), (2.0, 0, 0)], "[1] is (2.0, 0, 0)"),
        ([(1, 0)], "[0] is (1, 0)"),
        ("100", " is '100'"),
        ([(HUGE, 0, 0)], "[0] is a huge number"),
        (np.ones((2, 3)), " is an array of shape (2, 3) and type float64"),
    ],
)
def test_cells_are_three_whole_numbers(name: str, cells: object, named: str) -> None:
    with pytest.raises(AntsError) as caught:
        world(**{name: cells})
    assert f"{name}{named}" in str(caught.value)


@pytest.mark.parametrize("name", ["foods", "obstacles"])
def test_cells_are_inside(name: str) -> None:
    message = rf"{name}\[1\] is \(1, 6, 1\), outside"
    with pytest.raises(AntsError, match=message):
        world(**{name: [(1, 0, 0), (1, 6, 1)]})
    with pytest.raises(AntsError, match=message):
        world(**{name: np.array([(1, 0, 0), (1, 6, 1)])})


@pytest.mark.parametrize(
    ("name", "entries"),
    [
        ("foods", [(1, 0, 0), (2, 1, 1)]),
        ("obstacles", np.array([(1, 0, 0), (1, 0, 0)])),
        ("trails", [((1, 0, 0), 4), ((2, 1, 1), 5)]),
        ("ants", [((1, 0, 0), 4), ((2, 1, 1), 5)]),
    ],
)
def test_nothing_is_listed_twice(name: str, entries: object) -> None:
    with pytest.raises(AntsError, match=rf"{name} contain \(1, 0, 0\) more than once"):
        world(**{name: entries})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"foods": [(3, 3, 3)]}, r"foods contain \(0, 0, 0\), the cell of the queen"),
        (
            {"foods": [(1, 0, 0)], "obstacles": [(2, 1, 1)]},
            r"obstacles contain \(1, 0, 0\), the cell of a food item",
        ),
        (
            {"obstacles": [(1, 0, 0)], "trails": [((1, 0, 0), 3)]},
            r"trails contain \(1, 0, 0\), the cell of an obstacle",
        ),
        (
            {"obstacles": [(1, 0, 0)], "ants": [((1, 0, 0), 3)]},
            r"ants contain \(1, 0, 0\), the cell of an obstacle",
        ),
    ],
)
def test_one_thing_per_cell(changes: dict, message: str) -> None:
    with pytest.raises(AntsError, match=message):
        world(**changes)


def test_trails_may_lie_under_the_queen_food_and_ants() -> None:
    made = world(
        foods=[(1, 0, 0)],
        ants=[((2, 0, 0), 0)],
        trails=[((i, 0, 0), 10**9) for i in range(3)],
    )
    assert made.trails[:, 3].tolist() == [10**9] * 3


@pytest.mark.parametrize(
    ("name", "entry", "named"),
    [
        ("ants", ((1, 0, 0), 6), "heading"),
        ("ants", ((1, 0, 0), -1), "heading"),
        ("trails", ((1, 0, 0), -1), "level"),
        ("trails", ((1, 0, 0), 10**9 + 1), "level"),
    ],
)
def test_headings_and_levels_have_bounds(name: str, entry: tuple, named: str) -> None:
    flat = (*entry[0], entry[1])
    for entries in ([entry], [flat], np.array([flat])):
        with pytest.raises(AntsError) as caught:
            world(**{name: entries})
        assert f"{name}[0] is {flat}" in str(caught.value)
        assert f"the {named} (the last number) must lie between 0 and" in str(caught.value)
