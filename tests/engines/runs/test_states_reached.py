"""The kernels meet the 100 reachable states and no other.

Micro-worlds are built from the letters of each state; which cells are nearer to the queen is worked
out here, without the package's geometry.
"""

from __future__ import annotations

import numpy as np
from random_worlds import random_world

from taichi_ants import Task, TrainingConfig, trace_training, train
from taichi_ants.task.constants import N_STATES, PICK_UP
from taichi_ants.task.states import REACHABLE_STATES

PICKS_UP = np.zeros((N_STATES, 5))
PICKS_UP[:, PICK_UP] = 1


def test_random_worlds_show_no_other_state():
    """Random walks and learning ants, in all kinds of worlds."""
    met: set[int] = set()
    for number in range(60):
        config = TrainingConfig("sarsa", 0.5, 0.9, 1.0 if number % 2 else 0.3, 1.0)
        world = random_world(number + 3000, 6)
        task = Task(evaporation_in_training=number % 3 == 0)
        trace = trace_training(world, config, number, 3, 40, task)
        met |= {*trace.states.tolist(), *trace.next_states.tolist()}
    assert met <= set(REACHABLE_STATES)
    assert len(met) > 90


def test_training_touches_no_other_row():
    """Long runs of all learners: the action values of other states stay as they were."""
    configs = [
        TrainingConfig("q_learning", 0.3, 0.9, 1.0, 1.0),
        TrainingConfig("expected_sarsa", 0.3, 0.9, 0.5, 0.99),
        TrainingConfig("dyna_q", 0.3, 0.9, 1.0, 1.0, planning_steps=2),
    ]
    others = sorted(set(range(N_STATES)) - set(REACHABLE_STATES))
    touched = np.zeros(N_STATES, bool)
    for number in range(16):
        world = random_world(number + 5000, 8)
        task = Task(evaporation_in_training=number % 2 == 0)
        result = train(world, configs, range(6), 15, 80, task)
        touched |= result.q_values.any(axis=(0, 1, 3))
    assert not touched[others].any()
    assert touched.sum() > 95
