"""Parquet files: the types and values of the tables that they come from."""

from __future__ import annotations

import math

import pytest

from taichi_ants import AntsError, files
from taichi_ants.files import parquet

arrow = pytest.importorskip("pyarrow.parquet")
ROWS = [
    {"int": 2**62, "float": 1, "flag": True, "text": 'a,"b"\n', "mixed": "none", "big": 2**64},
    {"int": -1, "float": 0.1, "flag": False, "list": [3, 4], "mixed": 5, "nothing": None},
    {"int": None, "float": math.nan, "flag": None, "text": "null", "mixed": True, "big": -1},
]
TYPES = {
    **{"int": "int64", "float": "double", "flag": "bool", "text": "string", "mixed": "string"},
    **{"big": "string", "list": "string", "nothing": "string"},
}


def test_values_have_the_types_of_their_columns(tmp_path):
    assert parquet.types_of(ROWS) == TYPES
    files.write_csv(tmp_path / "a.csv", ROWS, [*TYPES])
    assert files.csv_columns(tmp_path / "a.csv") == [*TYPES]
    parquet.convert(tmp_path / "a.csv", tmp_path / "a.parquet", TYPES)
    table = arrow.read_table(tmp_path / "a.parquet")
    assert {name: str(table.schema.field(name).type) for name in TYPES} == TYPES
    first, second, third = table.to_pylist()
    assert (first["int"], first["float"], first["flag"]) == (2**62, 1.0, True)
    assert (first["text"], first["big"], first["list"]) == ('a,"b"\n', str(2**64), None)
    assert (second["list"], second["mixed"], second["nothing"]) == ("[3, 4]", "5", None)
    assert (third["int"], third["float"], third["flag"]) == (None, None, None)
    assert (third["text"], third["mixed"]) == ("null", "True")


def test_parts_have_the_same_types_and_old_ones_are_gone(tmp_path):
    for rows in (ROWS, ROWS[2:] + ROWS[:1]):
        table = parquet.GrowingDataset(tmp_path / "a", TYPES)
        for row in rows:
            table.append([row])
    found = arrow.read_table(tmp_path / "a")
    assert {str(one.type) for one in found.schema} == {*TYPES.values()}
    assert found.column("int").to_pylist() == [None, 2**62]


def test_the_same_table_gives_the_same_bytes(tmp_path):
    text = files.csv_text(ROWS, [*TYPES])
    for name in "ab":
        parquet.convert(text, tmp_path / name, TYPES)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_a_missing_table_is_named(tmp_path):
    with pytest.raises(AntsError, match=r"cannot read .*a\.csv"):
        parquet.convert(tmp_path / "a.csv", tmp_path / "a.parquet", TYPES)
    assert not list(tmp_path.iterdir())
