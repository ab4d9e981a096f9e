"""Worlds as drawings in plain text.

Hexagons are flat-topped. The neighbour straight up is two lines above in the same column; the
neighbour up and to the right is one line above and two columns to the right. So the cells of a line
are four columns apart, and neighbouring lines are offset by two columns. The characters are::

    .  empty          Q  the queen      0 to 5  an ant with this heading
    #  obstacle       F  food           a to f  an ant with heading 0 to 5 on a trail
    t  trail                            blanks are not cells

R, S and U are the queens of a second, third and fourth nest; G, H and I are food of a second, third
and fourth kind.

Lines that start with `;` are comments. A line `trail = 25` above the drawing sets the level of all
trails. Ants are numbered in reading order.
"""

from __future__ import annotations

import os
import re
from itertools import permutations

import numpy as np

from taichi_ants import files
from taichi_ants.errors import AntsError, expect, shown
from taichi_ants.grid.hexgrid import AxialGrid, cube
from taichi_ants.task.constants import MAX_TRAIL_LEVEL
from taichi_ants.worlds.world import World

DEFAULT_TRAIL_LEVEL = 25
EMPTY, OBSTACLE, TRAIL = ".#t"
FOODS = "FGHI"  # by kind
QUEENS = "QRSU"  # by nest
ANTS = "012345"  # by heading
ANTS_ON_TRAIL = "abcdef"

_CELLS = {EMPTY, OBSTACLE, TRAIL, *FOODS, *QUEENS, *ANTS, *ANTS_ON_TRAIL}
_ALLOWED = ". # t, F G H I, Q R S U, 0 to 5, a to f and blanks"
_LEVEL = re.compile(r"\s*trail\s*=\s*([0-9]{1,10})\s*")


def load_map(path: str | os.PathLike[str]) -> World:
    """Return the world drawn in a UTF-8 file; AntsError if it cannot be read. See `from_text`.

    >>> with open("paper.txt", "w") as file:
    ...     _ = file.write(worlds.to_text(worlds.paper()))
    >>> worlds.load_map("paper.txt") == worlds.paper()
    True
    """
    return from_text(files.read_text(path), str(path))


def from_text(text: str, source: str = "the map") -> World:
    """Return the world drawn in `text`, in the format that the module's docstring describes.

    It is the smallest world that contains all drawn cells; its other cells become obstacles. Raises
    AntsError, which calls the text `source`, if the map is damaged.

    >>> worlds.from_text("F\\n\\n.\\n\\nQ").queen
    (0, 0, 0)
    """
    expect(source, text, str)
    level, marks, ranges, cells = _read(text, source)
    grid = AxialGrid(ranges)
    undrawn = grid.exists.copy()
    undrawn[grid.index(cells)] = False
    queens = [mark for mark in marks if mark in QUEENS]
    if sorted(queens) != [*QUEENS[: max(1, len(queens))]]:
        listed = f"the queens {' '.join(queens)}" if queens else "no queen"
        raise AntsError(
            f"{source} has {listed}; draw the queen of each nest once, as {', '.join(QUEENS)} in "
            "this order."
        )
    trails = cells[np.isin(marks, [TRAIL, *ANTS_ON_TRAIL])]
    is_food = np.isin(marks, [*FOODS])
    is_ant = np.isin(marks, [*ANTS, *ANTS_ON_TRAIL])
    headings = [(ANTS + ANTS_ON_TRAIL).index(mark) % len(ANTS) for mark in marks[is_ant]]
    return World(
        ranges,
        [cells[marks == queen][0] for queen in sorted(queens)],
        foods=cells[is_food],
        food_kinds=[FOODS.index(mark) for mark in marks[is_food]],
        obstacles=np.concatenate([cells[marks == OBSTACLE], grid.cells(np.flatnonzero(undrawn))]),
        trails=np.column_stack([trails, np.full(len(trails), level)]),
        ants=np.column_stack([cells[is_ant], np.array(headings, dtype=np.int64)]),
    )


def ranges_of(text: str) -> tuple[int, int, int]:
    """Return the ranges of the world drawn in `text`, without building it."""
    return _read(text, "the map")[2]


def _read(text: str, source: str) -> tuple[int, np.ndarray, tuple[int, int, int], np.ndarray]:
    """Return the level of trails, characters, ranges of the smallest world, and cells (n, 3)."""
    level, row = 0, 0
    drawn: list[tuple[str, int, int, int]] = []  # character, line, row without comments, column
    text = text.removeprefix("\ufeff")  # the byte-order mark, which some editors write
    for number, line in enumerate(re.split("\r\n|\r|\n", text), start=1):
        if line.lstrip().startswith(";"):
            continue
        if "=" in line:
            read = None if level or drawn else _LEVEL.fullmatch(line)
            level = int(read[1]) if read else 0
            if not 1 <= level <= MAX_TRAIL_LEVEL:
                raise AntsError(
                    f"line {number} of {source} is {shown(line.strip())}; above the drawing, write "
                    f"`trail = LEVEL` once, with a level from 1 to {MAX_TRAIL_LEVEL}."
                )
            continue
        row += 1
        drawn += [(mark, number, row, column) for column, mark in enumerate(line) if mark != " "]
    if not drawn:
        raise AntsError(f"{source} has no cells; draw cells with {_ALLOWED}.")

    def refuse(wrong: np.ndarray, why: str) -> None:
        if wrong.any():
            mark, number, _, column = drawn[int(wrong.argmax())]
            raise AntsError(f"line {number}, column {column + 1} of {source} has {mark!r}{why}.")

    marks, _, rows, columns = (np.array(part) for part in zip(*drawn, strict=True))
    refuse(~np.isin(marks, [*_CELLS]), f"; use only {_ALLOWED}")
    # A column is 2 r and a row r - 2 q, both up to a shift. So all cells have the same parity of
    # the column and of row - r; the majority of the characters determines it.
    odd = columns % 2
    r = (columns - odd) // 2
    grids = 2 * odd + (rows - r) % 2
    grid = np.bincount(grids).argmax()
    refuse(
        grids != grid,
        ", which is between two cells; place the cells of a line four columns apart, and offset "
        "neighbouring lines by two columns",
    )
    axials = np.stack([(r - rows + grid % 2) // 2, r], axis=1)
    ranges, origin = smallest_world(axials)
    return level or DEFAULT_TRAIL_LEVEL, marks, ranges, cube(axials - origin)


def smallest_world(axials: np.ndarray) -> tuple[tuple[int, int, int], tuple[int, int]]:
    """Return the ranges of the smallest world that contains the given cells, and its origin.

    A world of ranges (a + 1, b + 1, c + 1) with its origin at (q0, r0) contains the cells (q, r)::

        -c <= q - q0 <= a,  -c <= r - r0 <= b,  -b <= (q - r) - (q0 - r0) <= a

    So only the extremes of q, r and d = q - r matter. An origin exists if and only if::

        a + c >= width of q,  b + c >= width of r,  a + b >= width of d
        a + b + c >= q_max - r_min - d_min,  a + b + c >= d_max - q_min + r_max

    The number of cells grows with s = a + b + c, so the smallest possible s is best. For this s,
    the number is a constant minus (a^2 + b^2 + c^2) / 2, so one of a, b and c should be as large as
    possible, then the next. Ties are broken by the largest X, then the largest Y; ties of the
    origin (q0, r0) by the smallest q0, then the smallest r0.
    """
    q, r = axials[:, 0], axials[:, 1]
    q_min, q_max = int(q.min()), int(q.max())
    r_min, r_max = int(r.min()), int(r.max())
    d_min, d_max = int((q - r).min()), int((q - r).max())

    total = max(q_max - r_min - d_min, d_max - q_min + r_max)
    most = (total - (r_max - r_min), total - (q_max - q_min), total - (d_max - d_min))
    fits = []
    for order in permutations(range(3)):
        sizes = [0, 0, 0]
        for axis in order:
            sizes[axis] = min(most[axis], total - sum(sizes))
        fits.append(sizes)
    a, b, c = max(fits, key=lambda fit: (sum(n * n for n in fit), fit))

    q_origin = max(q_max - a, d_max - a + r_max - b)
    r_origin = max(r_max - b, q_origin - d_min - b)
    return (a + 1, b + 1, c + 1), (q_origin, r_origin)


def to_text(world: World) -> str:
    """Return the map of a world; `from_text` reads it, with ants numbered in reading order.

    Raises AntsError for trails of several levels, and for trails under food or the queen.

    >>> worlds.from_text(worlds.to_text(worlds.paper())) == worlds.paper()
    True
    """
    expect("world", world, World)
    grid, levels = world.grid, np.unique(world.trails[:, 3])
    parts = (world.foods, world.queens, world.trails, world.ants)
    foods, queens, trails, ants = (grid.index(part[:, :3]) for part in parts)
    for what, is_there in (
        (f"trails of {len(levels)} levels", len(levels) > 1),
        (f"{world.n_nests} nests", world.n_nests > len(QUEENS)),
        (f"{world.n_food_kinds} kinds of food", world.n_food_kinds > len(FOODS)),
        ("a trail under the queen or food", np.isin(trails, [*queens, *foods]).any()),
        ("regions", bool(world.regions)),
    ):
        if is_there:
            raise AntsError(f"a map cannot show {what}; change this in the world.")
    marks = np.where(grid.exists, EMPTY, " ")
    marks[grid.index(world.obstacles)] = OBSTACLE
    marks[foods] = np.array([*FOODS])[world.kinds_by_cell()[foods]]
    marks[queens] = [*QUEENS[: world.n_nests]]
    marks[trails] = TRAIL
    letters = np.array([[*ANTS], [*ANTS_ON_TRAIL]])
    marks[ants] = letters[np.isin(ants, trails).astype(int), world.ants[:, 3]]
    lines = (f"trail = {level}\n" for level in levels)
    size_x, size_y, size_z = world.ranges
    page = np.full((2 * size_x + size_y + size_z - 3, 2 * (size_y + size_z) - 3), " ")
    existing = np.flatnonzero(grid.exists)
    x, y, z = grid.cells(existing).T
    page[y + z - 2 * (x - size_x + 1), 2 * (y - z + size_z - 1)] = marks[existing]
    return "".join([*lines, *("".join(row).rstrip() + "\n" for row in page)])
