"""One colony that lives for a while: with progress, saved, drawn, stopped between two ticks."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from taichi_ants import files
from taichi_ants.analysis.colony import over_time
from taichi_ants.analysis.colony.over_time import Totals
from taichi_ants.errors import AntsError, count

if TYPE_CHECKING:
    from taichi_ants.engines.colony.colony import Colony

FRAMES_PER_SECOND = 12.0
_PIECE_SECONDS = 0.2


def check_places(save: str | None, render: str | None, figure: str | None = None) -> None:
    """Make sure, before the work begins, that what `live` shall write can be written."""
    from taichi_ants.rendering.writers import check_animation, check_picture, is_picture

    if render is not None and is_picture(render):
        check_picture(render)
    elif render is not None:
        check_animation(render, FRAMES_PER_SECOND)
    if figure is not None:
        files.check_writable_file(over_time.numbers_beside(check_picture(figure)))
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
    """Let time pass in a colony, then write its files; it ends early once `stopped()` is true.

    It is saved even if its picture (.png) or animation (.gif, .mp4, a folder) cannot be written. A
    figure (.png) shows what was delivered over time, and has its numbers beside it (.csv).
    """
    from taichi_ants.rendering import colony_snapshots, frames, save_animation, save_picture
    from taichi_ants.rendering.writers import is_picture

    strongest = colony.task.pheromone.level
    animated = render is not None and not is_picture(render)
    frame_interval = frame_interval if animated else 0
    least = frame_interval or 1  # a span is a whole number of pictures
    span = -(-ticks // (least * over_time.MOST_SPANS)) * least if figure else ticks
    passing = _pieces(colony, ticks, progress, stopped, frame_interval, span)
    totals = [_so_far(colony)]
    if figure:
        passing = _noted(passing, colony, span, totals)
    try:
        if render and animated:
            shown = (one for _ in chain([0], passing) for one in colony_snapshots(colony))
            save_animation(render, frames(shown, strongest=strongest), FRAMES_PER_SECOND)
        for _ in passing:
            pass
        if render and not animated:
            save_picture(render, next(frames(colony_snapshots(colony), strongest=strongest)))
        if figure:
            if totals[-1].tick < colony.ticks:  # stopped within a span, or the last one is shorter
                totals.append(_so_far(colony))
            who = _who(colony.ants * len(colony.seeds), colony)
            over_time.save(over_time.rates(totals), who, figure)
    except (AntsError, OSError):
        # Pictures are drawn between ticks, so this one is whole, and may have taken hours.
        _save(colony, save)
        raise
    _save(colony, save)


def _save(colony: Colony, path: str | None) -> None:
    """Save a colony, if there is a file to save it to, into a folder that is made if need be."""
    if path is not None:
        files.check_writable_folder(Path(path).parent)
        colony.save(path)


def _pieces(
    colony: Colony,
    ticks: int,
    progress: Callable[[float], None],
    stopped: Callable[[], bool],
    frame_interval: int,
    span: int,
) -> Iterator[int]:
    """Move a colony on by short pieces, after which it can be stopped.

    Yields after each piece, or every `frame_interval` ticks if above 0; in any case after every
    `span` ticks and at the end.
    """
    begun, piece, passed, ends = colony.ticks, 1, 0, stopped()
    while not ends:
        began, left = time.perf_counter(), min(ticks - passed, span - passed % span)
        now = min(piece, left, frame_interval - passed % frame_interval if frame_interval else left)
        colony.tick(now)
        took, passed = time.perf_counter() - began, colony.ticks - begun
        if took > _PIECE_SECONDS:
            piece = max(1, piece // 2)
        elif now == piece:
            piece *= 2
        ends = passed == ticks or stopped()
        if ends or not frame_interval or passed % frame_interval == 0 or passed % span == 0:
            yield colony.ticks
        progress(passed / ticks)


def _noted(
    passing: Iterator[int], colony: Colony, span: int, totals: list[Totals]
) -> Iterator[int]:
    """Let time pass, and note what has happened after every `span` ticks."""
    begun = colony.ticks
    for tick in passing:
        if (tick - begun) % span == 0:
            totals.append(_so_far(colony))
        yield tick


def _so_far(colony: Colony) -> Totals:
    """What all colonies together have done in this episode."""
    now = colony.outcome()
    counts = now.deliveries, now.moves, now.blocked
    return Totals(colony.ticks, *(int(count.sum()) for count in counts))


def summary(colony: Colony, ticks: int, seconds: float) -> str:
    """What happened, in two lines, while so many ticks took so many seconds."""
    outcome = {name: int(array.sum()) for name, array in vars(colony.outcome()).items()}
    blocked = 100 * outcome["blocked"] / max(1, outcome["moves"])
    changes = [count(outcome[f"{one}s"], one) for one in ("birth", "death") if outcome[f"{one}s"]]
    changes += [f"{outcome['regrown']} regrown"] if outcome["regrown"] else []
    return (
        f"{_who(outcome['living'], colony)}, {count(ticks, 'tick')} in {seconds:.1f} s.\n"
        f"{count(outcome['deliveries'], 'delivery')} by tick {colony.ticks}, "
        f"{', '.join([f'{blocked:.1f} % of the moves blocked', *changes])}."
    )


def _who(ants: int, colony: Colony) -> str:
    colonies = f" in {len(colony.seeds):,} colonies" if len(colony.seeds) > 1 else ""
    return f"{ants:,} ant{'s' if ants != 1 else ''}{colonies}"
