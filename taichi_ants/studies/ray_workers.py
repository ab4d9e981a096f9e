"""Ray as an executor: workers on this machine, or in a cluster."""

from __future__ import annotations

import os
import pickle
import signal
import socket
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Future
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any

from taichi_ants.errors import AntsError, count, imported
from taichi_ants.runtime import available_threads
from taichi_ants.studies import executors
from taichi_ants.studies.executors import RESUME, LostWorkersError, check_versions

_WAIT = 3.0  # seconds for an answer of the cluster
_WAIT_FOR_WORKERS = 120.0  # seconds for the first worker of each machine
_COUNT_EVERY = 5.0  # seconds between counts of the workers
# Ray reads them when it starts: it sends no statistics, and prints fatal errors only.
_ENVIRONMENT = {
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_BACKEND_LOG_LEVEL": "fatal",
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",
}
# What a client of HTTP/2 sends first: the preface and empty settings. The answer are settings too.
_HELLO, _SETTINGS = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + bytes([0, 0, 0, 4, 0, 0, 0, 0, 0]), 4


class RayWorkers:
    """Workers that Ray starts; the calls wait for a worker, and Ray distributes them.

    Ray must not run in this process. It is connected until the `with` block ends. Each worker has
    as many processors of its machine as `threads`, and a GPU for "cuda". If a worker or its machine
    dies, the futures of its calls have a `BrokenExecutor`; Ray replaces the worker.

    Attributes:
        address: HOST:PORT of a cluster that this machine belongs to; None starts Ray on this
            machine alone, and ends it.
        finished: The number of calls that have returned.

    Raises:
        AntsError: Ray is not installed, no cluster is at the address, no machine has a worker's
            processors, or a machine has another version of Ray, Python or this package.
    """

    def __init__(self, address: str | None = None, threads: int = 1, arch: str = "cpu") -> None:
        self.address, self.finished = address, 0
        self._needs = {"CPU": threads, "GPU": int(arch == "cuda")}
        self._counted, self._workers = -_COUNT_EVERY, 0
        self._ended = ""  # why there are no workers any more
        self._head = ""  # HOST:PORT

    def __enter__(self) -> RayWorkers:
        for name, value in _ENVIRONMENT.items():
            os.environ.setdefault(name, value)
        if self.address:
            _check_listens(self.address)
            os.environ.setdefault("RAY_NUM_REDIS_GET_RETRIES", "1")
            if _has_token():  # `ray start` demands it then; clusters without tokens ignore it
                os.environ.setdefault("RAY_AUTH_MODE", "token")
        self._ray = ray = imported("a cluster", "ray", "ray")
        # With `log_to_driver=False`, Ray still prints the deaths of machines to standard output.
        if (private := sys.modules.get("ray._private.worker")) is not None:
            vars(private)["print_to_stdstream"] = lambda *given, **more: None
        where: dict[str, Any] = {"address": self.address or "local"}
        if not self.address:
            where |= {"num_cpus": available_threads(), "include_dashboard": False}
        with _beginning():
            try:
                ray.init(**where, logging_level="ERROR", log_to_driver=False)
            except (Exception, SystemExit) as error:
                ray.shutdown()
                at, remedy = "Ray", ""
                if self.address:
                    at = f"the Ray cluster at {self.address!r}"
                    remedy = (
                        "; check it with `ray status`, and if it needs a token, set RAY_AUTH_MODE "
                        "to token, and RAY_AUTH_TOKEN to the one that `ray get-auth-token` prints "
                        "on the head"
                    )
                raise AntsError(f"cannot use {at} ({_first_line(error)}){remedy}.") from error
        try:
            self._check_machines()
        except BaseException:
            ray.shutdown()
            raise
        self._head = ray.get_runtime_context().gcs_address
        needs = {"num_cpus": self._needs["CPU"], "num_gpus": self._needs["GPU"]}
        # The study repeats what fails. A worker computes any number of blocks.
        self._task = ray.remote(**needs, max_retries=0, max_calls=0)(_call)
        return self

    def __exit__(self, *raised: object) -> None:
        self._ray.shutdown()

    def submit(self, call: Callable[..., Any], /, *arguments: Any) -> Future[Any]:
        """Return the future of a call in a worker."""
        if self._ended:
            raise BrokenExecutor(self._ended)
        given: Future[Any] = Future()
        given.set_running_or_notify_cancel()
        theirs = self._task.remote(pickle.dumps((call, arguments), -1)).future()
        theirs.add_done_callback(partial(self._pass_on, given))
        return given

    @property
    def num_workers(self) -> int:
        """The number of workers for which the machines that are alive have room.

        Raises:
            LostWorkersError: The head of the cluster has died. Ray itself would end this process a
                minute later, without a message.
        """
        if time.monotonic() - self._counted >= _COUNT_EVERY:
            self._check_head()
            self._counted = time.monotonic()
            self._workers = sum(self._room(node["Resources"]) for node in self._alive())
        return self._workers

    def state(self) -> str:
        """Return the numbers of workers and of finished calls, for progress bars."""
        return f"{count(self._workers, 'worker')}, {count(self.finished, 'block')}"

    def _check_head(self) -> None:
        """Raise LostWorkersError if the head of the cluster, once it is known, does not listen."""
        if not self._head:
            return
        with suppress(AntsError):
            return _check_listens(self._head)
        time.sleep(_WAIT)
        try:
            _check_listens(self._head)
        except AntsError as error:
            raise LostWorkersError(
                f"the head of the Ray cluster at {self._head!r} does not listen any more; {RESUME}."
            ) from error

    def _alive(self) -> list[dict[str, Any]]:
        return [node for node in self._ray.nodes() if node["Alive"]]

    def _room(self, resources: dict[str, float]) -> int:
        """Return the number of workers on a machine."""
        return min(int(resources.get(name, 0) // n) for name, n in self._needs.items() if n)

    def _check_machines(self) -> None:
        """Raise AntsError if there is no room for a worker, or a machine has other versions."""
        if not self.num_workers:
            needs = " and ".join(count(n, name) for name, n in self._needs.items() if n)
            raise AntsError(
                f"no machine of the Ray cluster has {needs} for a worker; choose another --threads "
                "or --arch, or add machines."
            )
        if not self.address:
            return
        from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

        asked = {}
        look = self._ray.remote(num_cpus=0, max_retries=0)(_versions)
        for node in self._alive():
            if self._room(node["Resources"]):
                on = NodeAffinitySchedulingStrategy(node["NodeID"], soft=False)
                asked[look.options(scheduling_strategy=on).remote()] = node["NodeManagerHostname"]
        done, _ = self._ray.wait(list(asked), num_returns=len(asked), timeout=_WAIT_FOR_WORKERS)
        for one in done:
            try:
                theirs = self._ray.get(one)
            except self._ray.exceptions.RayTaskError as error:
                raise AntsError(
                    f"{asked[one]!r}, a machine of the Ray cluster: {_cause_of(error)}"
                ) from error
            except self._ray.exceptions.RayError:
                continue  # it has died
            machine = f"{asked[one]!r}, a machine of the Ray cluster,"
            check_versions(executors.versions(), theirs, machine)

    def _pass_on(self, given: Future[Any], theirs: Future[Any]) -> None:
        """Give the outcome of Ray's future to the one that `submit` has returned."""
        try:
            outcome = pickle.loads(theirs.result())
            self.finished += 1
            given.set_result(outcome)
        except self._ray.exceptions.RayTaskError as error:  # its text contains a traceback
            given.set_exception(_cause_of(error))
        except self._ray.exceptions.RayError as error:
            why = f"{type(error).__name__}: {_first_line(error)}"
            if isinstance(error, self._ray.exceptions.LocalRayletDiedError):
                self._ended = "Ray has ended on this machine"
            given.set_exception(BrokenExecutor(why))
        except Exception as error:  # the outcome cannot be read
            given.set_exception(error)


def _versions() -> tuple[str, str]:
    return executors.versions()  # of the worker


def _call(pickled: bytes) -> bytes:
    """Return the pickled result of a pickled call; this is what workers run."""
    call, arguments = pickle.loads(pickled)
    return pickle.dumps(call(*arguments), -1)


def _has_token() -> bool:
    """Return whether this machine has a token of Ray, by which clusters know their users."""
    if {"RAY_AUTH_TOKEN", "RAY_AUTH_TOKEN_PATH"} & os.environ.keys():
        return True
    return Path("~/.ray/auth_token").expanduser().exists()


def _check_listens(address: str) -> None:
    """Raise AntsError unless a server like Ray's listens at HOST:PORT."""
    host, _, port = address.rpartition(":")
    try:
        with socket.create_connection((host.strip("[]"), int(port)), timeout=_WAIT) as connection:
            if os.environ.get("RAY_USE_TLS", "0") != "0":
                return  # it first expects certificates
            connection.sendall(_HELLO)
            header = connection.recv(9)
    except OSError as error:
        why = error.strerror or str(error) or type(error).__name__
        raise AntsError(
            f"no Ray cluster listens at {address!r} ({why}); give the address that `ray start` has "
            "printed, or --ray alone to use this machine."
        ) from error
    if header[3:4] != bytes([_SETTINGS]):
        raise AntsError(
            f"the program that listens at {address!r} is not Ray; give the address that `ray "
            "start` has printed, or --ray alone to use this machine."
        )


@contextmanager
def _beginning() -> Iterator[None]:
    """Discard what Ray prints when it starts, and restore what SIGTERM does."""
    before, errors = signal.getsignal(signal.SIGTERM), os.dup(2)
    nothing = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nothing, 2)  # its library in C++ prints that it prints only fatal errors
        yield
    finally:
        os.dup2(errors, 2)
        os.close(errors)
        os.close(nothing)
        with suppress(ValueError):  # this is not the main thread
            signal.signal(signal.SIGTERM, before)


def _cause_of(error: Any) -> Exception:
    """Return the exception of a call that failed in a worker, without Ray's text."""
    if error.cause is None:
        return RuntimeError(_last_line(error))
    if "failed to import on the worker" in str(error.cause):
        return AntsError(
            f"a worker cannot import this version of taichi_ants ({_last_line(error)}); install it "
            "there."
        )
    return error.cause


def _first_line(error: BaseException) -> str:
    lines = str(error).strip().splitlines() or [type(error).__name__]
    return lines[0].strip().rstrip(".:")


def _last_line(error: BaseException) -> str:
    lines = str(error).strip().splitlines() or [type(error).__name__]
    return lines[-1].strip().rstrip(".:")
