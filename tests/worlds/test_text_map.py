"""Maps in text: what they mean, what is refused, and that drawing undoes reading."""

import itertools
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taichi_ants.errors import AntsError
from taichi_ants.grid.constants import HEADING_STEPS
from taichi_ants.grid.hexgrid import AxialGrid, cube
from taichi_ants.task.constants import EMPTY
from taichi_ants.worlds import World, from_text, load_map, to_text
from taichi_ants.worlds.text_map import smallest_world

GUIDE = Path(__file__).parents[2] / "docs/how-to/worlds.md"

# A queen and six ants, each on the neighbour at its heading.
RING = """
    0
  5   1
    Q
  4   2
    3
"""


def test_headings_on_paper_are_headings_in_the_world() -> None:
    world = from_text(RING)
    assert world.ranges == (2, 2, 2)
    assert world.queen == (0, 0, 0)
    reading_order = [0, 5, 1, 4, 2, 3]
    assert world.ants.tolist() == [[*HEADING_STEPS[h], h] for h in reading_order]


def test_the_cells_of_a_small_map() -> None:
    # The column of the queen is the x axis: q = x - z grows upwards, r = y - z to the right.
    world = from_text("F\n  t\nc\n  #\nQ\n")
    assert world == World(
        ranges=(3, 2, 1),
        queen=(0, 0, 0),
        foods=[(2, 0, 0)],
        trails=[((2, 1, 0), 25), ((1, 0, 0), 25)],
        obstacles=[(1, 1, 0), (0, 1, 0)],  # the second is not drawn
        ants=[((1, 0, 0), 2)],
    )


def test_settings() -> None:
    assert from_text("trail = 7\n  t\nQ").trails[:, 3].tolist() == [7]
    assert from_text("  t\nQ").trails[:, 3].tolist() == [25]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the map has no cells"),
        (".\n  .", "the map has no queen; draw the queen of each nest once, as Q, R, S, U in this"),
        ("Q\n  .\nQ", "the map has the queens Q Q; draw the queen of each nest once"),
        ("Q\n\nS", "the map has the queens Q S; draw the queen of each nest once"),
        (
            "Q\n  x",
            r"line 2, column 3 of the map has 'x'; use only \. # t, F G H I, Q R S U, 0 to 5",
        ),
        ("Q   .\n  .\n.  .", "line 3, column 4 of the map has '.', which is between two cells"),
        ("Q\n .", "of the map has '[Q.]', which is between"),
        *(
            (text, f"line {number} of the map is '{re.escape(line)}'; above the drawing, write")
            for text, number, line in (
                ("trail = -1\nQ", 1, "trail = -1"),
                ("trail = 9\ntrail = 9\nQ", 2, "trail = 9"),
                ("; c\ntrails = 3\nQ", 2, "trails = 3"),
                ("Q\ntrail = 3", 2, "trail = 3"),
            )
        ),
        ("Q" + " " * 200_003 + "." + "\n" * 200_000 + ".", "ranges"),
    ],
)
def test_damaged_maps(text: str, message: str) -> None:
    with pytest.raises(AntsError, match=message) as caught:
        from_text(text)
    assert "\n" not in str(caught.value)


def test_the_examples_of_the_guide_work() -> None:
    blocks = GUIDE.read_text(encoding="utf-8").split("```")[1::2]
    (drawn,) = [block for block in blocks if block.startswith("\n;")]
    assert from_text(drawn).reachable_foods().all()
    (listed,) = [block for block in blocks if "world = World(" in block]
    namespace: dict = {}
    exec(listed.removeprefix("python"), namespace)
    assert namespace["world"].reachable_foods().all()


def test_damaged_files(tmp_path: Path) -> None:
    file = tmp_path / "map.txt"
    file.write_bytes(b"\x89PNG\r\n\x1a\n")
    with pytest.raises(AntsError, match=r"map\.txt' is not UTF-8 text"):
        load_map(file)
    file.write_bytes(b"Q\n\x00\n")
    with pytest.raises(AntsError, match=r"line 2, column 1 of .*map\.txt has '\\x00'"):
        load_map(file)


def test_undrawn_cells_become_obstacles() -> None:
    # A ring without its centre: the world has the centre, and ants cannot enter it.
    world = from_text(RING.replace("Q", " ").replace("3", "Q"))
    assert world.obstacles.tolist() == [[0, 0, 0]]
    assert (world.ground() == EMPTY).sum() == 5


coordinates = st.integers(-5, 5)
axial_cells = st.lists(st.tuples(coordinates, coordinates), min_size=1, max_size=8)


@st.composite
def drawable_worlds(draw: st.DrawFn) -> World:
    """Worlds with trails of one level, none of them under the queen or food."""
    ranges = draw(st.tuples(*[st.integers(1, 6)] * 3))
    grid = AxialGrid(ranges)
    cells = draw(st.permutations(grid.cells(np.flatnonzero(grid.exists)).tolist()))
    kinds = draw(st.lists(st.sampled_from(".#Ft0a"), min_size=len(cells), max_size=len(cells)))
    kinds[0] = "Q"
    level = draw(st.integers(1, 10**9))

    def are(characters: str) -> list[list[int]]:
        return [cell for cell, kind in zip(cells, kinds, strict=True) if kind in characters]

    return World(
        ranges,
        cells[0],
        foods=are("F"),
        obstacles=are("#"),
        trails=[(cell, level) for cell in are("ta")],
        ants=[(cell, draw(st.integers(0, 5))) for cell in are("0a")],
    )


@given(drawable_worlds())
def test_reading_undoes_drawing(world: World) -> None:
    drawn = to_text(world)
    again = from_text(drawn)
    assert to_text(again) == drawn
    assert sorted(again.ants.tolist()) == sorted(world.ants.tolist())
    contents = (world.foods, world.obstacles, world.trails)
    assert again == World(world.ranges, world.queen, *contents, again.ants)


@given(axial_cells)
def test_no_world_that_holds_the_cells_is_smaller(cells: list[tuple[int, int]]) -> None:
    axials = np.array(cells)
    ranges, origin = smallest_world(axials)
    assert (cube(axials - origin) < ranges).all()
    # Origins beyond the bounding box are tried as well; for each, the ranges follow.
    low, high = axials.min(axis=0) - 4, axials.max(axis=0) + 4
    origins = itertools.product(*(range(a, b + 1) for a, b in zip(low, high, strict=True)))
    smallest = min(
        AxialGrid(tuple((cube(axials - other).max(axis=0) + 1).tolist())).count for other in origins
    )
    assert AxialGrid(ranges).count == smallest
