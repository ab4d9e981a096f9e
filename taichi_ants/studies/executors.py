"""The computation of blocks by any executor with the interface of `concurrent.futures`.

An executor has the method `submit(call, *arguments)`, which returns a `concurrent.futures.Future`.
Its attribute `num_workers`, if any, is the number of its workers; its method `check`, if any,
raises an error if they are lost. `Workers` are processes on this machine, `studies.ray` has those
of a cluster, and the executors of Dask and mpi4py work as they are.
"""

import concurrent.futures
import multiprocessing
import os
import pickle
import platform
import signal
import threading
from collections import Counter, deque
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from multiprocessing.util import Finalize
from pathlib import Path
from typing import Any, TypeVar

from taichi_ants import PHYSICS, __version__, runtime
from taichi_ants.errors import AntsError, checked_whole
from taichi_ants.runtime import available_threads
from taichi_ants.studies.interruption import stop_if_noted
from taichi_ants.studies.plugins import Code, load_code

TRIES = 3  # of a block whose worker dies
_LOOK_EVERY = 0.5  # seconds between looks for Ctrl-C
RESUME = "finished parts are saved, so run the same command again to resume"  # ends messages

Piece = TypeVar("Piece", bound=Hashable)
_DIED = f"{TRIES} workers died at it, perhaps because memory was short, so use fewer workers"
_one_at_a_time = threading.Lock()  # Taichi serves one thread, and workers can be threads


class LostWorkersError(AntsError):
    """There are no more workers for a study, whose finished blocks are saved."""

    exit_status = 1


def completed(
    pieces: Iterable[Piece],
    work_of: Callable[[Piece], Callable[..., Any]],
    executor: Any = None,
    code: Sequence[Code] = (),
) -> Iterator[tuple[Piece, Any]]:
    """Yield pieces of work with their outcomes as they come, or with the exception that they raise.

    A piece is tried again if its worker dies, `TRIES` times in all. Raises a LostWorkersError if
    the executor takes no more work.

    Args:
        work_of: A function that returns the work of a piece, a call that can be pickled.
        executor: The executor; None means this process.
        code: The plugins and modules that the workers need.
    """
    outcome: Any
    if executor is None:
        for piece in pieces:
            try:
                outcome = work_of(piece)()
            except Exception as error:
                stop_if_noted()
                outcome = error
            yield piece, outcome
        return
    waiting, deaths = deque(pieces), Counter[Piece]()
    coming: dict[Future[Any], Piece] = {}
    try:
        while waiting or coming:
            workers = getattr(executor, "num_workers", 0) or available_threads()
            while waiting and len(coming) < 2 * workers:
                piece = waiting.popleft()
                work = pickle.dumps(work_of(piece), -1)
                try:
                    future = executor.submit(run_pickled, versions(), tuple(code), work)
                except (BrokenExecutor, RuntimeError) as refusal:
                    why = f"{type(refusal).__name__}: {refusal}"
                    raise LostWorkersError(
                        f"the executor takes no more work ({why}); {RESUME}."
                    ) from refusal
                coming[future] = piece
            done, _ = concurrent.futures.wait(
                coming, _LOOK_EVERY, concurrent.futures.FIRST_COMPLETED
            )
            stop_if_noted()
            getattr(executor, "check", lambda: None)()
            for future in done:
                piece = coming.pop(future)
                try:
                    outcome = future.result()
                except BrokenExecutor:
                    deaths[piece] += 1
                    if deaths[piece] < TRIES:
                        waiting.append(piece)
                        continue
                    outcome = LostWorkersError(_DIED)
                except (Exception, SystemExit) as error:
                    outcome = error
                yield piece, outcome
    finally:
        for future in coming:
            future.cancel()


def versions() -> str:
    """Return the versions of this package, its physics and Python, which all workers must have."""
    python = ".".join(platform.python_version_tuple()[:2])
    return f"taichi_ants {__version__} (physics {PHYSICS}) and Python {python}"


def run_pickled(of_study: str, code: Sequence[Code], pickled: bytes) -> Any:
    """Return the outcome of pickled work; AntsError if this worker has other `versions`."""
    if of_study != versions():
        raise AntsError(
            f"the study runs with {of_study}, but a worker has {versions()}; install the same "
            "versions"
        )
    with _one_at_a_time:
        load_code(code)
        return pickle.loads(pickled)()  # after the plugins, which can define its classes


class Workers(Executor):
    """Worker processes on this machine, which are replaced if they die; AntsError for none.

    Each is a pool of one, so that its death costs its block only: a pool of several loses all
    blocks. The workers end with the `with` block; in case of an error, or if this process is
    killed, at once.
    """

    def __init__(self, workers: int) -> None:
        self.num_workers = checked_whole("workers", workers)
        self._pools: list[ProcessPoolExecutor | None] = [None] * workers
        self._calls: list[set[Future[Any]]] = [set() for _ in range(workers)]
        # The workers have one end. They see that the other one is closed, also by a crash.
        self._end, self._line = multiprocessing.Pipe(duplex=False)

    def submit(self, call: Callable[..., Any], /, *given: Any, **named: Any) -> Future[Any]:
        """Return the future of a call in the worker that has the fewest calls."""
        for calls in self._calls:
            calls -= {future for future in calls if future.done()}
        n = min(range(self.num_workers), key=lambda n: len(self._calls[n]))
        with _without_ctrl_c():
            for _ in range(TRIES):
                with suppress(BrokenExecutor):
                    pool = self._pools[n] = self._pools[n] or self._new_pool()
                    future = pool.submit(call, *given, **named)
                    self._calls[n].add(future)
                    return future
                self._pools[n] = None
        raise BrokenExecutor("worker processes die as soon as they start")

    def _new_pool(self) -> ProcessPoolExecutor:
        # A fork spares imports, but has only one thread; Taichi and others need theirs.
        tasks = [*Path("/proc/self/task").glob("*")]  # on Linux
        start = multiprocessing.get_context("fork" if len(tasks) == 1 else "spawn")
        return ProcessPoolExecutor(1, start, _end_with, (self._end, self._line))

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers after their calls; they save the kernels that they have compiled."""
        for pool in filter(None, self._pools):  # one by one: a second call would not wait
            pool.shutdown(wait, cancel_futures=cancel_futures)

    def __exit__(self, kind: object, *raised: object) -> None:
        if kind is None:
            self.shutdown()
        self._line.close()
        self._end.close()
        self.shutdown(wait=False, cancel_futures=True)


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


def _end_with(end: Connection, line: Connection) -> None:
    """Ignore Ctrl-C, and end this process when the first process closes its end of a line."""
    line.close()  # the copy of that end
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    Finalize(None, runtime.stop, exitpriority=0)  # a fork ends without its exit handlers

    def wait() -> None:
        with suppress(EOFError, OSError):
            end.recv()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()
