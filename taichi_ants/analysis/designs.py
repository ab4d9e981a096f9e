"""Figure of a design: a measure at many points, against each setting in its own panel."""

from __future__ import annotations

from collections.abc import Container, Sequence
from pathlib import Path

import numpy as np

from taichi_ants.analysis import style
from taichi_ants.analysis.findings import gaps_in_words
from taichi_ants.analysis.statistics import known_means
from taichi_ants.analysis.sweeps import Settings, are_numbers, short
from taichi_ants.analysis.tables import sentence

_COLUMNS = 4  # panels in a row
_PARTS = 8  # of a range, each with a mean


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
    settings = [row for row, mean in zip(settings, means, strict=True) if np.isfinite(mean)]
    means = means[np.isfinite(means)]
    rows = -(-len(names) // _COLUMNS)
    with style.styled():
        figure = style.new_figure(1.2 + 2.0 * rows)
        panels = figure.subplots(rows, min(_COLUMNS, len(names)), sharey=True, squeeze=False)
        for axes in panels.flat[len(names) :]:
            axes.set_visible(False)
        for axes, name in zip(panels.flat, names, strict=False):
            x, log = np.array([row[name] for row in settings]), name in logarithmic
            if are_numbers([row[name] for row in settings]):
                parts = np.array_split(np.argsort(x, kind="stable"), min(_PARTS, len(x)))
                middles = [np.exp(np.log(x[p]).mean()) if log else x[p].mean() for p in parts]
                ends = middles, [means[part].mean() for part in parts]
                axes.plot(*ends, color=style.INK, linewidth=1.2)
                if log:
                    style.logarithmic(axes.xaxis, (1,))
            else:
                choices, x = np.unique([str(row[name]) for row in settings], return_inverse=True)
                for n in range(len(choices)):
                    mean = means[x == n].mean()
                    axes.hlines(mean, n - 0.3, n + 0.3, color=style.INK, linewidth=1.2)
                labels = [choice.replace("_", "\n") for choice in choices]
                axes.set_xticks(range(len(choices)), labels, fontsize=8)
                x = x + 0.5 * ((np.arange(len(x)) * 0.618) % 1 - 0.5)  # spreads the dots evenly
            size = 6 if len(x) > 200 else 14
            axes.scatter(x, means, s=size, color=style.SKY, alpha=0.6, linewidths=0)
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
