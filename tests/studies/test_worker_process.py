"""A second process that does calls: in order, whole, and where it cannot, they are done here."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest
from command_lines import promptly

from taichi_ants import evaluate
from taichi_ants.errors import AntsError
from taichi_ants.learners.policies import random_policy
from taichi_ants.studies import worker_process as module
from taichi_ants.studies.worker_process import WorkerProcess
from taichi_ants.worlds import build

several = pytest.mark.skipif(
    module.available_threads() < 2, reason="there is a second process on several processors only"
)


@several
def test_calls_are_done_in_another_process_one_after_the_other() -> None:
    with WorkerProcess() as worker:
        first, changes = worker.begin(os.getpid), worker.begin(os.putenv, "NAME", "value")
        second, sums = worker.begin(os.getpid), worker.begin(np.add, np.arange(100_000), 1)
        assert first() == second() != os.getpid()
        assert changes() is None
        np.testing.assert_array_equal(sums(), np.arange(1, 100_001))
        assert first() == first()  # asked again


@several
def test_what_is_printed_there_is_no_answer(capfd: pytest.CaptureFixture[str]) -> None:
    with WorkerProcess() as worker:
        assert worker.begin(print, "hello")() is None
        assert worker.begin(os.system, "echo hello")() == 0
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("second", [False, True])
def test_what_a_call_raises_is_raised_here(second: bool) -> None:
    with WorkerProcess(second) as worker:
        wrong, right = worker.begin(build, "no such world"), worker.begin(build, "paper")
        with pytest.raises(AntsError, match="no such world"):
            wrong()
        assert right() == build("paper")


def test_without_a_second_process_calls_are_done_here() -> None:
    with WorkerProcess(second=False) as worker:
        assert worker.begin(os.getpid)() == os.getpid()


def test_what_cannot_be_sent_is_done_here() -> None:
    with WorkerProcess() as worker:
        assert worker.begin(lambda: os.getpid())() == os.getpid()
        assert worker.begin(_known_here_alone)() == os.getpid()


def _known_here_alone() -> int:
    return os.getpid()


def test_where_no_process_can_be_started_calls_are_done_here(monkeypatch) -> None:
    for program in ("/no/such/program", "/bin/false", ""):
        monkeypatch.setattr(module.sys, "executable", program)
        with WorkerProcess() as worker:
            assert worker.begin(os.getpid)() == os.getpid()


@several
def test_a_process_that_ends_loses_no_call() -> None:
    with WorkerProcess() as worker:
        other = worker.begin(os.getpid)()
        ended, after = worker.begin(os.kill, other, signal.SIGKILL), worker.begin(os.getpid)
        assert ended() is None
        assert after() == os.getpid()
        assert worker.begin(os.getpid)() == os.getpid()


@several
def test_it_ends_when_nothing_more_will_begin() -> None:
    with WorkerProcess() as worker:
        other, late = worker.begin(os.getpid), worker.begin(time.sleep, 0.1)
        worker.finish()
        after = worker.begin(os.getpid)
        assert other() != os.getpid()
        assert late() is None
        assert after() == os.getpid()


@several
def test_an_error_ends_it_at_once() -> None:
    others = []

    def fail() -> None:
        with WorkerProcess() as worker:
            others.append(worker.begin(os.getpid)())
            for _ in range(2):
                worker.begin(time.sleep, 60)
            raise KeyboardInterrupt

    began = time.perf_counter()
    with pytest.raises(KeyboardInterrupt):
        fail()
    assert time.perf_counter() - began < promptly()
    with pytest.raises(ProcessLookupError):
        os.kill(others[0], 0)


@several
def test_it_ends_with_the_block_and_keeps_what_it_has_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TI_OFFLINE_CACHE_FILE_PATH", str(tmp_path))
    with WorkerProcess() as worker:
        other = worker.begin(os.getpid)()
        worker.begin(evaluate, build("paper"), random_policy(), 1)()
    with pytest.raises(ProcessLookupError):
        os.kill(other, 0)
    assert list(tmp_path.rglob("*.tic"))
    assert not list(tmp_path.rglob("*.lock"))
