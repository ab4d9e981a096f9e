"""The figures of the study, from the rows of conditions.csv."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from taichi_ants.analysis import style
from taichi_ants.analysis.colony.study import (
    ARENAS,
    COPIED,
    JOINT,
    MEASURES,
    ON,
    RULES,
    WAYS,
    Design,
)
from taichi_ants.analysis.sweeps import draw_lines
from taichi_ants.analysis.tables import sentence
from taichi_ants.files import check_writable_folder

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Rows = Sequence[Mapping[str, Any]]
_WAYS = tuple(Design(ON, way) for way in WAYS)
_TRAILS = tuple(Design(rules, way) for way in (COPIED, JOINT) for rules in RULES)
_LIMITED = ("deliveries", "per_ant")

# By name: a title, the measure of each row of panels, the designs.
FIGURES: dict[str, tuple[str, tuple[str, ...], tuple[Design, ...]]] = {
    "scaling": ("More ants: what a colony delivers, and each of its ants", _LIMITED, _WAYS),
    "crowding": (
        "More ants: how often they block each other, how soon one delivers",
        ("blocked", "first_delivery"),
        _WAYS,
    ),
    "trails": ("Do the trails help that ants lay themselves?", ("deliveries", "reward"), _TRAILS),
}


def save_all(rows: Rows, folder: str | Path) -> None:
    """Write all figures as PNG files into a folder, which is made if needed.

    Raises:
        AntsError: The folder or a file in it cannot be written.
    """
    folder = check_writable_folder(folder)
    for name in FIGURES:
        style.save(draw(name, rows), folder / f"{name}.png")


def draw(name: str, rows: Rows) -> Figure:
    """One of `FIGURES`: measures against the number of ants, a column of panels for each arena."""
    title, measures, designs = FIGURES[name]
    arenas = list(dict.fromkeys(row["arena"] for row in rows))
    with style.styled():
        figure = style.new_figure(5.6)
        shape = len(measures), len(arenas)
        axes = figure.subplots(*shape, sharex="col", sharey="row", squeeze=False)
        for line_of_axes, measure in zip(axes, measures, strict=True):
            line_of_axes[0].set_ylabel(textwrap.fill(sentence(MEASURES[measure]), 30))
            for axis, arena in zip(line_of_axes, arenas, strict=True):
                of_arena = [row for row in rows if row["arena"] == arena]
                draw_lines(axis, {one.words: _points(of_arena, one, measure) for one in designs})
                if measure in _LIMITED:
                    most = {row["ants"]: row["deliveries_limit"] for row in of_arena}
                    if measure == "per_ant":
                        most = {ants: limit / ants for ants, limit in most.items()}
                    limit = sorted(most.items())
                    axis.plot(*zip(*limit, strict=True), "--", color=style.GREY, label="limit")
        for column, arena in zip(axes.T, arenas, strict=True):
            column[0].set_title(sentence(ARENAS[arena]), fontsize=9)
            column[-1].set_xlabel("Ants")
        seeds = rows[0]["seeds"]
        spread = f"Means over {seeds:g} seeds with 95 % intervals." if seeds > 1 else "One seed."
        caption = (
            f"{spread} Each ant was trained under the conditions that it is shown in. An episode\n"
            "without a delivery counts with all its ticks. Dashed grey: no colony can deliver more."
        )
        style.frame(figure, title, caption, style.legend_entries(axes.flat))
    return figure


def _points(rows: Rows, design: Design, measure: str) -> list[tuple[float, ...]]:
    """The number of ants, the mean and the ends of its interval, of each condition of a design."""
    columns = ("ants", *(f"{measure}_{end}" for end in ("mean", "ci_low", "ci_high")))
    return [tuple(row[n] for n in columns) for row in rows if (row["rules"], row["way"]) == design]
