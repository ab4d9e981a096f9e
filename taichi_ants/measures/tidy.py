"""Results as tidy rows, one value a row, for pandas and CSV."""

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
        plotted: The measures in a figure, if you name none.
        units: The unit of each measure by name; missing if it has none.
    """

    index: dict[str, np.ndarray]
    values: dict[str, np.ndarray]
    of_seed: np.ndarray
    of_group: np.ndarray
    seeds: tuple[int, ...]
    groups: tuple[str, ...] = ("",)
    plotted: tuple[str, ...] = ()
    units: dict[str, str] = field(default_factory=dict)


class Tidy:
    """Base of results with tidy rows; a class defines `measured`."""

    def measured(self) -> Measured:
        """Return the values of all measures, with a column for each."""
        raise NotImplementedError

    def rows(self) -> Iterator[dict[str, Any]]:
        """Yield tidy rows: columns such as world, seed, episode and tick, then measure and value.

        They are ordered by measure. A value that does not exist is nan.

        >>> [*next(result.rows())]
        ['configuration', 'seed', 'episode', 'tick', 'measure', 'value']
        """
        columns = self.columns()
        for row in zip(*(array.tolist() for array in columns.values()), strict=True):
            yield dict(zip(columns, row, strict=True))

    def columns(self) -> dict[str, np.ndarray]:
        """Return the columns of the tidy rows, arrays (rows,) by name."""
        table = self.measured()
        n, rows = len(table.values), len(table.of_seed)
        columns = {name: np.tile(array, n) for name, array in table.index.items()}
        columns["measure"] = np.repeat(np.array([*table.values], object), rows)
        columns["value"] = np.concatenate([np.empty(0), *table.values.values()], dtype=float)
        return columns

    def to_pandas(self) -> pandas.DataFrame:
        """Return the tidy rows as a `pandas.DataFrame`; AntsError if pandas is not installed.

        >>> result.to_pandas().groupby("measure", observed=True)["value"].mean().index.tolist()
        ['deliveries', 'efficiency', 'first_delivery', 'returns', 'steps']
        """
        table = imported("to_pandas", "pandas", "pandas")
        return table.DataFrame(self.columns()).astype({"measure": "category"})

    def to_csv(self, path: files.PathLike) -> None:
        """Write the tidy rows to a file of comma-separated values, with an empty field for nan.

        >>> result.to_csv("result.csv")
        """
        files.write_csv(path, self.rows(), [*self.measured().index, "measure", "value"])


def parts_of(table: Measured, name: object) -> list[str]:
    """Return a measure as a list, or the names of its parts; AntsError if there is none."""
    if isinstance(name, str) and name in table.values:
        return [name]
    parts = [column for column in table.values if column.startswith(f"{name}.")]
    if not parts:
        raise AntsError(
            f"the result has no measure {name!r}; choose one of {', '.join(table.values)}, or run "
            "the colony with measures=[...]."
        )
    return parts


def checked_measure(table: Measured, name: object) -> np.ndarray:
    """Return the values of a measure, or of its only part; AntsError if there is not one."""
    parts = parts_of(table, name)
    if len(parts) > 1:
        raise AntsError(
            f"the measure {name!r} has {len(parts)} parts; choose one of {', '.join(parts)}."
        )
    return np.asarray(table.values[parts[0]], float)


def last_rows(table: Measured) -> np.ndarray:
    """Return whether each row is the last one of its configuration, seed and episode, bool (R,)."""
    ticks = table.index["tick"]
    episodes = np.stack([table.of_group, table.of_seed, table.index["episode"]])
    _, which = np.unique(episodes, axis=1, return_inverse=True)
    last = np.zeros(len(ticks), ticks.dtype)
    np.maximum.at(last, which.ravel(), ticks)
    return ticks == last[which.ravel()]
