"""Report and figure of a design: a measure at many points, against each setting by itself."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.analysis import style
from taichi_ants.analysis.findings import gaps_in_words
from taichi_ants.analysis.statistics import known_means
from taichi_ants.analysis.sweeps import Settings, are_numbers, report, short
from taichi_ants.analysis.tables import sentence

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_ROWS = 10  # in the report
COLUMNS = 4  # panels in a row of the figure
_PARTS = 8  # of a range, each with a mean


def first_rows(settings: Sequence[Settings], values: Mapping[str, np.ndarray], words: str) -> str:
    """Return a report on the points with the highest first measure; `words` is the design."""
    name, first = next(iter(values.items()))
    means = known_means(first)
    order = np.argsort(-means, kind="stable")[:MOST_ROWS]  # nan comes last
    table = report([settings[p] for p in order], {n: array[order] for n, array in values.items()})
    most = f"the {len(order)} with the highest {name}" if len(order) < len(means) else "all"
    return f"{len(means)} points of {words}; {most}:\n\n{table}"


def draw(
    path: Path,
    settings: Sequence[Settings],
    names: Sequence[str],
    logarithmic: Container[str],
    values: np.ndarray,
    words: str,
) -> None:
    """Draw a measure against each setting that varies, a panel per setting and a dot per point.

    `settings` are those of P points, `names` the settings to show, `logarithmic` those with such an
    axis, `values` the measure, float64 (P, S), of S seeds, and `words` its name.

    Raises:
        AntsError: The file (.png) cannot be written.
    """
    means = known_means(values)
    settings = [one for one, mean in zip(settings, means, strict=True) if np.isfinite(mean)]
    means = means[np.isfinite(means)]
    rows = -(-len(names) // COLUMNS)
    with style.styled():
        figure = style.new_figure(1.2 + 2.0 * rows)
        panels = figure.subplots(rows, min(COLUMNS, len(names)), sharey=True, squeeze=False)
        for axes in panels.flat[len(names) :]:
            axes.set_visible(False)
        for axes, name in zip(panels.flat, names, strict=False):
            panel(axes, [one[name] for one in settings], means, name in logarithmic)
            axes.set_xlabel(short(name, names))
        figure.supylabel(words)
        seeds = values.shape[1]
        over = f"the mean over {seeds} seeds" if seeds > 1 else "one seed"
        caption = (
            f"A dot is a point of the design, {over}. Lines: means over an eighth of the points, "
            f"or over those with the same choice.{gaps_in_words(values)}"
        )
        style.frame(figure, f"{sentence(words)} against each setting", caption, {})
    style.save(figure, path)


def panel(axes: Axes, places: Sequence[Any], means: np.ndarray, logarithmic: bool) -> None:
    """Draw means, float64 (P,), against the values of a setting: numbers, or choices by name."""
    if are_numbers(places):
        x = np.array(places, float)
        dots(axes, x, means)
        parts = np.array_split(np.argsort(x, kind="stable"), min(_PARTS, len(x)))
        middles = [np.exp(np.log(x[one]).mean()) if logarithmic else x[one].mean() for one in parts]
        axes.plot(middles, [means[one].mean() for one in parts], color=style.INK, linewidth=1.2)
        if logarithmic:
            style.logarithmic(axes.xaxis, (1,))
        return
    labels = [str(place) for place in places]
    kinds = sorted(set(labels))
    x = np.array([kinds.index(label) for label in labels], float)
    aside = (np.arange(len(x)) * 0.618) % 1 - 0.5  # spreads the dots evenly, without chance
    dots(axes, x + 0.5 * aside, means)
    for place in range(len(kinds)):
        mean = means[x == place].mean()
        axes.hlines(mean, place - 0.3, place + 0.3, color=style.INK, linewidth=1.2)
    names = [kind.replace("_", "\n") for kind in kinds]
    axes.set_xticks(range(len(kinds)), names, fontsize=8)


def dots(axes: Axes, x: np.ndarray, y: np.ndarray) -> None:
    """Draw dots at (x, y), both float64 (P,); many of them are small."""
    axes.scatter(x, y, s=6 if len(x) > 200 else 14, color=style.SKY, alpha=0.6, linewidths=0)
