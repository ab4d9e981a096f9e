"""A sweep as tables and a figure: a measure of each seed against the settings that vary."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from taichi_ants.analysis import style
from taichi_ants.analysis.statistics import bootstrap_interval, centres
from taichi_ants.analysis.tables import MISSING, Table, plain_text, sentence

Settings = Mapping[str, Any]
_COLOURS = (style.BLUE, style.ORANGE, style.RED, style.WINE, style.SKY, style.INK, style.GREY)
_MARKERS = ("o", "s", "^", "D", "v", "P", "X")
_TERMINAL = 200  # columns, at most
_WIDE = 20  # a ratio of settings from which their axis is logarithmic


def seed_rows(
    settings: Sequence[Settings], seeds: Sequence[int], values: Mapping[str, np.ndarray]
) -> list[dict[str, Any]]:
    """A row for each point and seed: what varies, the seed, the measures.

    Args:
        settings: What varies, of P points.
        seeds: S seeds.
        values: Measures by name, float64 (P, S).
    """
    return [
        {**one, "seed": seed, **{name: float(array[p, s]) for name, array in values.items()}}
        for p, one in enumerate(settings)
        for s, seed in enumerate(seeds)
    ]


def summary_rows(
    settings: Sequence[Settings], values: Mapping[str, np.ndarray], typical: Sequence[str] = ()
) -> list[dict[str, Any]]:
    """A row for each point: means over seeds with 95 % intervals, as in `statistics.centres`.

    Args:
        settings, values: As above.
        typical: The measures of which the interquartile mean makes sense, too.
    """
    columns = {
        f"{name}_{column}": numbers
        for name, array in values.items()
        for column, numbers in centres(array, name in typical).items()
    }
    seeds = next(iter(values.values())).shape[1]
    return [
        {**one, "seeds": seeds, **{name: float(column[p]) for name, column in columns.items()}}
        for p, one in enumerate(settings)
    ]


def columns_of(rows: Sequence[Settings]) -> list[str]:
    """The names in rows, in order of appearance."""
    return list(dict.fromkeys(name for row in rows for name in row))


def report(
    settings: Sequence[Settings],
    values: Mapping[str, np.ndarray],
    against: tuple[str, Any] | None = None,
    notes: Sequence[str] = (),
) -> str:
    """The means with their intervals as a table for a terminal.

    Args:
        settings, values: As above.
        against: The setting with whose value the others are compared in the first measure.
        notes: What came out of it, for each point.
    """
    names = columns_of(settings)
    ends = {name: bootstrap_interval(array) for name, array in values.items()}
    lines = []
    for p, one in enumerate(settings):
        cells = [_shown(one.get(name, MISSING)) for name in names]
        for name, array in values.items():
            low, high = (end[p] for end in ends[name])
            mean = f"{array[p].mean():.4g}"
            cells.append(mean if np.isnan(low) else f"{mean} [{low:.4g}, {high:.4g}]")
        lines.append(cells)
    headers = [*(short(name, names) for name in names), *values]
    if against:
        other = f"{short(against[0], names)} {_shown(against[1])}"
        headers.append(f"{next(iter(values))} against {other}")
        lines = [[*line, note] for line, note in zip(lines, notes, strict=True)]
    seeds = next(iter(values.values())).shape[1]
    many = f"Means over {seeds} seeds, with 95 % intervals" if seeds > 1 else "One seed"
    return plain_text([Table(many, headers, lines, text_columns=len(headers))], _TERMINAL)


def draw(
    path: Path, settings: Sequence[Settings], values: np.ndarray, words: str, title: str
) -> None:
    """Draw a measure against the first setting that varies, a line for each value of the others.

    Args:
        path: Where to write the .png.
        settings: What varies, of P points.
        values: The measure, float64 (P, S).
        words: What it is.
        title: One line.

    Raises:
        AntsError: The file cannot be written.
    """
    names = columns_of(settings)
    first = names[0]
    others = [name for name in names[1:] if len({str(one.get(name)) for one in settings}) > 1]
    alike = [f"{short(n, names)} {_shown(settings[0][n])}" for n in names[1:] if n not in others]
    marks: list[Any] = [one.get(first) for one in settings]
    numbers = all(isinstance(mark, (int, float)) and not isinstance(mark, bool) for mark in marks)
    places = marks if numbers else list(map(_shown, marks))
    low, high = bootstrap_interval(values)
    lines: dict[str, list[int]] = {}
    for p, one in enumerate(settings):
        label = ", ".join(f"{short(n, names)} {_shown(one[n])}" for n in others if n in one)
        lines.setdefault(label, []).append(p)
    with style.styled():
        figure = style.new_figure(4.5)
        axes = figure.subplots()
        looks = itertools.cycle(zip(_COLOURS, _MARKERS, strict=True))
        for (label, points), (colour, marker) in zip(lines.items(), looks, strict=False):
            if numbers:
                points.sort(key=lambda p: marks[p])
            x: Any = [places[p] for p in points]
            mean = values[points].mean(axis=1)
            axes.plot(x, mean, marker=marker, color=colour, label=label or words)
            axes.fill_between(x, low[points], high[points], color=colour, alpha=0.15, linewidth=0)
        if numbers and min(marks) > 0 and max(marks) / min(marks) >= _WIDE:
            style.logarithmic(axes.xaxis, (1, 2, 5))
        axes.set(xlabel=first, ylabel=words)
        seeds = values.shape[1]
        spread = f"mean of {seeds} seeds with 95 % bootstrap intervals" if seeds > 1 else "one seed"
        entries = style.legend_entries([axes])
        caption = ", ".join([sentence(spread), *alike])
        style.frame(figure, title, f"{caption}.", entries)
    style.save(figure, path)


def short(name: str, names: Sequence[str]) -> str:
    """The last part of a name, if no other of the names has the same."""
    last = name.rpartition(".")[2]
    return last if sum(one.rpartition(".")[2] == last for one in names) == 1 else name


def _shown(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
