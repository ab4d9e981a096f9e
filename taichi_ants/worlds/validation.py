"""Conversion of the arguments of `World` into checked arrays."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from taichi_ants.errors import (
    AntsError,
    check_word,
    checked_whole,
    count,
    entries_of,
    expect,
    shown,
    whole,
)
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.grid.hexgrid import FAR, MAX_ARRAY_CELLS, AxialGrid
from taichi_ants.task.constants import MAX_FOOD_KINDS, MAX_NESTS, MAX_TRAIL_LEVEL

_STANDS = ("nothing", "the queen", "a food item", "an obstacle")


def parse_ranges(ranges: object) -> tuple[int, int, int]:
    """Return `ranges` as three integers of at least 1; AntsError if they are not."""
    values = _whole_numbers(ranges)
    if len(values) != 3 or min(values) < 1 or max(values) > MAX_ARRAY_CELLS:
        raise AntsError(
            f"ranges are {shown(ranges)}; they must be three whole numbers (X, Y, Z) "
            f"from 1 to {MAX_ARRAY_CELLS}."
        )
    return values[0], values[1], values[2]


def parse_contents(
    grid: AxialGrid,
    queens: object,
    foods: object,
    obstacles: object,
    trails: object,
    ants: object,
    food_kinds: object,
) -> dict[str, np.ndarray]:
    """Return the checked contents of a world by field, with coordinates in normal form."""
    foods, kinds = _foods_and_kinds(foods, food_kinds)
    contents = {
        "queens": _queens(queens, grid),
        "foods": _parse("foods", foods, grid),
        "obstacles": _parse("obstacles", obstacles, grid),
        "trails": _parse("trails", trails, grid, "level", MAX_TRAIL_LEVEL),
        "ants": _parse("ants", ants, grid, "heading", N_HEADINGS - 1),
    }
    contents["foods"] = np.column_stack([contents["foods"], _kinds(kinds, contents["foods"])])
    stands = np.zeros(grid.size, dtype=np.uint8)  # the content of each cell, an index of _STANDS
    for name, rows in contents.items():
        if name not in ("queens", "ants"):
            rows = rows[np.lexsort((rows[:, 2], rows[:, 1], rows[:, 0]))]
        index = grid.index(rows[:, :3])
        _, first = np.unique(index, return_index=True)
        if len(first) < len(index):
            again = np.delete(np.arange(len(index)), first)[0]
            raise AntsError(
                f"{name} contain {_cell(rows[again])} more than once; list each cell once."
            )
        # Trails may lie under the queen and foods.
        (shared,) = np.nonzero(stands[index] > (2 if name == "trails" else 0))
        if len(shared):
            raise AntsError(
                f"{name} contain {_cell(rows[shared[0]])}, the cell of "
                f"{_STANDS[stands[index[shared[0]]]]}; remove one of them."
            )
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
    row = np.array([_row(f"{path}.centre", disc["centre"], "(x, y, z)", 3)])
    ((x, y, z),) = _inside(f"{path}.centre", row, grid).tolist()
    return grid.cells(np.flatnonzero(grid.exists & (grid.distances((x, y, z)) <= radius)))


def _queens(values: object, grid: AxialGrid) -> np.ndarray:
    """Return the cells of the queens, int32 (N, 3), from one cell or a sequence of cells."""
    entries = entries_of(values) or []
    is_list = bool(entries) and all(entries_of(entry) is not None for entry in entries)
    if not is_list:
        return _inside(
            "queen",
            np.array([_row("queen", values, "one cell (x, y, z), or a list of cells", 3)]),
            grid,
        )
    if len(entries) > MAX_NESTS:
        raise AntsError(
            f"queen has {len(entries)} cells; a world has at most {MAX_NESTS} nests, so list fewer."
        )
    return _inside("queen", _rows("queen", entries, "(x, y, z)", 3), grid)


def _foods_and_kinds(foods: object, kinds: object) -> tuple[object, object]:
    """Return cells and kinds of food, which may be given together as ((x, y, z), kind)."""
    if isinstance(foods, np.ndarray):
        together = foods.ndim == 2 and foods.shape[1] == 4
        return (foods[:, :3], foods[:, 3]) if together else (foods, kinds)
    entries = [entries_of(entry) or [] for entry in entries_of(foods) or []]
    paired = [len(entry) == 2 and entries_of(entry[0]) is not None for entry in entries]
    if not any(paired):
        return foods, kinds
    pairs = [entry if pair else [entry, 0] for entry, pair in zip(entries, paired, strict=True)]
    return [cell for cell, _ in pairs], [kind for _, kind in pairs]


def _kinds(values: object, foods: np.ndarray) -> np.ndarray:
    """Return the kind of each food item, int32 (n, 1); without kinds, all are of the first."""
    entries = entries_of(values)
    if not entries:
        return np.zeros((len(foods), 1), np.int32)
    if len(entries) != len(foods):
        raise AntsError(
            f"food_kinds has {count(len(entries), 'entry')} for {count(len(foods), 'food item')}; "
            "give one kind for each."
        )
    most = MAX_FOOD_KINDS - 1
    kinds = [checked_whole(f"food_kinds[{i}]", kind, 0, most) for i, kind in enumerate(entries)]
    return np.array(kinds, dtype=np.int32).reshape(-1, 1)


def _parse(
    name: str, values: object, grid: AxialGrid, number: str = "", most: int = 0
) -> np.ndarray:
    """Return entries as int32 (n, 3), or (n, 4) with a fourth column from 0 to `most`."""
    form, columns = (f"((x, y, z), {number})", 4) if number else ("(x, y, z)", 3)
    rows = _rows(name, values, form, columns)
    (bad,) = np.nonzero(((rows[:, 3:] < 0) | (rows[:, 3:] > most)).any(axis=1))
    if len(bad):
        raise AntsError(
            f"{name}[{bad[0]}] is {tuple(rows[bad[0]].tolist())}, but the {number} (the last "
            f"number) must lie between 0 and {most}."
        )
    return _inside(name, rows, grid)


def _inside(name: str, entries: np.ndarray, grid: AxialGrid) -> np.ndarray:
    """Return rows of int64 (n, 3 or more) in normal form, int32; AntsError if outside the world."""
    rows = entries.copy()
    rows[:, :3] -= entries[:, :3].min(axis=1, keepdims=True, initial=FAR)
    (outside,) = np.nonzero((rows[:, :3] >= np.array(grid.ranges)).any(axis=1))
    if len(outside):
        entry = name if name == "queen" or name.endswith(".centre") else f"{name}[{outside[0]}]"
        raise AntsError(
            f"{entry} is {tuple(entries[outside[0]].tolist())}, outside the world; after the "
            f"smallest coordinate is subtracted from all, x, y, z must be below {grid.ranges}."
        )
    return rows.astype(np.int32)


def _rows(name: str, values: object, form: str, columns: int) -> np.ndarray:
    if not isinstance(values, np.ndarray):
        entries = entries_of(values)
        if entries is None:
            raise AntsError(f"{name} is {shown(values)}; it must be a sequence of {form}.")
        rows = [_row(f"{name}[{i}]", entry, form, columns) for i, entry in enumerate(entries)]
        return np.array(rows, dtype=np.int64).reshape(-1, columns)
    if values.size == 0:
        return np.zeros((0, columns), dtype=np.int64)
    if values.dtype.kind not in "iu" or values.ndim != 2 or values.shape[1] != columns:
        raise AntsError(
            f"{name} is an array of shape {values.shape} and type {values.dtype}; "
            f"it must have whole numbers and the shape (n, {columns}), with rows {form}."
        )
    (far,) = np.nonzero((np.abs(values.astype(np.float64)) > FAR).any(axis=1))
    if len(far):
        _row(f"{name}[{far[0]}]", tuple(values[far[0]].tolist()), form, columns)  # raises
    return values.astype(np.int64)


def _row(name: str, entry: object, form: str, columns: int) -> list[int]:
    """Return one entry as `columns` integers; a pair (cell, number) is flattened."""
    values = entries_of(entry) or []
    if columns == 4 and len(values) == 2:
        values = [*(entries_of(values[0]) or []), values[1]]
    numbers = _whole_numbers(values)
    if len(numbers) != columns or max(map(abs, numbers)) > FAR:
        raise AntsError(
            f"{name} is {shown(entry)}; it must be {form} in whole numbers up to 2**40."
        )
    return numbers


def _whole_numbers(values: object) -> list[int]:
    """Return the entries of a sequence as integers; [] if they are not whole numbers."""
    try:
        return [whole("", value) for value in entries_of(values) or []]
    except AntsError:
        return []


def _cell(row: np.ndarray) -> tuple[int, ...]:
    return tuple(row[:3].tolist())
