"""Tables of rewards: what they may hold, and that nothing is recognised by its reward."""

from __future__ import annotations

import pytest
from random_rewards import TELLING

from taichi_ants import Colony, Task, TrainingConfig, rollout
from taichi_ants.learners.policies import trail_follower
from taichi_ants.worlds import paper


@pytest.mark.parametrize("table", TELLING)
def test_runs_pay_by_the_table_and_count_deliveries_only(table):
    """The shortest delivery: 32 steps on trail or towards the queen, a pick-up, a give."""
    task, follower = Task(rewards=table), trail_follower()
    total = 32 * table.shaping + table.pick_up + table.deliver
    trace = rollout(paper(), follower, task=task)
    assert (len(trace), trace.delivered.nonzero()[0].tolist()) == (34, [33])
    assert trace.rewards.sum() == total
    training = TrainingConfig("q_learning", 0.1, 0.9, 0.0, 1.0)
    colony = Colony(paper(), task, training, sharing="frozen", q_values=follower)
    colony.begin_episode()
    colony.tick(34)
    outcome = colony.outcome()
    assert (outcome.deliveries[0, 0], outcome.first_delivery[0, 0]) == (1, 34)
    assert outcome.returns[0, 0] == total
