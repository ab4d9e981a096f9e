"""One colony that lives for a while: with progress, saved, drawn, stopped between two ticks."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from taichi_ants import results
from taichi_ants.errors import AntsError

if TYPE_CHECKING:
    from taichi_ants.engines.colony import Colony

FRAMES_PER_SECOND = 12.0
_PIECE_SECONDS = 0.25


@dataclass
class Pace:
    """How much was done.

    Attributes:
        ticks: Ticks that have passed.
        ant_steps: Living ants, summed over the ticks that were timed.
        seconds: What these took. The first piece, which may compile, is left out if there are more.
    """

    ticks: int = 0
    ant_steps: int = 0
    seconds: float = 0.0

    @property
    def steps_per_second(self) -> float:
        """Ant-steps per second; nan before anything was timed."""
        return self.ant_steps / self.seconds if self.seconds > 0 else float("nan")


@dataclass(frozen=True)
class Outputs:
    """Files of a colony.

    Attributes:
        save: Where to keep it at the end; None keeps nothing.
        render: A .png of the end, or an animation of all (.gif, .webp, .mp4, or a folder); or None.
        every: Ticks from one picture of an animation to the next.
    """

    save: str | None = None
    render: str | None = None
    every: int = 2

    @property
    def animated(self) -> bool:
        """Whether there are several pictures."""
        return self.render is not None and Path(self.render).suffix.lower() != ".png"

    def check(self) -> None:
        """Make sure, before the work begins, that all can be written.

        Raises:
            AntsError: Something cannot.
        """
        from taichi_ants.rendering import check_animation, check_picture

        if self.animated:
            check_animation(self.render, FRAMES_PER_SECOND)
        elif self.render:
            check_picture(self.render)
        if self.save:
            if Path(self.save).is_dir():
                raise AntsError(f"{self.save!r} is a folder; name a file to save to.")
            results.check_writable_folder(Path(self.save).parent)


def live(
    colony: Colony, ticks: int, outputs: Outputs, progress: Callable[[float], None]
) -> tuple[Pace, bool]:
    """Let time pass in a colony, then write its files; Ctrl-C ends it at a whole tick.

    Args:
        colony: In an episode.
        ticks: How many.
        outputs: What to write.
        progress: Called now and then with the share of the work that is done.

    Returns:
        How much was done, and whether it was stopped before its end.
    """
    from taichi_ants.rendering import colony_picture, save_picture

    pace = Pace()
    with stop_requests() as stop:
        passing = let_time_pass(colony, ticks, pace, stop, outputs.every * outputs.animated)
        shown = _with_progress(passing, ticks, progress)
        if outputs.animated:
            _save_animation(outputs, colony, shown)
        else:
            for _ in shown:
                pass
        if outputs.save:
            colony.save(outputs.save)
        if outputs.render and not outputs.animated:
            save_picture(outputs.render, colony_picture(colony))
    return pace, pace.ticks < ticks


def let_time_pass(
    colony: Colony, ticks: int, pace: Pace, stop: Callable[[], bool], every: int = 0
) -> Iterator[int]:
    """Move a colony on, piece by piece.

    Args:
        colony: In an episode.
        ticks: How many.
        pace: Is kept up to date.
        stop: Asked before each piece whether to end.
        every: Ticks of a piece; 0 chooses pieces of about a quarter of a second.

    Yields:
        After each piece the ticks that have passed.
    """
    piece, pieces = every or 1, 0
    while pace.ticks < ticks and not stop():
        n = min(piece, ticks - pace.ticks)
        living = int(colony.outcome().living.sum())
        began = time.perf_counter()
        colony.tick(n)
        seconds = time.perf_counter() - began
        pace.ticks += n
        pieces += 1
        if pieces == 2:
            pace.ant_steps, pace.seconds = 0, 0.0  # the first piece may have compiled
        pace.ant_steps += n * living
        pace.seconds += seconds
        if not every:
            piece = max(1, min(2 * n, int(n * _PIECE_SECONDS / max(seconds, 1e-6))))
        yield pace.ticks


@contextmanager
def stop_requests() -> Iterator[Callable[[], bool]]:
    """Let Ctrl-C ask for an end instead of raising; a second one raises as ever.

    Yields:
        Whether it was asked for.
    """
    requests: list[int] = []

    def note(number: int, frame: object) -> None:
        if requests:
            raise KeyboardInterrupt
        requests.append(number)

    previous = signal.signal(signal.SIGINT, note)
    try:
        yield lambda: bool(requests)
    finally:
        signal.signal(signal.SIGINT, previous)


def summary(colony: Colony, pace: Pace) -> str:
    """What happened, in two lines."""
    outcome = {name: int(array.sum()) for name, array in vars(colony.outcome()).items()}
    blocked = 100 * outcome["blocked"] / max(1, outcome["moves"])
    changes = "".join(
        f", {outcome[name]} {name}" for name in ("births", "deaths", "regrown") if outcome[name]
    )
    return (
        f"{outcome['living']} ants, {pace.ticks} ticks: {pace.steps_per_second / 1e6:.2f} million "
        "ant-steps per second.\n"
        f"{outcome['deliveries']} deliveries by tick {colony.ticks}, {blocked:.1f} % of the moves "
        f"blocked{changes}."
    )


def _with_progress(
    passing: Iterator[int], ticks: int, progress: Callable[[float], None]
) -> Iterator[int]:
    for passed in passing:
        yield passed
        progress(passed / ticks)


def _save_animation(outputs: Outputs, colony: Colony, passing: Iterator[int]) -> None:
    from taichi_ants.rendering import colony_picture, save_animation

    def frames() -> Iterator[np.ndarray]:
        yield colony_picture(colony)
        for _ in passing:
            yield colony_picture(colony)

    save_animation(outputs.render, frames(), FRAMES_PER_SECOND)
