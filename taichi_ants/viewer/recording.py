"""Recordings: what happened in a world, moment by moment, small enough for a page.

All are made from a colony while it runs; an episode of one ant is played once more by a colony of
one. A recording is a header, which says what it is about, and `frames`.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from taichi_ants.checks import check_progress
from taichi_ants.engines.colony.colony import Colony
from taichi_ants.engines.runs.traces import Trace
from taichi_ants.errors import AntsError, expect
from taichi_ants.rendering.snapshots import Episode, colony_of_rollout, intervals
from taichi_ants.viewer.frames import unpack
from taichi_ants.viewer.recorder import Recorder


@dataclass(frozen=True, eq=False)
class Recording:
    """What happened, as a page plays it.

    Attributes:
        header: What it is about, as JSON can hold it, see `Recorder.header`.
        frames: The first moment, then what changed until each later one, see `frames`.
    """

    header: dict[str, Any]
    frames: list[bytes]

    def __len__(self) -> int:
        """The number of moments."""
        return len(self.frames)

    def to_bytes(self) -> bytes:
        """The recording as a page holds it, compressed: its header as JSON, then all frames."""
        header = json.dumps(self.header, separators=(",", ":")).encode()
        header += b" " * (-(len(header) + 4) % 8)  # frames begin at a multiple of eight
        length = np.array([len(header)], dtype="<u4").tobytes()
        return zlib.compress(b"".join([length, header, *self.frames]), 9)

    def sections(self, moment: int) -> dict[str, np.ndarray]:
        """The sections of the frame of a moment."""
        return unpack(self.header["types"], self.frames[moment])


def record_colony(
    colony: Colony,
    ticks: int = 0,
    frame_interval: int = 1,
    *,
    world: int = 0,
    title: str = "",
    follow: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """What a colony does from now on; it is moved on by `ticks`.

    Args:
        colony: In an episode.
        ticks: How many; 0 gives the moment as it is.
        frame_interval: Ticks from one moment to the next; what each ant did is known only if it is
            1.
        world: Which of its worlds.
        title: What the page is called.
        follow: The number of the ant that the page follows at first.
        progress: Called after each moment with the share of the work that is done.

    Raises:
        AntsError: A number is not allowed, or no episode has begun.
    """
    between, done = intervals(colony, ticks, frame_interval, follow), 0
    check_progress(progress)
    recorder = Recorder(colony, world, title, follow)
    frames = [recorder.snapshot()]
    for n in between:
        frames.append(recorder.tick(n))
        done += n
        if progress is not None:
            progress(done / ticks)
    return Recording(recorder.header(), frames)


def record_episode(episode: Episode, title: str = "") -> Recording:
    """An episode in which one ant follows a policy."""
    expect("episode", episode, Episode)
    one = episode
    colony = colony_of_rollout(one.world, one.task, one.q_values, one.epsilon, one.seed)
    return _record_rollout(colony, len(one.trace), title)


def record_trace(trace: Trace, title: str = "") -> Recording:
    """A trace of `rollout` or `trace_training`, with its TD errors.

    Raises:
        AntsError: It is none of one policy, so nobody knows how to play it again.
    """
    expect("trace", trace, Trace)
    made = trace.made
    if made is None:
        raise AntsError(
            "the trace does not say how it was made, so it cannot be played again; take one of "
            "rollout or trace_training."
        )
    if made.config is None:
        assert made.q_values is not None  # one of the two it has
        colony = colony_of_rollout(
            made.world, made.task, made.q_values, made.epsilon, made.seed, made.number
        )
        return _record_rollout(colony, len(trace), title)
    # A colony of one ant with a table of its own learns as it did.
    options: dict[str, Any] = {"sharing": "independent", "ends_at_delivery": True}
    colony = Colony(made.world, made.task, made.config, made.seed, 1, **options)
    colony.begin_episode(made.max_steps)
    recorder, frames = Recorder(colony, 0, title, 0), []
    errors = np.zeros(len(trace)) if trace.td_errors is None else trace.td_errors
    for number, (step, error) in enumerate(zip(trace.steps.tolist(), errors, strict=True)):
        if step == 0 and number:
            recorder.progress.note(ended=True)
            colony.end_episode()
            colony.begin_episode(made.max_steps)
        if step == 0:
            frames.append(recorder.snapshot())
        frames.append(recorder.tick(td_errors=np.array([error])))
    return Recording(recorder.header(), frames)


def _record_rollout(colony: Colony, ticks: int, title: str) -> Recording:
    expect("title", title, str)
    return record_colony(colony, ticks, title=title or "One ant that follows a policy", follow=0)
