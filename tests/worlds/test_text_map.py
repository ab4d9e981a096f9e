"""Maps in text: what they mean, what is refused, and that drawing undoes reading."""

import re
from pathlib import Path

import pytest

from taichi_ants import worlds
from taichi_ants.errors import AntsError
from taichi_ants.grid.constants import HEADING_STEPS
from taichi_ants.task.constants import EMPTY
from taichi_ants.worlds import World, from_text, load_map, to_text

GARDEN = Path(__file__).parents[2] / "experiments" / "maps" / "garden.txt"
GUIDE = Path(__file__).parents[2] / "docs" / "worlds.md"

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


def test_the_papers_world_round_trip() -> None:
    drawn = to_text(worlds.paper())
    assert from_text(drawn) == worlds.paper()
    lines = drawn.splitlines()
    assert lines[0] == "trail = 25"
    assert lines[1].strip() == "F"
    assert lines[-1].strip() == "Q"
    assert lines[-3].split() == [".", "a", "."]


@pytest.mark.parametrize(
    "changed",
    [
        RING.replace("\n", "\r\n"),
        RING.replace("\n", "\r"),
        RING.replace("\n", "   \n"),
        "\n\n\n" + RING + "\n  \n",
        RING.replace("\n", "\n       "),
        RING.strip("\n"),
        "; drawn by hand\n" + RING + "  ; end",
        RING.replace("  5", "; a comment is no line of the drawing\n  5"),
        "trail = 3\n" + RING,
    ],
)
def test_what_does_not_matter(changed: str) -> None:
    assert from_text(changed) == from_text(RING)


def test_settings() -> None:
    assert from_text("trail = 7\n  t\nQ").trails[:, 3].tolist() == [7]
    assert from_text("  t\nQ").trails[:, 3].tolist() == [25]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the map has no cells"),
        (" \n\n; nothing\n", "the map has no cells"),
        (".\n  .", "no queen"),
        ("Q\n  .\nQ", "line 3, column 1 of the map has 'Q' a second time"),
        (
            "Q\n  x",
            r"line 2, column 3 of the map has 'x'; use only \. # t, F G H I, Q R S U, 0 to 5",
        ),
        ("; c\nQ\n\t.", r"line 3, column 1 of the map has '\\t'; use only"),
        ("Q\n  6", "line 2, column 3 of the map has '6'"),
        ("Q\n  ö", "line 2, column 3 of the map has 'ö'"),
        ("Q\n  \ud800", r"line 2, column 3 of the map has '\\ud800'"),
        ("Q   .\n  .\n.  .", "line 3, column 4 of the map has '.', which is between two cells"),
        (
            "..\n    Q   .\n  .   .\n",
            "line 1, column [12] of the map has '.', which is between two cells",
        ),
        ("Q . .   .   .", "line 1, column 3 of the map has '.', which is between"),
        ("Q\n .", "of the map has '[Q.]', which is between"),
        ("trail = -1\nQ", "line 1 of the map sets trail to '-1'; .* from 1 to 1000000000"),
        ("trail = 0\nQ", "line 1 of the map sets trail to '0'"),
        ("trail = 1000000001\nQ", "sets trail to '1000000001'"),
        ("trail = ٣\nQ", "sets trail to '٣'"),
        ("trail =\nQ", "sets trail to ''"),
        ("trail = 1 2\nQ", "sets trail to '1 2'"),
        (
            "; c\ntrails = 3\nQ",
            "line 2 of the map sets 'trails'; the only settings are trail and region",
        ),
        ("trail = 3\ntrail = 3\nQ", "line 2 of the map is 'trail = 3'; only one such line"),
        ("Q\ntrail = 3", "line 2 of the map is 'trail = 3'; only one such line is allowed, above"),
        ("Q" + " " * 200_003 + "." + "\n" * 200_000 + ".", "ranges are"),
    ],
)
def test_damaged_maps(text: str, message: str) -> None:
    with pytest.raises(AntsError, match=message) as caught:
        from_text(text)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", [None, b"Q", 5, ["Q"]])
def test_a_map_is_text(text: object) -> None:
    with pytest.raises(AntsError, match=r"the map is .*; it must be text"):
        from_text(text)


def test_several_trail_levels_cannot_be_drawn() -> None:
    world = World((3, 3, 3), (0, 0, 0), trails=[((1, 0, 0), 3), ((2, 0, 0), 4)])
    with pytest.raises(AntsError, match="2 levels from 3 to 4"):
        to_text(world)


@pytest.mark.parametrize("cell", [(0, 0, 0), (2, 0, 0)])
def test_trails_under_the_queen_or_food_cannot_be_drawn(cell: tuple) -> None:
    world = World((3, 3, 3), (0, 0, 0), foods=[(2, 0, 0)], trails=[(cell, 3)])
    with pytest.raises(AntsError) as caught:
        to_text(world)
    assert f"a trail lies on {cell} under" in str(caught.value)


def test_ants_are_numbered_in_reading_order() -> None:
    world = World((3, 3, 3), (0, 0, 0), ants=[((0, 2, 0), 1), ((2, 0, 0), 2), ((0, 0, 1), 3)])
    in_reading_order = World((3, 3, 3), (0, 0, 0), ants=world.ants[[1, 2, 0]])
    assert from_text(to_text(world)) == in_reading_order


def test_the_garden_loads() -> None:
    garden = load_map(GARDEN)
    assert garden.ranges == (6, 6, 6)
    assert len(garden.foods) == 3
    assert garden.reachable_foods().all()
    assert len(garden.obstacles) == 12
    assert len(garden.ants) == 1
    # Following the trail from the ant leads to a food, cell by cell.
    cells, headings = garden.start(0)
    assert garden.trail_levels()[cells[0]] == 60
    assert garden.closer()[cells[0]] == 1 << (headings[0] + 3) % 6
    assert load_map(str(GARDEN)) == garden
    assert from_text(to_text(garden)) == garden


def test_the_examples_of_the_guide_work() -> None:
    blocks = GUIDE.read_text(encoding="utf-8").split("```")[1::2]
    (drawn,) = [block for block in blocks if block.startswith("\n;")]
    assert from_text(drawn).reachable_foods().all()
    (listed,) = [block for block in blocks if "world = World(" in block]
    namespace: dict = {}
    exec(listed.removeprefix("python"), namespace)
    assert namespace["world"].reachable_foods().all()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "map.txt has no cells"),
        (b"\x89PNG\r\n\x1a\n", "map.txt' is not UTF-8 text"),
        (b"Q\n\x00\n", r"line 2, column 1 of .*map.txt has '\\x00'"),
        ("Q\n  .".encode("utf-16"), "map.txt' is not UTF-8 text"),
        (b"Q\n  x", "line 2, column 3 of .*map.txt has 'x'"),
    ],
)
def test_damaged_files(tmp_path: Path, content: bytes, message: str) -> None:
    file = tmp_path / "map.txt"
    file.write_bytes(content)
    with pytest.raises(AntsError, match=message):
        load_map(file)


def test_a_byte_order_mark_is_no_character(tmp_path: Path) -> None:
    file = tmp_path / "map.txt"
    for text in (RING, f"; a comment\ntrail = 7\n{RING}"):
        file.write_text(text, encoding="utf-8-sig")
        assert load_map(file) == from_text("\ufeff" + text) == from_text(text)
    with pytest.raises(AntsError, match="line 2, column 1 of the map has 'x'"):
        from_text("\ufeff; a comment\nx")


@pytest.mark.parametrize("above", ["; c\n", "\ufeff; c\n;; d\n", "; c\ntrail = 3\n;\n", "\n;\n"])
def test_errors_name_the_line_of_the_file_whatever_stands_above(above: str) -> None:
    for text in ("Q   .\n  x\n", "Q\n; between\n\n .", "Q   .\n  .\ntrail = 4\n"):
        lines = []
        for whole in (text, above + text):
            with pytest.raises(AntsError) as caught:
                from_text(whole)
            lines.append(int(re.search(r"line (\d+)", str(caught.value))[1]))
        assert lines[1] == lines[0] + above.count("\n")


@pytest.mark.parametrize("world", [None, 3, "paper", RING])
def test_only_worlds_are_drawn(world: object) -> None:
    with pytest.raises(AntsError, match=r"world is .*; it must be a World"):
        to_text(world)


def test_files_that_cannot_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(AntsError, match=r"cannot read .*nothing\.txt': no such file"):
        load_map(tmp_path / "nothing.txt")
    with pytest.raises(AntsError, match=r"cannot read .*: is a directory"):
        load_map(tmp_path)
    with pytest.raises(AntsError, match="path is 5; it must be text or a path"):
        load_map(5)
    with pytest.raises(AntsError, match=r"cannot read .*: file name too long"):
        load_map("x" * 10_000)

    def refuse(*arguments: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("os.open", refuse)
    with pytest.raises(AntsError, match=r"cannot read .*garden\.txt': permission denied"):
        load_map(GARDEN)


def test_undrawn_cells_become_obstacles() -> None:
    # A ring without its centre: the world has the centre, and ants cannot enter it.
    world = from_text(RING.replace("Q", " ").replace("3", "Q"))
    assert world.obstacles.tolist() == [[0, 0, 0]]
    assert (world.ground() == EMPTY).sum() == 5
