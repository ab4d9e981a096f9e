"""Tables of rewards: what they may hold, and that nothing is recognised by its reward."""

from __future__ import annotations

import pytest
from random_rewards import TELLING

from taichi_ants import Colony, Task, TrainingConfig, rollout
from taichi_ants.learners.policies import trail_follower
from taichi_ants.worlds import paper


@pytest.mark.parametrize("table", TELLING)
def test_an_episode_pays_by_the_table_and_ends_with_the_delivery(table):
    """The shortest delivery: 32 steps on trail or towards the queen, a pick-up, a give."""
    trace = rollout(paper(), trail_follower(), task=Task(rewards=table))
    assert (len(trace), trace.delivered.nonzero()[0].tolist()) == (34, [33])
    assert trace.rewards.sum() == 32 * table.shaping + table.pick_up + table.deliver


@pytest.mark.parametrize("table", TELLING)
def test_a_colony_pays_by_the_table_and_counts_gives_only(table):
    training = TrainingConfig("q_learning", 0.1, 0.9, 0.0, 1.0)
    colony = Colony(
        paper(), Task(rewards=table), training, sharing="frozen", q_values=trail_follower()
    )
    colony.begin_episode()
    colony.tick(34)
    outcome = colony.outcome()
    assert (outcome.deliveries[0, 0], outcome.first_delivery[0, 0]) == (1, 34)
    assert outcome.returns[0, 0] == 32 * table.shaping + table.pick_up + table.deliver
