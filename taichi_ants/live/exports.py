"""Files that pages can export from a session, and jobs: replays, and files that take long.

A job has the attributes `done` and `total`, in steps or ticks, and `page`, the page that asked for
it, if any. Its `result` is a session, a file or a message; None before the end.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from multiprocessing.connection import Connection
from typing import Any

from taichi_ants.errors import AntsError, words_of
from taichi_ants.live.session import Log, Session, bytes_of
from taichi_ants.viewer import Recording, page

Snapshots = Iterable[tuple[Session, bytes]]  # of a replay, see `Session.snapshots`

_SLICE = 0.05  # seconds of a replay per turn of the server
LOAD = "load"  # pages' name for a replay: of an uploaded file, or to undo a change


def recording(snapshots: Snapshots) -> Recording:
    """Return a recording of a session."""
    (*_, session), frames = zip(*snapshots, strict=True)
    return Recording(session.recorder.header(), list(frames))


def gif_bytes(snapshots: Snapshots) -> bytes:
    """Return a GIF of a session."""
    from taichi_ants.rendering import colony_snapshots, frames, save_animation

    snapshots = iter(snapshots)
    session, _ = next(snapshots)  # it advances
    shown = (next(colony_snapshots(session.colony)) for _ in chain([None], snapshots))
    pictures = frames(shown, task=session.setup.task)
    return bytes_of("session.gif", lambda path: save_animation(path, pictures, fps=12.0))


# Pages' names of files, file names, and the functions that make them.
QUICK: dict[str, tuple[str, Callable[[Session], bytes]]] = {
    "session": ("session.npz", Session.to_bytes),
    "policy": ("policy.npz", Session.policy_bytes),
    "colony": ("colony.npz", Session.colony_bytes),
}
# The same for an `Export`, with the number of snapshots.
SLOW: dict[str, tuple[str, Callable[[Snapshots], bytes], int]] = {
    "page": ("session.html", lambda snapshots: page(recording(snapshots)).encode(), 1000),
    "gif": ("session.gif", gif_bytes, 300),
}


class Replay:
    """A replay, in slices: iterates over `sessions`, the last of which is the result."""

    page = None

    def __init__(self, sessions: Iterator[Session], total: int, undoes: bool = False) -> None:
        self._sessions, self.total, self.undoes = sessions, total, undoes
        self.done = 0
        self._last: Session | None = None
        self.result: Session | str | None = None

    def proceed(self) -> None:
        """Continue for a moment; AntsError and MemoryError become messages in `result`."""
        until = time.monotonic() + _SLICE
        try:
            for session in self._sessions:
                self._last, self.done = session, session.steps
                if time.monotonic() > until:
                    return
            self.result = self._last
        except (AntsError, MemoryError) as error:
            self.result = words_of(error, "the replay")

    def cancel(self) -> None:
        """Do nothing, because the session of the server has not changed."""


class Export:
    """A worker process that makes a file of `SLOW`, while the session continues.

    The process calls `prepare` first, for example to load a plugin.
    """

    undoes = False

    def __init__(
        self, kind: str, session: Session, prepare: Callable[[], None] | None, page: Any = None
    ) -> None:
        self.done, self.total, self.page = 0, session.ticks, page
        self.result: bytes | str | None = None
        context = multiprocessing.get_context("spawn")
        self._answers, answers = context.Pipe(duplex=False)
        arguments = (kind, session.to_bytes(), prepare, answers)
        self._process = context.Process(target=_make, args=arguments, daemon=True)
        self._process.start()
        answers.close()  # so that `recv` raises EOFError when the process ends

    def proceed(self) -> None:
        """Read what the process has sent: numbers of ticks, then the result."""
        try:
            while self.result is None and self._answers.poll():
                answer = self._answers.recv()
                if isinstance(answer, int):
                    self.done = answer
                else:
                    self.result = answer
        except (EOFError, OSError):
            self.result = "the worker process has ended early, perhaps for lack of memory."

    def cancel(self) -> None:
        """End the process now."""
        self._process.terminate()


def _make(kind: str, log: bytes, prepare: Callable[[], None] | None, answers: Connection) -> None:
    """Send numbers of ticks while working, then the result, or a message if there is none."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process ends this one
    if hasattr(os, "nice"):  # Windows does not have it
        os.nice(5)  # the server has priority
    _, make, most = SLOW[kind]

    def passed() -> Snapshots:
        for session, frame in Session.snapshots(Log.read("the session", log), most):
            yield session, frame
            answers.send(session.ticks)

    try:
        if prepare is not None:
            prepare()
        answers.send(make(passed()))
    except AntsError as error:
        answers.send(str(error))
