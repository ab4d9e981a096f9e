"""The figures of the study, one column of panels for each arena.

Each function takes the study and returns a matplotlib Figure; `save_all` writes all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from taichi_ants.analysis.colony.study import (
    COPIED,
    COPIED_LONG,
    JOINT,
    LASTING,
    OFF,
    ON,
    OWN,
    PHEROMONES,
    THEN_JOINT,
    WAYS,
    Arena,
    ColonyStudy,
)
from taichi_ants.analysis.statistics import bootstrap_interval
from taichi_ants.analysis.style import GREY, INK, frame, legend_entries, new_figure, save, styled
from taichi_ants.results import check_writable_folder

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito's palette, distinct for the colour-blind; markers tell the lines apart without it.
_WAY_LOOKS = {
    COPIED: ("#0072B2", "o", "-"),
    COPIED_LONG: ("#56B4E9", "v", ":"),
    JOINT: ("#D55E00", "s", "-"),
    THEN_JOINT: ("#E69F00", "D", "--"),
    OWN: ("#009E73", "^", "-"),
}
_PHEROMONE_LOOKS = {ON: ("#D55E00", "s"), OFF: ("#0072B2", "o"), LASTING: ("#009E73", "^")}
_SPREAD = 0.035  # of log10 of the number of ants, between lines, so that their bars stand apart


def scaling(study: ColonyStudy) -> Figure:
    """Deliveries of the whole colony and of each ant against the number of ants."""
    return _by_way(
        study,
        {
            "deliveries": "Deliveries\nper 1000 ticks",
            "per_ant": "Deliveries per ant\nand 1000 ticks",
        },
        "More ants: what a colony delivers, and each of its ants",
        "Trails evaporate. Dashed grey: no colony can deliver more (shortest cycles, room at food "
        "and queen).",
        limits=True,
    )


def crowding(study: ColonyStudy) -> Figure:
    """Blocked moves and the time to the first delivery against the number of ants."""
    return _by_way(
        study,
        {
            "blocked": "Blocked moves\n(share of those tried)",
            "first_delivery": "Ticks to the\nfirst delivery",
        },
        "More ants: how often they block each other, how soon one delivers",
        "Trails evaporate. An episode without a delivery counts with all its ticks.",
    )


def trails(study: ColonyStudy) -> Figure:
    """What the trails that ants lay do to deliveries, for copies and for joint training."""
    with styled():
        figure = new_figure(5.6)
        axes = figure.subplots(2, len(study.arenas), sharex="col", sharey="row", squeeze=False)
        for row, way in zip(axes, (COPIED, JOINT), strict=True):
            for axis, arena in zip(row, study.arenas, strict=True):
                for number, (pheromone, (colour, marker)) in enumerate(_PHEROMONE_LOOKS.items()):
                    style = {"color": colour, "marker": marker, "label": PHEROMONES[pheromone]}
                    line = (study, arena, pheromone, way, "deliveries")
                    _draw_line(axis, *line, number - 1, style)
            words = WAYS[way].replace(", ", ",\n")
            row[0].set_ylabel(f"{words[0].upper()}{words[1:]}\n(deliveries per 1000 ticks)")
        _finish(figure, axes, study.arenas, logarithmic=(True, True))
        frame(
            figure,
            "Do the trails help that ants lay themselves?",
            f"Each ant was trained under the condition that it is shown in. {_caption(study)}",
            legend_entries(axes.flat),
        )
    return figure


def joint_learning(study: ColonyStudy) -> Figure:
    """Paired differences from copies of an ant trained alone, as shares of what these deliver."""
    ways = [way for way in _WAY_LOOKS if way != COPIED]
    with styled():
        figure = new_figure(3.6)
        axes = figure.subplots(1, len(study.arenas), sharey=True, squeeze=False)
        for axis, arena in zip(axes[0], study.arenas, strict=True):
            axis.axhline(0, color=INK, linewidth=0.8)
            for number, way in enumerate(ways):
                colour, marker, line = _WAY_LOOKS[way]
                style = {"color": colour, "marker": marker, "linestyle": line, "label": WAYS[way]}
                _draw_gain(axis, study, arena, way, number - (len(ways) - 1) / 2, style)
        axes[0, 0].set_ylabel("More deliveries than\ncopies (%)")
        _finish(figure, axes, study.arenas, logarithmic=(False,))
        frame(
            figure,
            "What other ways of sharing deliver, compared with copies of an ant trained alone",
            f"Trails evaporate. Differences are paired by seed. {_caption(study)}",
            legend_entries(axes.flat),
        )
    return figure


def save_all(study: ColonyStudy, folder: str | Path) -> list[Path]:
    """Write all figures as PNG files into a folder, which is made if needed.

    Returns:
        The paths written.

    Raises:
        AntsError: The folder or a file in it cannot be written.
    """
    folder = check_writable_folder(folder)
    paths = []
    for make in (scaling, crowding, trails, joint_learning):
        paths.append(folder / f"{make.__name__}.png")
        save(make(study), paths[-1])
    return paths


def _by_way(
    study: ColonyStudy, measures: dict[str, str], title: str, caption: str, limits: bool = False
) -> Figure:
    """A row of panels for each measure, a line for each way, trails evaporating."""
    share: Literal[False, "row"] = False if limits else "row"  # limits already set the scale
    with styled():
        figure = new_figure(5.6)
        axes = figure.subplots(
            len(measures), len(study.arenas), sharex="col", sharey=share, squeeze=False
        )
        for row, (measure, label) in zip(axes, measures.items(), strict=True):
            row[0].set_ylabel(label)
            for axis, arena in zip(row, study.arenas, strict=True):
                for number, (way, (colour, marker, line)) in enumerate(_WAY_LOOKS.items()):
                    style = {"color": colour, "marker": marker, "linestyle": line}
                    style["label"] = WAYS[way]
                    _draw_line(axis, study, arena, ON, way, measure, number - 2, style)
                if limits and arena.limits:
                    _draw_limit(axis, arena, each=measure == "per_ant")
        entries = legend_entries(axes.flat)
        entries |= {"limit": entries.pop("limit")} if "limit" in entries else {}  # comes last
        _finish(figure, axes, study.arenas, [measure != "blocked" for measure in measures])
        frame(figure, title, f"{caption} {_caption(study)}", entries)
    return figure


def _draw_line(
    axis: Axes,
    study: ColonyStudy,
    arena: Arena,
    pheromone: str,
    way: str,
    measure: str,
    place: float,
    style: dict[str, Any],
) -> None:
    """Means over seeds with their intervals, against the number of ants."""
    sizes = study.sizes(arena, pheromone, way)
    if not sizes:
        return
    values = np.stack([study.values(arena, pheromone, way, n, measure) for n in sizes])
    _errorbar(axis, sizes, values.mean(axis=1), *bootstrap_interval(values), place, style)


def _draw_gain(
    axis: Axes, study: ColonyStudy, arena: Arena, way: str, place: float, style: dict[str, Any]
) -> None:
    sizes = [n for n in study.sizes(arena, ON, way) if n > 1 and study.has(arena, ON, COPIED, [n])]
    if not sizes:
        return
    copies = np.stack([study.values(arena, ON, COPIED, n) for n in sizes])
    others = np.stack([study.values(arena, ON, way, n) for n in sizes])
    gains = 100 * (others - copies) / np.maximum(copies.mean(axis=1, keepdims=True), 1e-9)
    _errorbar(axis, sizes, gains.mean(axis=1), *bootstrap_interval(gains), place, style)


def _errorbar(
    axis: Axes,
    sizes: Sequence[int],
    means: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    place: float,
    style: dict[str, Any],
) -> None:
    at = np.array(sizes) * 10 ** (place * _SPREAD)
    below, above = (np.nan_to_num(np.abs(end - means)) for end in (low, high))
    axis.errorbar(
        at,
        means,
        yerr=[below, above],
        markersize=4.5,
        markeredgecolor="white",
        markeredgewidth=0.5,
        elinewidth=1.2,
        **style,
    )


def _draw_limit(axis: Axes, arena: Arena, each: bool) -> None:
    sizes = np.unique(np.geomspace(arena.sizes[0], arena.sizes[-1], 60).round().astype(int))
    limits = [np.mean([limit.deliveries(int(n)) for limit in arena.limits]) for n in sizes]
    values = np.array(limits) / (sizes if each else 1)
    axis.plot(sizes, values, "--", color=GREY, linewidth=1.2, label="limit")


def _finish(
    figure: Figure, axes: np.ndarray, arenas: Sequence[Arena], logarithmic: Sequence[bool]
) -> None:
    from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullLocator

    plain = FuncFormatter(lambda value, _: f"{value:g}")
    for row, by_powers in zip(axes, logarithmic, strict=True):
        for axis in row:
            if by_powers and np.isfinite(axis.dataLim.minposy):  # something is above 0
                axis.set_yscale("log")
                low, high = axis.get_ylim()
                subs = (1, 2, 5) if high < 1000 * low else (1,)
                axis.yaxis.set_major_locator(LogLocator(subs=subs, numticks=30))
                axis.yaxis.set_minor_locator(NullLocator())
            else:
                axis.margins(y=0.08)
            axis.yaxis.set_major_formatter(plain)
    for column, arena in zip(axes.T, arenas, strict=True):
        column[0].set_title(f"{arena.words[0].upper()}{arena.words[1:]}", fontsize=9)
        column[-1].set_xlabel("Ants")
        for axis in column:
            axis.set_xscale("log")
            axis.xaxis.set_major_locator(FixedLocator(arena.sizes))
            axis.xaxis.set_minor_locator(NullLocator())
            axis.xaxis.set_major_formatter(plain)
    figure.align_ylabels(axes[:, 0])


def _caption(study: ColonyStudy) -> str:
    seeds = sorted({arena.seeds for arena in study.arenas})
    number = " or ".join(map(str, seeds))
    if seeds == [1]:
        return "One seed."
    return f"Means over {number} seeds with 95 % intervals."
