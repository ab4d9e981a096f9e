"""Every way to misdescribe a world is refused with a sentence that names the value."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from taichi_ants.worlds import World, from_text, to_text

HUGE = 10**5000  # more digits than Python writes


def world(**changes: object) -> World:
    return World(**{"ranges": (5, 5, 5), "queen": (0, 0, 0), **changes})


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


FORM = "; it must be an array of whole numbers"
CELLS = f"{FORM} and of shape (n, 3)."
FOODS = f"{FORM} and of shape (n, 4)."
ROCK, TWICE = {"obstacles": [(1, 0, 0)]}, "is there more than once; list each cell once"
OUTSIDE = "is outside the world; after the smallest coordinate is subtracted from all"


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        *(
            ({"ranges": ranges}, f"{FORM} and of shape (3,).")
            for ranges in ((5, 5), np.array([5.0, 5, 5]), "555", (1, 1, HUGE), {"x": 1}, None)
        ),
        ({"ranges": (0, 5, 5)}, "ranges contains 0; all must lie between 1 and"),
        *(
            ({"queen": queen}, "queen is ")
            for queen in ((0, 0), (0.0, 0, 0), (np.nan, 0, 0), "000", None, 7, [], np.zeros(3))
        ),
        ({"queen": [(0, 0, 0), (1, 0)]}, FORM),
        ({"queen": [(0, 0, 0), (3, 3, 3)]}, f"the cell (0, 0, 0) of queens {TWICE}."),
        ({"queen": [(0, i, 0) for i in range(4)] * 2}, "queen has 8 cells; give a cell for each"),
        ({"foods": [((1, 0, 0), 8)]}, "the kind (the last number) of foods contains 8; all must"),
        ({"foods": [((1, 0, 0), 0.5)]}, f"foods is [[1, 0, 0, 0.5]]{FOODS}"),
        (
            {"foods": [(1, 0, 0)], "food_kinds": [0, 1]},
            f"food_kinds is [0, 1]{FORM} and of shape (1,).",
        ),
        ({"foods": "100"}, f"foods is '100'{FOODS}"),
        ({"obstacles": [(1, 0, 0), (2.0, 0, 0)]}, f"[[1, 0, 0], [2.0, 0, 0]]{CELLS}"),
        ({"obstacles": [(1, 0)]}, f"obstacles is [[1, 0]]{CELLS}"),
        ({"obstacles": [(HUGE, 0, 0)]}, f"obstacles is a huge number{CELLS}"),
        ({"obstacles": 3}, f"obstacles is 3{CELLS}"),
        ({"obstacles": np.ones((2, 3))}, CELLS),
        ({"foods": [(1, 0, 0), (1, 6, 1)]}, f"the cell (1, 6, 1) of foods {OUTSIDE}"),
        ({"obstacles": np.array([(1, 6, 1)])}, f"the cell (1, 6, 1) of obstacles {OUTSIDE}"),
        ({"obstacles": [(2**41, 0, 0)]}, "obstacles contains 2199023255552; all must lie between"),
        ({"foods": [(1, 0, 0), (2, 1, 1)]}, f"the cell (1, 0, 0) of foods {TWICE}."),
        ({"trails": [((1, 0, 0), 4), ((2, 1, 1), 5)]}, f"(1, 0, 0) of trails {TWICE}."),
        ({"ants": [((1, 0, 0), 4), ((2, 1, 1), 5)]}, f"the cell (1, 0, 0) of ants {TWICE}."),
        ({"foods": [(3, 3, 3)]}, "(0, 0, 0) of foods is also the cell of the queen; remove one"),
        ({**ROCK, "foods": [(2, 1, 1)]}, "(1, 0, 0) of obstacles is also the cell of a food item"),
        ({**ROCK, "trails": [((1, 0, 0), 3)]}, "(1, 0, 0) of trails is also the cell of an obst"),
        ({**ROCK, "ants": [((1, 0, 0), 3)]}, "(1, 0, 0) of ants is also the cell of an obstacle"),
        ({"ants": [((1, 0, 0), 6)]}, "the heading (the last number) of ants contains 6; all must"),
        ({"ants": np.array([(1, 0, 0, -1)])}, "the heading (the last number) of ants contains -1"),
        ({"trails": [(1, 0, 0, -1)]}, "the level (the last number) of trails contains -1; all"),
        ({"regions": [1]}, "regions is [1]; it must be a mapping of names to values."),
        ({"regions": {"a": []}}, "regions.a is empty; give at least one cell."),
        ({"regions": {"a": 3}}, f"regions.a is 3{CELLS}"),
        ({"regions": {"a": {"centre": (0, 0, 0)}}}, "regions.a has the settings centre; give cent"),
        ({"regions": {"a": {"centre": (0, 0, 0), "radius": -1}}}, "regions.a.radius is -1; it mu"),
        (
            {"regions": {"a": {"centre": (9, 0, 0), "radius": 1}}},
            f"the cell (9, 0, 0) of regions.a.centre {OUTSIDE}",
        ),
        ({"regions": {"a": [(9, 0, 0)]}}, f"the cell (9, 0, 0) of regions.a {OUTSIDE}"),
    ],
)
def test_wrong_contents_are_named_with_what_is_allowed(changes: dict, says: str) -> None:
    refused(says, world, **changes)


def test_trails_may_lie_under_the_queen_food_and_ants() -> None:
    made = world(
        foods=[(1, 0, 0)],
        ants=[((2, 0, 0), 0)],
        trails=[((i, 0, 0), 10**9) for i in range(3)],
    )
    assert made.trails[:, 3].tolist() == [10**9] * 3
