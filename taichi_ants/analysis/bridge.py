"""The double bridge: the share of a colony's ants that crosses by the short branch."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.analysis import style
from taichi_ants.analysis.findings import LEAST_SEEDS
from taichi_ants.analysis.statistics import bootstrap_interval
from taichi_ants.analysis.sweeps import draw_lines
from taichi_ants.analysis.tables import Table, interval, number, plain_text, sentence
from taichi_ants.errors import count

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHORT_RIGHT, SHORT_LEFT, EQUAL = "23 and 36", "36 and 23", "23 and 23, food ahead"
EQUAL_ASIDE = "23 and 23, food aside"
LATE = "36, later 23 too"  # the short branch opens when half of the time is over
BRIDGES = (SHORT_RIGHT, SHORT_LEFT, EQUAL, EQUAL_ASIDE, LATE)
LOADS = ("foragers", "carriers")
WINDOWS = 10  # of an evaluation; the late share is that of the second half


@dataclass(frozen=True)
class Design:
    """The rules by which a colony lives, and the bridge on which it learns.

    Attributes:
        rules: "queueing" or "foraging", see `taichi_ants.task`.
        aside: Of the bridge, see `worlds.double_bridge`.
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

# Those whose colonies are also followed where the short branch opens late.
LATE_DESIGNS = (Design(), *OTHERS, Design(evaporation="none"))

# Crossings by design and bridge, int64 (windows, loads, branches, seeds), the short branch first.
Crossings = Mapping[Design, Mapping[str, np.ndarray]]


def length(bridge: str, ticks: int) -> int:
    """Return for how many ticks colonies are followed on a bridge, of those that the study asks."""
    return 2 * ticks if bridge == LATE else ticks


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
            "from_tick": w * length(bridge, ticks) // WINDOWS,
            "short": int(crossed[w, number_of_load, 0, s]),
            "long": int(crossed[w, number_of_load, 1, s]),
        }
        for design, bridges in found.items()
        for bridge, crossed in bridges.items()
        for s, seed in enumerate(seeds)
        for number_of_load, load in enumerate(LOADS)
        for w in range(WINDOWS)
    ]


def report(found: Crossings, ticks: int) -> str:
    """Return the late shares of all designs, and those after a late opening, as tables of text."""
    headers = [*asdict(Design())]
    lines, late = [], []
    for design, bridges in found.items():
        row = [*map(str, asdict(design).values())]
        for bridge, crossed in bridges.items():
            if bridge == LATE:
                late += [[*row, load, *cells] for load, cells in _since_opening(crossed)]
            else:
                lines.append([*row, bridge, *map(_cell, late_shares(crossed))])
    n = next(iter(found[Design()].values())).shape[-1]
    shares = Table(
        f"Who crosses by the short branch, second half: {_means(n)}",
        [*headers, "branches", *(f"{load}, %" for load in LOADS)],
        lines,
        text_columns=len(headers) + 1,
    )
    edges = [w * 2 * ticks // WINDOWS for w in range(WINDOWS // 2 + 1)]
    since = Table(
        f"Who crosses by the short branch that opens after {ticks} ticks, by ticks since then",
        [*headers, "%", *(f"{a} to\n{b}" for a, b in pairwise(edges)), "colonies\nabove 50 %"],
        late,
        [f"{sentence(_means(n))}. Colonies: by the last column of ticks."],
        text_columns=len(headers) + 1,
    )
    return plain_text([shares, since], 120)


def _since_opening(crossed: np.ndarray) -> Iterator[tuple[str, list[str]]]:
    """Yield for each load the shares since the opening, and how many colonies prefer it."""
    for k, load in enumerate(LOADS):
        shares = _shares(crossed)[WINDOWS // 2 :, k]
        *first, last = shares
        there = last[np.isfinite(last)]
        means = [number(100 * _centre(values)[0], 0) for values in first]
        yield load, [*means, _cell(last), f"{np.count_nonzero(there > 0.5)} of {len(there)}"]


def _cell(values: np.ndarray) -> str:
    """A share of all seeds in percent, with its interval if they are enough for one."""
    mean, low, high = _centre(values)
    between = "" if np.isnan(low) else f" {interval(100 * low, 100 * high, 0)}"
    return f"{number(100 * mean, 0)}{between}"


def _means(seeds: int) -> str:
    if seeds < LEAST_SEEDS:
        return (
            f"means over {count(seeds, 'seed')}, too few for intervals (take {LEAST_SEEDS} or more)"
        )
    return f"means over {seeds} seeds with 95 % intervals"


def draw(path: Path, found: Crossings, ticks: int) -> None:
    """Draw the shares over time on three bridges, and what else moves them."""
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
            f"{sentence(_means(seeds))}. Above: {Design().ants} ants.\n"
            "Below, food aside: one setting varies; second half of the time, mean of both mirror "
            "images.\nEvaporation: none, 1 a tick (linear), or a half-life in ticks."
        )
        title = "Who crosses a double bridge by the short branch"
        style.frame(figure, title, caption, style.legend_entries(above))
    style.save(figure, path)


def draw_late(path: Path, found: Crossings, ticks: int) -> None:
    """Draw the shares before and after the short branch opens, for three designs."""
    panels = {
        "Food aside": Design(),
        "Food ahead": Design(aside=0),
        "Food aside, no evaporation": Design(evaporation="none"),
    }
    with style.styled():
        figure = style.new_figure(3.2)
        several = figure.subplots(1, len(panels), sharey=True)
        for axes, (title, design) in zip(several, panels.items(), strict=True):
            _draw_shares(axes, {"": found[design][LATE]}, 2 * ticks)
            axes.axvline(ticks, color=style.GREY, linewidth=0.9)
            axes.annotate("opens", (ticks, 95), (-4, 0), textcoords="offset points", ha="right")
            axes.set(title=title, xlabel="tick", xticks=[0, ticks, 2 * ticks])
        several[0].set(ylabel="% by the short branch", ylim=(0, 103))
        caption = (
            f"{sentence(_means(found[Design()][LATE].shape[-1]))}; {Design().ants} ants that have "
            "learned with both branches open, and learn no more.\nIn the model of Goss and others "
            "no colony goes over to a short branch that opens late."
        )
        title = "Who takes a short branch that opens late"
        style.frame(figure, title, caption, style.legend_entries(several))
    style.save(figure, path)


def _draw_time(axes: Axes, found: Crossings, bridge: str, ticks: int) -> None:
    shown = {"": Design(), ", food ahead": Design(aside=0)}
    if bridge == EQUAL:  # its food is never aside
        del shown[", food ahead"]
    _draw_shares(axes, {words: found[one][bridge] for words, one in shown.items()}, ticks)


def _draw_shares(axes: Axes, crossed: Mapping[str, np.ndarray], ticks: int) -> None:
    """Lines of the shares over time, by what is added to the names of the loads."""
    middle = [(w + 0.5) * ticks / WINDOWS for w in range(WINDOWS)]
    lines = {}
    for words, counts in crossed.items():
        shares = _shares(counts)
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
    """Return the mean over seeds in which ants crossed, and its interval; nan for too few seeds."""
    there = values[np.isfinite(values)]
    if len(there) < LEAST_SEEDS:
        return float(there.mean()) if there.size else np.nan, np.nan, np.nan
    low, high = bootstrap_interval(there[None])
    return float(there.mean()), float(low[0]), float(high[0])


def _percent(numbers: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(100 * one for one in numbers)
