"""Figures of a comparison, and the data of their learning curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from paper.baselines import Baseline
from paper.comparison import FIGURE_1, Comparison, Variant, counts
from paper.table2 import shown_position
from taichi_ants.analysis import style
from taichi_ants.analysis.behaviour import BEHAVIOURS
from taichi_ants.analysis.drawings import Drawing, drawings
from taichi_ants.analysis.statistics import interquartile_mean
from taichi_ants.analysis.style import BLUE, COLOURS, INK, ORANGE, WINE
from taichi_ants.errors import count

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CURVES = {"returns": "Return", "steps": "Steps", "deliveries": "Deliveries"}
_PER_DECADE = 12  # points of a learning curve between two powers of ten
# Colours and markers of behaviours, in the order of `BEHAVIOURS`.
BEHAVIOUR_LOOKS = ((BLUE, "o"), (ORANGE, "^"), (WINE, "s"), (INK, "x"))


def curve_row(comparison: Comparison, delivery: str, variant: Variant) -> int:
    """Return the row of a learner's configuration in figure 1, or if it has none, in table 2."""
    row = comparison.position(delivery, variant, FIGURE_1)
    return shown_position(comparison, delivery, variant) if row is None else row


def spans(episodes: int) -> np.ndarray:
    """Return the first episode of each span, from 0, and the last span's end, int64 (spans + 1,).

    Spans grow, so that points are evenly spaced on a logarithmic axis; the first spans are single
    episodes.
    """
    n, end = max(2, round(_PER_DECADE * np.log10(episodes + 1)) + 1), episodes + 1
    return np.unique(np.geomspace(1, end, n).round().astype(int)) - 1


def sums(name: str) -> str:
    """Return the name of the array with the sum of a curve's quantity over each span."""
    return f"sum_{name}"


def curves_of(comparison: Comparison, runs: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the curves of all `comparison.learners`, float64 (learners, 3, spans) by name.

    The second axis has the interquartile mean over seeds and the ends of the middle half of the
    seeds. For deliveries, which are 0 or 1 per episode, it has the mean instead. `runs` has the
    `sums` of all runs, (rows, seeds, spans).
    """
    rows = [curve_row(comparison, *learner) for learner in comparison.learners]
    lengths, curves = np.diff(spans(comparison.episodes)), {}
    for name in CURVES:
        found = []
        for means in runs[sums(name)][rows] / lengths:
            middle = means.mean(axis=0) if name == "deliveries" else interquartile_mean(means.T)
            found.append([middle, *np.percentile(means, (25, 75), axis=0)])
        curves[name] = np.array(found)
    return curves


def learning_curves(comparison: Comparison, baselines: Sequence[Baseline] = ()) -> Figure:
    """Return a figure of the return, length and deliveries of episodes, by delivery setting.

    It shows each learner in the configuration of `curve_row`. A point is the mean over a span of
    episodes. Lines are interquartile means over seeds; bands are the middle half of the seeds.
    """
    colours = dict(zip(comparison.variants, cycle(COLOURS)))
    settings = comparison.delivery_settings
    edges = spans(comparison.episodes)
    at = np.sqrt((edges[:-1] + 1) * edges[1:])  # the middle of a span on a logarithmic axis
    with style.styled():
        figure = style.new_figure(6.5)
        shape = len(CURVES), len(settings)
        axes = figure.subplots(*shape, sharex=True, sharey="row", squeeze=False)
        for place, (setting, variant) in enumerate(comparison.learners):
            point = comparison.rows[curve_row(comparison, setting, variant)].point
            more = "" if point == FIGURE_1 else f", {setting}: {point.label}"
            label = style.label(variant.label + more)
            for axis, name in zip(axes[:, settings.index(setting)], CURVES, strict=True):
                middle, low, high = comparison.curves[name][place]
                mark = "o" if len(at) == 1 else ""
                axis.plot(at, middle, marker=mark, color=colours[variant], label=label)
                if name != "deliveries":
                    axis.fill_between(at, low, high, color=colours[variant], alpha=0.15, lw=0)
        for (axis, *_), (name, label) in zip(axes, CURVES.items(), strict=True):
            axis.set_ylabel(f"{label} per episode")
            if name == "steps":
                style.logarithmic(axis.yaxis, (1, 2, 5))
            if name == "deliveries":  # a share, for which an axis of few hundredths would mislead
                axis.set_ylim(min(0.9, axis.get_ylim()[0]), 1.02)
        for column, setting in zip(axes.T, settings, strict=True):
            column[0].set_title(f"Delivery {setting}")
            for row in baselines:
                if row.baseline == "shortest delivery" and row.return_mean is not None:
                    for axis, level in zip(column, (row.return_mean, row.steps_mean), strict=False):
                        axis.axhline(level, color=INK, lw=0.9, ls=":", label=row.baseline)
            column[-1].set_xlabel("Episode")
            style.logarithmic(column[-1].xaxis, (1,) if comparison.episodes > 50 else (1, 2, 5))
        words = (
            f"World: {comparison.world}. Line: interquartile mean of "
            f"{count(len(comparison.seeds), 'seed')} (mean for deliveries), band: their middle "
            "half.\nLater points are means over longer spans. Unless the legend names others, "
            f"the learning rate is {FIGURE_1.learning_rate:g},\nthe discount "
            f"{FIGURE_1.discount:g}, epsilon {FIGURE_1.epsilon:g} and its decay "
            f"{FIGURE_1.epsilon_decay:g}. The paper's figure 1 names no configuration; this one "
            "occurs\ntwice in its table 2."
        )
        style.frame(figure, "Learning curves", words, style.legend_entries(axes.flat))
    return figure


def return_against_deliveries(comparison: Comparison, baselines: Sequence[Baseline] = ()) -> Figure:
    """Return a figure with a mark for each run: return, deliveries and behaviour."""
    settings = comparison.delivery_settings
    returns = comparison.measures["return_last50"]
    deliveries = comparison.measures["deliveries_last50"]
    with style.styled():
        figure = style.new_figure(5.0)
        axes = figure.subplots(1, len(settings), sharex=True, sharey=True, squeeze=False)[0]
        for axis, setting in zip(axes, settings, strict=True):
            axis.set_title(f"Delivery {setting}")
            axis.set_xlabel("Deliveries per episode (last 50)")
            of_setting = np.array([row.delivery == setting for row in comparison.rows])[:, None]
            for code in counts(comparison.behaviours):
                runs = of_setting & (comparison.behaviours == code)
                colour, marker = BEHAVIOUR_LOOKS[code]
                faint: dict[str, Any] = {"color": colour, "markersize": 4, "alpha": 0.6}
                axis.plot(deliveries[runs], returns[runs], marker, label=BEHAVIOURS[code], **faint)
            # Hollow marks, larger than those of the data and above them. Optimal policies assume
            # that a delivery ends the episode, so other settings do not show them.
            look: dict[str, Any] = {"color": INK, "markerfacecolor": "none", "markersize": 11}
            for row, marker in zip(baselines, cycle("osD^vph")):
                counts_here = setting == "terminates" or row.baseline != "optimal policy"
                if row.return_mean is not None and counts_here:
                    axis.plot(row.deliveries_mean, row.return_mean, marker, label=row.label, **look)
        axes[0].set_ylabel("Return (reward per episode, last 50)")
        style.frame(
            figure,
            "Return and deliveries in training, and behaviour of the final policies",
            f"World: {comparison.world}. A mark is a run: "
            f"{count(len(comparison.rows), 'configuration')}, "
            f"{count(len(comparison.seeds), 'seed')} each. Its shape and colour show\nthe "
            "behaviour of the greedy final policy, with evaporation as in training.",
            style.legend_entries(axes),
        )
    return figure


def draw_all(comparison: Comparison, baselines: Sequence[Baseline]) -> dict[str, Figure]:
    """Return all figures by name."""
    return {
        draw.__name__: draw(comparison, baselines)
        for draw in (learning_curves, return_against_deliveries)
    }


def save_all(comparison: Comparison, baselines: Sequence[Baseline], folder: Path) -> list[Drawing]:
    """Write all figures as files, and return them for the page."""
    return drawings(draw_all(comparison, baselines), folder)
