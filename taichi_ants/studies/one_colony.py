"""One colony that lives for a while: with progress, saved, drawn, stopped between two ticks."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from taichi_ants import files
from taichi_ants.errors import AntsError, count

if TYPE_CHECKING:
    from taichi_ants.engines.colony.colony import Colony

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
        render: A .png of the end, or an animation of all (.gif, .mp4 or a folder); or None.
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

        if self.render and self.animated:
            check_animation(self.render, FRAMES_PER_SECOND)
        elif self.render:
            check_picture(self.render)
        if self.save:
            if Path(self.save).is_dir():
                raise AntsError(f"{self.save!r} is a folder; name a file to save to.")
            files.check_writable_folder(Path(self.save).parent)
        places = [os.path.realpath(path) for path in (self.save, self.render) if path]
        if len(places) > len(set(places)):
            raise AntsError(
                f"{self.save!r} and {self.render!r} are one place, to save the colony in and for "
                "its picture; name two."
            )


def live(
    colony: Colony,
    ticks: int,
    outputs: Outputs,
    progress: Callable[[float], None],
    stopped: Callable[[], bool],
) -> Pace:
    """Let time pass in a colony, then write its files.

    The colony is saved even if its picture or animation cannot be written.

    Args:
        colony: In an episode.
        ticks: How many.
        outputs: What to write.
        progress: Called now and then with the share of the work that is done.
        stopped: Asked between ticks whether to end.

    Raises:
        AntsError: A file cannot be written; the message says where the colony is, if it is saved.
    """
    pace, failure = Pace(), None
    passing = let_time_pass(colony, ticks, pace, stopped, outputs.every * outputs.animated)
    shown = _with_progress(passing, ticks, progress)
    try:
        if outputs.animated:
            _save_animation(str(outputs.render), colony, shown)
        for _ in shown:  # what the animation has left, all without one
            pass
        if outputs.render and not outputs.animated:
            _save_picture(outputs.render, colony)
    except Exception as error:
        # Pictures are drawn between ticks, so this one is whole, and may have taken hours.
        failure = error
    if outputs.save:
        colony.save(outputs.save)
    if outputs.save and isinstance(failure, (AntsError, OSError)):
        reason = str(failure).rstrip(".")
        raise AntsError(
            f"{reason}; the colony is saved in {outputs.save!r}, at tick {colony.ticks}."
        ) from failure
    if failure is not None:
        raise failure
    return pace


def let_time_pass(
    colony: Colony, ticks: int, pace: Pace, stopped: Callable[[], bool], every: int = 0
) -> Iterator[int]:
    """Move a colony on, piece by piece.

    Args:
        colony: In an episode.
        ticks: How many.
        pace: Is kept up to date.
        stopped: Asked before each piece whether to end.
        every: Ticks of a piece; 0 chooses pieces of about a quarter of a second.

    Yields:
        After each piece the ticks that have passed.
    """
    piece, pieces = every or 1, 0
    while pace.ticks < ticks and not stopped():
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


def summary(colony: Colony, pace: Pace) -> str:
    """What happened, in two lines; a third one if no ant can be born any more."""
    outcome = {name: int(array.sum()) for name, array in vars(colony.outcome()).items()}
    blocked = 100 * outcome["blocked"] / max(1, outcome["moves"])
    changes = [count(outcome[f"{one}s"], one) for one in ("birth", "death") if outcome[f"{one}s"]]
    changes += [f"{outcome['regrown']} regrown"] if outcome["regrown"] else []
    colonies = f" in {len(colony.seeds)} colonies" if len(colony.seeds) > 1 else ""
    lines = [
        f"{count(outcome['living'], 'ant')}{colonies}, {count(pace.ticks, 'tick')}: "
        f"{pace.steps_per_second / 1e6:.2f} million ant-steps per second.",
        f"{count(outcome['deliveries'], 'delivery')} by tick {colony.ticks}, "
        f"{', '.join([f'{blocked:.1f} % of the moves blocked', *changes])}.",
    ]
    places, foods = colony.capacity * len(colony.seeds), colony.waiting_foods
    if colony.task.life.births and outcome["living"] == places:
        waiting = f"{count(foods, 'food')} {'waits' if foods == 1 else 'wait'}"
        lines.append(
            f"{places} of {places} places are taken, {waiting} at the queen; --capacity gives more."
        )
    return "\n".join(lines)


def _with_progress(
    passing: Iterator[int], ticks: int, progress: Callable[[float], None]
) -> Iterator[int]:
    for passed in passing:
        yield passed
        progress(passed / ticks)


def _save_animation(path: str, colony: Colony, passing: Iterator[int]) -> None:
    from taichi_ants.rendering import colony_moments, frames, save_animation

    moments = (moment for _ in chain([0], passing) for moment in colony_moments(colony))
    save_animation(path, frames(moments), FRAMES_PER_SECOND)


def _save_picture(path: str, colony: Colony) -> None:
    from taichi_ants.rendering import colony_moments, frames, save_picture

    save_picture(path, next(frames(colony_moments(colony))))
