"""Offline learners equal the reference, and do what their methods promise."""

import numpy as np
import plain_offline as plain
import pytest
from plain_offline import episodes_of, random_data
from random_worlds import random_world

from taichi_ants import (
    Dataset,
    Task,
    TrainingConfig,
    evaluate,
    load_policy,
    record,
    save_policy,
    train,
    worlds,
)
from taichi_ants.offline.dataset import COLUMNS
from taichi_ants.offline.learners import (
    EmpiricalModel,
    batch_q_learning,
    fitted_q_iteration,
    pessimistic_q_iteration,
    tolerance,
)


@pytest.mark.parametrize("seed", range(3))
def test_all_equal_the_reference(seed):
    """Of all data, and of each run."""
    data = random_data(random_world(seed), seed)
    parts = [data, data.of_run(0), data.of_run(1)]
    batch = [batch_q_learning(one, 0.95, 0.3, 3, 0.5) for one in parts]
    fitted = [fitted_q_iteration(one, 0.95, 0.5) for one in parts]
    careful = [pessimistic_q_iteration(one, 0.95, 0.7) for one in parts]
    for k, one in enumerate(parts):
        steps = episodes_of(one), 128, 0.95
        assert np.array_equal(batch[k], plain.batch_q_learning(*steps, 0.3, 3, 0.5))
        best = plain.q_iteration(*steps, 0.5, tolerance(10, 0.95, 0.5))
        assert np.array_equal(fitted[k], best.astype(np.float32))
        lowest = -1 / (1 - 0.95)
        near = tolerance(10, 0.95, lowest)
        low = plain.q_iteration(*steps, lowest, near, penalty=0.7, lowest=lowest)
        assert np.array_equal(careful[k], low.astype(np.float32))
    by_run = [batch_q_learning(data, 0.95, 0.3, 3, 0.5, by_run=True)]
    by_run += [fitted_q_iteration(data, 0.95, 0.5, by_run=True)]
    by_run += [pessimistic_q_iteration(data, 0.95, 0.7, by_run=True)]
    for tables, several in zip(by_run, (batch, fitted, careful), strict=True):
        assert np.array_equal(tables, several[1:])


def test_the_values_of_a_policy_equal_the_reference():
    data = random_data(random_world(3), 3)
    policy = np.random.default_rng(0).dirichlet(np.ones(5), 128)
    times = np.array([[1] * 12, [2, 0, 0, 1, 3, 0, 1, 1, 1, 1, 2, 0]], np.uint8)
    model = EmpiricalModel.of(data, times)
    ours = model.solve(0.9, model.rewards, 0.25, policy)
    steps = episodes_of(data)
    for k, counts in enumerate(times):
        drawn = [one for one, n in zip(steps, counts, strict=True) for _ in range(n)]
        near = tolerance(10, 0.9, 0.25)
        assert np.array_equal(ours[k], plain.q_iteration(drawn, 128, 0.9, 0.25, near, policy))


def by_hand(rows, task=None) -> Dataset:
    """Transitions (state, action, reward, next state, terminated), each an episode of its own."""
    state, action, reward, next_state, terminated = map(np.array, zip(*rows, strict=True))
    n = len(rows)
    columns = {
        **dict.fromkeys(("run", "agent", "step"), np.zeros(n)),
        **{"episode": np.arange(n), "state": state, "action": action, "reward": reward},
        **{"next_state": next_state, "terminated": terminated, "truncated": ~terminated},
        "behaviour_probability": np.full(n, 0.2),
    }
    columns = {name: columns[name].astype(kind) for name, kind in COLUMNS.items()}
    return Dataset(worlds.paper(), task or Task(), (0,), {}, **columns)


CHAIN = [(0, 1, 0, 1, False)] * 3 + [(0, 1, 4, 2, False), (1, 4, 10, 7, True), (2, 0, -1, 2, False)]


def test_values_worked_by_hand():
    """One in four leads from 0 to 2, where the ant stays for ever, the others to the end."""
    q = fitted_q_iteration(by_hand(CHAIN), 0.5)
    assert q[1, 4] == 10
    # In 2 the other actions are unknown, and 0 is better than -1 for ever.
    assert q[2].tolist() == [-1, 0, 0, 0, 0]
    assert q[0, 1] == pytest.approx(1 + 0.5 * (0.75 * 10 + 0.25 * 0))
    q = pessimistic_q_iteration(by_hand(CHAIN), 0.5, penalty=2)
    assert q[1].tolist() == [-2, -2, -2, -2, 8]
    assert q[2].tolist() == [-2] * 5
    assert q[0, 1] == pytest.approx(1 - 2 / 2 + 0.5 * (0.75 * 8 + 0.25 * -2))
    # Two sweeps: only in the second does 0 know of the 10.
    q = batch_q_learning(by_hand(CHAIN[2:]), 0.5, 1.0, 1)
    assert q[0, 1] == 4
    assert batch_q_learning(by_hand([CHAIN[0], CHAIN[4]]), 0.5, 1.0, 2)[0, 1] == 5


def test_what_is_learned_from_random_ants_delivers(tmp_path):
    """A policy file of it acts in the world."""
    still = Task(evaporation_in_evaluation=False)
    data = record(worlds.paper(), None, 250, 0, task=still)
    q_values = pessimistic_q_iteration(data)
    save_policy(tmp_path / "offline.npz", q_values, {"data": data.behaviour})
    outcome = evaluate(worlds.paper(), load_policy(tmp_path / "offline.npz").q_values, task=still)
    assert outcome.deliveries.all()
    assert outcome.steps.max() <= 40


def test_one_sweep_over_a_learners_history_is_what_it_learned_online():
    config = TrainingConfig("q_learning", 0.1, 0.9, 0.3, 0.99)
    data = record(worlds.paper(), config, 30, range(3))
    offline = batch_q_learning(data, 0.9, 0.1, sweeps=1, by_run=True)
    assert np.array_equal(offline, train(worlds.paper(), config, range(3), 30).q_values[0])
