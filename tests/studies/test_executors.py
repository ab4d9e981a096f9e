"""Blocks by executors of all kinds: the same results, whatever happens to the workers."""

from __future__ import annotations

import os
import pickle
import signal
import time
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from taichi_ants import AntsError, TrainingConfig
from taichi_ants.studies import executors
from taichi_ants.studies.executors import TRIES, LocalWorkers, Work, completed, do
from taichi_ants.studies.points import ColonyPoint, RunPoint
from taichi_ants.studies.runner import FailedBlocksError, Study
from taichi_ants.task import Life, Task
from taichi_ants.worlds import open_world, paper

SARSA = TrainingConfig("sarsa", 0.1, 0.9, 0.3, 0.99)
LIVELY = Task(delivery="truncates", evaporation_in_training=True, life=Life(regrowth=0))
SEEDS = (3, 5, 8, 1)
WORLDS = tuple(open_world(seed, (12, 12, 12)) for seed in SEEDS)
ALONE = ColonyPoint(WORLDS, LIVELY, SARSA, episodes=2, ticks=60, rollouts=2)
COLONIES = Study((ALONE, replace(ALONE, ants=4, episodes=0, after=ALONE)), SEEDS)
RUNS = Study(
    tuple(RunPoint(paper(), Task(), replace(SARSA, epsilon=e), 6, 80, 3) for e in (0.1, 0.3)), SEEDS
)


class Here:
    """An executor that runs a call at once, as mean as one far away: in a new process each time."""

    num_workers = 1

    def __init__(self):
        self.calls = 0

    def submit(self, call, *arguments):
        self.calls += 1
        future = Future()
        call, arguments = pickle.loads(pickle.dumps((call, arguments)))
        try:
            future.set_result(pickle.loads(pickle.dumps(call(*arguments))))
        except Exception as error:
            future.set_exception(error)
        return future


def same(one, other):
    assert one.keys() == other.keys()
    for point, arrays in one.items():
        assert arrays.keys() == other[point].keys()
        for name, array in arrays.items():
            if name != "seconds":
                np.testing.assert_array_equal(array, other[point][name])
                assert array.dtype == other[point][name].dtype
    return True


def folder(path: Path) -> Path:
    path.mkdir()
    return path


@pytest.mark.parametrize(
    "study",
    [COLONIES, pytest.param(RUNS, marks=pytest.mark.slow)],
    ids=["colonies", "runs"],
)
def test_pickled_blocks_have_the_same_outcomes(study, tmp_path):
    executor, shares = Here(), []
    plain = study.run(folder(tmp_path / "plain"))
    other = study.run(folder(tmp_path / "other"), shares.append, executor=executor)
    assert same(plain, other)
    assert executor.calls == len(list((tmp_path / "other").iterdir()))
    assert shares[0] == 0
    assert shares[-1] == pytest.approx(1)
    again = executor.calls
    assert same(plain, study.run(tmp_path / "other", executor=executor))
    assert executor.calls == again  # nothing is missing


def die_once(marker: str) -> int:
    """Kill this process, the first time."""
    if not os.path.exists(marker):
        Path(marker).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return os.getpid()


class Deadly(LocalWorkers):
    """Workers of which one dies before its first block."""

    def __init__(self, workers: int, marker: Path) -> None:
        super().__init__(workers)
        self.marker, self.calls = str(marker), 0

    def submit(self, call, *arguments):
        self.calls += 1
        return super().submit(_die_or_do, self.marker, arguments)


def _die_or_do(marker, arguments):
    die_once(marker)
    return do(*arguments)


@pytest.mark.slow
def test_a_killed_worker_process_costs_its_blocks_only(tmp_path, monkeypatch):
    plain = COLONIES.run(folder(tmp_path / "plain"))
    monkeypatch.setattr(ColonyPoint, "runs_of_a_block", 2)
    with Deadly(2, tmp_path / "died") as executor:
        other = COLONIES.run(folder(tmp_path / "other"), executor=executor)
    assert same(plain, other)
    assert (tmp_path / "died").exists()
    assert 4 < executor.calls <= 4 * TRIES


class Fails(Here):
    """An executor some of whose calls fail: those whose pickled work contains a text."""

    def __init__(self, fails):
        super().__init__()
        self.fails = fails

    def submit(self, call, *arguments):
        self.calls += 1
        future = Future()
        if (error := self.fails(pickle.loads(arguments[-1]), self.calls)) is not None:
            future.set_exception(error)
            return future
        self.calls -= 1
        return super().submit(call, *arguments)


def test_what_fails_now_and_then_is_tried_again(tmp_path):
    executor = Fails(lambda work, n: OSError("no memory") if n % TRIES else None)
    assert same(
        RUNS.run(folder(tmp_path / "a"), executor=executor), RUNS.run(folder(tmp_path / "b"))
    )


def test_numbers_of_workers_and_blocks_are_checked(tmp_path):
    with pytest.raises(AntsError, match=r"^workers is 0; it must lie between 1 and"):
        LocalWorkers(0)
    with pytest.raises(AntsError, match=r"^in_flight is 0; it must lie between 1 and"):
        RUNS.run(tmp_path, executor=Here(), in_flight=0)


def test_workers_can_be_threads_of_this_process(tmp_path, monkeypatch):
    """Taichi serves one of them at a time."""
    monkeypatch.setattr(RunPoint, "runs_of_a_block", 2)
    plain, busy, most = RUNS.run(folder(tmp_path / "plain")), [], []

    def notes(*_):
        busy.append(1)
        most.append(len(busy))
        time.sleep(0.02)  # for others to come, if they can
        busy.pop()

    monkeypatch.setattr(executors, "compile_once", notes)
    with ThreadPoolExecutor(4) as executor:
        assert same(plain, RUNS.run(folder(tmp_path / "other"), executor=executor))
    assert len(most) > 2
    assert max(most) == 1


def test_a_block_that_always_fails_is_named_and_the_others_are_done(tmp_path, monkeypatch):
    monkeypatch.setattr(RunPoint, "runs_of_a_block", 2)
    executor = Fails(
        lambda work, n: (
            KeyError("x") if work.points[0].training.epsilon == 0.3 and 8 in work.seeds else None
        )
    )
    with pytest.raises(FailedBlocksError) as caught:
        RUNS.run(tmp_path, executor=executor)
    assert str(caught.value) == (
        "1 block failed: training.epsilon 0.3, seeds 8 to 1 (KeyError: 'x'); all others are saved, "
        "so correct the cause and run the same command again, or with another --out if you change "
        "a plugin."
    )
    assert executor.calls == 3 + TRIES
    assert len(list(tmp_path.iterdir())) == 3


@pytest.mark.parametrize("fails", ["one", "all"])
def test_a_block_at_which_all_workers_die_is_named(fails, tmp_path, monkeypatch):
    monkeypatch.setattr(RunPoint, "runs_of_a_block", 2)
    died = BrokenProcessPool("A process in the process pool was terminated abruptly")
    executor = Fails(lambda work, n: died if fails == "all" or 8 in work.seeds else None)
    with pytest.raises(AntsError) as caught:
        RUNS.run(tmp_path, executor=executor)
    assert caught.value.exit_status == 1
    assert f"{TRIES} workers died at this block, perhaps because memory was" in str(caught.value)
    assert ("2 blocks failed: " in str(caught.value)) == (fails == "one")
    assert "abruptly" not in str(caught.value)


def test_points_whose_training_failed_are_left_out_and_no_others(tmp_path, monkeypatch):
    monkeypatch.setattr(ColonyPoint, "runs_of_a_block", 1)
    executor = Fails(
        lambda work, n: OSError("full") if work.points[0].episodes and 8 in work.seeds else None
    )
    with pytest.raises(FailedBlocksError, match=r"^1 block failed: .*, seed 8 \(OSError: full\)"):
        COLONIES.run(tmp_path, executor=executor)
    assert len(list(tmp_path.iterdir())) == 3 + 3


def test_a_study_of_which_nothing_succeeds_ends_with_the_error(tmp_path, monkeypatch):
    monkeypatch.setattr(RunPoint, "runs_of_a_block", 1)
    executor = Fails(lambda work, n: AntsError("no good"))
    with pytest.raises(AntsError, match="no good"):
        RUNS.run(tmp_path, executor=executor)
    assert executor.calls < 8 * TRIES


def test_few_blocks_are_in_flight():
    class Slow:
        num_workers = 2

        def __init__(self):
            self.pool, self.flying, self.most = ThreadPoolExecutor(2), set(), 0

        def submit(self, call, *arguments):
            self.flying = {one for one in self.flying if not one.done()}
            future = self.pool.submit(lambda: {"n": np.zeros(1)})
            self.flying.add(future)
            self.most = max(self.most, len(self.flying))
            return future

    taken, executor = [], Slow()
    works = completed((taken.append(n) or n for n in range(50)), lambda n: n, executor)
    next(works)
    assert len(taken) <= 4
    assert len(list(works)) == 49
    assert executor.most <= 4


def test_workers_of_another_version_are_refused():
    work = pickle.dumps(Work(RUNS.points[:1], (0,), None, None, {}))
    with pytest.raises(AntsError, match=r"taichi_ants 0\.0\.1 and Python 3\.8, but a worker has"):
        do(("0.0.1", "3.8"), (), work)


def test_a_plugin_travels_as_text(tmp_path, monkeypatch):
    monkeypatch.setattr(executors, "_loaded", {})
    text = b"import beside_it, pathlib\npathlib.Path(__file__).with_name('ran').touch()\n"
    plugin = {"here/plugin_that_travels.py": text, "here/beside_it.py": b"VALUE = 1\n"}
    work = pickle.dumps(Work(RUNS.points[:1], (0,), None, None, {}))
    do(executors.versions(), (plugin,), work)
    assert Path(executors._folders[-1].name, "ran").exists()
    with pytest.raises(AntsError, match=r"another plugin 'plugin_that_travels\.py'"):
        do(executors.versions(), ({**plugin, "here/beside_it.py": b"VALUE = 2\n"},), work)
