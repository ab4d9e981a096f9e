"""Tables of rewards: what they may hold, and that nothing is recognised by its reward."""

from __future__ import annotations

import numpy as np
import pytest
from random_rewards import TELLING

from taichi_ants import AntsError, Colony, Task, TrainingConfig, rollout, train
from taichi_ants.learners.policies import trail_follower
from taichi_ants.task.constants import MOST_REWARD
from taichi_ants.task.rewards import Rewards
from taichi_ants.worlds import paper


def test_the_papers_table_by_event():
    assert Rewards().by_event().tolist() == [0, 0, -1, 1, 3, 10, -1, 0]
    assert Rewards().by_event().dtype == np.int32


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


def test_returns_fit_into_their_integers():
    config = TrainingConfig("q_learning", 0.1, 0.9, 0.0, 1.0)
    with pytest.raises(AntsError, match="max_steps is 10000000; it must lie between 1 and 2147483"):
        train(paper(), config, 0, 1, 10_000_000, Task(rewards=Rewards(deliver=MOST_REWARD)))
