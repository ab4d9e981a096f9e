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

A line `region gate = %` above the drawing says that cells drawn as % are empty, and belong to the
region "gate"; with `region gate = % #` they are obstacles. A cell can belong to several regions, as
in `region gate, short = % #`, and a region can have several marks, each in its own line.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import permutations
from typing import NamedTuple

import numpy as np

from taichi_ants import files
from taichi_ants.errors import AntsError, check_word, count, expect, shown
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
_SETTING = re.compile(r"\s*([A-Za-z]\w*)\s*=(.*)")
_REGION = re.compile(r"\s*region\s+(\w+(?:\s*,\s*\w+)*)\s*=\s*(\S)(?:\s+(\S))?\s*")
_MARKS = "%*@+!$&/?:<>^~|-_gklmnopqrsuvwxyzABCDEJKLMNOPTVWXYZ6789"  # for regions, in this order


def load_map(path: str | os.PathLike[str]) -> World:
    """Return the world drawn in a UTF-8 file; AntsError if it cannot be read. See `from_text`."""
    return from_text(files.read_text(path), str(path))


def from_text(text: str, source: str = "the map") -> World:
    """Return the world drawn in `text`, in the format that the module's docstring describes.

    It is the smallest world that contains all drawn cells; its other cells become obstacles. Raises
    AntsError, which calls the text `source`, if the map is damaged.
    """
    expect(source, text, str)
    text = text.removeprefix("\ufeff")  # the byte-order mark, which some editors write
    level, drawn, regions = _read(text, source)
    axials = _axials(drawn, source)
    ranges, origin = smallest_world(axials)
    cells = cube(axials - origin)
    grid = AxialGrid(ranges)
    undrawn = grid.exists.copy()
    undrawn[grid.index(cells)] = False

    names = dict.fromkeys(name for marks in regions.values() for name in marks.names)
    within = {
        name: cells[[char.mark in regions and name in regions[char.mark].names for char in drawn]]
        for name in names
    }
    drawn = [replace(char, mark=regions[char.mark].cell) if char.mark in regions else char
             for char in drawn]  # fmt: skip
    marks = np.array([char.mark for char in drawn])
    trails = cells[np.isin(marks, [TRAIL, *ANTS_ON_TRAIL])]
    is_food = np.isin(marks, [*FOODS])
    is_ant = np.isin(marks, [*ANTS, *ANTS_ON_TRAIL])
    headings = [(ANTS + ANTS_ON_TRAIL).index(mark) % len(ANTS) for mark in marks[is_ant]]
    return World(
        ranges,
        [cells[marks == queen][0] for queen in QUEENS if queen in marks],
        foods=cells[is_food],
        food_kinds=[FOODS.index(mark) for mark in marks[is_food]],
        obstacles=np.concatenate([cells[marks == OBSTACLE], grid.cells(np.flatnonzero(undrawn))]),
        trails=np.column_stack([trails, np.full(len(trails), level)]),
        ants=np.column_stack([cells[is_ant], np.array(headings, dtype=np.int64)]),
        regions=within,
    )


def ranges_of(text: str, source: str = "the map") -> tuple[int, int, int]:
    """Return the ranges of the world drawn in `text`, without building it."""
    _, drawn, _ = _read(text, source)
    return smallest_world(_axials(drawn, source))[0]


@dataclass(slots=True)
class _Drawn:
    """A character of a drawing; `line` counts all lines from 1, `row` lines of the drawing."""

    mark: str
    line: int
    row: int
    column: int

    def described(self, source: str) -> str:
        return f"line {self.line}, column {self.column + 1} of {source} has {self.mark!r}"


class _Mark(NamedTuple):
    """A mark of regions: the character of the cell that it draws, and the names of the regions."""

    cell: str
    names: tuple[str, ...]


def _read(text: str, source: str) -> tuple[int, list[_Drawn], dict[str, _Mark]]:
    level = None
    drawn: list[_Drawn] = []
    regions: dict[str, _Mark] = {}
    row = 0
    for number, line in enumerate(re.split("\r\n|\r|\n", text), start=1):
        if line.lstrip().startswith(";"):
            continue
        if (setting := _SETTING.fullmatch(line)) and setting[1] != "region":
            if level is not None or drawn:
                raise AntsError(
                    f"line {number} of {source} is {shown(line.strip())}; only one such line is "
                    "allowed, above the drawing."
                )
            level = _read_level(f"line {number} of {source}", *setting.groups())
            continue
        if re.match(r"\s*region\b", line):
            where = f"line {number} of {source}"
            if drawn:
                raise AntsError(f"{where} names a region; move it above the drawing.")
            _read_region(where, line, regions)
            continue
        row += 1
        for column, mark in enumerate(line):
            if mark != " ":
                drawn.append(_Drawn(mark, number, row, column))
                if mark not in _CELLS and mark not in regions:
                    raise AntsError(f"{drawn[-1].described(source)}; use only {_ALLOWED}.")
    if not drawn:
        raise AntsError(f"{source} has no cells; draw cells with {_ALLOWED}.")
    for mark, region in regions.items():
        if not any(char.mark == mark for char in drawn):
            raise AntsError(
                f"{source} has no cell {mark!r} of the region {', '.join(region.names)}; "
                "draw one, or leave the line of the region out."
            )
    cell_of = {mark: region.cell for mark, region in regions.items()}
    queens = [replace(char, mark=cell_of.get(char.mark, char.mark)) for char in drawn]
    queens = [char for char in queens if char.mark in QUEENS]
    for nest, mark in enumerate(QUEENS):
        alike = [char for char in queens if char.mark == mark]
        if not alike and (nest == 0 or any(late.mark > mark for late in queens)):
            missing = "queen" if nest == 0 else f"queen {mark}"
            raise AntsError(f"{source} has no {missing}; draw one cell as {mark}.")
        if len(alike) > 1:
            raise AntsError(
                f"{alike[1].described(source)} a second time; draw the queen of each nest once, as "
                f"{', '.join(QUEENS)}."
            )
    return DEFAULT_TRAIL_LEVEL if level is None else level, drawn, regions


def _read_region(where: str, line: str, regions: dict[str, _Mark]) -> None:
    """Add the mark of a line such as `region gate = % #`."""
    form = "write a name and a mark, such as `region gate = %` or `region gate = % #`"
    matched = _REGION.fullmatch(line)
    if matched is None:
        raise AntsError(f"{where} is {shown(line.strip())}; {form}.")
    names, mark, cell = matched.groups()
    if mark in _CELLS or mark in regions or mark in "=;":
        why = "is used already" if mark in regions else "has a meaning in maps"
        free = " ".join(free_mark for free_mark in _MARKS[:10] if free_mark not in regions)
        raise AntsError(f"{where} has the mark {mark!r}, which {why}; choose one of {free}.")
    if cell is not None and cell not in _CELLS:
        raise AntsError(f"{where} draws cells as {cell!r}; use only {_ALLOWED}.")
    region_names = tuple(name.strip() for name in names.split(","))
    for name in region_names:
        check_word(f"the name of a region in {where}", name)
    regions[mark] = _Mark(cell or EMPTY, region_names)


def _read_level(where: str, name: str, value: str) -> int:
    if name != "trail":
        raise AntsError(f"{where} sets {shown(name)}; the only settings are trail and region.")
    level = int(value) if re.fullmatch(r"\s*[0-9]{1,10}\s*", value) else 0
    if not 1 <= level <= MAX_TRAIL_LEVEL:
        raise AntsError(
            f"{where} sets trail to {shown(value.strip())}; it must be a whole number "
            f"from 1 to {MAX_TRAIL_LEVEL}."
        )
    return level


def _axials(drawn: list[_Drawn], source: str) -> np.ndarray:
    """Return the axial coordinates (q, r) of the characters, up to a shift: int64 (n, 2)."""
    # A column is 2 r and a row r - 2 q, both up to a shift. So all cells have the same parity of
    # the column and of row - r; the majority of the characters determines it.
    rows = np.array([char.row for char in drawn])
    columns = np.array([char.column for char in drawn])
    odd = columns % 2
    r = (columns - odd) // 2
    grids = 2 * odd + (rows - r) % 2
    grid = np.bincount(grids).argmax()
    stray = np.flatnonzero(grids != grid)
    if len(stray):
        raise AntsError(
            f"{drawn[stray[0]].described(source)}, which is between two cells; place the cells of "
            "a line four columns apart, and offset neighbouring lines by two columns."
        )
    return np.stack([(r - rows + grid % 2) // 2, r], axis=1)


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
    """
    expect("world", world, World)
    levels = np.unique(world.trails[:, 3])
    if len(levels) > 1:
        raise AntsError(
            f"the trails have {len(levels)} levels from {levels[0]} to {levels[-1]}, but a map can "
            "show only one; give all trails the same level."
        )
    on_trail = {tuple(cell) for *cell, _ in world.trails.tolist()}
    if world.n_nests > len(QUEENS) or world.n_food_kinds > len(FOODS):
        raise AntsError(
            f"the world has {count(world.n_nests, 'nest')} and "
            f"{count(world.n_food_kinds, 'kind')} of food; a map can show {len(QUEENS)} of each."
        )
    hidden = on_trail & set(map(tuple, [*world.queens.tolist(), *world.foods.tolist()]))
    if hidden:
        raise AntsError(
            f"a trail lies on {min(hidden)} under the queen or food, which a map cannot show; "
            "remove this trail."
        )
    marks = [(world.grid.cells(np.flatnonzero(world.grid.exists)), EMPTY)]
    kinds = world.kinds_by_cell()[world.grid.index(world.foods)]
    marks += [(world.obstacles, OBSTACLE)]
    marks += [(world.foods[kinds == kind], FOODS[kind]) for kind in range(world.n_food_kinds)]
    marks += [(cell[None], QUEENS[nest]) for nest, cell in enumerate(world.queens)]
    marks += [(world.trails[:, :3], TRAIL)]
    for *cell, heading in world.ants.tolist():
        letters = ANTS_ON_TRAIL if tuple(cell) in on_trail else ANTS
        marks.append((np.array([cell]), letters[heading]))
    lines = [f"trail = {level}" for level in levels]
    if world.regions:
        more, named = _marks_of_regions(world, marks)
        lines, marks = [*lines, *named], [*marks, *more]
    return "".join(f"{line}\n" for line in lines) + drawing(world.ranges, marks)


def _marks_of_regions(
    world: World, marks: Iterable[tuple[np.ndarray, str]]
) -> tuple[list[tuple[np.ndarray, str]], list[str]]:
    """Return the marks of the cells in regions, and the lines that explain them."""
    drawn = {tuple(cell): mark for cells, mark in marks for cell in cells.tolist()}
    inside: dict[tuple[int, ...], list[str]] = {}
    for name, cells in world.regions.items():
        for cell in map(tuple, cells.tolist()):
            inside.setdefault(cell, []).append(name)
    groups: dict[tuple[str, ...], list[tuple[int, ...]]] = {}
    for cell, names in sorted(inside.items()):
        groups.setdefault((drawn[cell], *names), []).append(cell)
    if len(groups) > len(_MARKS):
        raise AntsError(
            f"the regions have {len(groups)} kinds of cells, but a map can show {len(_MARKS)}; "
            "leave out some regions."
        )
    legend, lines = [], []
    for mark, ((cell_mark, *names), group) in zip(_MARKS, groups.items(), strict=False):
        legend.append((np.array(group), mark))
        end = "" if cell_mark == EMPTY else f" {cell_mark}"
        lines.append(f"region {', '.join(names)} = {mark}{end}")
    return legend, lines


def drawing(ranges: tuple[int, int, int], marks: Iterable[tuple[np.ndarray, str]]) -> str:
    """Return a drawing with characters on cells (n, 3) in normal form; later ones cover earlier."""
    size_x, size_y, size_z = ranges
    page = np.full((2 * size_x + size_y + size_z - 3, 2 * (size_y + size_z) - 3), " ")
    for cells, mark in marks:
        x, y, z = cells.T
        page[y + z - 2 * (x - size_x + 1), 2 * (y - z + size_z - 1)] = mark
    return "".join("".join(row).rstrip() + "\n" for row in page)
