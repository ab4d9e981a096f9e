"""Runs of one colony: saving, drawing, and stopping between ticks."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from taichi_ants import files
from taichi_ants.errors import AntsError, count

if TYPE_CHECKING:
    from taichi_ants.engines.colony.colony import Colony

FRAMES_PER_SECOND = 12.0
_PIECE_SECONDS = 0.2


def check_places(save: str | None, render: str | None) -> None:
    """Check, before the work begins, that the files of `live` can be written."""
    from taichi_ants.rendering import check_animation

    if render is not None:
        check_animation(render, FRAMES_PER_SECOND)
    if save is not None:
        files.check_writable_file(save)


def live(
    colony: Colony,
    ticks: int,
    progress: Callable[[float], None],
    stopped: Callable[[], bool],
    save: str | None = None,
    render: str | None = None,
    frame_interval: int = 2,
) -> None:
    """Run a colony for `ticks` ticks, or until `stopped()` is true, and write its files.

    `save` is the file of the colony, which is saved even if drawing fails. `render` is a picture
    (.png) of the end, or an animation (.gif).
    """
    from taichi_ants.rendering import colony_snapshots, frames, save_animation, save_picture
    from taichi_ants.rendering.writers import is_picture

    animated = render is not None and not is_picture(render)
    interval = frame_interval if animated else ticks
    error: Exception | None = None
    passing = _pieces(colony, ticks, progress, stopped, interval)
    try:
        if render and animated:
            shown = (s for _ in chain([0], passing) for s in colony_snapshots(colony))
            save_animation(render, frames(shown, task=colony.task), FRAMES_PER_SECOND)
        for _ in passing:
            pass
        if render and not animated:
            save_picture(render, next(frames(colony_snapshots(colony), task=colony.task)))
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
) -> Iterator[int]:
    """Run a colony in short pieces, so that it can be stopped between them.

    Yields after every `interval` ticks and at the end.
    """
    begun, piece, passed, ends = colony.ticks, 1, 0, stopped()
    while not ends:
        began = time.perf_counter()
        now = min(piece, ticks - passed, interval - passed % interval)
        colony.tick(now)
        took, passed = time.perf_counter() - began, colony.ticks - begun
        if took > _PIECE_SECONDS:
            piece = max(1, piece // 2)
        elif now == piece:
            piece *= 2
        ends = passed == ticks or stopped()
        if ends or passed % interval == 0:
            yield colony.ticks
        progress(passed / ticks)


def summary(colony: Colony, ticks: int, seconds: float) -> str:
    """Return a summary of two lines for a run of `ticks` ticks that took `seconds`."""
    outcome = {name: int(array.sum()) for name, array in colony.outcome().counts().items()}
    blocked = 100 * outcome["blocked"] / max(1, outcome["moves"])
    changes = [count(outcome[f"{n}s"], n) for n in ("birth", "death") if outcome[f"{n}s"]]
    changes += [f"{outcome['regrown']} regrown"] if outcome["regrown"] else []
    colonies = f" in {len(colony.seeds):,} colonies" if len(colony.seeds) > 1 else ""
    living = f"{outcome['living']:,} ant{'s' if outcome['living'] != 1 else ''}{colonies}"
    return (
        f"{living}, {count(ticks, 'tick')} in {seconds:.1f} s.\n"
        f"{count(outcome['deliveries'], 'delivery')} by tick {colony.ticks}, "
        f"{', '.join([f'{blocked:.1f} % of the moves blocked', *changes])}."
    )
