"""Ray as an executor: workers on this machine, or in a cluster."""

from __future__ import annotations

import os
import signal
import socket
import time
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

import taichi_ants
from taichi_ants.errors import AntsError, imported
from taichi_ants.runtime import available_threads
from taichi_ants.studies.executors import RESUME, LostWorkersError

_LOOK_EVERY, _PATIENCE = 5.0, 3.0  # seconds between looks, and for an answer
_LEAST = 64  # workers for which there is work in advance, because machines can join later
# Ray reads them when it starts: it sends no statistics, and prints fatal errors only.
_ENVIRONMENT = {"RAY_USAGE_STATS_ENABLED": "0", "RAY_BACKEND_LOG_LEVEL": "fatal"}
_ENVIRONMENT |= {"RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0"}


class RayWorkers(Executor):
    """Workers that Ray starts, each with `threads` processors, and a GPU for "cuda".

    The `address` is HOST:PORT of a cluster that this machine belongs to, whose workers run the
    source of this package that this process runs. None starts Ray on this machine alone, until the
    `with` block ends. If a worker or its machine dies, Ray repeats the call elsewhere. Raises an
    AntsError if Ray is not installed, or no cluster is at the address.
    """

    def __init__(self, address: str | None = None, threads: int = 1, arch: str = "cpu") -> None:
        where: dict[str, Any] = {"num_cpus": available_threads(), "include_dashboard": False}
        environment = dict(_ENVIRONMENT)
        if address:
            _check_listens(address)
            where = {"runtime_env": {"py_modules": [str(Path(taichi_ants.__file__).parent)]}}
            if _has_token():  # `ray start` demands it then; clusters without tokens ignore it
                environment["RAY_AUTH_MODE"] = "token"
        os.environ.update(environment | os.environ)
        ray = self._ray = imported("a cluster", "ray", "ray")
        with _quiet_start():
            try:
                ray.init(address or "local", **where, logging_level="ERROR", log_to_driver=False)
            except (Exception, SystemExit) as error:
                why = (str(error).strip() or type(error).__name__).splitlines()[0].rstrip(".:")
                raise AntsError(
                    f"cannot use Ray at {address or 'this machine'} ({why}); check it with `ray "
                    "status`, and if it needs a token, set RAY_AUTH_MODE to token, and "
                    "RAY_AUTH_TOKEN to the one that `ray get-auth-token` prints on the head."
                ) from error
        self._head: str = ray.get_runtime_context().gcs_address
        self._remote = cache(ray.remote(num_cpus=threads, num_gpus=int(arch == "cuda")))
        self.num_workers = max(_LEAST, int(ray.cluster_resources().get("CPU", 0) // threads))
        self._looked = time.monotonic()

    def submit(self, call: Callable[..., Any], /, *given: Any, **named: Any) -> Future[Any]:
        """Return the future of a call in a worker."""
        mine: Future[Any] = Future()
        mine.set_running_or_notify_cancel()
        theirs = self._remote(call).remote(*given, **named).future()
        theirs.add_done_callback(lambda done: self._pass_on(mine, done))
        return mine

    def _pass_on(self, mine: Future[Any], theirs: Future[Any]) -> None:
        """Give the outcome of Ray's future to the one that `submit` has returned."""
        error = theirs.exception()
        if error is None:
            mine.set_result(theirs.result())
        elif isinstance(error, self._ray.exceptions.RayTaskError):  # its text has a traceback
            last = str(error).strip().rpartition("\n")[2]
            mine.set_exception(getattr(error, "cause", None) or RuntimeError(last))
        else:
            mine.set_exception(BrokenExecutor(type(error).__name__))

    def check(self) -> None:
        """Raise LostWorkersError if the head has died; Ray would end this process without a word.

        Any question to a dead head hangs, so this only opens a connection to it.
        """
        if time.monotonic() - self._looked < _LOOK_EVERY:
            return
        try:
            _check_listens(self._head)
        except AntsError as error:
            raise LostWorkersError(
                f"the head of the Ray cluster at {self._head!r} does not answer any more; {RESUME}."
            ) from error
        self._looked = time.monotonic()

    def __exit__(self, *raised: object) -> None:
        self._ray.shutdown()


def _has_token() -> bool:
    """Return whether this machine has a token of Ray, by which clusters know their users."""
    names = {"RAY_AUTH_TOKEN", "RAY_AUTH_TOKEN_PATH"}
    return bool(names & os.environ.keys()) or Path("~/.ray/auth_token").expanduser().exists()


def _check_listens(address: str) -> None:
    """Raise AntsError unless a program listens at HOST:PORT."""
    host, _, port = address.rpartition(":")
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=_PATIENCE).close()
    except (OSError, ValueError, OverflowError) as error:  # ValueError: the port is not a number
        why = getattr(error, "strerror", None) or str(error) or type(error).__name__
        raise AntsError(
            f"no Ray cluster listens at {address!r} ({why}); give HOST:PORT, which `ray start` has "
            "printed, or --ray as the last option to use this machine."
        ) from error


@contextmanager
def _quiet_start() -> Iterator[None]:
    """Discard what Ray's library in C++ prints at the start, and keep what SIGTERM does."""
    before, errors = signal.getsignal(signal.SIGTERM), os.dup(2)
    with open(os.devnull, "wb") as nothing:
        os.dup2(nothing.fileno(), 2)
    try:
        yield
    finally:
        os.dup2(errors, 2)
        os.close(errors)
        with suppress(ValueError):  # this is not the main thread
            signal.signal(signal.SIGTERM, before)
