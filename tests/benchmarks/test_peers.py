"""Peers that train in the paper's world train as we do; the command and what it writes."""

from __future__ import annotations

import numpy as np
import pytest
from systems import numpy_runs

from taichi_ants import Task, TrainingConfig, train, worlds
from taichi_ants.engines.runs.training import trace_training
from taichi_ants.task.constants import Event

# They learn soon, so that deliveries and long episodes both occur.
CONFIGS = [
    TrainingConfig("q_learning", 0.3, 0.9, 0.3, 0.9),
    TrainingConfig("q_learning", 0.1, 0.99, 0.5, 0.95),
]
SEEDS, EPISODES, STEPS = 60, 40, 150
TRUNCATES = "truncates"


@pytest.fixture(scope="module")
def ours():
    given = worlds.paper(), CONFIGS, range(SEEDS), EPISODES, STEPS
    result = train(*given, Task(delivery=TRUNCATES))
    assert 0.2 < result.deliveries.mean() < 0.9
    return [values.reshape(-1, EPISODES) for values in (result.returns, result.steps)]


def assert_distributed_alike(ours, theirs):
    for expected, given in zip(ours, theirs, strict=True):
        for some in (slice(0, SEEDS), slice(SEEDS, None)):
            for part in (slice(0, 10), slice(10, None)):  # before and after most is learned
                a, b = expected[some, part].mean(axis=1), given[some, part].mean(axis=1)
                error = np.sqrt((a.var(ddof=1) + b.var(ddof=1)) / SEEDS)
                assert abs(a.mean() - b.mean()) < 3.5 * error


@pytest.fixture(scope="module")
def trace():
    """Forty episodes of one run: what it sees and does, and its table after each step."""
    made = trace_training(worlds.paper(), CONFIGS[0], 3, EPISODES, STEPS, Task(delivery=TRUNCATES))
    assert (made.events == Event.DELIVERED).sum() > 5
    return made


def test_numpy_steps_as_we_do(trace):
    run = numpy_runs.NumpyRuns(CONFIGS[:1], 1, STEPS)
    for state, action, table in zip(trace.states, trace.actions, trace.tables, strict=True):
        assert run.row[0] == state
        run.learn(np.array([action]))
        assert np.allclose(run.q, table, rtol=1e-4, atol=1e-4)
    returns = np.bincount(trace.episodes, trace.rewards)
    assert [int(returned[0]) for _, returned, _ in run.ended] == returns.tolist()


def test_numpy_trains_as_we_do(ours):
    assert_distributed_alike(ours, numpy_runs.train(CONFIGS, SEEDS, EPISODES, STEPS))


@pytest.mark.slow
@pytest.mark.parametrize("parallel", [False, True])
def test_numba_gives_the_same_runs(ours, parallel):
    pytest.importorskip("numba")
    from systems import numba_runs

    theirs = numba_runs.train(CONFIGS, SEEDS, EPISODES, STEPS, parallel)
    assert all(map(np.array_equal, ours, theirs))
