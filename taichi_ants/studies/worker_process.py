"""A second process for calls that keep Python itself busy, such as drawing.

Two threads of one process would only take turns at it.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from typing import Any, ParamSpec, TypeVar

from taichi_ants.runtime import available_threads

Given = ParamSpec("Given")
Answer = TypeVar("Answer")

_SERVE = "from taichi_ants.studies.worker_process import serve; serve()"


class WorkerProcess:
    """A process that does one call after the other, until the `with` block ends.

    This process does what that one cannot: where there is one processor, where no process can be
    started, and where a call raises. So a call may be done twice.
    """

    def __init__(self, second: bool = True) -> None:
        self._second = second and available_threads() > 1
        self._process: subprocess.Popen[bytes] | None = None
        self._turns = ThreadPoolExecutor(1)  # waits for answers

    def __enter__(self) -> WorkerProcess:
        return self

    def __exit__(self, kind: object, *raised: object) -> None:
        failed = kind is not None
        if self._process is not None and failed:
            self._process.kill()
        self._turns.shutdown(cancel_futures=failed)
        self._leave()
        if self._process is not None:
            self._process.wait()  # it keeps the kernels that it has compiled

    def begin(
        self, call: Callable[Given, Answer], *arguments: Given.args, **named: Given.kwargs
    ) -> Callable[[], Answer]:
        """Have a call of a module's function done after those before; return what waits for it."""
        here = partial(call, *arguments, **named)
        if not self._second:
            return here
        if self._process is None:
            try:
                self._process = _started()
            except Exception:  # nobody can be started
                return here
        coming = self._turns.submit(self._ask, here)

        def answer() -> Answer:
            done, value = coming.result()
            return value if done else here()

        return answer

    def finish(self) -> None:
        """Let the process end when it has done what has begun; later calls are done here."""
        self._turns.submit(self._leave)

    def _leave(self) -> None:
        process: Any = self._process
        for pipe in (process.stdin, process.stdout) if process else ():
            with suppress(OSError):  # it has ended, with something still to be read
                pipe.close()

    def _ask(self, call: Callable[[], Any]) -> tuple[bool, Any]:
        """Whether the other process has done a call, and what it returns."""
        try:
            process: Any = self._process
            pickle.dump(pickle.dumps(call, -1), process.stdin)  # whole, or not at all
            process.stdin.flush()
            return pickle.loads(pickle.load(process.stdout))
        except Exception:  # the call cannot be sent, or the process has ended
            return False, None


def serve() -> None:
    """Do the calls that come on standard input, and write what they return to standard output."""
    with suppress(EOFError, BrokenPipeError), os.fdopen(os.dup(1), "wb") as answers:
        os.dup2(2, 1)  # what is printed goes where errors go
        while True:  # until nobody asks any more
            call = pickle.load(sys.stdin.buffer)
            try:
                answer = pickle.dumps((True, pickle.loads(call)()), -1)
            except Exception:
                answer = pickle.dumps((False, None))
            pickle.dump(answer, answers)
            answers.flush()


def _started() -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-c", _SERVE],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,  # what it has to say is said here
        start_new_session=True,  # Ctrl-C is for this process alone, which ends the other one
    )
