"""The figures of the study, from the rows of conditions.csv."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_ants.analysis.colony.study import (
    ARENAS,
    COPIED,
    COPIED_LONG,
    JOINT,
    LASTING,
    OFF,
    ON,
    OWN,
    RULES,
    THEN_JOINT,
    WAYS,
    Design,
)
from taichi_ants.analysis.style import (
    BLUE,
    GREY,
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
WAY_LOOKS = {
    COPIED: (BLUE, "o", "-"),
    COPIED_LONG: (SKY, "v", ":"),
    JOINT: (RED, "s", "-"),
    THEN_JOINT: (ORANGE, "D", "--"),
    OWN: (WINE, "^", "-."),
}
RULES_LOOKS = {ON: (RED, "s", "-"), OFF: (BLUE, "o", "--"), LASTING: (ORANGE, "^", ":")}
_SPREAD = 0.035  # of log10 of the number of ants, between lines, so that their bars stand apart

Rows = Sequence[Mapping[str, Any]]
# Designs with the label and the look of their lines.
_Lines = Mapping[Design, tuple[str, tuple[str, str, str]]]
_BY_WAY: _Lines = {Design(ON, way): (WAYS[way], look) for way, look in WAY_LOOKS.items()}


def _by_rules(way: str) -> tuple[str, str, _Lines]:
    label = sentence(WAYS[way].replace(", ", ",\n"))
    lines = {Design(one, way): (RULES[one], look) for one, look in RULES_LOOKS.items()}
    return f"{label}\n(deliveries per 1000 ticks)", "deliveries", lines


# By name: the label, the measure and the lines of each row of panels, a title, a caption.
FIGURES: dict[str, tuple[Sequence[tuple[str, str, _Lines]], str, str]] = {
    "scaling": (
        [
            ("Deliveries\nper 1000 ticks", "deliveries", _BY_WAY),
            ("Deliveries per ant\nand 1000 ticks", "per_ant", _BY_WAY),
        ],
        "More ants: what a colony delivers, and each of its ants",
        "Trails evaporate. Dashed grey: no colony can deliver more (shortest cycles, room at food "
        "and queen).",
    ),
    "crowding": (
        [
            ("Blocked moves\n(share of those tried)", "blocked", _BY_WAY),
            ("Ticks to the\nfirst delivery", "first_delivery", _BY_WAY),
        ],
        "More ants: how often they block each other, how soon one delivers",
        "Trails evaporate. An episode without a delivery counts with all its ticks.",
    ),
    "trails": (
        [_by_rules(COPIED), _by_rules(JOINT)],
        "Do the trails help that ants lay themselves?",
        "Each ant was trained under the condition that it is shown in. Dashed grey: no colony can "
        "deliver more.",
    ),
}


def save_all(rows: Rows, folder: str | Path) -> None:
    """Write all figures as PNG files into a folder, which is made if needed.

    Raises:
        AntsError: The folder or a file in it cannot be written.
    """
    folder = check_writable_folder(folder)
    for name in FIGURES:
        save(draw(name, rows), folder / f"{name}.png")


def draw(name: str, rows: Rows) -> Figure:
    """One of `FIGURES`: measures against the number of ants, a column of panels for each arena."""
    panels, title, caption = FIGURES[name]
    arenas = list(dict.fromkeys(row["arena"] for row in rows))
    with styled():
        figure = new_figure(5.6)
        axes = figure.subplots(len(panels), len(arenas), sharex="col", sharey="row", squeeze=False)
        for line_of_axes, (label, measure, lines) in zip(axes, panels, strict=True):
            line_of_axes[0].set_ylabel(label)
            for axis, arena in zip(line_of_axes, arenas, strict=True):
                _draw_panel(axis, [row for row in rows if row["arena"] == arena], measure, lines)
        for column, arena in zip(axes.T, arenas, strict=True):
            column[0].set_title(sentence(ARENAS[arena]), fontsize=9)
            column[-1].set_xlabel("Ants")
        figure.align_ylabels(axes[:, 0])
        entries = legend_entries(axes.flat)
        entries |= {"limit": entries.pop("limit")} if "limit" in entries else {}  # comes last
        seeds = rows[0]["seeds"]
        spread = f"Means over {seeds:g} seeds with 95 % intervals." if seeds > 1 else "One seed."
        frame(figure, title, f"{caption} {spread}", entries)
    return figure


def _draw_panel(axis: Axes, rows: Rows, measure: str, lines: _Lines) -> None:
    """Means with their intervals against the number of ants, and what no colony exceeds."""
    from matplotlib.ticker import FixedLocator

    for place, (design, (label, (colour, marker, dashes))) in enumerate(lines.items()):
        of_design = [row for row in rows if (row["rules"], row["way"]) == design]
        if not of_design:
            continue
        ants, mean, low, high = (
            np.array([row[name] for row in of_design], float)
            for name in ("ants", *(f"{measure}_{end}" for end in ("mean", "ci_low", "ci_high")))
        )
        axis.errorbar(
            ants * 10 ** ((place - (len(lines) - 1) / 2) * _SPREAD),
            mean,
            yerr=np.nan_to_num([mean - low, high - mean]),
            color=colour,
            marker=marker,
            linestyle=dashes,
            label=label,
            markersize=4.5,
            markeredgecolor="white",
            markeredgewidth=0.5,
            elinewidth=1.2,
        )
    limits = {row["ants"]: row["deliveries_limit"] for row in rows}
    sizes = sorted(limits)
    if measure in ("deliveries", "per_ant"):
        most = [limits[n] / (n if measure == "per_ant" else 1) for n in sizes]
        axis.plot(sizes, most, "--", color=GREY, linewidth=1.2, label="limit")
    if measure != "blocked" and np.isfinite(axis.dataLim.minposy):  # something is above 0
        axis.set_yscale("log")
        bottom, top = axis.get_ylim()
        logarithmic(axis.yaxis, (1, 2, 5) if top < 1000 * bottom else (1,))
    else:
        axis.margins(y=0.08)
    logarithmic(axis.xaxis, (1,))
    axis.xaxis.set_major_locator(FixedLocator(sizes))
