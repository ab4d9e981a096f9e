"""The double bridge: which share of a colony's ants crosses by the short branch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.analysis import style
from taichi_ants.analysis.statistics import bootstrap_interval
from taichi_ants.analysis.sweeps import draw_lines
from taichi_ants.analysis.tables import Table, interval, number, plain_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHORT_RIGHT, SHORT_LEFT, EQUAL = "23 and 36", "36 and 23", "23 and 23, food ahead"
EQUAL_ASIDE = "23 and 23, food aside"
BRIDGES = (SHORT_RIGHT, SHORT_LEFT, EQUAL, EQUAL_ASIDE)
LOADS = ("foragers", "carriers")
WINDOWS = 10  # of an evaluation; the late share is that of the second half


@dataclass(frozen=True)
class Design:
    """The rules by which a colony lives, and the bridge on which it learns.

    Attributes:
        rules: "queueing" or "foraging", see `taichi_ants.task`.
        aside: Of the bridge, see `worlds.double_bridge`.
        ants: How many.
        slope: Of the trail; its level is such that an ant lays it for 50 ticks.
        evaporation: "linear", by 1 a tick, "none", or the half-life in ticks as a number.
    """

    rules: str = "queueing"
    aside: int = 1
    ants: int = 32
    slope: int = 10
    evaporation: str = "linear"


# What is varied, each alone, from the design that all compare with.
PANELS: dict[str, tuple[Any, ...]] = {
    "ants": (8, 16, 32, 64),
    "slope": (1, 2, 5, 10, 20),
    "evaporation": ("none", "linear", "100", "20"),
}
OTHERS = (Design(aside=0), Design(rules="foraging"), Design(rules="foraging", aside=0))
DESIGNS = tuple(
    dict.fromkeys(
        [Design(), *OTHERS]
        + [replace(Design(), **{name: one}) for name, some in PANELS.items() for one in some]
    )
)

# Crossings by design and bridge, int64 (windows, loads, branches, seeds), the short branch first.
Crossings = Mapping[Design, Mapping[str, np.ndarray]]


def late_shares(crossed: np.ndarray) -> np.ndarray:
    """The share by the short branch in the second half, float64 (loads, seeds), nan where none."""
    return _shares(crossed[len(crossed) // 2 :].sum(axis=0, keepdims=True))[0]


def rows(found: Crossings, seeds: Sequence[int], ticks: int) -> list[dict[str, Any]]:
    """A row for each design, bridge, seed, load and window, with both counts."""
    return [
        {
            **asdict(design),
            "bridge": bridge,
            "seed": seed,
            "load": load,
            "from_tick": w * ticks // WINDOWS,
            "short": int(crossed[w, number_of_load, 0, s]),
            "long": int(crossed[w, number_of_load, 1, s]),
        }
        for design, bridges in found.items()
        for bridge, crossed in bridges.items()
        for s, seed in enumerate(seeds)
        for number_of_load, load in enumerate(LOADS)
        for w in range(WINDOWS)
    ]


def report(found: Crossings) -> str:
    """The late shares of all designs as a table for a terminal."""
    lines = []
    for design, bridges in found.items():
        for bridge, crossed in bridges.items():
            centres = [_centre(values) for values in late_shares(crossed)]
            cells = [f"{number(100 * m, 0)} {interval(100 * a, 100 * b, 0)}" for m, a, b in centres]
            lines.append([*map(str, asdict(design).values()), bridge, *cells])
    headers = [*asdict(Design()), "branches", *(f"{load}, %" for load in LOADS)]
    title = "Who crosses by the short branch, second half: means over seeds with 95 % intervals"
    return plain_text([Table(title, headers, lines, text_columns=len(headers))], 120)


def draw(path: Path, found: Crossings, ticks: int) -> None:
    """Draw the shares over time on three bridges, and what else moves them.

    Raises:
        AntsError: The file cannot be written.
    """
    with style.styled():
        figure = style.new_figure(5.6)
        above, below = figure.subplots(2, len(PANELS), sharey=True)
        titles = {
            SHORT_RIGHT: "Short branch to the right",
            SHORT_LEFT: "Short branch to the left",
            EQUAL: "Equal branches: the right one",
        }
        for axes, (bridge, title) in zip(above, titles.items(), strict=True):
            _draw_time(axes, found, bridge, ticks)
            axes.set(title=title, xlabel="tick")
        for axes, name in zip(below, PANELS, strict=True):
            _draw_panel(axes, found, name)
        for axes in (above[0], below[0]):
            axes.set(ylabel="% by the short branch", ylim=(0, 103))
        seeds = found[Design()][SHORT_RIGHT].shape[-1]
        caption = (
            f"Means over {seeds} seeds with 95 % intervals. Above: {Design().ants} ants. "
            "Below, food aside: one setting varies; second half of the\ntime, mean of both mirror "
            "images. Evaporation: none, 1 a tick (linear), or a half-life in ticks."
        )
        title = "Who crosses a double bridge by the short branch"
        style.frame(figure, title, caption, style.legend_entries(above))
    style.save(figure, path)


def _draw_time(axes: Axes, found: Crossings, bridge: str, ticks: int) -> None:
    middle = [(w + 0.5) * ticks / WINDOWS for w in range(WINDOWS)]
    lines = {}
    shown = {"": Design(), ", food ahead": Design(aside=0)}
    if bridge == EQUAL:  # its food is never aside
        del shown[", food ahead"]
    for words, design in shown.items():
        shares = _shares(found[design][bridge])
        for k, load in enumerate(LOADS):
            points = [(t, *_percent(_centre(shares[w, k]))) for w, t in enumerate(middle)]
            lines[f"{load}{words}"] = points
    axes.axhline(50, color=style.GREY, linewidth=0.7, linestyle="dashed")
    draw_lines(axes, lines)
    axes.set(xlim=(0, ticks), xticks=np.linspace(0, ticks, 4))


def _draw_panel(axes: Axes, found: Crossings, name: str) -> None:
    lines: dict[str, list[tuple[Any, ...]]] = {load: [] for load in LOADS}
    for value in PANELS[name]:
        bridges = found[replace(Design(), **{name: value})]
        both = np.mean([late_shares(bridges[one]) for one in (SHORT_RIGHT, SHORT_LEFT)], axis=0)
        for k, load in enumerate(LOADS):
            lines[load].append((value, *_percent(_centre(both[k]))))
    axes.axhline(50, color=style.GREY, linewidth=0.7, linestyle="dashed")
    draw_lines(axes, lines)
    axes.set(title=name.capitalize())
    if name != "evaporation":
        axes.set_xticks(PANELS[name])


def _shares(crossed: np.ndarray) -> np.ndarray:
    """The share by the short branch, float64 (windows, loads, seeds), nan where nobody crossed."""
    total = crossed.sum(axis=2)
    return np.where(total > 0, crossed[:, :, 0] / np.maximum(total, 1), np.nan)


def _centre(values: np.ndarray) -> tuple[float, float, float]:
    """The mean over the seeds in which ants crossed, and the ends of its interval."""
    there = values[np.isfinite(values)]
    if not there.size:
        return np.nan, np.nan, np.nan
    low, high = bootstrap_interval(there[None])
    return float(there.mean()), float(low[0]), float(high[0])


def _percent(numbers: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(100 * one for one in numbers)
