"""Starts and rollouts of the reference."""

from __future__ import annotations

import numpy as np
import pytest
from plain_runs import rollout

from taichi_ants.reference.geometry import normal_form
from taichi_ants.task import Task
from taichi_ants.task.constants import FORWARD, GIVE, PICK_UP
from taichi_ants.worlds.world import World

PAPER = World(
    (10, 10, 10),
    (0, 9, 9),
    foods=[(9, 0, 0)],
    trails=[((i, 0, 0), 25) for i in range(-8, 9)],
    ants=[((0, 8, 8), 0)],
)


def followers_policy():
    """The policy that walks the paper's trail to the food, and back.

    Away from the queen the ant sees E T E (8) until the food is ahead, E F E (12); turned round it
    sees E S E with food (64 + 8) until the queen is ahead, E Q E (64 + 12).
    """
    q_values = np.zeros((128, 5), np.float32)
    for state, action in ((8, FORWARD), (12, PICK_UP), (72, FORWARD), (76, GIVE)):
        q_values[state, action] = 1
    return q_values


@pytest.mark.parametrize("evaporation", [True, False])
def test_along_the_papers_trail(evaporation):
    # 16 moves from (0, 8, 8) to (8, 0, 0) at +1, +3, 16 moves back at +1, +10.
    task = Task(evaporation_in_evaluation=evaporation)
    played = rollout(PAPER, followers_policy(), task=task)
    assert (played.returns, played.steps, played.deliveries) == ([45], [34], [1])
    assert [step.cell for step in played.trace[:17]] == [normal_form(i, 0, 0) for i in range(-8, 9)]
    assert [step.cell for step in played.trace[17:]] == [
        normal_form(i, 0, 0) for i in range(8, -9, -1)
    ]
    assert [step.state for step in played.trace] == [8] * 16 + [12] + [72] * 16 + [76]
    assert [step.step for step in played.trace] == list(range(34))


def test_the_step_limit_truncates_a_rollout():
    played = rollout(PAPER, followers_policy(), max_steps=33)
    assert (played.returns, played.steps, played.deliveries) == ([35], [33], [0])
    assert played.trace[-1].truncated
    assert not any(step.truncated for step in played.trace[:-1])
    assert rollout(PAPER, followers_policy(), max_steps=34).deliveries == [1]


@pytest.mark.parametrize(("evaporation", "then"), [(True, 0), (False, 8)])
def test_the_first_observation_sees_the_trail_undiminished(evaporation, then):
    # A trail of level 1 ahead, E T E (8). Giving without food leaves all as it is, but a tick
    # passes: with evaporation the trail is gone, E E E (0).
    world = World((5, 5, 5), (0, 0, 4), trails=[((1, 1, 0), 1)], ants=[((0, 0, 0), 1)])
    q_values = np.zeros((128, 5), np.float32)
    q_values[8, GIVE] = 1
    task = Task(evaporation_in_evaluation=evaporation)
    [step] = rollout(world, q_values, max_steps=1, task=task).trace
    assert (step.state, step.next_state) == (8, then)
