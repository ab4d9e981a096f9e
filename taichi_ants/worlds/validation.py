"""Turns what a caller passes to `World` into checked arrays, and names what is wrong."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from taichi_ants.errors import AntsError, shown, whole
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.grid.hexgrid import MAX_ARRAY_CELLS, AxialGrid
from taichi_ants.task.constants import MAX_TRAIL_LEVEL

# Coordinates beyond this are in no world, and their differences would leave 64 bits.
_FAR = 1 << 40
_NAMED = 3  # a message names this many bad values and counts the others


def parse_ranges(ranges: object) -> tuple[int, int, int]:
    """`ranges` as three integers of at least 1.

    Raises:
        AntsError: They are not three, not whole, or below 1.
    """
    values = _whole_numbers(ranges)
    if len(values) != 3 or min(values) < 1 or max(values) > MAX_ARRAY_CELLS:
        raise AntsError(
            f"ranges are {shown(ranges)}; they must be three whole numbers (X, Y, Z) "
            f"from 1 to {MAX_ARRAY_CELLS}."
        )
    return values[0], values[1], values[2]


def parse_contents(
    grid: AxialGrid, queen: object, foods: object, obstacles: object, trails: object, ants: object
) -> dict[str, tuple[int, int, int] | np.ndarray]:
    """The contents of a world in normal form, checked, by the names of `World`'s fields.

    Foods, obstacles and trails come in lexicographic order of their cells, ants in the order given.

    Raises:
        AntsError: See `World`.
    """
    queen_cell = _parse_queen(queen, grid)
    contents = {
        "foods": _parse_cells("foods", foods, grid),
        "obstacles": _parse_cells("obstacles", obstacles, grid),
        "trails": _parse_cells("trails", trails, grid, ("level", 0, MAX_TRAIL_LEVEL)),
        "ants": _parse_cells("ants", ants, grid, ("heading", 0, N_HEADINGS - 1)),
    }
    numbers = {name: grid.number(rows[:, :3]) for name, rows in contents.items()}
    for name in ("foods", "obstacles", "trails"):
        order = np.argsort(numbers[name], kind="stable")
        contents[name], numbers[name] = contents[name][order], numbers[name][order]
    for name, rows in contents.items():
        _check_distinct(name, rows, numbers[name])
    places = {"the queen": grid.number([queen_cell]), "a food": numbers["foods"]}
    _check_apart("foods", contents, numbers, {"the queen": places["the queen"]})
    _check_apart("obstacles", contents, numbers, places)
    places["an obstacle"] = numbers["obstacles"]
    _check_apart("trails", contents, numbers, {"an obstacle": places["an obstacle"]})
    _check_apart("ants", contents, numbers, places)
    contents["trails"] = contents["trails"][contents["trails"][:, 3] > 0]
    for rows in contents.values():
        rows.setflags(write=False)
    return {"queen": queen_cell, **contents}


def _parse_queen(queen: object, grid: AxialGrid) -> tuple[int, int, int]:
    given = _row("queen", queen, "one cell (x, y, z)", 3)
    x, y, z = (value - min(given) for value in given)
    normal = x, y, z
    if any(value >= end for value, end in zip(normal, grid.ranges, strict=True)):
        raise AntsError(f"queen is {tuple(given)}, {_outside(grid)}")
    return normal


def _parse_cells(
    name: str, values: object, grid: AxialGrid, number: tuple[str, int, int] | None = None
) -> np.ndarray:
    """Entries as int32 (n, 3), or (n, 4) if `number` names the fourth column, its low and high."""
    form = f"((x, y, z), {number[0]})" if number else "(x, y, z)"
    given = _as_rows(name, values, form, 4 if number else 3)
    rows = given.copy()
    if len(given):
        rows[:, :3] -= given[:, :3].min(axis=1, keepdims=True)
    outside = np.any(rows[:, :3] >= np.array(grid.ranges), axis=1)
    if outside.any():
        raise AntsError(f"{_listed(name, given, outside)}, {_outside(grid)}")
    if number:
        what, low, high = number
        bad = (given[:, 3] < low) | (given[:, 3] > high)
        if bad.any():
            raise AntsError(
                f"{_listed(name, given, bad)}, but the {what} (the last number) must lie "
                f"between {low} and {high}."
            )
    return rows.astype(np.int32)


def _outside(grid: AxialGrid) -> str:
    return (
        f"outside the world: with the smallest coordinate shifted to 0, the others must be below "
        f"the ranges {grid.ranges}."
    )


def _check_distinct(name: str, rows: np.ndarray, numbers: np.ndarray) -> None:
    """Raises AntsError if a cell number occurs twice; `rows` (n, >= 3) are their cells."""
    order = np.argsort(numbers, kind="stable")
    again = order[1:][numbers[order[1:]] == numbers[order[:-1]]]
    if len(again):
        cells = np.unique(rows[again, :3], axis=0)
        raise AntsError(f"{name} hold {_cells(cells)} more than once; list each cell once.")


def _check_apart(
    name: str,
    contents: dict[str, np.ndarray],
    numbers: dict[str, np.ndarray],
    places: dict[str, np.ndarray],
) -> None:
    """Raises AntsError if cells of `name` are cells where something else stands.

    `places` holds sorted cell numbers, which a search uses (np.isin would sort them again).
    """
    for other, taken in places.items():
        found = np.searchsorted(taken, numbers[name], side="right")
        shared = found > np.searchsorted(taken, numbers[name])
        if shared.any():
            raise AntsError(
                f"{name} hold {_cells(contents[name][shared])}, where {other} stands; "
                "only one of them can be there."
            )


def _as_rows(name: str, values: object, form: str, columns: int) -> np.ndarray:
    """Entries of `columns` whole numbers as int64 (n, columns)."""
    if isinstance(values, np.ndarray):
        return _rows_of_array(name, values, form, columns)
    entries = _entries(values)
    if entries is None:
        raise AntsError(f"{name} is {shown(values)}; it must be a sequence of {form}.")
    rows = [_row(f"{name}[{i}]", entry, form, columns) for i, entry in enumerate(entries)]
    return np.array(rows, dtype=np.int64).reshape(-1, columns)


def _rows_of_array(name: str, values: np.ndarray, form: str, columns: int) -> np.ndarray:
    if values.size == 0:
        return np.zeros((0, columns), dtype=np.int64)
    if values.dtype.kind not in "iu" or values.ndim != 2 or values.shape[1] != columns:
        raise AntsError(
            f"{name} is an array of shape {values.shape} and type {values.dtype}; "
            f"it must hold whole numbers in the shape (n, {columns}), each row {form}."
        )
    if values.dtype.itemsize == 8:
        far = ((values > _FAR) | (values.astype(np.int64) < -_FAR)).any(axis=1)
        if far.any():
            raise AntsError(_too_far(f"{name}[{int(far.argmax())}]", values[far][0].tolist()))
    return values.astype(np.int64)


def _row(name: str, entry: object, form: str, columns: int) -> list[int]:
    """One entry as `columns` integers; a pair (cell, number) is taken apart."""
    values = _entries(entry) or []
    if columns == 4 and len(values) == 2:
        values = [*(_entries(values[0]) or []), values[1]]
    numbers = _whole_numbers(values)
    if len(numbers) != columns:
        raise AntsError(f"{name} is {shown(entry)}; it must be {form} in whole numbers.")
    if max(map(abs, numbers)) > _FAR:
        raise AntsError(_too_far(name, numbers))
    return numbers


def _whole_numbers(values: object) -> list[int]:
    """The entries of a sequence as integers; none if it is no sequence of whole numbers."""
    try:
        return [whole("", value) for value in _entries(values) or []]
    except AntsError:
        return []


def _entries(values: object) -> list | None:
    """The entries of a sequence; None for all else, text and mappings included."""
    if isinstance(values, (str, bytes, Mapping)):
        return None
    try:
        return list(values)  # type: ignore[call-overload]
    except TypeError:
        return None


def _too_far(name: str, numbers: list[int]) -> str:
    return f"{name} is {shown(tuple(numbers))}; every number must lie between {-_FAR} and {_FAR}."


def _listed(name: str, rows: np.ndarray, bad: np.ndarray) -> str:
    """Names the bad rows: "foods[3] is (1, 2, 3)"."""
    places = np.flatnonzero(bad)
    named = [f"{name}[{i}] is {tuple(rows[i].tolist())}" for i in places[:_NAMED]]
    return _joined(named, len(places))


def _cells(rows: np.ndarray) -> str:
    return _joined([str(tuple(row[:3].tolist())) for row in rows[:_NAMED]], len(rows))


def _joined(named: list[str], total: int) -> str:
    more = [f"{total - len(named)} more"] if total > len(named) else []
    *first, last = named + more
    return f"{', '.join(first)} and {last}" if first else last
