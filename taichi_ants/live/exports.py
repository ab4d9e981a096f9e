"""Files that pages can export from a session, and worker processes that make or replay them."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

from taichi_ants.errors import AntsError
from taichi_ants.live.session import Log, Session, bytes_of
from taichi_ants.viewer import Recording, page

Progress = Callable[[int], None]  # called with the number of ticks that have passed

_PROGRESS_EVERY = 0.1  # seconds
_SLICE = 0.05  # seconds of undoing per turn of the server


def recording(log: Log, most_frames: int = 1000, progress: Progress | None = None) -> Recording:
    """Return a recording of the session; `most_frames` is as in `Session.snapshots`."""
    (*_, session), frames = zip(*_snapshots(log, most_frames, progress), strict=True)
    return Recording(session.header(), list(frames))


def gif_bytes(log: Log, progress: Progress | None = None, most_frames: int = 300) -> bytes:
    """Return a GIF of the session; `most_frames` is as in `Session.snapshots`."""
    from taichi_ants.rendering import colony_snapshots, frames, save_animation

    passed = _snapshots(log, most_frames, progress)
    snapshots = (now for session, _ in passed for now in colony_snapshots(session.colony))
    pictures = frames(snapshots, task=log.setup.task)
    return bytes_of("session.gif", lambda path: save_animation(path, pictures, fps=12.0))


def _snapshots(log: Log, most: int, progress: Progress | None) -> Iterator[tuple[Session, bytes]]:
    for session, frame in Session.snapshots(log, most):
        yield session, frame
        if progress is not None:
            progress(session.ticks)


LOAD = "load"  # pages' name for the replay of an uploaded file, and for undoing
# Pages' names of files, file names, and the functions that make them: at once, or by a replay.
QUICK: dict[str, tuple[str, Callable[[Session], bytes]]] = {
    "session": ("session.npz", Session.to_bytes),
    "policy": ("policy.npz", Session.policy_bytes),
    "colony": ("colony.npz", Session.colony_bytes),
}
SLOW: dict[str, tuple[str, Callable[[Log, Progress], bytes]]] = {
    "page": ("session.html", lambda log, told: page(recording(log, progress=told)).encode()),
    "gif": ("session.gif", gif_bytes),
}


class UndoJob:
    """The replay of a session without its last change; it has the attributes of `WorkerJob`."""

    page = None

    def __init__(self, session: Session) -> None:
        self._replay, self._last = session.undone(), session
        self.done, (self.total, _) = 0, session.edits[session.changes[-1]]
        self.result: Session | str | None = None

    def proceed(self) -> None:
        """Continue for a moment; AntsError and MemoryError become messages in `result`."""
        until = time.monotonic() + _SLICE
        try:
            for session in self._replay:
                self._last, self.done = session, session.steps
                if time.monotonic() > until:
                    return
            self.result = self._last
        except AntsError as error:
            self.result = str(error)
        except MemoryError:
            self.result = "undoing needs more memory than is available."

    def cancel(self) -> None:
        """Do nothing, because the session has not changed."""


class WorkerJob:
    """A worker process that makes a file of `SLOW`, or replays a session (`LOAD`).

    `content` is a session file, `total` its number of ticks. The process calls `prepare` first, for
    example to load a plugin. `page` is the page that asked for it.

    Attributes:
        done: The number of ticks that have been replayed.
        result: The result, or a message if there is none; None before the end.
    """

    def __init__(
        self,
        kind: str,
        content: bytes,
        total: int,
        prepare: Callable[[], None] | None,
        page: Any = None,
    ) -> None:
        self._kind, self.done, self.total, self.page = kind, 0, total, page
        self.result: bytes | str | Session | None = None
        self._cancelled = False
        context = multiprocessing.get_context("spawn")
        self._answers, answers = context.Pipe(duplex=False)
        arguments = (kind, content, prepare, answers)
        self._process = context.Process(target=_make, args=arguments, daemon=True)
        threading.Thread(target=self._run, args=(answers,), daemon=True).start()

    def proceed(self) -> None:
        """Do nothing, because the process continues by itself."""

    def cancel(self) -> None:
        """End the process now."""
        self._cancelled = True
        if self._process.pid is not None:
            self._process.terminate()

    def _run(self, answers: Connection) -> None:
        answer: bytes | str | int | Session = 0
        with self._answers, suppress(EOFError, OSError):  # for example if memory is exhausted
            self._process.start()
            answers.close()  # so that `recv` raises EOFError when the process ends
            if self._cancelled:
                self._process.terminate()
            while isinstance(answer := self._answers.recv(), int):
                self.done = answer
        if isinstance(answer, int):
            answer = "the worker process has ended early, perhaps for lack of memory."
        faulty = isinstance(answer, str) and self._kind == LOAD
        self.result = _of_page(answer) if faulty else answer


def _make(
    kind: str, content: bytes, prepare: Callable[[], None] | None, answers: Connection
) -> None:
    """Send numbers of ticks while working, then the result, or a message if there is none."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process ends this one
    if hasattr(os, "nice"):  # Windows does not have it
        os.nice(5)  # the server has priority
    told = 0.0

    def progress(ticks: int) -> None:
        nonlocal told
        if time.monotonic() - told > _PROGRESS_EVERY:
            told = time.monotonic()
            answers.send(ticks)

    try:
        if prepare is not None:
            prepare()
        log = Log.from_bytes(content)
        if kind == LOAD:
            for session in Session.replay(log):
                progress(session.steps)
            answers.send(session)
        else:
            answers.send(SLOW[kind][1](log, progress))
    except AntsError as error:
        answers.send(str(error))


def uploaded(content: bytes) -> Log:
    """Return the log in an uploaded file; raise AntsError with advice for users of the page."""
    try:
        return Log.from_bytes(content)
    except AntsError as error:
        raise AntsError(_of_page(error)) from None


def _of_page(fault: object) -> str:
    what = str(fault).partition("; ")[0].rstrip(".").replace("'the loaded file'", "the loaded file")
    return f"{what}; load a file that Save session has written."
