"""The figure of the hyperparameters: how much does each change the return?"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.analysis.paper.comparison import Comparison, Hyperparameters, Variant
from taichi_ants.analysis.statistics import bootstrap_interval, interquartile_mean
from taichi_ants.analysis.style import GREY, INK, frame, looks, new_figure, styled
from taichi_ants.errors import count

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_OFFSET = 0.19  # rows
_NAMES = {
    "learning_rate": "Learning rate",
    "discount": "Discount",
    "epsilon": "Epsilon",
    "epsilon_decay": "Decay of epsilon",
}


def sensitivity(comparison: Comparison) -> Figure:
    """What each hyperparameter changes in the return, a panel for each that takes several values.

    Pairs of configurations that differ in one hyperparameter alone, its lowest and its highest
    value, are compared seed by seed. A small dot is the interquartile mean over seeds of such a
    pair; the large mark is that of the seeds' means over all pairs, with a 95 % bootstrap interval.
    Most effects are small and a few huge, so the axis shows where most are; what lies beyond is an
    arrow, for a large mark with its number. Of two delivery settings the first has filled marks.
    """
    from matplotlib.ticker import MaxNLocator

    settings, style = comparison.delivery_settings, looks(comparison.variants)
    factors = {
        name: (min(values), max(values))
        for name in Hyperparameters._fields
        if len(values := {getattr(row.hyperparameters, name) for row in comparison.rows}) > 1
    }
    effects = {
        (name, setting, variant): _effects(comparison, name, ends, setting, variant)
        for name, ends in factors.items()
        for setting in settings
        for variant in comparison.variants
    }
    effects = {key: pairs for key, pairs in effects.items() if len(pairs)}
    limits = _limits([interquartile_mean(pairs) for pairs in effects.values()])
    offsets = _OFFSET * np.linspace(-1, 1, len(settings)) if len(settings) > 1 else [0.0]
    with styled():
        figure = new_figure(1.7 + 0.5 * len(comparison.variants))
        axes = figure.subplots(1, max(1, len(factors)), sharex=True, sharey=True, squeeze=False)[0]
        for axis, (name, (low, high)) in zip(axes, factors.items(), strict=False):
            axis.set_title(_NAMES[name])
            axis.set_xlabel(f"Change of the return\nfrom {low:g} to {high:g}")
            axis.xaxis.set_major_locator(MaxNLocator(4, prune="both"))
            axis.axvline(0, color=INK, linewidth=0.8, zorder=1)
            for row, variant in enumerate(comparison.variants):
                for place, setting in enumerate(settings):
                    if (name, setting, variant) in effects:
                        pairs = effects[name, setting, variant]
                        height, look = row + offsets[place], (*style[variant], place == 0)
                        _draw(axis, pairs, height, limits, look)
        axes[0].set_xlim(limits)
        names = [variant.label for variant in comparison.variants]
        axes[0].set_yticks(range(len(names)), names)
        axes[0].set_ylim(len(names) - 0.5, -0.5)
        for axis in axes:
            axis.tick_params(axis="y", length=0, labelsize=9)
            axis.grid(axis="y", visible=False)
        interval = " with its 95 % interval" if len(comparison.seeds) > 1 else ""
        frame(
            figure,
            "What each hyperparameter changes in the return (reward per episode, last 50)"
            if factors
            else "No hyperparameter takes more than one value, so there is nothing to compare",
            f"Small dot: two configurations that differ in it alone, interquartile mean of "
            f"{count(len(comparison.seeds), 'seed')}.\nLarge mark: over all such pairs{interval}. "
            "Arrows point to what lies beyond the axis, numbers say where.",
            _settings(settings),
        )
    return figure


def _effects(
    comparison: Comparison, name: str, ends: tuple[float, float], setting: str, variant: Variant
) -> np.ndarray:
    """Return at the highest value of a hyperparameter minus that at the lowest, (pairs, seeds)."""
    returns, low, high = comparison.measure("return_last50"), *ends
    pairs = []
    for position in comparison.positions(setting, variant):
        here = comparison.rows[position].hyperparameters
        there = comparison.position(setting, variant, here._replace(**{name: high}))
        if getattr(here, name) == low and there is not None:
            pairs.append(returns[there] - returns[position])
    return np.array(pairs).reshape(len(pairs), len(comparison.seeds))


def _limits(centres: Sequence[np.ndarray]) -> tuple[float, float]:
    """The axis, with 0: all if all lie close together, else four times the middle half."""
    if not centres:
        return -1.0, 1.0
    values = np.concatenate(centres)
    reach = 4 * max(np.subtract(*np.percentile(values, (75, 25))), 0.25)
    low, high = min(values.min(), 0.0), max(values.max(), 0.0)
    room = 0.05 * (high - low) + 0.05
    return max(low - room, -reach), min(high + room, reach)


def _draw(
    axis: Axes,
    pairs: np.ndarray,
    height: float,
    limits: tuple[float, float],
    look: tuple[str, str, bool],
) -> None:
    """One learner in one delivery setting.

    Args:
        axis: Where to.
        pairs: Effects, float (pairs, seeds).
        height: Its row.
        limits: Of the axis.
        look: Colour, marker, and whether the marker is filled.
    """
    from matplotlib.markers import CARETLEFT, CARETRIGHT  # their tips are where they stand

    colour, marker, filled = look
    small = interquartile_mean(pairs)
    inside = np.clip(small, *limits) == small
    faint: dict[str, Any] = {"linestyle": "none", "alpha": 0.45, "markeredgewidth": 0}
    heights = np.full(inside.sum(), height)
    axis.plot(small[inside], heights, ".", markersize=5, color=colour, **faint)
    seeds = pairs.mean(axis=0)[None]
    centre = float(interquartile_mean(seeds)[0])
    interval = np.concatenate(bootstrap_interval(seeds, iqm=True))  # nan for one seed
    low, high = np.clip(interval, *limits)
    axis.plot([low, high], [height] * 2, color=colour, linewidth=1.6)
    beyond = np.concatenate([small, interval])
    arrows = {
        CARETLEFT: (limits[0], beyond < limits[0]),
        CARETRIGHT: (limits[1], beyond > limits[1]),
    }
    for arrow, (edge, outside) in arrows.items():
        if outside.any():
            axis.plot(edge, height, marker=arrow, color=colour, markersize=6, markeredgewidth=0)
    face = colour if filled else "white"
    if limits[0] <= centre <= limits[1]:
        axis.plot(centre, height, marker, color=colour, markersize=6, markerfacecolor=face)
        return
    left = centre < limits[0]
    axis.annotate(
        f"{centre:+.0f}" if abs(centre) >= 10 else f"{centre:+.1f}",
        (limits[0] if left else limits[1], height),
        xytext=(7 if left else -7, 0),
        textcoords="offset points",
        ha="left" if left else "right",
        va="center",
        color=colour,
        fontsize=7.5,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8},
    )


def _settings(settings: Sequence[str]) -> dict[str, Artist]:
    """The legend of the delivery settings: filled marks for the first, open ones for others."""
    from matplotlib.lines import Line2D

    look: dict[str, Any] = {"color": GREY, "marker": "o", "linestyle": "none"}
    return {
        f"{setting} delivery": Line2D([], [], **look, markerfacecolor="white" if place else GREY)
        for place, setting in enumerate(settings)
    }
