"""Designs and results of the double bridge: the share of ants that take the short branch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.analysis import style
from taichi_ants.analysis.findings import LEAST_SEEDS
from taichi_ants.analysis.statistics import bootstrap_interval
from taichi_ants.analysis.sweeps import draw_lines
from taichi_ants.analysis.tables import Table, interval, number, sentence
from taichi_ants.errors import count

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHORT_RIGHT, SHORT_LEFT, EQUAL = "23 and 36", "36 and 23", "23 and 23, food ahead"
EQUAL_ASIDE = "23 and 23, food aside"
LATE = "36, later 23 too"  # the short branch opens halfway through the evaluation
BRIDGES = (SHORT_RIGHT, SHORT_LEFT, EQUAL, EQUAL_ASIDE, LATE)
LOADS = ("foragers", "carriers")
WINDOWS = 10  # parts of an evaluation; the late share is that of the second half


@dataclass(frozen=True)
class Case:
    """A case of the study: the rules of a colony and the bridge on which it learns.

    Attributes:
        rules: "queueing" or "foraging", see `taichi_ants.task`.
        aside: The argument of `worlds.double_bridge`.
        slope: The slope of the trail. The deposit is chosen so that an ant lays it for 50 ticks.
        evaporation: "linear" (by 1 per tick), "none", or the half-life in ticks as a number.
    """

    rules: str = "queueing"
    aside: int = 1
    ants: int = 32
    slope: int = 10
    evaporation: str = "linear"


# Settings and the values to which each is changed alone, from the default case.
PANELS: dict[str, tuple[Any, ...]] = {
    "ants": (8, 16, 32, 64),
    "slope": (1, 2, 5, 10, 20),
    "evaporation": ("none", "linear", "100", "20"),
}
OTHERS = (Case(aside=0), Case(rules="foraging"), Case(rules="foraging", aside=0))
CASES = tuple(
    dict.fromkeys(
        [Case(), *OTHERS]
        + [replace(Case(), **{name: one}) for name, some in PANELS.items() for one in some]
    )
)
# Designs that are also evaluated on a bridge whose short branch opens late.
LATE_CASES = (Case(), *OTHERS, Case(evaporation="none"))

# Crossings by design and bridge, int64 (windows, loads, branches, seeds), the short branch first.
Crossings = Mapping[Case, Mapping[str, np.ndarray]]


def bridges(design: Case) -> dict[str, dict[str, Any]]:
    """Return the bridges on which a design is evaluated, as arguments of `double_bridge`.

    On the bridge `LATE`, rock closes the short branch for the first half of the time.
    """
    unequal: dict[str, Any] = {"short": 23, "long": 36, "aside": design.aside}
    equal = {"short": 23, "long": 23}
    found = {SHORT_RIGHT: unequal, SHORT_LEFT: {**unequal, "mirrored": True}, EQUAL: equal}
    if design.aside:
        found[EQUAL_ASIDE] = {**equal, "aside": design.aside}
    if design in LATE_CASES:
        found[LATE] = unequal
    return found


def late_shares(crossed: np.ndarray) -> np.ndarray:
    """Return the short branch's share in the second half, float64 (loads, seeds), nan if none."""
    return _shares(crossed[len(crossed) // 2 :].sum(axis=0))


def rows(found: Crossings, seeds: Sequence[int], ticks: int) -> list[dict[str, Any]]:
    """Return a row for each design, bridge, seed, load and window, with the counts of crossings."""
    return [
        {
            **asdict(design),
            **{"bridge": bridge, "seed": seed, "load": load},
            "from_tick": w * (2 * ticks if bridge == LATE else ticks) // WINDOWS,
            **{"short": int(crossed[w, k, 0, s]), "long": int(crossed[w, k, 1, s])},
        }
        for design, bridges in found.items()
        for bridge, crossed in bridges.items()
        for s, seed in enumerate(seeds)
        for k, load in enumerate(LOADS)
        for w in range(WINDOWS)
    ]


def tables(found: Crossings, ticks: int) -> dict[str, Table]:
    """Return tables of late shares by rules and food, then by setting, and after a late opening."""
    lines, late, varied = [], [], []
    for design, crossed_by in found.items():
        row = [design.rules, "aside" if design.aside else "ahead"]
        for bridge, crossed in crossed_by.items():
            if bridge == LATE:
                for k, load in enumerate(LOADS):
                    *first, last = _shares(crossed)[WINDOWS // 2 :, k]
                    means = [number(_percent(values)[0], 0) for values in first]
                    colonies = f"{np.count_nonzero(last > 0.5)} of {np.isfinite(last).sum()}"
                    late.append([*row, design.evaporation, load, *means, _cell(last), colonies])
            elif design in (Case(), *OTHERS):
                lines.append([*row, bridge, *map(_cell, late_shares(crossed))])
    for name, value in ((name, value) for name, values in PANELS.items() for value in values):
        of_case = found.get(replace(Case(), **{name: value}), {})
        if SHORT_RIGHT in of_case:
            sides = [late_shares(of_case[side]) for side in (SHORT_RIGHT, SHORT_LEFT)]
            varied.append([f"{name} {value}", *(_cell(one, 1) for one in np.mean(sides, axis=0))])
    means_of = _means(found)
    edges = [w * 2 * ticks // WINDOWS for w in range(WINDOWS // 2 + 1)]
    opens = f"a short branch that opens after {ticks} ticks"
    since = f"Share of {opens} in percent, by ticks since then"
    head, half = ("rules", "food"), "Share of the short branch in percent, second half"
    windows = [f"{a} to\n{b}" for a, b in pairwise(edges)]
    note = f"{sentence(means_of)}. Colonies are counted in the last column of ticks."
    columns = (*head, "evaporation", "%", *windows, "colonies\nabove 50 %")
    both = f"{half}, mean of both mirror images: {means_of}"
    return {
        "shares": Table(f"{half}: {means_of}", (*head, "branches", *LOADS), lines, (), 3),
        "late": Table(since, columns, late, [note], 4),
        "settings": Table(both, ("setting", *LOADS), varied),
    }


def _cell(values: np.ndarray, digits: int = 0) -> str:
    mean, low, high = _percent(values)
    return number(mean, digits) + ("" if np.isnan(low) else f" {interval(low, high, digits)}")


def _means(found: Crossings) -> str:
    seeds = next(iter(found[Case()].values())).shape[-1]
    if seeds < LEAST_SEEDS:
        few = f"too few for intervals (use {LEAST_SEEDS} or more)"
        return f"means over {count(seeds, 'seed')}, {few}"
    return f"means over {seeds} seeds with 95 % intervals"


def draw(path: Path, found: Crossings, ticks: int) -> None:
    """Draw the shares over time on three bridges, and against three settings."""
    titles = {
        SHORT_RIGHT: "Short branch to the right",
        SHORT_LEFT: "Short branch to the left",
        EQUAL: "Equal branches: right branch",
    }
    with style.styled():
        figure = style.new_figure(5.6)
        above, below = figure.subplots(2, len(PANELS), sharey=True)
        for axes, (bridge, title) in zip(above, titles.items(), strict=True):
            # The food of equal branches is never aside.
            ahead = {} if bridge == EQUAL else {", food ahead": found[Case(aside=0)][bridge]}
            _draw_shares(axes, {"": found[Case()][bridge], **ahead}, ticks)
            axes.set(title=title, xlabel="Tick")
        for axes, (name, values) in zip(below, PANELS.items(), strict=True):
            several = [found[replace(Case(), **{name: value})] for value in values]
            sides = [
                [late_shares(one[side]) for side in (SHORT_RIGHT, SHORT_LEFT)] for one in several
            ]
            mirrored = np.mean(sides, axis=1)
            _draw_lines(axes, {load: (values, mirrored[:, k]) for k, load in enumerate(LOADS)})
            axes.set(title=name.capitalize())
            if name != "evaporation":
                axes.set_xticks(values)
        caption = (
            f"{sentence(_means(found))}. Upper row: {Case().ants} ants.\n"
            "Lower row: food aside, one setting varies; second half of the time, mean of both "
            "mirror images.\nEvaporation: none, 1 per tick (linear), or a half-life in ticks."
        )
        for axes in (above[0], below[0]):
            axes.set(ylabel="Crossings (%)", ylim=(0, 103))
        title = "Share of crossings by the short branch of a double bridge"
        style.frame(figure, title, caption, style.legend_entries(above))
    style.save(figure, path)


def draw_late(path: Path, found: Crossings, ticks: int) -> None:
    """Draw the shares before and after the short branch opens, for three designs."""
    panels = {
        "Food aside": Case(),
        "Food ahead": Case(aside=0),
        "Food aside, no evaporation": Case(evaporation="none"),
    }
    with style.styled():
        figure = style.new_figure(3.2)
        several = figure.subplots(1, len(panels), sharey=True)
        for axes, (title, design) in zip(several, panels.items(), strict=True):
            _draw_shares(axes, {"": found[design][LATE]}, 2 * ticks)
            axes.axvline(ticks, color=style.GREY, linewidth=0.9)
            axes.annotate("opens", (ticks, 95), (-4, 0), textcoords="offset points", ha="right")
            axes.set(title=title, xlabel="Tick", xticks=[0, ticks, 2 * ticks])
        several[0].set(ylabel="Crossings (%)", ylim=(0, 103))
        caption = (
            f"{sentence(_means(found))}; {Case().ants} ants that have learned with both branches "
            "open and follow their final policy.\nIn the model of Goss and others, no colony "
            "switches to a short branch that opens late."
        )
        title = "Share of crossings by a short branch that opens late"
        style.frame(figure, title, caption, style.legend_entries(several))
    style.save(figure, path)


def _draw_shares(axes: Axes, crossed: Mapping[str, np.ndarray], ticks: int) -> None:
    """Draw shares over time; the keys of `crossed` are appended to the names of the loads."""
    middle = [(w + 0.5) * ticks / WINDOWS for w in range(WINDOWS)]
    lines = {
        f"{load}{words}": (middle, _shares(counts)[:, k])
        for words, counts in crossed.items()
        for k, load in enumerate(LOADS)
    }
    _draw_lines(axes, lines)
    axes.set(xlim=(0, ticks), xticks=np.linspace(0, ticks, 4))


def _draw_lines(axes: Axes, lines: Mapping[str, tuple[Sequence[Any], np.ndarray]]) -> None:
    """Draw lines by label, each as positions on the x-axis and shares (positions, seeds)."""
    axes.axhline(50, color=style.GREY, linewidth=0.7, linestyle="dashed")
    points = {
        label: [(place, *_percent(values)) for place, values in zip(places, shares, strict=True)]
        for label, (places, shares) in lines.items()
    }
    draw_lines(axes, points)


def _shares(crossed: np.ndarray) -> np.ndarray:
    """Return the share of the short branch, float64 (..., seeds), nan without a crossing."""
    total = crossed.sum(axis=-2)
    return np.where(total > 0, crossed[..., 0, :] / np.maximum(total, 1), np.nan)


def _percent(shares: np.ndarray) -> tuple[float, float, float]:
    """Return the mean over seeds with crossings and its interval, nan for too few seeds."""
    there = shares[np.isfinite(shares)]
    low, high = bootstrap_interval(there[None]) if len(there) >= LEAST_SEEDS else ([np.nan],) * 2
    mean = there.mean() if there.size else np.nan
    return 100 * float(mean), 100 * float(low[0]), 100 * float(high[0])
