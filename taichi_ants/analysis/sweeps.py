"""Tables and figures of a sweep: a measure of each seed against the settings that vary."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.analysis import style
from taichi_ants.analysis.findings import gaps_in_words, means_in_words
from taichi_ants.analysis.statistics import Estimator, estimates, known_means
from taichi_ants.analysis.tables import MISSING, Table, plain_text, sentence
from taichi_ants.errors import count

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Settings = Mapping[str, Any]
Lines = Mapping[str, Sequence[tuple[Any, ...]]]
_MARKERS = ("o", "s", "^", "D", "v", "P", "X")  # 7 with 10 colours give 70 different lines
_TERMINAL = 200  # the maximum number of columns
_WIDE = 20  # the ratio of largest to smallest from which an axis is logarithmic
_COLUMNS = 4  # panels of a design in a row
_PARTS = 8  # of a range, each with a mean


def centre_columns(found: Mapping[str, Estimator], gaps: Sequence[str] = ()) -> dict[str, float]:
    """Return the columns of a table for the estimates of several measures.

    Measures in `gaps` have a column with the number of seeds without a value.
    """
    return {
        f"{name}_{field}": value
        for name, estimator in found.items()
        for field, value in estimator._asdict().items()
        if (estimator.iqm is not None or "iqm" not in field)
        and (field != "left_out" or name in gaps)
    }


def centres_of(
    values: Mapping[str, np.ndarray], with_iqm: Sequence[str] = ()
) -> list[dict[str, Estimator]]:
    """Return estimates for each point, by measure, from values float64 (points, seeds).

    Only the measures in `with_iqm` get an interquartile mean.
    """
    by_name = [estimates(array, name in with_iqm) for name, array in values.items()]
    return [dict(zip(values, row, strict=True)) for row in zip(*by_name, strict=True)]


def columns_of(rows: Sequence[Settings]) -> list[str]:
    """Return the names in rows, in order of appearance."""
    return list(dict.fromkeys(name for row in rows for name in row))


def report(
    settings: Sequence[Settings],
    values: Mapping[str, np.ndarray],
    against: tuple[str, Any] | None = None,
    notes: Sequence[str] = (),
) -> str:
    """Return the means with their intervals as a table for a terminal.

    With `against`, a setting and its value, the last column compares the first measure of each
    point with that value; `notes` has its text.
    """
    names = columns_of(settings)
    lines = []
    for row, centres in zip(settings, centres_of(values), strict=True):
        cells = [_shown(row.get(name, MISSING)) for name in names]
        for centre in centres.values():
            ends = f" [{centre.ci_low:.4g}, {centre.ci_high:.4g}]"
            without = f" ({centre.left_out} left out)" if centre.left_out else ""
            mean = f"{centre.mean:.4g}" if np.isfinite(centre.mean) else MISSING
            cells.append(f"{mean}{'' if np.isnan(centre.ci_low) else ends}{without}")
        lines.append(cells)
    headers = [*(short(name, names) for name in names), *values]
    if against:
        other = f"{short(against[0], names)} {_shown(against[1])}"
        headers.append(f"{next(iter(values))} against {other}")
        lines = [[*line, note] for line, note in zip(lines, notes, strict=True)]
    title = means_in_words(next(iter(values.values())).shape[1])
    if any(np.isnan(array).any() for array in values.values()):
        title += "; runs without a value are left out"
    return plain_text([Table(title, headers, lines, text_columns=len(headers))], _TERMINAL)


def draw(path: Path, settings: Sequence[Settings], values: np.ndarray, words: str) -> None:
    """Draw a measure against the first setting that varies, a line for each value of the others.

    `settings` are those that vary, for each of P points, `values` the measure, float64 (P, S), of S
    seeds, and `words` its name. Raises AntsError if the file (.png) cannot be written.
    """
    names = columns_of(settings)
    others = [name for name in names[1:] if len({str(row.get(name)) for row in settings}) > 1]
    alike = [f"{short(n, names)} {_shown(settings[0][n])}" for n in names[1:] if n not in others]
    means = [estimator[:3] for estimator in estimates(values, uses_iqm=False)]  # with intervals
    lines: dict[str, list[tuple[Any, ...]]] = {}
    for row, mean in zip(settings, means, strict=True):
        label = ", ".join(f"{short(n, names)} {_shown(row[n])}" for n in others if n in row)
        lines.setdefault(label or words, []).append((row.get(names[0]), *mean))
    with style.styled():
        figure = style.new_figure(4.5)
        axes = figure.subplots()
        draw_lines(axes, lines)
        axes.set(xlabel=names[0], ylabel=words)
        caption = ", ".join([means_in_words(values.shape[1]), *alike])
        caption = f"{caption}.{gaps_in_words(values)}"
        style.frame(figure, sentence(words), caption, style.legend_entries([axes]))
    style.save(figure, path)


def draw_lines(axes: Axes, lines: Lines, shared: Sequence[Lines] = ()) -> None:
    """Draw means with intervals, by label: for each point, x, mean, and the ends of the interval.

    If any x is not a number, the points of a label are not joined by a line. `shared` are the lines
    of panels with the same vertical axis, which is not logarithmic if a mean or an end is not
    positive.
    """
    places = [value for points in lines.values() for value, *_ in points]
    numbers = are_numbers(places)
    ticks = list(dict.fromkeys(map(_shown, places)))
    looks = zip(itertools.cycle(style.COLOURS), itertools.cycle(_MARKERS), strict=False)
    aside = np.linspace(-0.3, 0.3, len(lines)) if len(lines) > 1 else [0.0]
    for shift, (label, points), look in zip(aside, lines.items(), looks, strict=False):
        colour, marker = look
        ordered = sorted(points, key=lambda point: point[0]) if numbers else points
        x = [value if numbers else ticks.index(_shown(value)) + shift for value, *_ in ordered]
        mean, low, high = np.array([point[1:] for point in ordered], float).reshape(-1, 3).T
        (line,) = axes.plot(x, mean, marker=marker, ms=4.5, color=colour, label=style.label(label))
        if numbers:
            axes.fill_between(x, low, high, color=colour, alpha=0.15, linewidth=0)
        else:
            line.set_linestyle("none")
            axes.vlines(x, low, high, color=colour)
    if not numbers:
        axes.set_xticks(range(len(ticks)), [tick.replace("_", "\n") for tick in ticks])
    elif _far_apart(places):
        style.logarithmic(axes.xaxis, (1,))
        axes.set_xticks(sorted(set(places)))
    means = [point[1] for points in lines.values() for point in points if np.isfinite(point[1])]
    rows = [row for each in (lines, *shared) for points in each.values() for row in points]
    if numbers and _far_apart(means) and not any(y <= 0 for _, *ys in rows for y in ys):
        style.logarithmic(axes.yaxis, (1, 2, 5) if max(means) < 1000 * min(means) else (1,))


def draw_design(
    path: Path, settings: Sequence[Settings], names: Sequence[str], values: np.ndarray, words: str
) -> None:
    """Draw a measure against each of some settings, a panel for each.

    `settings` are those of P points, `values` the measure, float64 (P, S), of S seeds, and `words`
    its name. A panel has means over an eighth of the points, or over those with the same choice.
    Raises AntsError if the file (.png) cannot be written.
    """
    means, rows = known_means(values), -(-len(names) // _COLUMNS)
    lines = {name: {words: _parts_of([row[name] for row in settings], means)} for name in names}
    with style.styled():
        figure = style.new_figure(1.2 + 2.0 * rows)
        panels = figure.subplots(rows, min(_COLUMNS, len(names)), sharey=True, squeeze=False)
        for axes in panels.flat[len(names) :]:
            axes.set_visible(False)
        for axes, name in zip(panels.flat, names, strict=False):
            draw_lines(axes, lines[name], [*lines.values()])
            if axes.get_xscale() == "log":
                style.logarithmic(axes.xaxis, (1, 3))  # instead of a tick for each mean
            axes.set_xlabel(short(name, names))
        figure.supylabel(words)
        caption = "Means over an eighth of the points, or those with the same choice, with 95 % "
        caption += f"intervals. A point is the mean of {count(values.shape[1], 'seed')}."
        style.frame(figure, f"{sentence(words)} against each setting", caption, {})
    style.save(figure, path)


def _parts_of(column: Sequence[Any], means: np.ndarray) -> list[tuple[Any, ...]]:
    """Return for `draw_lines` the means over parts of the points, by their values in a column."""
    choices, part = np.unique(column, return_inverse=True)
    if is_range := are_numbers(column) and len(choices) > _PARTS:
        part = np.argsort(np.argsort(column, kind="stable")) * _PARTS // len(column)
    points = []
    for n in range(part.max() + 1):
        middle = np.median(np.array(column)[part == n]) if is_range else choices[n].item()
        points.append((middle, *estimates(means[None, part == n], uses_iqm=False)[0][:3]))
    return points


def _far_apart(numbers: Sequence[float]) -> bool:
    return len(numbers) > 0 and min(numbers) > 0 and max(numbers) / min(numbers) >= _WIDE


def are_numbers(places: Sequence[Any]) -> bool:
    """Return whether all values of a setting are numbers, not flags."""
    return all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in places)


def short(name: str, names: Sequence[str]) -> str:
    """Return the last part of a name if it is unique among `names`, else the whole name."""
    last = name.rpartition(".")[2]
    return last if sum(other.rpartition(".")[2] == last for other in names) == 1 else name


def _shown(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
