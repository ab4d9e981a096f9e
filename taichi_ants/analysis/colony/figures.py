"""The figures of the study, from the rows of conditions.csv."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from taichi_ants.analysis import style
from taichi_ants.analysis.colony.study import (
    ABC,
    ABROAD,
    ALONE,
    ARENAS,
    BC,
    FEW,
    JOINT,
    MEASURES,
    PAPER,
    QUEUES,
    RULES,
    SOME,
    WORLDS,
    A,
    Design,
)
from taichi_ants.analysis.sweeps import draw_lines
from taichi_ants.analysis.tables import sentence
from taichi_ants.files import check_writable_folder

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Rows = Sequence[Mapping[str, Any]]


def save_all(rows: Rows, folder: str | Path) -> None:
    """Write all figures for which there are rows as PNG files into a folder, made if needed.

    Raises:
        AntsError: The folder or a file in it cannot be written.
    """
    folder = check_writable_folder(folder)
    for name, draw in FIGURES.items():
        figure = draw(rows)
        if figure is not None:
            style.save(figure, folder / f"{name}.png")


def rules(rows: Rows) -> Figure | None:
    """What the largest colony delivers under each of the rules: a panel for each arena."""
    at_home = [row for row in rows if row["way"] == JOINT]
    largest = max((row["ants"] for row in at_home), default=0)
    panels = {
        sentence(ARENAS[arena]): [
            (RULES[row["rules"]], row)
            for row in at_home
            if (row["arena"], row["ants"]) == (arena, largest)
        ]
        for arena in dict.fromkeys(row["arena"] for row in at_home)
    }
    caption = f"{_spread(rows)} Dashed: no colony can deliver more."
    return _dots(panels, f"What each rule adds: {largest:g} ants, trained jointly", caption)


def elsewhere(rows: Rows) -> Figure | None:
    """What ants deliver in other worlds than those of their training: a panel for each world."""
    abroad = [row for row in rows if row["way"] == ABROAD]
    panels = {
        textwrap.fill(sentence(WORLDS[arena]), 24): [
            (RULES[row["rules"]], row) for row in abroad if row["arena"] == arena
        ]
        for arena in dict.fromkeys(row["arena"] for row in abroad)
    }
    caption = f"{_spread(rows)} All were trained in open worlds; none has seen these before."
    return _dots(panels, "In other worlds than those of the training", caption)


def scaling(rows: Rows) -> Figure | None:
    """Deliveries against the number of ants."""
    designs = [Design(rules) for rules in (PAPER, A, BC, ABC, QUEUES)]
    return _lines(rows, designs, ("deliveries", "per_ant"), "More ants: what a colony delivers")


def training(rows: Rows) -> Figure | None:
    """Deliveries of ants that were trained as so many."""
    designs = [Design(rules, way) for rules in (PAPER, ABC) for way in (JOINT, SOME, FEW, ALONE)]
    return _lines(rows, designs, ("deliveries", "blocked"), "With how many ants to train")


FIGURES: dict[str, Callable[[Rows], Figure | None]] = {
    "rules": rules,
    "scaling": scaling,
    "training": training,
    "elsewhere": elsewhere,
}


def _dots(
    panels: Mapping[str, Sequence[tuple[str, Mapping]]], title: str, caption: str
) -> Figure | None:
    """Deliveries with intervals, a line for each label, in panels with axes of their own."""
    panels = {name: lines for name, lines in panels.items() if lines}
    if not panels:
        return None
    across = min(4, len(panels))
    down = -(-len(panels) // across)
    with style.styled():
        figure = style.new_figure(1.6 + down * (0.9 + 0.28 * max(map(len, panels.values()))))
        axes = figure.subplots(down, across, sharey=True, squeeze=False).flat
        for axis, (name, lines) in zip(axes, panels.items(), strict=False):
            axis.set_title(name, fontsize=9)
            axis.set_xlabel(sentence(MEASURES["deliveries"]), fontsize=8)
            for place, (_, row) in enumerate(lines):
                _dot(axis, place, row)
            limits = [row["deliveries_limit"] for _, row in lines]
            axis.plot(limits, range(len(lines)), "--", color=style.GREY, drawstyle="steps-mid")
            axis.set_yticks(range(len(lines)), [label for label, _ in lines])
            axis.set_xlim(left=0)
        axes[0].invert_yaxis()
        for axis in list(axes)[len(panels) :]:
            axis.set_axis_off()
        style.frame(figure, title, caption, {})
    return figure


def _dot(axis: Axes, place: int, row: Mapping) -> None:
    mean, low, high = (row[f"deliveries_{end}"] for end in ("mean", "ci_low", "ci_high"))
    colour = style.COLOURS[place % len(style.COLOURS)]
    axis.hlines(place, low, high, color=colour)
    axis.plot(mean, place, "o", color=colour)
    axis.annotate(f"{mean:.0f}", (mean, place), (0, 5), textcoords="offset points", ha="center")


def _lines(
    rows: Rows, designs: Sequence[Design], measures: Sequence[str], title: str
) -> Figure | None:
    """Measures against the number of ants, a column of panels for each arena."""
    arenas = [one for one in ARENAS if any(row["arena"] == one for row in rows)]
    if not arenas:
        return None
    with style.styled():
        figure = style.new_figure(5.6)
        shape = len(measures), len(arenas)
        axes = figure.subplots(*shape, sharex="col", sharey="row", squeeze=False)
        for line_of_axes, measure in zip(axes, measures, strict=True):
            line_of_axes[0].set_ylabel(textwrap.fill(sentence(MEASURES[measure]), 30))
            for axis, arena in zip(line_of_axes, arenas, strict=True):
                of_arena = [row for row in rows if row["arena"] == arena]
                draw_lines(axis, {one.words: _points(of_arena, one, measure) for one in designs})
        for column, arena in zip(axes.T, arenas, strict=True):
            column[0].set_title(sentence(ARENAS[arena]), fontsize=9)
            column[-1].set_xlabel("Ants")
        style.frame(figure, title, _spread(rows), style.legend_entries(axes.flat))
    return figure


def _spread(rows: Rows) -> str:
    seeds = rows[0]["seeds"]
    return f"Means over {seeds:g} seeds with 95 % intervals." if seeds > 1 else "One seed."


def _points(rows: Rows, design: Design, measure: str) -> list[tuple[float, ...]]:
    """The number of ants, the mean and the ends of its interval, of each condition of a design."""
    columns = ("ants", *(f"{measure}_{end}" for end in ("mean", "ci_low", "ci_high")))
    return [tuple(row[n] for n in columns) for row in rows if (row["rules"], row["way"]) == design]
