"""Summaries, figures and comparisons of the results of `Colony.run`, `train` and `evaluate`.

The unit of all statistics is the seed. Intervals are bootstrap intervals of the mean over seeds,
see `statistics`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.analysis import style
from taichi_ants.analysis.findings import means_in_words
from taichi_ants.analysis.statistics import bootstrap_interval, estimates
from taichi_ants.analysis.tables import Table, plain_text, sentence
from taichi_ants.errors import AntsError, checked_whole, expect, shown
from taichi_ants.measures.tidy import Measured, Tidy, checked_measure, last_rows, parts_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_RESAMPLES = 4000  # of figures, which have many intervals
_EPISODES, _TICKS = "episode", "tick"


@dataclass(frozen=True)
class Summary:
    """Means over seeds with 95 % intervals; `print` shows a table.

    Attributes:
        rows: For each configuration and measure, a mapping with the keys configuration, measure,
            unit, seeds (the number of seeds that have a value), mean, low and high.
    """

    rows: tuple[dict[str, Any], ...]

    def __repr__(self) -> str:
        lines = [["Configuration", "Measure", "Mean", "Low", "High", "Seeds"]]
        for row in self.rows:
            unit = f" ({row['unit']})" if row["unit"] else ""
            numbers = [f"{row[name]:.4g}" for name in ("mean", "low", "high")]
            measure = [f"{row['measure']}{unit}", *numbers, str(row["seeds"])]
            lines.append([row["configuration"], *measure])
        if is_one := len({row["configuration"] for row in self.rows}) < 2:
            lines = [line[1:] for line in lines]
        return plain_text([Table("", lines[0], lines[1:], text_columns=2 - is_one)], 100)


@dataclass(frozen=True)
class Comparison:
    """A paired comparison of two results over the same seeds; `print` shows it in a line.

    Attributes:
        measure: The name of the measure.
        first, second: The means over seeds of the two results.
        difference: The mean of first minus second.
        low, high: The ends of the 95 % interval of the difference; nan for a single seed.
        seeds: The number of seeds that have a value in both results.
        differences: The difference of each of these seeds.
    """

    measure: str
    first: float
    second: float
    difference: float
    low: float
    high: float
    seeds: int
    differences: tuple[float, ...]

    def __repr__(self) -> str:
        return (
            f"Comparison({self.measure}: {self.first:.4g} and {self.second:.4g}, difference "
            f"{self.difference:.4g} [{self.low:.4g}, {self.high:.4g}], 95 % "
            f"interval over {self.seeds} paired seeds)"
        )


def compare(
    a: Tidy,
    b: Tidy,
    measure: str = "deliveries",
    *,
    configurations: tuple[int, int] = (0, 0),
    last: int | None = None,
) -> Comparison:
    """Return the difference of a measure between two results, a minus b, paired by seed.

    The value of a seed is its mean over episodes, at the last tick of each.

    Args:
        a, b: Results of `Colony.run`, `train` or `evaluate` with the same seeds.
        measure: The name of a measure that both results have.
        configurations: The numbers of the configurations of a and b; 0 for colonies.
        last: The number of episodes to use, from the last one; None uses all.

    Raises:
        AntsError: The seeds differ, a result does not have the measure or the configuration, or no
            seed has a value in both results.

    >>> compare(result, train(worlds.paper(), config, range(3), 60), "returns").difference
    0.0
    """
    values = []
    tables = _tables_of({"a": a, "b": b}).values()
    for table, number in zip(tables, configurations, strict=True):
        group = checked_whole("a configuration", number, 0, len(table.groups) - 1)
        values.append(of_seeds(table, measure, last)[group])
    both = ~np.isnan(values[0] - values[1])
    if not both.any():
        raise AntsError(f"no seed has a value of {measure!r} in both results; run more ticks.")
    first, second = (sample[both] for sample in values)
    differences = first - second
    low, high = (float(end[0]) for end in bootstrap_interval(differences))
    return Comparison(
        *(measure, float(first.mean()), float(second.mean()), float(differences.mean())),
        *(low, high, len(differences), tuple(differences.tolist())),
    )


def summary(result: Tidy, last: int | None = None) -> Summary:
    """Return means over seeds with 95 % intervals, for each configuration and measure.

    The value of a seed is its mean over episodes, at the last tick of each.

    Args:
        result: The result of `Colony.run`, `train` or `evaluate`.
        last: The number of episodes to use, from the last one; None uses all.

    >>> [row["measure"] for row in summary(result, last=10).rows][:3]
    ['returns', 'steps', 'deliveries']
    """
    expect("result", result, Tidy)
    table, rows = result.measured(), []
    for name in table.values:
        for group, values in zip(table.groups, of_seeds(table, name, last), strict=True):
            ((mean, low, high, *_),) = estimates(values[None], uses_iqm=False)
            rows.append({
                "configuration": group, "measure": name, "unit": table.units.get(name, ""),
                "seeds": int(np.count_nonzero(~np.isnan(values))),
                "mean": mean, "low": low, "high": high,
            })  # fmt: skip
    return Summary(tuple(rows))


def plot(results: Tidy | Mapping[str, Tidy], *measures: str) -> Figure:
    """Return a figure of means over seeds with 95 % intervals, a panel for each measure.

    The horizontal axis is the tick if episodes have several rows, which are then averaged over
    episodes; otherwise it is the episode.

    Args:
        results: A result of `Colony.run`, `train` or `evaluate`, or several by name, with the same
            seeds and measures, to draw into the same panels.
        measures: Names of measures; none for the usual ones.

    Raises:
        AntsError: A result does not have a measure, or the seeds differ.

    >>> len(plot(result, "returns", "steps").axes)
    2
    """
    tables = _tables_of(results if isinstance(results, Mapping) else {"": results})
    first, *others = tables.values()
    names = [part for name in measures for part in parts_of(first, name)]
    names = names or [n for n in first.plotted if all(n in table.values for table in others)]
    if not names:
        raise AntsError("the results have no measure in common; name other results.")
    # An episode of a seed has several rows if there are series.
    across = _EPISODES if all(last_rows(table).all() for table in tables.values()) else _TICKS
    labels = [f"{name} {group}".strip() for name, table in tables.items() for group in table.groups]
    with style.styled():
        figure = style.new_figure(1.2 + 1.8 * len(names))
        panels = np.atleast_1d(figure.subplots(len(names), 1, sharex=True))
        for axes, name in zip(panels, names, strict=True):
            lines = (line for table in tables.values() for line in curves(table, name, across))
            looks = itertools.cycle(style.COLOURS)
            for label, colour, (x, values) in zip(labels, looks, lines, strict=False):
                rows = estimates(values, uses_iqm=False, resamples=_RESAMPLES)
                mean, low, high = np.array([row[:3] for row in rows]).reshape(-1, 3).T
                marker = "o" if len(x) < 2 else None
                axes.plot(x, mean, color=colour, marker=marker, label=style.label(label))
                axes.fill_between(x, low, high, color=colour, alpha=0.15, linewidth=0)
            unit = first.units.get(name, "")
            whole, _, part = name.partition(".")
            words = sentence(whole.replace("_", " ")) + (f" ({part})" if part else "")
            axes.set_ylabel(f"{words},\n{unit}" if unit else words)
        panels[-1].set_xlabel(sentence(across))
        entries = style.legend_entries([panels[0]]) if labels[1:] else {}
        caption = f"{means_in_words(len(first.seeds))}."
        title = "Measures" if names[1:] else words
        style.frame(figure, f"{title} by {across}", caption, entries)
    return figure


def _tables_of(results: Mapping[str, Tidy]) -> dict[str, Measured]:
    """Return the tables of results by name; AntsError unless all have the same seeds."""
    for name, result in results.items():
        expect(name or "result", result, Tidy)
    if not results:
        raise AntsError("there are no results; give at least one.")
    tables = {name: result.measured() for name, result in results.items()}
    first, *others = tables
    for name in others:
        if tables[name].seeds != tables[first].seeds:
            raise AntsError(
                f"the seeds of {name!r} are {shown(tables[name].seeds)}, those of {first!r} are "
                f"{shown(tables[first].seeds)}; use the same seeds in the same order."
            )
    return tables


def of_seeds(table: Measured, measure: str, last: int | None = None) -> np.ndarray:
    """Return the mean over episodes at the last tick of each, float64 (configurations, seeds).

    Episodes without a value do not count; a seed without any value is nan.
    """
    values, where = checked_measure(table, measure), last_rows(table)
    if last is not None:
        episodes = table.index["episode"]
        n = checked_whole("last", last, most=int(episodes.max(initial=0)) + 1)
        where &= episodes > episodes.max(initial=0) - n
    where &= ~np.isnan(values)
    shape = len(table.groups), len(table.seeds)
    sums, counts = np.zeros(shape), np.zeros(shape)
    place = table.of_group[where], table.of_seed[where]
    np.add.at(sums, place, values[where])
    np.add.at(counts, place, 1.0)
    return np.divide(sums, counts, out=np.full(shape, math.nan), where=counts > 0)


def curves(table: Measured, measure: str, across: str) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield x and values (x, seeds) of each configuration, by "tick" or "episode".

    By tick, values are means over episodes, and an episode that has ended keeps its last value. By
    episode, the value is that at the last tick. Values are nan where there are none.
    """
    values, episodes = checked_measure(table, measure), table.index["episode"]
    order = np.lexsort((table.index["tick"], episodes, table.of_seed, table.of_group))
    if across == _EPISODES:
        order = order[last_rows(table)[order]]
    for group in range(len(table.groups)):
        ours = order[table.of_group[order] == group]
        x, begins = np.unique(table.index[across][ours], return_inverse=True)
        ends = begins + 1
        if across == _TICKS:  # a value holds until the next row of the episode
            runs = np.stack([table.of_seed[ours], episodes[ours]])
            goes_on = np.append((runs[:, 1:] == runs[:, :-1]).all(axis=0), False)
            ends = np.where(goes_on, np.roll(begins, -1), len(x))
        sums, counts = np.zeros((2, len(x), len(table.seeds)))
        for value, seed, begin, end in zip(
            values[ours], table.of_seed[ours], begins, ends, strict=True
        ):
            if not np.isnan(value):
                sums[begin:end, seed] += value
                counts[begin:end, seed] += 1
        yield x, np.divide(sums, counts, out=np.full(sums.shape, math.nan), where=counts > 0)
