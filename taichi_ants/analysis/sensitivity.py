"""The figure of all configurations: how much does which hyperparameter matter?"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.analysis.comparison import Comparison, Hyperparameters
from taichi_ants.analysis.statistics import bootstrap_interval
from taichi_ants.analysis.style import (
    GREY,
    INK,
    for_setting,
    frame,
    in_training,
    legend_entries,
    looks,
    new_figure,
    over_seeds,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLUMNS = 2
_OFFSET = 0.17  # rows
_DASHES = ((0, (4, 2)), (0, (1, 1.5)), (0, (6, 2, 1, 2)), (0, (2, 2)))


def sensitivity(comparison: Comparison, baselines: Sequence[Mapping] = ()) -> Figure:
    """Return of every configuration with its 95 % interval, a panel for each learner.

    Most configurations lie close together and a few far off, so the axis shows where most are;
    what lies beyond is named at the edge. Of two delivery settings the first has filled marks.

    Args:
        comparison: The comparison.
        baselines: Rows of baselines.csv; those of the training setting are drawn as lines where
            they lie within the axis (optimal policies only if there is absorbing delivery, for
            which they are optimal).
    """
    configurations = sorted({row.hyperparameters for row in comparison.rows})
    variants, style = comparison.variants, looks(comparison.variants)
    means = comparison.measure("return_last50").mean(axis=1)
    ends = bootstrap_interval(comparison.measure("return_last50"))
    limits = _limits(means, *ends)
    if "absorbing" not in comparison.delivery_settings:
        baselines = for_setting(baselines, comparison.delivery_settings[0])
    with styled():
        wide = min(_COLUMNS, len(variants))
        deep = math.ceil(len(variants) / wide)
        figure = new_figure(1.3 + deep * (0.55 + 0.19 * len(configurations)))
        axes = figure.subplots(deep, wide, sharex=True, sharey=True, squeeze=False)
        for axis in axes.flat[len(variants) :]:
            axis.set_visible(False)
        for axis, variant in zip(axes.flat, variants, strict=False):
            axis.set_title(variant.label, color=style[variant][0])
            axis.set_xlabel("Return (reward per episode, last 50)")
            offsets = _OFFSET * np.linspace(-1, 1, len(comparison.delivery_settings))
            for place, setting in enumerate(comparison.delivery_settings):
                positions = comparison.positions(setting, variant)
                rows = [
                    configurations.index(comparison.rows[position].hyperparameters)
                    for position in positions
                ]
                heights = np.array(rows) + offsets[place]
                values = np.array([means, *ends])[:, positions]
                _dots(axis, heights, values, limits, style[variant], filled=place == 0)
            _lines(axis, baselines, limits)
            axis.tick_params(labelbottom=True)
        _rows(axes, configurations, limits)
        frame(
            figure,
            "Every configuration: learning rate / discount / epsilon / decay",
            f"Each mark: {over_seeds(len(comparison.seeds), '95 % interval')}. Marks with a number "
            "lie beyond the axis, at that number.",
            _settings(comparison.delivery_settings) | legend_entries(axes.flat),
        )
    return figure


def _limits(means: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[float, float]:
    """The axis: all if all lie close together, else three times the middle half to either side."""
    first, third = np.percentile(means, (25, 75))
    reach = 3 * max(third - first, 1.0)
    low, high = np.fmin(low, means), np.fmax(high, means)
    return max(first - reach, low.min() - 0.5), min(third + reach, high.max() + 0.5)


def _dots(
    axis: Axes,
    heights: np.ndarray,
    values: np.ndarray,
    limits: tuple[float, float],
    look: tuple[str, str],
    filled: bool,
) -> None:
    """One delivery setting of one learner; values are (3, rows): means, lower and upper ends."""
    colour, marker = look
    means, low, high = values
    at = np.clip(means, *limits)
    near = at == means
    axis.hlines(heights[near], low[near], high[near], color=colour, linewidth=1.2)
    axis.plot(
        at,
        heights,
        marker,
        color=colour,
        markersize=4.5,
        markerfacecolor=colour if filled else "white",
        clip_on=False,
    )
    for mean, edge, height in zip(means[~near], at[~near], heights[~near], strict=True):
        side = -1 if mean > edge else 1
        axis.annotate(
            f"{mean:.0f}",
            (edge, height),
            # Away from the number of the same configuration's other delivery setting.
            xytext=(6 * side, 1.5 if filled else -1.5),
            textcoords="offset points",
            ha="right" if side < 0 else "left",
            va="center",
            color=colour,
            fontsize=6.5,
        )


def _lines(axis: Axes, baselines: Sequence[Mapping], limits: tuple[float, float]) -> None:
    places = in_training(baselines, ["return_mean"]).items()
    shown = [(name, place) for name, (place,) in places if limits[0] <= place <= limits[1]]
    for number, (name, place) in enumerate(shown):
        axis.axvline(
            place,
            color=GREY,
            linewidth=1.0,
            linestyle=_DASHES[number % len(_DASHES)],
            zorder=1,
            label=f"{name} ({place:g})",
        )


def _rows(
    axes: np.ndarray, configurations: Sequence[Hyperparameters], limits: tuple[float, float]
) -> None:
    """Names the rows, first one on top, with a line between learning rates."""
    first = axes.flat[0]
    first.set_yticks(range(len(configurations)), [one.label for one in configurations])
    first.set_ylim(len(configurations) - 0.4, -0.6)
    first.set_xlim(limits)
    for axis in axes.flat:
        axis.tick_params(axis="y", length=0, labelsize=7.5)
        for number in range(1, len(configurations)):
            before, after = configurations[number - 1 : number + 1]
            if before.learning_rate != after.learning_rate:
                axis.axhline(number - 0.5, color=GREY, linewidth=0.7)


def _settings(settings: Sequence[str]) -> dict[str, Artist]:
    """The legend of the delivery settings: filled marks for the first, open ones for others."""
    from matplotlib.lines import Line2D

    look: dict[str, Any] = {"color": INK, "marker": "o", "linestyle": "none"}
    return {
        f"{setting} delivery": Line2D([], [], **look, markerfacecolor="white" if place else INK)
        for place, setting in enumerate(settings)
    }
