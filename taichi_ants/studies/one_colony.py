"""Runs of one colony: saving, drawing, stopping between ticks, and deliveries over time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from itertools import chain, pairwise
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from taichi_ants import files
from taichi_ants.analysis import style
from taichi_ants.errors import AntsError, count

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from taichi_ants.engines.colony.colony import Colony

FRAMES_PER_SECOND = 12.0
_MOST_SPANS = 60  # in a figure
_PIECE_SECONDS = 0.2


class Totals(NamedTuple):
    """Totals of all worlds up to a tick: food items delivered, moves tried, and moves blocked."""

    tick: int
    deliveries: int
    moves: int
    blocked: int

    @classmethod
    def of(cls, colony: Colony) -> Totals:
        """Return the totals of a colony in this episode."""
        now = colony.outcome()
        counts = (int(c.sum()) for c in (now.deliveries, now.moves, now.blocked))
        return cls(colony.ticks, *counts)


class Span(NamedTuple):
    """A row of the .csv file of a figure: the ticks between two totals."""

    from_tick: int
    to_tick: int
    foods_per_tick: float
    blocked: float  # share of the moves


def spans(totals: Sequence[Totals]) -> list[Span]:
    """Return a span for each two successive totals."""
    rows = []
    for before, after in pairwise(totals):
        ticks, deliveries, moves, blocked = (b - a for a, b in zip(before, after, strict=True))
        rows.append(Span(before.tick, after.tick, deliveries / ticks, blocked / max(1, moves)))
    return rows


def draw(rows: Sequence[Span], title: str) -> Figure:
    """Return a figure of food items per tick (above) and the share of blocked moves (below)."""
    edges = [rows[0].from_tick, *(row.to_tick for row in rows)] if rows else [0]
    with style.styled():
        figure = style.new_figure(3.6)
        foods, blocked = figure.subplots(2, 1, sharex=True, height_ratios=(4, 1))
        for axis, values, colour in (
            (foods, [row.foods_per_tick for row in rows], style.BLUE),
            (blocked, [100 * row.blocked for row in rows], style.GREY),
        ):
            axis.stairs(values, edges, fill=True, color=colour, alpha=0.15)
            axis.stairs(values, edges, baseline=None, color=colour, lw=1.5)
            axis.yaxis.set_major_formatter("{x:,g}")
        foods.set_ylim(bottom=0)
        foods.set_ylabel("Food items per tick")
        blocked.set_ylim(0, 100)
        blocked.set_ylabel("Blocked, %")
        blocked.set_xlabel("Tick")
        if rows:
            blocked.set_xlim(edges[0], edges[-1])
        longest = max((row.to_tick - row.from_tick for row in rows), default=0)
        caption = f"Means over {longest:g} ticks. Blocked: share of the moves that fail."
        style.frame(figure, title, caption, {})
    return figure


def check_places(save: str | None, render: str | None, figure: str | None = None) -> None:
    """Check, before the work begins, that the files of `live` can be written."""
    from taichi_ants.rendering import check_animation, check_picture

    if render is not None:
        check_animation(render, FRAMES_PER_SECOND)
    if figure is not None:
        files.check_writable_file(Path(check_picture(figure)).with_suffix(".csv"))
    if save is not None:
        files.check_writable_file(save)


def live(
    colony: Colony,
    ticks: int,
    progress: Callable[[float], None],
    stopped: Callable[[], bool],
    save: str | None = None,
    render: str | None = None,
    figure: str | None = None,
    frame_interval: int = 2,
) -> None:
    """Run a colony for `ticks` ticks, or until `stopped()` is true, and write its files.

    `save` is the file of the colony, which is saved even if drawing fails. `render` is a picture
    (.png) of the end, or an animation (.gif). `figure` (.png) shows deliveries over
    time; their numbers are in a file with the same name (.csv).
    """
    from taichi_ants.rendering import colony_snapshots, frames, save_animation, save_picture
    from taichi_ants.rendering.writers import is_picture

    animated = render is not None and not is_picture(render)
    interval = frame_interval if animated else ticks
    least = frame_interval if animated else 1  # a span is a whole number of frames
    span = -(-ticks // (least * _MOST_SPANS)) * least if figure else ticks
    totals = [Totals.of(colony)]
    error: Exception | None = None
    passing = _pieces(colony, ticks, progress, stopped, interval, span, totals)
    try:
        if render and animated:
            shown = (s for _ in chain([0], passing) for s in colony_snapshots(colony))
            save_animation(render, frames(shown, task=colony.task), FRAMES_PER_SECOND)
        for _ in passing:
            pass
        if render and not animated:
            save_picture(render, next(frames(colony_snapshots(colony), task=colony.task)))
        if figure:
            path, rows = Path(figure), spans(totals)
            files.check_writable_folder(path.parent)
            numbers = [row._asdict() for row in rows]
            files.write_csv(path.with_suffix(".csv"), numbers, Span._fields)
            who = _who(colony.ants * len(colony.seeds), colony)
            style.save(draw(rows, f"{who}: food items delivered"), path)
    except (AntsError, OSError) as raised:
        error = raised  # the colony is intact, because drawing happens between ticks
    if save is not None:
        files.check_writable_folder(Path(save).parent)
        colony.save(save)
    if error is not None:
        raise error


def _pieces(
    colony: Colony,
    ticks: int,
    progress: Callable[[float], None],
    stopped: Callable[[], bool],
    interval: int,
    span: int,
    totals: list[Totals],
) -> Iterator[int]:
    """Run a colony in short pieces, so that it can be stopped between them.

    Yields after every `interval` ticks and at the end; appends to `totals` after every `span`
    ticks and at the end.
    """
    begun, piece, passed, ends = colony.ticks, 1, 0, stopped()
    while not ends:
        began = time.perf_counter()
        now = min(piece, ticks - passed, span - passed % span, interval - passed % interval)
        colony.tick(now)
        took, passed = time.perf_counter() - began, colony.ticks - begun
        if took > _PIECE_SECONDS:
            piece = max(1, piece // 2)
        elif now == piece:
            piece *= 2
        ends = passed == ticks or stopped()
        if ends or passed % span == 0:
            totals.append(Totals.of(colony))
        if ends or passed % interval == 0:
            yield colony.ticks
        progress(passed / ticks)


def summary(colony: Colony, ticks: int, seconds: float) -> str:
    """Return a summary of two lines for a run of `ticks` ticks that took `seconds`."""
    outcome = {name: int(array.sum()) for name, array in colony.outcome().counts().items()}
    blocked = 100 * outcome["blocked"] / max(1, outcome["moves"])
    changes = [count(outcome[f"{n}s"], n) for n in ("birth", "death") if outcome[f"{n}s"]]
    changes += [f"{outcome['regrown']} regrown"] if outcome["regrown"] else []
    return (
        f"{_who(outcome['living'], colony)}, {count(ticks, 'tick')} in {seconds:.1f} s.\n"
        f"{count(outcome['deliveries'], 'delivery')} by tick {colony.ticks}, "
        f"{', '.join([f'{blocked:.1f} % of the moves blocked', *changes])}."
    )


def _who(ants: int, colony: Colony) -> str:
    colonies = f" in {len(colony.seeds):,} colonies" if len(colony.seeds) > 1 else ""
    return f"{ants:,} ant{'s' if ants != 1 else ''}{colonies}"
