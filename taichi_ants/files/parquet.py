"""Tables as Parquet files, from the comma-separated values that `files.write_csv` writes."""

from __future__ import annotations

import io
import shutil
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

from taichi_ants import files
from taichi_ants.errors import imported

Types = Mapping[str, str]  # names of Arrow's types, by column


def check_installed() -> None:
    """Raise AntsError if pyarrow, which writes Parquet, is not installed."""
    imported("Parquet", "pyarrow", "parquet")


def types_of(rows: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """Return the types of columns from all of their values: None and missing ones fit any type.

    Values that are not only numbers, or only flags, are text.
    """
    found = {}
    for name in dict.fromkeys(name for row in rows for name in row):
        values = [row[name] for row in rows if row.get(name) is not None]
        kinds = {str if type(one) is int and abs(one) >= 2**63 else type(one) for one in values}
        if kinds == {bool}:
            found[name] = "bool"
        elif kinds and kinds <= {int, float}:
            found[name] = "double" if float in kinds else "int64"
        else:
            found[name] = "string"
    return found


def convert(source: Path | bytes, path: Path, types: Types) -> None:
    """Write a Parquet file from a table, which is a file or its content.

    Empty fields become null. `types` lists all columns. AntsError if a file cannot be read or
    written.
    """
    import pyarrow
    from pyarrow import csv, parquet

    columns = {name: pyarrow.type_for_alias(kind) for name, kind in types.items()}
    how = csv.ConvertOptions(column_types=columns, null_values=[""], strings_can_be_null=True)
    lines = csv.ParseOptions(newlines_in_values=True)

    def write(target: BinaryIO, table: BinaryIO) -> None:
        batches = csv.open_csv(table, parse_options=lines, convert_options=how)
        with batches, parquet.ParquetWriter(target, batches.schema) as writer:
            for batch in batches:
                writer.write_batch(batch)

    if isinstance(source, bytes):
        files.write_atomically(path, lambda target: write(target, io.BytesIO(source)))
    else:
        with files.opened(source) as table:
            files.write_atomically(path, lambda target: write(target, table))


class GrowingDataset:
    """A new folder of Parquet files, to which rows are appended while others read it."""

    def __init__(self, folder: Path, types: Types) -> None:
        shutil.rmtree(folder, ignore_errors=True)
        self._folder, self._types, self._parts = files.check_writable_folder(folder), types, 0

    def append(self, rows: Iterable[Mapping[str, Any]]) -> None:
        """Append rows, as one more file."""
        text = files.csv_text(rows, list(self._types))
        convert(text, self._folder / f"part-{self._parts:06d}.parquet", self._types)
        self._parts += 1
