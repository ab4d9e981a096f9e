"""The rows of baselines.csv."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from paper.baselines import bound_rows, policy_rows

from taichi_ants import evaluate
from taichi_ants.analysis import bounds as exact_bounds
from taichi_ants.learners.policies import random_policy, trail_follower
from taichi_ants.task import Rewards, Task
from taichi_ants.worlds import paper
from taichi_ants.worlds.world import World


def test_the_rows_of_the_world_of_the_paper() -> None:
    rows = bound_rows(paper(), Task()) + policy_rows(paper(), Task(), evaluate, [3, 4], 2)
    assert all(row.note for row in rows)
    figures = [row[:5] for row in rows if row.baseline != "random policy"]
    assert figures == [
        ("shortest delivery", None, 45, 34, 1),
        ("optimal policy", 0.9, 45, 34, 1),
        ("optimal policy", 0.99, 476, 600, 0),
        ("trail follower", None, 45, 34, 1),
    ]
    assert [row.baseline for row in rows].count("random policy") == 1


def test_policies_are_evaluated_as_in_training_with_one_table_for_each_seed() -> None:
    calls = []

    def record(world: World, q_values: np.ndarray, **options: Any) -> SimpleNamespace:
        calls.append((q_values, options))
        shape = (3, 2)
        # Per seed the means are 1, 2 and 6.
        returns = np.array([[0, 2], [2, 2], [5, 7]])
        return SimpleNamespace(returns=returns, steps=np.full(shape, 9), deliveries=np.eye(3, 2))

    task = Task("five_cells", rewards=Rewards(deliver=77))
    rows = policy_rows(paper(), task, record, range(5, 8), rollouts=2, max_steps=77)
    for (q_values, options), policy in zip(calls, (random_policy(), trail_follower()), strict=True):
        np.testing.assert_array_equal(q_values, np.stack([policy] * 3))
        assert options == {
            "rollouts": 2,
            "max_steps": 77,
            "task": Task(rewards=task.rewards, evaporation_in_evaluation=False),
            "seeds": [5, 6, 7],
        }
    for row in rows:
        assert row.return_mean == 3
        assert row.steps_mean == 9
        assert row.deliveries_mean == pytest.approx(1 / 3)


def test_all_baselines_are_paid_what_the_task_pays() -> None:
    task = Task(rewards=Rewards(empty=0, failed=-1, shaping=2, pick_up=30, deliver=100))
    rows = bound_rows(paper(), task, (0.9,)) + policy_rows(paper(), task, evaluate, [0], 1)
    returns = {row.return_mean for row in rows if row.baseline != "random policy"}
    assert returns == {32 * 2 + 30 + 100}


def test_of_a_world_that_is_too_large_no_bounds_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exact_bounds, "MAX_STATES", 100)
    [row] = bound_rows(paper(), Task(), max_steps=40)
    assert row.baseline == "exact bounds"
    assert "use a smaller world" in row.note
    assert row.return_mean is None
