"""The figures of a comparison.

Each function takes data and returns a matplotlib Figure; `save_all` writes all of them. Figures
are made without pyplot, so nothing global changes and no window system is needed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from taichi_ants.analysis.behaviour import BEHAVIOURS, DELIVERS, counts
from taichi_ants.analysis.paper.best_of import best_of, best_position, percentile_of
from taichi_ants.analysis.paper.comparison import Comparison, Variant
from taichi_ants.analysis.paper.published import FIGURE_1, TABLE_2
from taichi_ants.analysis.paper.sensitivity import sensitivity
from taichi_ants.analysis.statistics import interquartile_mean
from taichi_ants.analysis.style import (
    BEHAVIOUR_LOOKS,
    INK,
    for_setting,
    frame,
    in_training,
    legend_entries,
    logarithmic,
    looks,
    new_figure,
    save,
    styled,
)
from taichi_ants.errors import count
from taichi_ants.files import check_writable_folder

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLUMNS = 4  # learners side by side
_PER_DECADE = 12  # points of a learning curve between two powers of ten
_CURVES = {
    "returns": "Return\n(reward)",
    "steps": "Length\n(steps)",
    "deliveries": "Deliveries\n(per episode)",
}
_BEST = {"return": "Return of the best run", "steps_all": "Its mean length (steps)"}
_OUR_CHOICE = (
    f"All learners have {FIGURE_1.label} (learning rate / discount / epsilon / decay). The paper's "
    "figure 1 shares hyperparameters\ntoo, but does not name them: these are our choice, the only "
    "ones that stand twice in its table 2."
)
_OTHERS: dict[str, Any] = {
    "color": "#C4C4C4",
    "linewidth": 0.9,
    "zorder": 1,
    "label": "the other learners",
}
_DASHES = ((0, (2.5, 3)), (0, (1, 2)))
# Delivery setting and learner -> row of the comparison.
Shown = dict[tuple[str, Variant], int]


def learning_curves(comparison: Comparison, baselines: Sequence[Mapping] = ()) -> Figure:
    """Return, length and deliveries per episode, a column for each learner.

    All are shown at the configuration that stands for the paper's figure 1. Where one of them lacks
    it, or the world is not the paper's, each is shown at the configuration with its highest mean
    return. A point is the mean over a span of episodes (`_spans`); lines are interquartile means
    over seeds, bands the middle half of the seeds (none for one seed).

    Args:
        comparison: The comparison.
        baselines: Rows of baselines.csv; of these the shortest delivery is drawn.
    """
    shared = _at_figure_1(comparison)
    shown = shared or _at_best(comparison)
    seeds = count(len(comparison.seeds), "seed")
    title, words = "Learning at one configuration that all learners share", [_OUR_CHOICE]
    if not shared:
        title = "Learning, each learner at its configuration with the highest return"
        words = ["Learning rate / discount / epsilon / decay:", *_configurations(comparison, shown)]
    if len(comparison.seeds) > 1:
        seeds = f"interquartile mean of {seeds}, of deliveries the mean; band: their middle half"
    words = [
        f"Line: {seeds}.",
        "A point is the mean over a span of episodes; later spans are longer. Episodes and lengths "
        "are on logarithmic axes.",
        *words,
    ]
    with styled():
        figure, blocks = _blocks(comparison, [1.5] * len(_CURVES), 0.14 * len(words))
        for block, variants in blocks:
            for row, (name, label) in zip(block, _CURVES.items(), strict=True):
                row[0].set_ylabel(label)
                for axis, variant in zip(row, variants, strict=False):
                    _curves(axis, comparison, shown, name, variant)
                    _shortest_delivery(axis, baselines, name)
                _keep_to_lines(row)
                if name == "steps":
                    logarithmic(row[0].yaxis, (1, 2, 5))
            for axis in block[-1]:
                axis.set_xlabel("Episode")
                axis.set_xlim(0.9, 1.1 * comparison.episodes)
                logarithmic(axis.xaxis, (1,) if comparison.episodes > 50 else (1, 2, 5))
        frame(figure, title, "\n".join(words), _setting_lines(comparison, figure))
    return figure


def best_runs(comparison: Comparison) -> Figure:
    """What "train each configuration once, report the best" gives.

    For each learner the distribution over independent draws of seeds of the winner's return and
    length: a line's height is the share of draws that report no more. In the paper's world a
    diamond marks the paper's figure, with the share of draws below it.
    """
    settings = comparison.delivery_settings
    with styled():
        rows = [(setting, name) for setting in settings for name in _BEST]
        figure, blocks = _blocks(comparison, [1.3] * len(rows), 0.2, sharex="row")
        for block, variants in blocks:
            for row, (setting, name) in zip(block, rows, strict=True):
                row[0].set_ylabel(f"{setting.capitalize()}\nshare")
                bests = {one: best_of(comparison, setting, one) for one in comparison.variants}
                values = {one: best[name] for one, best in bests.items() if best}
                for axis, variant in zip(row, variants, strict=False):
                    axis.set_xlabel(_BEST[name])
                    axis.tick_params(labelbottom=True)
                    _distributions(axis, values, variant, comparison)
                    if variant in TABLE_2 and variant in values and comparison.in_paper_world:
                        _paper_mark(axis, variant, name, values[variant])
                row[0].set_xlim(_span_of(values, name, comparison))
                row[0].set_ylim(-0.06, 1.06)
                row[0].set_yticks([0, 0.5, 1], ["0", "½", "1"])
        counts = {
            len(comparison.positions(setting, variant))
            for setting in settings
            for variant in comparison.variants
        }
        number = " or ".join(str(count) for count in sorted(counts - {0}))
        frame(
            figure,
            f"What the best of {number} configurations with one run each reports",
            "A draw trains each configuration once, on a random one of "
            f"{count(len(comparison.seeds), 'seed')}, and reports the run with the highest return."
            "\nA line's height is the share of draws that report no more. Up to 2.5 % of a "
            "learner's draws lie beyond either end of an axis.",
            legend_entries(figure.axes),
        )
    return figure


def return_against_deliveries(comparison: Comparison, baselines: Sequence[Mapping] = ()) -> Figure:
    """Who earns reward by delivering, and what the others do instead: a mark for each run.

    Args:
        comparison: The comparison.
        baselines: Rows of baselines.csv; those of the training setting are shown, the optimal
            policies, for which delivery is the end, only in the panel of absorbing delivery.
    """
    settings = comparison.delivery_settings
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
            of_setting = np.array([row.delivery == setting for row in comparison.rows])[:, None]
            for code in counts(comparison.behaviours):
                runs = of_setting & (comparison.behaviours == code)
                colour, marker = BEHAVIOUR_LOOKS[code]
                axis.plot(
                    *(deliveries[runs], returns[runs], marker),
                    color=colour,
                    markersize=4,
                    alpha=0.6,
                    label=BEHAVIOURS[code],
                )
            _baseline_marks(axis, marks, setting)
        axes[0, 0].set_ylabel("Return (reward per episode, last 50)")
        frame(
            figure,
            "Return against deliveries in training, and what the final policies do",
            "A mark is a run. Its look tells what an ant does that follows the final policy "
            f"greedily, {comparison.as_trained}.\n"
            + "\n".join(_who_else(comparison, setting) for setting in settings),
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
        "learning_curves": learning_curves(comparison, baselines),
        "sensitivity": sensitivity(comparison),
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


def _blocks(
    comparison: Comparison,
    heights: Sequence[float],
    words: float,
    sharex: Literal["col", "row"] = "col",
) -> tuple[Figure, list[tuple[np.ndarray, tuple[Variant, ...]]]]:
    """A figure with a column of panels for each learner, in blocks of `_COLUMNS` learners.

    Args:
        comparison: The comparison.
        heights: Of the rows of a block, in inches.
        words: Height of the caption, in inches.
        sharex: Which panels share their x-axes, as in matplotlib.

    Returns:
        The figure, and for each block its panels (rows, columns) and its learners. Panels of a row
        share their y-axes; those without a learner are hidden.
    """
    variants, style = comparison.variants, looks(comparison.variants)
    wide = min(_COLUMNS, len(variants))
    chunks = [variants[start : start + wide] for start in range(0, len(variants), wide)]
    figure = new_figure(0.9 + words + len(chunks) * sum(heights))
    axes = figure.subplots(
        len(chunks) * len(heights), wide, sharex=sharex, sharey="row", squeeze=False
    )
    blocks = [
        (axes[start : start + len(heights)], chunk)
        for start, chunk in zip(range(0, len(axes), len(heights)), chunks, strict=True)
    ]
    for block, chunk in blocks:
        figure.align_ylabels(block[:, 0])
        for column, variant in zip(block.T, chunk, strict=False):
            column[0].set_title(variant.label, color=style[variant][0])
        for axis in block[:, len(chunk) :].flat:
            axis.set_visible(False)
    return figure, blocks


def _spans(episodes: int) -> np.ndarray:
    """The first episodes, from 0, of the spans over which a learning curve averages, and the end.

    Their lengths grow with the episode, so that points are evenly spaced on a logarithmic axis;
    the first spans are single episodes.
    """
    n = max(2, round(_PER_DECADE * np.log10(episodes + 1)) + 1)
    return np.unique(np.geomspace(1, episodes + 1, n).round().astype(int)) - 1


def _curves(axis: Axes, comparison: Comparison, shown: Shown, name: str, variant: Variant) -> None:
    """A learner's lines with their bands, over the pale lines of the others."""
    edges = _spans(comparison.episodes)
    at = np.sqrt((edges[:-1] + 1) * edges[1:])  # the middle of a span on a logarithmic axis
    marker = "o" if len(at) == 1 else ""
    for (setting, other), row in shown.items():
        place = comparison.delivery_settings.index(setting)
        runs = getattr(comparison, name)[row].astype(float)
        means = np.add.reduceat(runs, edges[:-1], axis=1) / np.diff(edges)
        # One run of an episode delivers or does not: there is no typical half to average.
        middle = means.mean(axis=0) if name == "deliveries" else interquartile_mean(means.T)
        if other != variant:
            if not place:
                axis.plot(at, middle, marker=marker, **_OTHERS)
            continue
        colour = INK if place else looks(comparison.variants)[variant][0]
        axis.plot(at, middle, marker=marker, ms=3, **_setting_look(place, colour))
        if len(runs) > 1 and name != "deliveries":
            low, high = np.percentile(means, (25, 75), axis=0)
            axis.fill_between(at, low, high, color=colour, alpha=0.1 if place else 0.25, lw=0)


def _setting_look(place: int, colour: str) -> dict[str, Any]:
    """Of a line, by the place of its delivery setting: thick, or thin, dashed and above it."""
    if not place:
        return {"color": colour, "linewidth": 2.2, "zorder": 3}
    dashes = _DASHES[(place - 1) % len(_DASHES)]
    return {"color": INK, "linewidth": 1.0, "linestyle": dashes, "zorder": 4}


def _setting_lines(comparison: Comparison, figure: Figure) -> dict[str, Artist]:
    """The legend of the delivery settings, then that of what the panels of a figure label."""
    from matplotlib.lines import Line2D

    first, _ = looks(comparison.variants)[comparison.variants[0]]
    lines = {
        f"{setting} delivery": Line2D([], [], **_setting_look(place, first))
        for place, setting in enumerate(comparison.delivery_settings)
    }
    return lines | legend_entries(figure.axes)


def _shortest_delivery(axis: Axes, baselines: Sequence[Mapping], name: str) -> None:
    """A dotted line at the return or the length of the shortest delivery, where it is known."""
    shortest = [row for row in baselines if row["baseline"] == "shortest delivery"]
    for place in in_training(shortest, ["return_mean", "steps_mean"]).values():
        figures = dict(zip(("returns", "steps"), place, strict=True))
        if name in figures:
            label = f"shortest delivery: return {place[0]:g} in {place[1]:g} steps"
            axis.axhline(figures[name], color=INK, linewidth=0.9, linestyle=":", label=label)


def _keep_to_lines(row: Sequence[Axes]) -> None:
    """Let panels that share an axis show little beside what their lines span."""
    lines = np.concatenate([line.get_ydata() for axis in row for line in axis.get_lines()])
    low, high = lines.min(), lines.max()
    room = 0.08 * (high - low) or 1.0
    row[0].set_ylim(max(low / 1.15, low - room) if low > 0 else low - room, high + room)


def _distributions(
    axis: Axes, values: Mapping[Variant, np.ndarray], variant: Variant, comparison: Comparison
) -> None:
    """A learner's cumulated distribution, over the pale ones of the others."""
    for other, drawn in values.items():
        points, counts = np.unique(drawn, return_counts=True)
        shares = np.cumsum(counts) / len(drawn)
        # From 0 on the left edge to 1 on the right one.
        line = np.concatenate([[-1e9], points, [1e9]]), np.concatenate([[0.0], shares, [1.0]])
        colour = looks(comparison.variants)[variant][0]
        look: dict[str, Any] = {"color": colour, "linewidth": 2.0, "zorder": 3}
        axis.plot(*line, drawstyle="steps-post", **(look if other == variant else _OTHERS))


def _paper_mark(axis: Axes, variant: Variant, name: str, drawn: np.ndarray) -> None:
    figures = TABLE_2[variant]
    place = figures.return_last50 if name == "return" else figures.steps_all
    below = percentile_of(place, drawn)
    axis.plot(
        place,
        below / 100,
        "D",
        color=INK,
        ms=6,
        mec="white",
        zorder=5,
        label="the paper's figure, and how many draws lie below it",
    )
    axis.annotate(
        f"{place:.1f}, {below:.0f} % below",
        (0.97, 0.07),
        xycoords="axes fraction",
        ha="right",
        fontsize=7.5,
    )


def _span_of(
    values: Mapping[Variant, np.ndarray], name: str, comparison: Comparison
) -> tuple[float, float]:
    """The axis: all learners without the outermost 5 % of each, and the paper's figures."""
    ends = [np.percentile(drawn, (2.5, 97.5)) for drawn in values.values()]
    if comparison.in_paper_world:
        papers = [TABLE_2[variant] for variant in values if variant in TABLE_2]
        ends += [[row.return_last50 if name == "return" else row.steps_all] for row in papers]
    low, high = min(map(min, ends)), max(map(max, ends))
    room = 0.05 * (high - low) or 1.0
    return low - room, high + room


def _who_else(comparison: Comparison, setting: str) -> str:
    """How many runs of each learner end with a policy that does not deliver, as a line."""
    parts = []
    for variant in comparison.variants:
        behaviours = comparison.behaviours[comparison.positions(setting, variant)]
        if others := int((behaviours != DELIVERS).sum()):
            parts.append(f"{variant.label} {others} of {behaviours.size}")
    return f"Runs that do not deliver, {setting} delivery: {', '.join(parts) or 'none'}."


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
