"""SARSA (Rummery and Niranjan 1994): on-policy, bootstraps from the action taken next."""

import taichi as ti

from taichi_ants.learners.registry import td_learner
from taichi_ants.task.constants import N_ACTIONS


@ti.func
def td_error(value, reward, discount, next_values, next_action, epsilon):
    """reward + discount * Q(s', a') - Q(s, a); the discount is 0 where no a' was drawn."""
    next_value = next_values[0]
    for a in ti.static(range(1, N_ACTIONS)):
        if next_action == a:
            next_value = next_values[a]
    return reward + discount * next_value - value


SARSA = td_learner(
    "sarsa", td_error, draws_next_action=True, summary="on-policy, towards the action taken next"
)
