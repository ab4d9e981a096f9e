"""Blocks by executors of all kinds: the same results, whatever happens to the workers."""

import os
import pickle
import re
import subprocess
import sys
import time
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_lines import environment, promptly

from taichi_ants import PHYSICS, AntsError, TrainingConfig
from taichi_ants.studies import executors, plugins
from taichi_ants.studies.executors import TRIES, LostWorkersError, Workers, completed, run_pickled
from taichi_ants.studies.points import ColonyPoint, Drawn, RunPoint
from taichi_ants.studies.store import Store
from taichi_ants.studies.study import FailedBlocksError, Study, run
from taichi_ants.task import Life, Task
from taichi_ants.worlds import paper

SARSA = TrainingConfig("sarsa", 0.1, 0.9, 0.3, 0.99)
LIVELY = Task(delivery="truncates", evaporation_in_training=True, life=Life(regrowth=0))
SEEDS = (3, 5, 8, 1)
DRAWN = Drawn.by("open", ranges=(12, 12, 12))
ALONE = ColonyPoint(DRAWN, LIVELY, SARSA, episodes=2, ticks=60, rollouts=2)
COLONIES = Study((ALONE, replace(ALONE, ants=4, episodes=0, after=ALONE)), SEEDS, ("deliveries",))
RUNS = Study(
    tuple(RunPoint(paper(), Task(), replace(SARSA, epsilon=e), 6, 80, 3) for e in (0.1, 0.3)),
    *(SEEDS, ("returns", "q_values")),
)


def outcome(study, folder, **how):
    run(study, store := Store(folder), **how)
    return store.read(study.keys, study.seeds, study.arrays)


def same(one, other):
    return one.keys() == other.keys() and all(
        np.array_equal(array, other[name]) and array.dtype == other[name].dtype
        for name, array in one.items()
    )


def files_in(folder):
    return list((folder / "blocks").iterdir())


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


@pytest.mark.parametrize("study", [COLONIES, RUNS], ids=["colonies", "runs"])
def test_pickled_blocks_have_the_same_outcomes(study, tmp_path):
    executor, shares = Here(), []
    plain = outcome(study, tmp_path / "plain")
    assert same(plain, outcome(study, tmp_path, progress=shares.append, executor=executor))
    assert executor.calls == len(files_in(tmp_path))
    assert shares[0] == 0
    assert shares[-1] == pytest.approx(1)
    again = executor.calls
    assert same(plain, outcome(study, tmp_path, executor=executor))
    assert executor.calls == again  # nothing is missing


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


@pytest.mark.slow
def test_the_calls_of_a_dead_worker_are_lost_and_no_others(tmp_path):
    """And workers end when their executor does, or fails."""
    with pytest.raises(AntsError, match=r"^workers is 0; it must lie between 1 and"):
        Workers(0)
    with Workers(2) as workers:
        first, other = workers.submit(os.getpid), workers.submit(os.getpid)
        assert first.result() != other.result()
        dies, stays = workers.submit(os.kill, first.result(), 9), workers.submit(time.sleep, 0.5)
        assert isinstance(dies.exception(), BrokenProcessPool)
        assert stays.result() is None
        new = [workers.submit(os.getpid).result() for _ in range(2)]
        assert first.result() not in new
    began, workers = time.monotonic(), Workers(1)
    pid = workers.submit(os.getpid).result()
    workers.submit(time.sleep, 100)
    workers.__exit__(KeyError)
    while Path(f"/proc/{pid}").exists():
        assert time.monotonic() - began < promptly()
        time.sleep(0.05)


ONE_KERNEL = """
import sys
import numpy as np
from taichi_ants.rendering.rasteriser import draw_marks, marks
from taichi_ants.studies.command_line import run_command
from taichi_ants.studies.executors import Workers

frame, mark = np.zeros((9, 9, 3), np.uint8), marks((4, 4), 3, 0, 0)
if sys.argv[1] == "worker":
    with Workers(1) as workers:
        workers.submit(draw_marks, frame, mark).result()
else:
    run_command(lambda: draw_marks(frame, mark))
"""


@pytest.mark.parametrize("process", ["worker 1", "worker 2", "command 2"])
def test_a_process_saves_its_kernels(process, tmp_path):
    name, threads = process.split()  # with one, a worker is a fork on Linux
    given = environment(tmp_path, OPENBLAS_NUM_THREADS=threads)
    subprocess.run([sys.executable, "-c", ONE_KERNEL, name], env=given, check=True)
    assert len([*tmp_path.rglob("*.tic")]) == 1


def test_workers_can_be_threads_of_this_process(tmp_path, monkeypatch):
    """Taichi serves one of them at a time."""
    monkeypatch.setattr(RunPoint, "runs_of_a_block", 2)
    plain, busy, most = outcome(RUNS, tmp_path / "plain"), [], []

    def notes(*_):
        busy.append(1)
        most.append(len(busy))
        time.sleep(0.02)  # for others to come, if they can
        busy.pop()

    monkeypatch.setattr(executors, "load_code", notes)
    with ThreadPoolExecutor(4) as executor:
        assert same(plain, outcome(RUNS, tmp_path / "other", executor=executor))
    assert len(most) > 2
    assert max(most) == 1


def block_of(work):
    """The points and seeds of pickled work."""
    return work.args[:2]


def test_a_block_that_fails_is_named_and_the_others_are_done(tmp_path, monkeypatch):
    monkeypatch.setattr(RunPoint, "runs_of_a_block", 2)

    def fails(work, n):
        points, seeds = block_of(work)
        return KeyError("x") if points[0].training.epsilon == 0.3 and 8 in seeds else None

    executor = Fails(fails)
    with pytest.raises(FailedBlocksError) as caught:
        run(RUNS, Store(tmp_path), executor=executor)
    assert str(caught.value) == (
        "1 block failed: training.epsilon 0.3, seeds 8 to 1 (KeyError: 'x'); all others are saved, "
        "so correct the cause and run the same command again, or with another --out if you change "
        "a plugin."
    )
    assert executor.calls == 4
    assert len(files_in(tmp_path)) == 3


@pytest.mark.parametrize("fails", ["one", "all"])
def test_a_block_at_which_all_workers_die_is_named(fails, tmp_path, monkeypatch):
    monkeypatch.setattr(RunPoint, "runs_of_a_block", 2)
    died = BrokenProcessPool("A process in the process pool was terminated abruptly")
    executor = Fails(lambda work, n: died if fails == "all" or 8 in block_of(work)[1] else None)
    with pytest.raises(AntsError) as caught:
        run(RUNS, Store(tmp_path), executor=executor)
    assert caught.value.exit_status == 1
    assert f"{TRIES} workers died at it, perhaps because memory was" in str(caught.value)
    assert ("2 blocks failed: " in str(caught.value)) == (fails == "one")
    assert "(for the same reason)" in str(caught.value)
    if fails == "one":
        assert executor.calls == len(files_in(tmp_path)) + 2 * TRIES
    assert "abruptly" not in str(caught.value)


def test_an_executor_that_takes_no_more_work_ends_the_study(tmp_path):
    class Broken:
        def submit(self, *_):
            raise BrokenProcessPool("no more")

    with pytest.raises(
        LostWorkersError, match=r"no more work \(BrokenProcessPool: no more\); fini"
    ):
        run(RUNS, Store(tmp_path), executor=Broken())


def test_copies_whose_training_failed_wait_for_it(tmp_path, monkeypatch):
    monkeypatch.setattr(ColonyPoint, "runs_of_a_block", 1)

    def fails(work, n):
        points, seeds = block_of(work)
        return OSError("full") if points[0].episodes and 8 in seeds else None

    with pytest.raises(FailedBlocksError, match=r"^1 block failed: seed 8 \(OSError: full\)"):
        run(COLONIES, Store(tmp_path), executor=Fails(fails))
    assert len(files_in(tmp_path)) == 3


def test_a_study_of_which_nothing_succeeds_ends_early(tmp_path, monkeypatch):
    monkeypatch.setattr(RunPoint, "runs_of_a_block", 1)
    executor = Fails(lambda work, n: AntsError("no good"))
    with pytest.raises(AntsError, match="no good"):
        run(RUNS, Store(tmp_path), executor=executor)
    assert executor.calls < 8


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
    works = completed(range(50), lambda n: taken.append(n) or n, executor)
    next(works)
    assert len(taken) <= 4
    assert len(list(works)) == 49
    assert executor.most <= 4


def test_workers_of_another_version_are_refused():
    theirs = f"taichi_ants 0.0.1 (physics {PHYSICS}) and Python 3.8"
    with pytest.raises(AntsError, match=f"{re.escape(theirs)}, but a worker has taichi_ants"):
        run_pickled(theirs, (), pickle.dumps(None))


def test_a_plugin_travels_as_text(monkeypatch):
    monkeypatch.setattr(plugins, "_loaded", {})
    text = b"import beside_it, pathlib\npathlib.Path(__file__).with_name('ran').touch()\n"
    plugin = {"here/plugin_that_travels.py": text, "here/beside_it.py": b"VALUE = 1\n"}
    assert run_pickled(executors.versions(), (plugin,), pickle.dumps(dict)) == {}
    assert Path(plugins._folders[-1].name, "ran").exists()
    changed = {**plugin, "here/beside_it.py": b"VALUE = 2\n"}
    with pytest.raises(AntsError, match=r"another file 'plugin_that_travels\.py'"):
        run_pickled(executors.versions(), (changed,), pickle.dumps(dict))
