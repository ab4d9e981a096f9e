"""Tables: columns with their types, written as comma-separated values and as Parquet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants import files
from taichi_ants.errors import imported

Table = dict[str, np.ndarray]  # columns by name, all of one length


def table_of(rows: Sequence[Mapping[str, Any]]) -> Table:
    """Return the table of rows, whose columns are in order of appearance; missing ones are None."""
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: column([row.get(name) for row in rows]) for name in names}


def column(values: Sequence[Any]) -> np.ndarray:
    """Return a column of numbers or flags as an array of their type, others as Python objects."""
    kinds = {*map(type, values)}
    if not kinds - {float} or kinds in ({int}, {bool}):
        numbers = np.array(values)
        if kinds != {int} or numbers.dtype.kind in "iu":  # not of whole numbers beyond 63 bits
            return numbers
    objects = np.empty(len(values), object)
    objects[:] = values
    return objects


def write(path: Path, table: Table, parquet: bool = False) -> None:
    """Write a table to `path`.csv and, with `parquet`, to `path`.parquet.

    None and nan are empty fields, and null in Parquet, in which mixed columns are floats if they
    have numbers only, else text.
    """
    columns = {name: values.tolist() for name, values in table.items()}
    rows = (dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True))
    files.write_csv(path.with_suffix(".csv"), rows, [*columns])
    if parquet:
        pyarrow = imported("Parquet", "pyarrow", "parquet")
        arrays = {name: pyarrow.array(*_typed(values)) for name, values in columns.items()}
        whole, to_file = pyarrow.table(arrays), imported("", "pyarrow.parquet", "").write_table
        files.write_atomically(path.with_suffix(".parquet"), lambda file: to_file(whole, file))


def _typed(values: list[Any]) -> tuple[list[Any], str]:
    """Return values as Parquet has them, and the name of their type."""
    kinds = {*map(type, values)} - {type(None)}
    values = [None if value != value else value for value in values]
    if kinds == {bool}:
        return values, "bool_"
    if kinds and kinds <= {int, float} and all(v is None or abs(v) < 2**63 for v in values):
        return values, "double" if float in kinds else "int64"
    return [None if value is None else str(value) for value in values], "string"
