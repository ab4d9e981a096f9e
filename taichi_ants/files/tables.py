"""Tables: columns with their types, written as comma-separated values and as Parquet."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants import files
from taichi_ants.errors import imported

Table = dict[str, np.ndarray]  # columns by name, all of one length


def check_parquet() -> None:
    """Raise AntsError if pyarrow, which writes Parquet, is not installed."""
    imported("Parquet", "pyarrow", "parquet")


def table_of(rows: Sequence[Mapping[str, Any]]) -> Table:
    """Return the table of rows, whose columns are in order of appearance; missing ones are None."""
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: column([row.get(name) for row in rows]) for name in names}


def column(values: Sequence[Any]) -> np.ndarray:
    """Return a column of numbers or flags as an array of their type, others as Python objects."""
    kinds = {*map(type, values)}
    if not kinds - {float} or kinds in ({int}, {bool}):
        found = np.array(values)
        if kinds != {int} or found.dtype.kind in "iu":  # not of whole numbers beyond 63 bits
            return found
    found = np.empty(len(values), object)
    found[:] = values
    return found


def write(path: Path, table: Table, parquet: bool = False) -> None:
    """Write a table to `path`.csv and, with `parquet`, to `path`.parquet."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(table)
    rows.writerows(zip(*map(_plain, table.values()), strict=True))
    files.write_text(path.with_suffix(".csv"), text.getvalue())
    if parquet:
        _write_parquet(path.with_suffix(".parquet"), table)


def _plain(values: np.ndarray) -> Iterator[Any]:
    """Return values as the CSV file has them: floats exactly, None and nan as empty fields."""
    return (None if one != one else one for one in values.tolist())


def _write_parquet(path: Path, table: Table) -> None:
    """Write a table with the types of its columns; None and nan are null.

    Mixed columns are floats if they have numbers only, else text.
    """
    check_parquet()
    import pyarrow
    from pyarrow import parquet

    columns = {name: pyarrow.array(*_typed(one)) for name, one in table.items()}
    whole = pyarrow.table(columns)
    files.write_atomically(path, lambda file: parquet.write_table(whole, file))


def _typed(values: np.ndarray) -> tuple[list[Any], str]:
    """Return values as Parquet has them, and the name of their type."""
    kinds = {type(one) for one in values.tolist()} - {type(None)}
    plain = list(_plain(values))
    if kinds == {bool}:
        return plain, "bool_"
    if kinds and kinds <= {int, float} and all(one is None or abs(one) < 2**63 for one in plain):
        return plain, "double" if float in kinds else "int64"
    return [None if one is None else str(one) for one in plain], "string"
