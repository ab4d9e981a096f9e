"""The files that a session gives, and the processes that make or replay what takes long."""

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
_SLICE = 0.05  # seconds of undoing at each turn


def recording(log: Log, most_frames: int = 1000, progress: Progress | None = None) -> Recording:
    """The session as a page plays it without a server, see `Session.snapshots`."""
    (*_, session), frames = zip(*_snapshots(log, most_frames, progress), strict=True)
    return Recording(session.header(), list(frames))


def gif_bytes(log: Log, progress: Progress | None = None, most_frames: int = 300) -> bytes:
    """An animation of the session, see `Session.snapshots`."""
    from taichi_ants.rendering import colony_snapshots, frames, save_animation

    passed = _snapshots(log, most_frames, progress)
    shown = (one for session, _ in passed for one in colony_snapshots(session.colony))
    pictures = frames(shown, strongest=log.setup.task.pheromone.level)
    return bytes_of("session.gif", lambda path: save_animation(path, pictures, fps=12.0))


def _snapshots(log: Log, most: int, progress: Progress | None) -> Iterator[tuple[Session, bytes]]:
    for session, frame in Session.snapshots(log, most):
        yield session, frame
        if progress is not None:
            progress(session.ticks)


# What pages call it, the name of the file, and what makes it: at once, or from the beginning.
LOAD = "load"  # what they call the replay of an uploaded file, or of a session in part undone
QUICK: dict[str, tuple[str, Callable[[Session], bytes]]] = {
    "session": ("session.npz", Session.to_bytes),
    "policy": ("policy.npz", Session.policy_bytes),
    "colony": ("colony.npz", Session.colony_bytes),
}
SLOW: dict[str, tuple[str, Callable[[Log, Progress], bytes]]] = {
    "page": ("session.html", lambda log, told: page(recording(log, progress=told)).encode()),
    "gif": ("session.gif", gif_bytes),
}


class Undoing:
    """A session that is made once more without its last change; attributes as of `Making`."""

    page = None

    def __init__(self, session: Session) -> None:
        self._pieces, self._last = session.undone(), session
        self.done, (self.total, _) = 0, session.edits[session.changes[-1]]
        self.made: Session | str | None = None

    def go_on(self) -> None:
        """Undo for a moment; AntsError and MemoryError become words in `made`."""
        until = time.monotonic() + _SLICE
        try:
            for session in self._pieces:
                self._last, self.done = session, session.steps
                if time.monotonic() > until:
                    return
            self.made = self._last
        except AntsError as error:
            self.made = str(error)
        except MemoryError:
            self.made = "undoing needs more memory than there is."

    def cancel(self) -> None:
        """Nothing to do: the session is as it was."""


class Making:
    """A file of `SLOW` that a worker process makes, or a session that it replays (`LOAD`).

    `content` is the session as its file holds it, `total` its ticks, `prepare` what the process
    calls first, as to load a plugin; `page` is who asked.

    Attributes:
        done: How many of the ticks have passed.
        made: What was made, or why there is nothing; None before the end.
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
        self.made: bytes | str | Session | None = None
        self._cancelled = False
        context = multiprocessing.get_context("spawn")
        self._answers, answers = context.Pipe(duplex=False)
        given = (kind, content, prepare, answers)
        self._process = context.Process(target=_make, args=given, daemon=True)
        threading.Thread(target=self._run, args=(answers,), daemon=True).start()

    def go_on(self) -> None:
        """Nothing to do: the process goes on by itself."""

    def cancel(self) -> None:
        """End it now."""
        self._cancelled = True
        if self._process.pid is not None:
            self._process.terminate()

    def _run(self, answers: Connection) -> None:
        answer: bytes | str | int | Session = 0
        with self._answers, suppress(EOFError, OSError):  # as where there is no memory
            self._process.start()
            answers.close()  # so that the end of the process is the end of its answers
            if self._cancelled:
                self._process.terminate()
            while isinstance(answer := self._answers.recv(), int):
                self.done = answer
        if isinstance(answer, int):
            answer = "the process that was to do this has ended early, as for lack of memory."
        faulty = isinstance(answer, str) and self._kind == LOAD
        self.made = _of_page(answer) if faulty else answer


def _make(
    kind: str, content: bytes, prepare: Callable[[], None] | None, answers: Connection
) -> None:
    """Answer with numbers of ticks, then with what was made, or with why there is nothing."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends this one
    if hasattr(os, "nice"):  # as on Windows it has not
        os.nice(5)  # the server answers pages first
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
    """The log in a file that a page has sent; AntsError with the way out that a page has."""
    try:
        return Log.from_bytes(content)
    except AntsError as error:
        raise AntsError(_of_page(error)) from None


def _of_page(fault: object) -> str:
    what = str(fault).partition("; ")[0].rstrip(".").replace("'the loaded file'", "the loaded file")
    return f"{what}; load a session that Save has made."
