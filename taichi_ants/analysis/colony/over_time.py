"""What colonies deliver over time: foods per tick, and the share of moves that are blocked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from taichi_ants.analysis import style
from taichi_ants.files import PathLike, check_writable_folder, write_csv

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_SPANS = 60
COLUMNS = ("from_tick", "to_tick", "foods_per_tick", "blocked")
Rates = Sequence[Mapping[str, float]]


class Totals(NamedTuple):
    """What has happened until a tick: foods delivered, moves tried, and those of them blocked."""

    tick: int
    deliveries: int
    moves: int
    blocked: int


def rates(totals: Sequence[Totals]) -> Rates:
    """A row for each span between two totals: its ticks, foods per tick, blocked share."""
    rows = []
    for one, next_ in pairwise(totals):
        ticks, deliveries, moves, blocked = (b - a for a, b in zip(one, next_, strict=True))
        row = one.tick, next_.tick, deliveries / ticks, blocked / max(1, moves)
        rows.append(dict(zip(COLUMNS, row, strict=True)))
    return rows


def save(rows: Rates, who: str, path: PathLike) -> None:
    """Write the figure (.png) of `rates`, and its rows beside it (.csv); the title says whose."""
    check_writable_folder(Path(path).parent)
    write_csv(numbers_beside(path), rows, COLUMNS)
    style.save(draw(rows, who), Path(path))


def numbers_beside(path: PathLike) -> Path:
    """The file with the numbers of a figure."""
    return Path(path).with_suffix(".csv")


def draw(rows: Rates, who: str) -> Figure:
    """Foods per tick above, the share of blocked moves below."""
    edges = [row["from_tick"] for row in rows[:1]] + [row["to_tick"] for row in rows]
    with style.styled():
        figure = style.new_figure(3.6)
        foods, blocked = figure.subplots(2, 1, sharex=True, height_ratios=(4, 1))
        for axis, column, factor, colour in (
            (foods, "foods_per_tick", 1, style.BLUE),
            (blocked, "blocked", 100, style.GREY),
        ):
            values = [factor * row[column] for row in rows]
            axis.stairs(values, edges or [0], fill=True, color=colour, alpha=0.15)
            axis.stairs(values, edges or [0], baseline=None, color=colour, lw=1.5)
            axis.yaxis.set_major_formatter("{x:,g}")
        foods.set_ylim(bottom=0)
        foods.set_ylabel("Foods per tick")
        blocked.set_ylim(0, 100)
        blocked.set_ylabel("Blocked, %")
        blocked.set_xlabel("Tick")
        if rows:
            blocked.set_xlim(edges[0], edges[-1])
        longest = max((row["to_tick"] - row["from_tick"] for row in rows), default=0)
        caption = f"Means over {longest:g} ticks. Blocked: share of the moves that fail."
        style.frame(figure, f"{who}: foods delivered", caption, {})
    return figure
