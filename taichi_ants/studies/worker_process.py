"""A second process for work that Python code does, such as drawing.

Threads of one process would take turns at such work.
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
    """A process that runs one call after the other, until the `with` block ends.

    This process runs calls itself if there is only one processor, if the other process cannot
    start, or if a call raises there. A call may therefore run twice.
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
            self._process.wait()  # it saves the kernels that it has compiled

    def begin(
        self, call: Callable[Given, Answer], *arguments: Given.args, **named: Given.kwargs
    ) -> Callable[[], Answer]:
        """Return a function that waits for the result of a call, which the other process runs.

        The called function must be at the top level of a module.
        """
        here = partial(call, *arguments, **named)
        if not self._second:
            return here
        if self._process is None:
            try:
                self._process = _started()
            except Exception:  # no process can be started
                return here
        coming = self._turns.submit(self._ask, here)

        def answer() -> Answer:
            done, value = coming.result()
            return value if done else here()

        return answer

    def finish(self) -> None:
        """End the other process after the calls that have begun; later calls run in this one."""
        self._turns.submit(self._leave)

    def _leave(self) -> None:
        process: Any = self._process
        for pipe in (process.stdin, process.stdout) if process else ():
            with suppress(OSError):  # the process has ended, with data left in the pipe
                pipe.close()

    def _ask(self, call: Callable[[], Any]) -> tuple[bool, Any]:
        """Return whether the other process has done a call, and the value of the call."""
        try:
            process: Any = self._process
            pickle.dump(pickle.dumps(call, -1), process.stdin)  # pickled completely or not sent
            process.stdin.flush()
            return pickle.loads(pickle.load(process.stdout))
        except Exception:  # the call cannot be sent, or the process has ended
            return False, None


def serve() -> None:
    """Run the calls from standard input, and write their return values to standard output."""
    with suppress(EOFError, BrokenPipeError), os.fdopen(os.dup(1), "wb") as answers:
        os.dup2(2, 1)  # calls that print write to standard error
        while True:  # until standard input is closed
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
        stderr=subprocess.DEVNULL,  # this process reports errors
        start_new_session=True,  # only this process gets Ctrl-C, and ends the other one
    )
