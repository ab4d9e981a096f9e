"""Conversion of the arguments of `World` into checked arrays."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from taichi_ants.errors import AntsError, as_array, check_word, checked_whole, entries_of, expect
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.grid.hexgrid import FAR, MAX_ARRAY_CELLS, AxialGrid
from taichi_ants.task.constants import MAX_FOOD_KINDS, MAX_NESTS, MAX_TRAIL_LEVEL

_STANDS = ("nothing", "the queen", "a food item", "an obstacle")
_NUMBERS = {  # the fourth column of an array, and its largest value
    "foods": ("kind", MAX_FOOD_KINDS - 1),
    "trails": ("level", MAX_TRAIL_LEVEL),
    "ants": ("heading", N_HEADINGS - 1),
}


def parse_ranges(ranges: object) -> tuple[int, int, int]:
    """Return `ranges` as three integers of at least 1; AntsError if they are not."""
    x, y, z = as_array("ranges", ranges, "iu", (3,), 1, MAX_ARRAY_CELLS).tolist()
    return x, y, z


def parse_contents(
    grid: AxialGrid, queens: Any, food_kinds: Any, **parts: Any
) -> dict[str, np.ndarray]:
    """Return the checked contents of a world by field, with coordinates in normal form."""
    contents = {name: _parse(name, values, grid) for name, values in parts.items()}
    contents = {"queens": _queens(queens, grid), **contents}
    if entries_of(food_kinds):
        (n, _), most = contents["foods"].shape, MAX_FOOD_KINDS - 1
        contents["foods"][:, 3] = as_array("food_kinds", food_kinds, "iu", (n,), 0, most)
    stands = np.zeros(grid.size, dtype=np.uint8)  # the content of each cell, an index of _STANDS
    for name, rows in contents.items():
        if name not in ("queens", "ants"):
            rows = rows[np.lexsort((rows[:, 2], rows[:, 1], rows[:, 0]))]
        index = grid.index(rows[:, :3])
        again = np.ones(len(index), dtype=bool)
        again[np.unique(index, return_index=True)[1]] = False
        _refuse(name, rows, again, "is there more than once; list each cell once")
        # Trails may lie under the queen and foods.
        shared = stands[index] > (2 if name == "trails" else 0)
        other = _STANDS[stands[index][shared][:1].max(initial=0)]
        _refuse(name, rows, shared, f"is also the cell of {other}; remove one of them")
        stands[index] = {"queens": 1, "foods": 2, "obstacles": 3}.get(name, stands[index])
        contents[name] = rows
    contents["trails"] = contents["trails"][contents["trails"][:, 3] > 0]
    contents["food_kinds"] = contents["foods"][:, 3].astype(np.uint8)
    contents["foods"] = np.ascontiguousarray(contents["foods"][:, :3])
    for rows in contents.values():
        rows.setflags(write=False)
    return contents


def parse_regions(grid: AxialGrid, regions: object) -> Mapping[str, np.ndarray]:
    """Return the cells of regions, each int32 (n, 3) in lexicographic order, by sorted names.

    A region is a sequence of cells, or a mapping with a `centre` and a `radius`.
    """
    expect("regions", regions, Mapping)
    assert isinstance(regions, Mapping)
    cells_of: dict[str, np.ndarray] = {}
    for name, cells in regions.items():
        check_word("the name of a region", name)
        path = f"regions.{name}"
        rows = _disc(path, cells, grid) if isinstance(cells, Mapping) else _parse(path, cells, grid)
        if not len(rows):
            raise AntsError(f"{path} is empty; give at least one cell.")
        cells_of[name] = np.unique(rows, axis=0)
        cells_of[name].setflags(write=False)
    return MappingProxyType(dict(sorted(cells_of.items())))


def _disc(path: str, disc: Mapping, grid: AxialGrid) -> np.ndarray:
    """Return the cells of the world within a number of steps from a cell."""
    if set(disc) != {"centre", "radius"}:
        raise AntsError(
            f"{path} has the settings {', '.join(map(str, disc)) or 'of nothing'}; give centre "
            "(x, y, z) and radius, or a list of cells."
        )
    radius = checked_whole(f"{path}.radius", disc["radius"], 0)
    ((x, y, z),) = _parse(f"{path}.centre", [disc["centre"]], grid).tolist()
    return grid.cells(np.flatnonzero(grid.exists & (grid.distances((x, y, z)) <= radius)))


def _queens(values: object, grid: AxialGrid) -> np.ndarray:
    """Return the cells of the queens, int32 (N, 3), from one cell or a sequence of cells."""
    cells = as_array("queen", values, "iu")
    queens = _parse("queen", cells[None] if cells.ndim == 1 else cells, grid)
    if not 1 <= len(queens) <= MAX_NESTS:
        raise AntsError(f"queen has {len(queens)} cells; give a cell for each of 1 to 7 nests.")
    return queens


def _rows(name: str, values: Any) -> Any:
    """Return an array, or entries as lists, ((x, y, z), number) as (x, y, z, number).

    The kind of a food without one is 0.
    """
    if isinstance(values, np.ndarray):
        has_no_kinds = name == "foods" and values.shape[1:] == (3,)
        return np.pad(values, ((0, 0), (0, 1))) if has_no_kinds else values
    if (rows := entries_of(values)) is None:
        return values
    for i, entry in enumerate(rows):
        row = entries_of(entry) or entry
        if isinstance(row, list) and len(row) == 2 and entries_of(row[0]):
            row = [*row[0], row[1]]
        rows[i] = [*row, 0] if name == "foods" and isinstance(row, list) and len(row) == 3 else row
    return rows


def _parse(name: str, values: Any, grid: AxialGrid) -> np.ndarray:
    """Return entries in normal form, int32 (n, 3), or (n, 4) if they have a number."""
    rows, columns = _rows(name, values), 4 if name in _NUMBERS else 3
    if not rows if isinstance(rows, list) else np.size(rows) == 0:
        return np.zeros((0, columns), np.int32)
    entries = as_array(name, rows, "iu", (None, columns), -FAR, FAR).astype(np.int64)
    if columns == 4:
        number, most = _NUMBERS[name]
        as_array(f"the {number} (the last number) of {name}", entries[:, 3], "iu", None, 0, most)
    parsed = entries.copy()
    parsed[:, :3] -= entries[:, :3].min(axis=1, keepdims=True)
    outside = (parsed[:, :3] >= np.array(grid.ranges)).any(axis=1)
    form = "after the smallest coordinate is subtracted from all, x, y, z must be below"
    _refuse(name, entries, outside, f"is outside the world; {form} {grid.ranges}")
    return parsed.astype(np.int32)


def _refuse(name: str, rows: np.ndarray, wrong: Any, why: str) -> None:
    """Raise AntsError for the first row that is wrong, if there is one."""
    if wrong.any():
        raise AntsError(f"the cell {tuple(rows[wrong][0, :3].tolist())} of {name} {why}.")
