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
from taichi_ants.analysis.statistics import bootstrap_interval, resampling_counts
from taichi_ants.analysis.style import (
    BLUE,
    GREY,
    INK,
    ORANGE,
    RED,
    SKY,
    WINE,
    frame,
    legend_entries,
    logarithmic,
    new_figure,
    save,
    styled,
)
from taichi_ants.analysis.tables import sentence
from taichi_ants.files import check_writable_folder

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Markers and dashes tell the lines apart without colours.
_WAY_LOOKS = {
    COPIED: (BLUE, "o", "-"),
    COPIED_LONG: (SKY, "v", ":"),
    JOINT: (RED, "s", "-"),
    THEN_JOINT: (ORANGE, "D", "--"),
    OWN: (WINE, "^", "-."),
}
_PHEROMONE_LOOKS = {ON: (RED, "s", "-"), OFF: (BLUE, "o", "--"), LASTING: (ORANGE, "^", ":")}
# Pheromone, way, look and label of a line.
_Line = tuple[str, str, tuple[str, str, str], str]
_WAY_LINES: list[_Line] = [(ON, way, look, WAYS[way]) for way, look in _WAY_LOOKS.items()]
_SPREAD = 0.035  # of log10 of the number of ants, between lines, so that their bars stand apart


def scaling(study: ColonyStudy) -> Figure:
    """Deliveries of the whole colony and of each ant against the number of ants."""
    return _by_size(
        study,
        [
            ("Deliveries\nper 1000 ticks", "deliveries", _WAY_LINES),
            ("Deliveries per ant\nand 1000 ticks", "per_ant", _WAY_LINES),
        ],
        "More ants: what a colony delivers, and each of its ants",
        "Trails evaporate. Dashed grey: no colony can deliver more (shortest cycles, room at food "
        "and queen).",
        limits=True,
    )


def crowding(study: ColonyStudy) -> Figure:
    """Blocked moves and the time to the first delivery against the number of ants."""
    return _by_size(
        study,
        [
            ("Blocked moves\n(share of those tried)", "blocked", _WAY_LINES),
            ("Ticks to the\nfirst delivery", "first_delivery", _WAY_LINES),
        ],
        "More ants: how often they block each other, how soon one delivers",
        "Trails evaporate. An episode without a delivery counts with all its ticks.",
    )


def trails(study: ColonyStudy) -> Figure:
    """What the trails that ants lay do to deliveries, for copies and for joint training."""
    rows = []
    for way in (COPIED, JOINT):
        lines = [(one, way, look, PHEROMONES[one]) for one, look in _PHEROMONE_LOOKS.items()]
        words = sentence(WAYS[way].replace(", ", ",\n"))
        rows.append((f"{words}\n(deliveries per 1000 ticks)", "deliveries", lines))
    return _by_size(
        study,
        rows,
        "Do the trails help that ants lay themselves?",
        "Each ant was trained under the condition that it is shown in.",
    )


def joint_learning(study: ColonyStudy) -> Figure:
    """How many times as much other ways deliver as copies of an ant trained alone."""
    ways = [way for way in _WAY_LOOKS if way != COPIED]
    with styled():
        figure = new_figure(3.8)
        axes = figure.subplots(1, len(study.arenas), sharey=True, squeeze=False)
        for axis, arena in zip(axes[0], study.arenas, strict=True):
            axis.set_yscale("log")
            axis.axhline(1, color=INK, linewidth=0.8)
            for number, way in enumerate(ways):
                style = _style(_WAY_LOOKS[way], WAYS[way])
                _draw_ratios(axis, study, arena, way, number - (len(ways) - 1) / 2, style)
        axes[0, 0].set_ylabel("Times the deliveries\nof copies (logarithmic)")
        _finish(figure, axes, study.arenas, by_powers=(True,))
        frame(
            figure,
            "What other ways of sharing deliver, compared with copies of an ant trained alone",
            f"Trails evaporate. {_caption(study).replace('Means', 'Ratios of means')}",
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


def _by_size(
    study: ColonyStudy,
    rows: Sequence[tuple[str, str, Sequence[_Line]]],
    title: str,
    caption: str,
    limits: bool = False,
) -> Figure:
    """A row of panels for each (label, measure, lines), a column for each arena."""
    share: Literal["row"] | bool = False if limits else "row"  # limits already set the scale
    with styled():
        figure = new_figure(5.6)
        axes = figure.subplots(
            len(rows), len(study.arenas), sharex="col", sharey=share, squeeze=False
        )
        for row, (label, measure, lines) in zip(axes, rows, strict=True):
            row[0].set_ylabel(label)
            for axis, arena in zip(row, study.arenas, strict=True):
                for number, (pheromone, way, look, name) in enumerate(lines):
                    place, style = number - (len(lines) - 1) / 2, _style(look, name)
                    _draw_line(axis, study, arena, pheromone, way, measure, place, style)
                if limits and arena.limits:
                    _draw_limit(axis, arena, each=measure == "per_ant")
        entries = legend_entries(axes.flat)
        entries |= {"limit": entries.pop("limit")} if "limit" in entries else {}  # comes last
        _finish(figure, axes, study.arenas, [measure != "blocked" for _, measure, _ in rows])
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
    style: dict[str, str],
) -> None:
    """Means over seeds with their intervals, against the number of ants."""
    sizes = study.sizes(arena, pheromone, way)
    if not sizes:
        return
    values = np.stack([study.values(arena, pheromone, way, n, measure) for n in sizes])
    _errorbar(axis, sizes, values.mean(axis=1), *bootstrap_interval(values), place, style)


def _style(look: tuple[str, str, str], label: str) -> dict[str, str]:
    return dict(zip(("color", "marker", "linestyle", "label"), (*look, label), strict=True))


def _draw_ratios(
    axis: Axes, study: ColonyStudy, arena: Arena, way: str, place: float, style: dict[str, str]
) -> None:
    """A way's deliveries over those of copies; nothing where copies deliver nothing."""
    sizes = [
        n
        for n in study.sizes(arena, ON, way)
        if n > 1 and study.has(arena, ON, COPIED, [n]) and study.mean(arena, ON, COPIED, n) > 0
    ]
    if sizes:
        copies = np.stack([study.values(arena, ON, COPIED, n) for n in sizes])
        others = np.stack([study.values(arena, ON, way, n) for n in sizes])
        _errorbar(axis, sizes, *ratios(others, copies), place, style)


def ratios(others: np.ndarray, copies: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ratios of means over seeds with 95 % intervals of the percentile bootstrap.

    Args:
        others: Float (rows, seeds), 0 or more.
        copies: The same of what they are compared with; no row may be all 0.

    Returns:
        The ratios and the intervals' lower and upper ends, float64 (rows,) each; ends are nan for
        one seed. Where resampled copies deliver nothing, the ratio is unbounded.
    """
    centre = others.mean(axis=1) / copies.mean(axis=1)
    if others.shape[1] < 2:
        return centre, np.full_like(centre, np.nan), np.full_like(centre, np.nan)
    counts = resampling_counts(others.shape[1]).astype(float)
    above, below = counts @ others.T, counts @ copies.T
    drawn = np.divide(above, below, out=np.full_like(above, np.inf), where=below > 0)
    low, high = np.percentile(drawn, (2.5, 97.5), axis=0, method="nearest")
    return centre, low, high


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
    for beyond, edge, arrow in ((np.isinf(high), 1.0, "^"), (means <= 0, 0.0, "v")):
        if axis.get_yscale() == "log" and beyond.any():  # an arrow at the edge of the panel
            edges = np.full(beyond.sum(), edge)
            across, colour = axis.get_xaxis_transform(), style["color"]
            axis.plot(at[beyond], edges, arrow, ms=5, clip_on=False, color=colour, transform=across)
    below, above = (np.nan_to_num(np.abs(end - means), posinf=0.0) for end in (low, high))
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
    values = np.array([arena.limit(int(n)) for n in sizes]) / (sizes if each else 1)
    axis.plot(sizes, values, "--", color=GREY, linewidth=1.2, label="limit")


def _finish(
    figure: Figure, axes: np.ndarray, arenas: Sequence[Arena], by_powers: Sequence[bool]
) -> None:
    from matplotlib.ticker import FixedLocator

    for row, logarithmic_row in zip(axes, by_powers, strict=True):
        for axis in row:
            if logarithmic_row and np.isfinite(axis.dataLim.minposy):  # something is above 0
                axis.set_yscale("log")
                low, high = axis.get_ylim()
                logarithmic(axis.yaxis, (1, 2, 5) if high < 1000 * low else (1,))
            else:
                axis.margins(y=0.08)
    for column, arena in zip(axes.T, arenas, strict=True):
        column[0].set_title(sentence(arena.words), fontsize=9)
        column[-1].set_xlabel("Ants")
        for axis in column:
            logarithmic(axis.xaxis, (1,))
            axis.xaxis.set_major_locator(FixedLocator(arena.sizes))
    figure.align_ylabels(axes[:, 0])


def _caption(study: ColonyStudy) -> str:
    seeds = sorted({arena.seeds for arena in study.arenas})
    number = " or ".join(map(str, seeds))
    if seeds == [1]:
        return "One seed."
    return f"Means over {number} seeds with 95 % intervals."
