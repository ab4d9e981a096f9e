"""The computation of blocks by any executor with the interface of `concurrent.futures`.

An executor needs the method `submit(call, *arguments)`, which returns a
`concurrent.futures.Future`; its attribute `num_workers`, if any, is the number of its workers. An
executor whose worker dies sets an exception in the futures of that worker's calls, and accepts
further calls.
"""

from __future__ import annotations

import concurrent.futures
import multiprocessing
import os
import pickle
import platform
import signal
import sys
import tempfile
import threading
from collections import Counter, deque
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np

from taichi_ants import __version__
from taichi_ants.errors import AntsError, checked_whole
from taichi_ants.runtime import available_threads
from taichi_ants.studies.blocks import Outcome
from taichi_ants.studies.command_line import load_plugin
from taichi_ants.studies.command_line import read_plugin as read_plugin
from taichi_ants.studies.compilation import compile_once
from taichi_ants.studies.interruption import stop_if_noted

TRIES = 3  # of a block, before it counts as failed
RESUME = "finished parts are saved, so run the same command again to resume"  # ends messages
_LOOK_EVERY = 0.5  # seconds between looks for Ctrl-C

Plugin = Mapping[str, bytes]  # the files of a plugin, which travel to the workers
Piece = TypeVar("Piece", bound=Hashable)
# (points, seeds, outcome) -> what is kept of the outcome; arrays (points, seeds, ...)
Reduce = Callable[[Sequence[Any], Sequence[int], Outcome], Outcome]


class Executor(Protocol):
    """An executor, as far as studies need one."""

    def submit(self, call: Callable[..., Any], /, *arguments: Any) -> Future[Any]:
        """Return the future of a call, which runs elsewhere or later."""


class LostWorkersError(AntsError):
    """There are no more workers for a study, whose finished blocks are saved."""

    exit_status = 1


@dataclass(frozen=True)
class Work:
    """A block as a value that can be pickled: everything that a worker needs to compute it.

    Attributes:
        points, seeds: The runs of the block; all points are `alike`.
        learned: The tables of the point `after`, float32 (seeds, n_states, 5), or None.
        reduce: What is kept of the outcome, a function at the top level of a module or a `partial`
            of one; None keeps all.
        where: The arguments `threads` and `arch` of `train`.
    """

    points: tuple[Any, ...]
    seeds: tuple[int, ...]
    learned: np.ndarray | None
    reduce: Reduce | None
    where: Mapping[str, Any]

    def do(self, progress: Callable[[float], None] = lambda share: None) -> Outcome:
        """Return the outcome, arrays (points, seeds, ...); call `progress` with shares of it."""
        given = self.points, self.seeds, self.learned, progress, self.where
        outcome = self.points[0].do(*given)
        return self.reduce(self.points, self.seeds, outcome) if self.reduce else outcome


def versions() -> tuple[str, str]:
    """Return the versions of this package and of Python, which all workers must have."""
    return __version__, ".".join(platform.python_version_tuple()[:2])


def check_versions(of_study: tuple[str, str], own: tuple[str, str], owner: str) -> None:
    """Raise AntsError if a worker, which the message calls `owner`, has other `versions`."""
    if own != of_study:
        theirs, its = (f"taichi_ants {one} and Python {other}" for one, other in (of_study, own))
        raise AntsError(
            f"the study runs with {theirs}, but {owner} has {its}; install the same versions."
        )


def do(of_study: tuple[str, str], plugins: Sequence[Plugin], pickled: bytes) -> Outcome:
    """Return the outcome of a pickled `Work`; this is what workers run.

    Raises:
        AntsError: The worker has other `versions` than the study.
    """
    check_versions(of_study, versions(), "a worker")
    with _ONE_AT_A_TIME:
        for plugin in plugins:
            _load(plugin)
        work: Work = pickle.loads(pickled)  # after the plugins, which can define its classes
        compile_once(work, *plugins)
        return work.do()


# Taichi serves one thread of a process; workers of an executor can be threads.
_ONE_AT_A_TIME = threading.Lock()
_loaded: dict[str, list[bytes]] = {}  # contents of plugins by name
_folders: list[tempfile.TemporaryDirectory[str]] = []  # of loaded plugins, until this process ends


def _load(plugin: Plugin) -> None:
    """Load the files of a plugin, unless this process has loaded it; AntsError if that failed."""
    name, contents = Path(next(iter(plugin))).name, [*plugin.values()]
    if _loaded.setdefault(name, contents) != contents:
        raise AntsError(f"a worker has loaded another plugin {name!r}; start new workers.")
    if f"plugin_{Path(name).stem}" in sys.modules:
        return
    _folders.append(tempfile.TemporaryDirectory())
    for one, content in plugin.items():  # in files, because Taichi reads the source of functions
        Path(_folders[-1].name, Path(one).name).write_bytes(content)
    load_plugin(str(Path(_folders[-1].name, name)))


def completed(
    pieces: Iterable[Piece],
    work_of: Callable[[Piece], Work],
    executor: Executor,
    in_flight: int | None = None,
    plugins: Sequence[Plugin] = (),
) -> Iterator[tuple[Piece, Outcome | Exception]]:
    """Yield pieces of work with their outcomes as they come, or with the error of the last try.

    Work that fails is tried `TRIES` times. Work that fails together with its worker is tried alone
    in the end, because a worker can die for a reason that lies elsewhere.

    Args:
        pieces: The pieces; a few are taken at a time.
        work_of: A function that returns the work of a piece.
        executor: The executor.
        in_flight: The number of pieces that the executor has at the same time, by default twice
            the present number of its workers, or of the processors of this machine.
        plugins: Plugins that the workers need.

    Raises:
        LostWorkersError: The executor takes no more work.
    """
    of_study = versions()
    source, again, alone = iter(pieces), deque[Piece](), deque[Piece]()
    coming: dict[Future[Any], Piece] = {}
    failures: Counter[Piece] = Counter()

    def following() -> Iterator[Piece]:
        workers = getattr(executor, "num_workers", 0) or available_threads()
        while len(coming) < (in_flight or 2 * workers):
            if again:
                yield again.popleft()
            elif (new := next(source, None)) is not None:
                yield new
            elif alone and not coming:
                yield alone.popleft()
                return
            else:
                return

    try:
        while True:
            for piece in following():
                pickled = pickle.dumps(work_of(piece), -1)
                try:
                    future = executor.submit(do, of_study, tuple(plugins), pickled)
                except (BrokenExecutor, RuntimeError) as refusal:
                    raise LostWorkersError(
                        f"the executor takes no more work ({type(refusal).__name__}: {refusal}); "
                        f"{RESUME}."
                    ) from refusal
                coming[future] = piece
            if not coming:
                return
            done, _ = concurrent.futures.wait(
                coming, _LOOK_EVERY, concurrent.futures.FIRST_COMPLETED
            )
            stop_if_noted()
            for future in done:
                piece, error = coming.pop(future), _error_of(future)
                if error is None:
                    yield piece, future.result()
                    continue
                failures[piece] += 1
                if failures[piece] == TRIES:
                    yield piece, _died(error) if isinstance(error, BrokenExecutor) else error
                elif failures[piece] == TRIES - 1 and isinstance(error, BrokenExecutor):
                    alone.append(piece)
                else:
                    again.append(piece)
    finally:
        for future in coming:
            future.cancel()


def _error_of(future: Future[Any]) -> Exception | None:
    """Return the error of a finished future, which somebody else may have cancelled."""
    try:
        error = future.exception()
    except concurrent.futures.CancelledError as cancelled:
        return RuntimeError(f"cancelled {cancelled}".strip())
    if error is None or isinstance(error, Exception):
        return error
    return RuntimeError(f"{type(error).__name__}: {error}")  # a SystemExit, for example


def _died(error: BrokenExecutor) -> LostWorkersError:
    """Return the error of a block whose workers have died in all tries."""
    how = "" if isinstance(error, BrokenProcessPool) else f" ({error})"  # its text has no cause
    return LostWorkersError(
        f"{TRIES} workers died at this block, perhaps because memory was short{how}, so use "
        "fewer workers"
    )


class LocalWorkers:
    """Worker processes on this machine, which are replaced if they die.

    They end with the `with` block; in case of an error, or if this process is killed, at once.

    Raises:
        AntsError: The number of workers is not a whole number above 0.
    """

    def __init__(self, workers: int) -> None:
        self.num_workers = checked_whole("workers", workers)
        self._pool: ProcessPoolExecutor | None = None
        # The workers have one end. They see that the other one is closed, also by a crash.
        self._end, self._line = multiprocessing.Pipe(duplex=False)

    def __enter__(self) -> LocalWorkers:
        return self

    def __exit__(self, kind: object, *raised: object) -> None:
        if kind is None and self._pool:
            self._pool.shutdown()  # the workers save the kernels that they have compiled
        self._line.close()
        self._end.close()
        if self._pool:
            self._pool.shutdown(wait=False, cancel_futures=True)

    def submit(self, call: Callable[..., Any], /, *arguments: Any) -> Future[Any]:
        """Return the future of a call in a worker process, which is started if necessary."""
        with _without_ctrl_c():
            for _ in range(TRIES):
                with suppress(BrokenExecutor):
                    if self._pool is not None:
                        return self._pool.submit(call, *arguments)
                self._pool = self._new()
        raise BrokenExecutor("worker processes die as soon as they start")

    def _new(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(
            self.num_workers,
            multiprocessing.get_context("spawn"),  # Taichi cannot be forked
            _end_with,
            (self._end,),
        )


@contextmanager
def _without_ctrl_c() -> Iterator[None]:
    """Let processes that are started in the context ignore Ctrl-C, which only this one gets."""
    if not hasattr(signal, "pthread_sigmask"):  # on Windows, workers ignore it once they run
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT,))  # processes inherit it
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _end_with(line: Connection) -> None:
    """Ignore Ctrl-C, and end this process when the other end of a line is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def wait() -> None:
        with suppress(EOFError, OSError):
            line.recv()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()
