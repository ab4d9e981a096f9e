"""Training by the reference, in an episode of two steps worked out by hand.

    M   food, (1, 1, 0), ahead: heading 1
    A   the ant, at the origin
    Q   queen, (0, 0, 1), behind: heading 4

Step 0: the ant sees E F E, state 12. Picking up pays 3 and turns it round, to heading 4. It then
sees E Q E with food, state 64 + 12 = 76: the cells beside the queen are at distance 1, as the ant.
Step 1: giving pays 10. The ant then sees E O E without food, state 4; the trail lies on A and M,
out of view.

The tables below make these two actions the only best ones: with epsilon 0 the episode is certain.
Learning rate and discount are 1/2, so that all values are exact.
"""

from __future__ import annotations

import numpy as np
import pytest
from colonies import training
from plain_runs import train

from taichi_ants.reference import LEARNERS
from taichi_ants.task import Task
from taichi_ants.task.constants import GIVE, PICK_UP
from taichi_ants.worlds.world import World

TWO_STEPS = World((3, 3, 3), (0, 0, 1), foods=[(1, 1, 0)], ants=[((0, 0, 0), 1)])


def prepared(learning, task=None, rng_state=0):
    """A run to start from: Q(12, pick up) = 1, Q(76, give) = 2, Q(4, forward) = 4."""
    q_values = np.zeros((128, 5), np.float32)
    q_values[12, PICK_UP], q_values[76, GIVE], q_values[4, 1] = 1, 2, 4
    run = train(TWO_STEPS, learning, 0, 0, 600, task)
    run.colony.learners[0] = LEARNERS[learning.learner](learning, 128, q_values)
    run.colony.streams[0].state = rng_state
    return run


def train_once(learning, delivery="terminates", max_steps=600, rng_state=0):
    task = Task(delivery=delivery)
    begun = prepared(learning, task, rng_state)
    return train(TWO_STEPS, learning, 0, 1, max_steps, task, start_from=begun)


# All learners see the same errors here: a' is the best action, and epsilon is 0.
#   Step 0: 3 + 0.5 * 2 - 1 = 3.
#   Step 1, terminates: 10 - 2 = 8; truncates: 10 + 0.5 * 4 - 2 = 10.
@pytest.mark.parametrize(("delivery", "last"), [("terminates", 8.0), ("truncates", 10.0)])
@pytest.mark.parametrize("learner", LEARNERS)
def test_td_errors_by_delivery_setting(learner, delivery, last):
    run = train_once(training(learner), delivery)
    assert [step.td_error for step in run.trace] == [3.0, last]
    assert [step.terminated for step in run.trace] == [False, delivery == "terminates"]
    assert run.deliveries == [1]
