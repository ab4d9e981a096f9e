"""The figures of a comparison.

Each function takes data and returns a matplotlib Figure; `save_all` writes all of them. Figures
are made without pyplot, so nothing global changes and no window system is needed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.analysis.best_of import best_of, best_position
from taichi_ants.analysis.comparison import Comparison, Variant
from taichi_ants.analysis.markdown import count
from taichi_ants.analysis.paper import FIGURE_1, TABLE_2
from taichi_ants.analysis.sensitivity import sensitivity
from taichi_ants.analysis.statistics import student_interval
from taichi_ants.analysis.style import (
    INK,
    for_setting,
    frame,
    in_training,
    legend_entries,
    looks,
    new_figure,
    over_seeds,
    save,
    styled,
)
from taichi_ants.results import check_writable_folder

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SMOOTHING = 10  # episodes
_CURVES = {
    "returns": "Return\n(reward per episode)",
    "steps": "Episode length\n(steps)",
    "deliveries": "Deliveries\n(per episode)",
}
# Delivery setting and learner -> row of the comparison.
Shown = dict[tuple[str, Variant], int]
_FEW = 0.9  # deliveries per episode
_BINS = 160
_CIRCLES = " High returns with few deliveries come from\nwalking in circles on a trail."
_HILLS = 10  # values from which on they are shown as a histogram
_DROP = 0.16  # of the bar below its ridge, in rows


def learning_curves(comparison: Comparison) -> Figure:
    """Return, length and deliveries per episode, at the configuration of the paper's figure 1.

    Where a learner lacks that one, or the world is not the paper's, each learner is shown at the
    configuration with its highest mean return. Lines are moving averages over `SMOOTHING`
    episodes, averaged over seeds; bands are pointwise 95 % Student intervals over seeds (none for
    one seed), cut off where no mean can be. The axes are those of the lines: the bands of two seeds
    would flatten all of them.
    """
    settings = comparison.delivery_settings
    style = looks(comparison.variants)
    shared = _at_figure_1(comparison)
    shown = shared or _at_best(comparison)
    title, words = (
        ("Learning at one shared configuration, the paper's figure 1", [f"{FIGURE_1.label}"])
        if shared
        else ("Learning, each learner at its configuration with the highest return", [])
    )
    words = words or _configurations(comparison, shown)
    possible = {
        "returns": (-np.inf, np.inf),
        "steps": (0, comparison.max_steps),
        "deliveries": (0, 1),
    }
    with styled():
        figure = new_figure(7.0 + 0.15 * len(words))
        axes = figure.subplots(
            len(_CURVES), len(settings), sharex=True, sharey="row", squeeze=False
        )
        for column, setting in zip(axes.T, settings, strict=True):
            column[0].set_title(f"{setting.capitalize()} delivery")
            column[-1].set_xlabel("Episode")
            for axis, name in zip(column, _CURVES, strict=True):
                limits = possible[name]
                for variant in comparison.variants:
                    if (setting, variant) in shown:
                        runs = getattr(comparison, name)[shown[setting, variant]]
                        _curve(axis, runs, *_line(style, variant), limits)
        for row, label in zip(axes, _CURVES.values(), strict=True):
            row[0].set_ylabel(label)
            _keep_to_lines(row)
        axes[0, 0].margins(x=0.01)
        figure.align_ylabels(axes[:, 0])
        window = _window(comparison.episodes)
        averaged = f"Moving average over {window} episodes, " if window > 1 else ""
        spread = over_seeds(len(comparison.seeds), "95 % band")
        caption = (
            f"{averaged}{spread}. Learning rate / discount / epsilon / decay: ",
            *words,
        )
        frame(
            figure,
            title,
            "".join(caption) if shared else "\n".join(caption),
            legend_entries(axes.flat),
        )
    return figure


def best_runs(comparison: Comparison) -> Figure:
    """What "train each configuration once, report the best" gives.

    For each learner the distribution over independent draws of seeds of the winner's return and
    length, with its median and 95 % range; in the paper's world the figure that the paper reports.
    """
    settings = comparison.delivery_settings
    with styled():
        figure = new_figure(1.5 + 0.6 * len(comparison.variants) * len(settings))
        axes = figure.subplots(len(settings), 2, sharey=True, squeeze=False)
        for row, setting in zip(axes, settings, strict=True):
            row[0].set_title(f"{setting.capitalize()} delivery")
            _ridges(row, comparison, setting)
            row[0].set_xlabel("Return of the best run (reward)")
            row[1].set_xlabel("Its mean length (steps)")
            for axis in row:
                if axis.get_xscale() == "log":
                    axis.set_xlabel(f"{axis.get_xlabel()}, logarithmic")
        counts = {
            len(comparison.positions(setting, variant))
            for setting in settings
            for variant in comparison.variants
        }
        number = " or ".join(str(count) for count in sorted(counts - {0}))
        frame(
            figure,
            f"What the best of {number} configurations with one run each reports",
            "Each configuration is trained once, on a random one of "
            f"{count(len(comparison.seeds), 'seed')}, and the run with the highest return is "
            "reported.\n"
            "Dot and bar: median and 95 % range; up to 2.5 % lie beyond either end of an axis.",
            legend_entries(axes.flat),
        )
    return figure


def return_against_deliveries(comparison: Comparison, baselines: Sequence[Mapping] = ()) -> Figure:
    """Who earns reward by delivering, and who by walking in circles on a trail.

    Args:
        comparison: The comparison.
        baselines: Rows of baselines.csv; those of the training setting are shown, the optimal
            policies, for which delivery is the end, only in the panel of absorbing delivery.
    """
    settings = comparison.delivery_settings
    style = looks(comparison.variants)
    returns = comparison.measure("return_last50")
    deliveries = comparison.measure("deliveries_last50")
    if "absorbing" not in settings:
        baselines = for_setting(baselines, settings[0])
    # One mark for each place, the same in all panels.
    marks = in_training(baselines, ["deliveries_mean", "return_mean"])
    with styled():
        figure = new_figure(5.0)
        axes = figure.subplots(1, len(settings), sharex=True, sharey=True, squeeze=False)
        for axis, setting in zip(axes[0], settings, strict=True):
            axis.set_title(f"{setting.capitalize()} delivery")
            axis.set_xlabel("Deliveries per episode (last 50)")
            for variant, (colour, marker) in style.items():
                rows = comparison.positions(setting, variant)
                cloud = {"color": colour, "marker": ".", "linestyle": "none"}
                axis.plot(
                    deliveries[rows].ravel(), returns[rows].ravel(), **cloud, ms=2.5, alpha=0.25
                )
                axis.plot(
                    deliveries[rows].mean(axis=1),
                    returns[rows].mean(axis=1),
                    color=colour,
                    marker=marker,
                    linestyle="none",
                    markersize=6.5,
                    markeredgecolor="white",
                    markeredgewidth=0.7,
                    zorder=4,
                    label=variant.label,
                )
            _baseline_marks(axis, marks, setting)
        axes[0, 0].set_ylabel("Return (reward per episode, last 50)")
        frame(
            figure,
            "Return against deliveries",
            "Filled marks: means of configurations. Small dots: single runs."
            + (_CIRCLES if _circles(comparison, baselines) else ""),
            legend_entries(axes.flat),
        )
    return figure


def save_all(
    comparison: Comparison, baselines: Sequence[Mapping], folder: str | Path
) -> list[Path]:
    """Writes all figures as PNG files into a folder, which is made if needed.

    Returns:
        The paths written.

    Raises:
        AntsError: The folder or a file in it cannot be written.
    """
    folder = check_writable_folder(folder)
    figures = {
        "learning_curves": learning_curves(comparison),
        "sensitivity": sensitivity(comparison, baselines),
        "best_runs": best_runs(comparison),
        "return_against_deliveries": return_against_deliveries(comparison, baselines),
    }
    paths = []
    for name, figure in figures.items():
        paths.append(folder / f"{name}.png")
        save(figure, paths[-1])
    return paths


def _at_figure_1(comparison: Comparison) -> Shown:
    """The rows at the configuration of the paper's figure 1; none if a learner lacks it."""
    found = {
        (setting, variant): comparison.position(setting, variant, FIGURE_1)
        for setting in comparison.delivery_settings
        for variant in comparison.variants
        if comparison.positions(setting, variant)
    }
    complete = {key: row for key, row in found.items() if row is not None}
    return complete if comparison.in_paper_world and len(complete) == len(found) else {}


def _at_best(comparison: Comparison) -> Shown:
    """The rows with the highest mean return of each learner."""
    return {
        (setting, variant): best_position(comparison, positions)
        for setting in comparison.delivery_settings
        for variant in comparison.variants
        if (positions := comparison.positions(setting, variant))
    }


def _configurations(comparison: Comparison, shown: Shown) -> list[str]:
    """A line for each learner with its configuration in each delivery setting."""
    lines = []
    for variant in comparison.variants:
        parts = [
            f"{comparison.rows[position].hyperparameters.label} ({setting})"
            for (setting, other), position in shown.items()
            if other == variant
        ]
        lines.append(f"{variant.label}: {', '.join(parts)}")
    return lines


def _line(style: dict[Variant, tuple[str, str]], variant: Variant) -> tuple[str, str]:
    return style[variant][0], variant.label


def _window(episodes: int) -> int:
    return max(1, min(SMOOTHING, episodes // SMOOTHING))


def _curve(
    axis: Axes, runs: np.ndarray, colour: str, label: str, limits: tuple[float, float]
) -> None:
    """One learner's line with its band within limits; runs are (seeds, episodes)."""
    window = _window(runs.shape[1])
    sums = np.cumsum(np.pad(runs, ((0, 0), (1, 0))), axis=1, dtype=float)
    smooth = (sums[:, window:] - sums[:, :-window]) / window
    # A value stands at the last episode that it averages.
    episodes = np.arange(window, runs.shape[1] + 1)
    marker = "o" if len(episodes) == 1 else ""
    axis.plot(episodes, smooth.mean(axis=0), color=colour, label=label, marker=marker)
    if len(runs) > 1:
        low, high = np.clip(student_interval(smooth.T), *limits)
        axis.fill_between(episodes, low, high, color=colour, alpha=0.2, linewidth=0)


def _keep_to_lines(row: Sequence[Axes]) -> None:
    """Let panels that share an axis show little beside what their lines span."""
    lines = np.concatenate([line.get_ydata() for axis in row for line in axis.get_lines()])
    room = 0.25 * np.ptp(lines) or 1.0
    low, high = row[0].get_ylim()
    row[0].set_ylim(max(low, lines.min() - room), min(high, lines.max() + room))


def _ridges(row: Sequence[Axes], comparison: Comparison, setting: str) -> None:
    """A ridge for each learner in the panels for return and steps."""
    style = looks(comparison.variants)
    bests = {variant: best_of(comparison, setting, variant) for variant in comparison.variants}
    for axis, name in zip(row, ("returns", "steps"), strict=True):
        drawn = {variant: getattr(best, name) for variant, best in bests.items() if best}
        paper = {
            variant: figures.return_last50 if name == "returns" else figures.steps_all
            for variant, figures in TABLE_2.items()
            if variant in drawn and comparison.in_paper_world
        }
        edges = _edges([*drawn.values(), *paper.values()])
        for height, variant in enumerate(reversed(comparison.variants)):
            if variant in drawn:
                _ridge(axis, drawn[variant], edges, height, style[variant][0])
            if variant in paper:
                place = paper[variant], height - _DROP
                axis.plot(*place, "D", color=INK, ms=6, mec="white", label="the paper's figure")
        names = [variant.label for variant in reversed(comparison.variants)]
        axis.set_yticks(range(len(names)), names)
        axis.tick_params(axis="y", length=0)
        axis.set_ylim(-0.45, len(names) - 0.1)
        axis.grid(axis="y", visible=False)
        axis.set_xlim(edges[0], edges[-1])
        if edges[0] > 0:
            _logarithmic(axis)


def _edges(values: Sequence[np.ndarray | float]) -> np.ndarray:
    """Bins from the lowest 2.5 % to the highest 97.5 % point of any, logarithmic if positive."""
    ends = [np.percentile(one, (2.5, 97.5)) for one in values]
    low, high = np.min(ends) - 0.5, np.max(ends) + 0.5
    if low <= 0:
        return np.linspace(low - 0.04 * (high - low), high + 0.04 * (high - low), _BINS + 1)
    pad = (high / low) ** 0.04
    return np.geomspace(low / pad, high * pad, _BINS + 1)


def _ridge(axis: Axes, values: np.ndarray, edges: np.ndarray, height: int, colour: str) -> None:
    """Smoothed histogram above a bar of the 95 % range with a dot at the median.

    So few values that a histogram would be a hill around each are dots.
    """
    low, median, high = np.percentile(values, (2.5, 50, 97.5))
    kernel = np.exp(-0.5 * (np.arange(-6, 7) / 2) ** 2)
    shares = np.convolve(np.histogram(values, edges)[0], kernel, mode="same")
    if len(few := np.unique(values)) < _HILLS:
        axis.plot(few, np.full(len(few), height), ".", color=colour, alpha=0.6)
    elif shares.max() > 0:
        top = height + 0.75 * shares / shares.max()
        middles = (edges[1:] + edges[:-1]) / 2
        axis.fill_between(middles, height, top, color=colour, alpha=0.35, linewidth=0)
    axis.plot([low, high], [height - _DROP] * 2, color=colour, linewidth=2.5)
    axis.plot(median, height - _DROP, "o", color=colour, ms=6, mec="white", mew=0.7)


def _logarithmic(axis: Axes) -> None:
    """A logarithmic axis with ticks at plain numbers, as many as its span has room for."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    low, high = axis.get_xlim()
    axis.set_xscale("log")
    steps = (1, 2, 3, 5, 7) if high > 4 * low else (1, 1.5, 2, 2.5, 3, 3.5, 4, 4.5, 5, 5.5, 6, 7, 8)
    ticks = [step * 10.0**power for power in range(-3, 8) for step in steps]
    axis.xaxis.set_major_locator(FixedLocator([tick for tick in ticks if low <= tick <= high]))
    axis.xaxis.set_minor_locator(NullLocator())
    axis.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _circles(comparison: Comparison, baselines: Sequence[Mapping]) -> bool:
    """Whether a configuration seldom delivers, yet returns more than the shortest delivery."""
    known = [row["return_mean"] for row in baselines if row["baseline"] == "shortest delivery"]
    if not known or known[0] is None:
        return False
    returns = comparison.measure("return_last50").mean(axis=1)
    deliveries = comparison.measure("deliveries_last50").mean(axis=1)
    return bool(((deliveries < _FEW) & (returns > known[0])).any())


def _baseline_marks(axis: Axes, marks: Mapping[str, Sequence[float]], setting: str) -> None:
    """Hollow marks, larger than those of the data and below them."""
    for number, (name, place) in enumerate(marks.items()):
        # Optimal policies take delivery for the end; elsewhere they are no yardstick.
        if setting != "absorbing" and all(
            part.startswith("optimal policy") for part in name.split("; ")
        ):
            continue
        axis.plot(
            *place,
            "osD^vph"[number % 7],
            color=INK,
            markerfacecolor="none",
            markersize=11,
            markeredgewidth=1.1,
            zorder=3,
            label=name,
        )
