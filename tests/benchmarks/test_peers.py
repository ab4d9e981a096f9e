"""Peers train in the paper's world as we do, and the soak finds faults put into a colony."""

import numpy as np
import pytest
import soak
from systems import numpy_runs

from taichi_ants import Task, TrainingConfig, train, worlds
from taichi_ants.engines.colony.layout import WorldRow
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


@pytest.mark.slow
def test_numba_gives_the_same_runs(ours):
    pytest.importorskip("numba")
    from systems import numba_runs

    theirs = numba_runs.train(CONFIGS, SEEDS, EPISODES, STEPS, parallel=True)
    assert all(map(np.array_equal, ours, theirs))


@pytest.mark.slow
def test_faults_are_found():
    colony = soak.new_colony("paper", 200)
    colony.tick(100)
    assert soak.faults(colony) == []
    colony.arrays["cell"][0] = colony.arrays["cell"][1]
    colony.arrays["worlds"][WorldRow.LIVING, 0] -= 1
    assert {"ants share a cell", "ants were lost"} <= set(soak.faults(colony))
