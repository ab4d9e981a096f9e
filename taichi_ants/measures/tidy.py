"""Results as tidy rows, one value a row, for pandas, Parquet and CSV."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants import files
from taichi_ants.errors import AntsError, imported

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class Measured:
    """Values of measures in R rows, with a column for each measure.

    Attributes:
        index: The columns that identify a row, (R,), in the order of tables. "seed", "episode"
            and "tick" are always among them.
        values: The values of each measure by name, (R,), nan if there is none.
        of_seed: The position of the row's seed in `seeds`, (R,).
        of_group: The number of the row's configuration, (R,); 0 for colonies.
        seeds: The seeds, in the order of the result.
        groups: The names of the configurations; one empty name for colonies.
        usual: The measures in a figure, if you name none.
        units: The unit of each measure by name; missing if it has none.
    """

    index: dict[str, np.ndarray]
    values: dict[str, np.ndarray]
    of_seed: np.ndarray
    of_group: np.ndarray
    seeds: tuple[int, ...]
    groups: tuple[str, ...] = ("",)
    usual: tuple[str, ...] = ()
    units: dict[str, str] = field(default_factory=dict)


class Tidy:
    """Base of results with tidy rows; a class defines `measured`."""

    def measured(self) -> Measured:
        """Return the values of all measures, with a column for each."""
        raise NotImplementedError

    def rows(self) -> Iterator[dict[str, Any]]:
        """Yield tidy rows: columns such as world, seed, episode and tick, then measure and value.

        They are ordered by measure. A value that does not exist is nan.
        """
        table = self.measured()
        index = [array.tolist() for array in table.index.values()]
        for name, values in table.values.items():
            for *where, value in zip(*index, values.tolist(), strict=True):
                yield {**dict(zip(table.index, where, strict=True)), "measure": name,
                       "value": float(value)}  # fmt: skip

    def columns(self) -> dict[str, np.ndarray]:
        """Return the columns of the tidy rows, arrays (rows,) by name."""
        table = self.measured()
        n, rows = len(table.values), len(table.of_seed)
        found = {name: np.concatenate([array] * n) if n else array[:0]
                 for name, array in table.index.items()}  # fmt: skip
        found["measure"] = np.repeat(np.array([*table.values], object), rows)
        several = [np.asarray(values, float) for values in table.values.values()]
        return {**found, "value": np.concatenate([np.empty(0), *several])}

    def to_pandas(self) -> pandas.DataFrame:
        """Return the tidy rows as a `pandas.DataFrame`; AntsError if pandas is not installed."""
        table = imported("to_pandas", "pandas", "pandas")
        return table.DataFrame(self.columns()).astype({"measure": "category"})

    def to_csv(self, path: files.PathLike) -> None:
        """Write the tidy rows to a file of comma-separated values, with an empty field for nan."""
        names = [*self.measured().index, "measure", "value"]
        files.write_csv(path, self.rows(), names)

    def to_parquet(self, path: files.PathLike) -> None:
        """Write the tidy rows to a Parquet file; AntsError if pyarrow is not installed."""
        arrow = imported("Parquet", "pyarrow", "parquet")
        parquet = imported("Parquet", "pyarrow.parquet", "parquet")
        columns: dict[str, Any] = self.columns()
        columns["measure"] = arrow.array(columns["measure"].tolist()).dictionary_encode()
        if columns["seed"].dtype == object:  # beyond 63 bits
            columns["seed"] = arrow.array([str(seed) for seed in columns["seed"]])
        table = arrow.table(columns)
        files.write_atomically(path, lambda file: parquet.write_table(table, file))


def seed_array(seeds: Any) -> np.ndarray:
    """Return seeds as int64, or as Python integers if one does not fit."""
    try:
        return np.array(seeds, np.int64)
    except OverflowError:
        return np.array(seeds, object)


def parts_of(table: Measured, name: object) -> list[str]:
    """Return a measure as a list, or the names of its parts; AntsError if there is none."""
    parts = [one for one in table.values if one.startswith(f"{name}.")]
    found = [name] if isinstance(name, str) and name in table.values else parts
    if not found:
        raise AntsError(
            f"the result has no measure {name!r} that is a number; "
            + (f"choose one of {', '.join(table.values)}, or " if table.values else "")
            + "run the colony with measures=[...]."
        )
    return found


def checked_measure(table: Measured, name: object) -> np.ndarray:
    """Return the values of a measure, or of its only part; AntsError if there is not one."""
    found = parts_of(table, name)
    if len(found) > 1:
        raise AntsError(
            f"the measure {name!r} has {len(found)} parts; choose one of {', '.join(found)}."
        )
    return np.asarray(table.values[found[0]], float)


def last_rows(table: Measured) -> np.ndarray:
    """Return whether each row is the last one of its configuration, seed and episode, bool (R,)."""
    ticks = table.index["tick"]
    episodes = np.stack([table.of_group, table.of_seed, table.index["episode"]])
    _, which = np.unique(episodes, axis=1, return_inverse=True)
    last = np.zeros(len(ticks), ticks.dtype)
    np.maximum.at(last, which.ravel(), ticks)
    return ticks == last[which.ravel()]
