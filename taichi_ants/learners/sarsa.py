"""SARSA (Rummery and Niranjan 1994): on-policy, bootstraps from the next action.

The target is `r + discount * Q(s', a')`. The ant draws a' before the update, and then takes it.
"""

from taichi_ants.learners.learner import td_learner
from taichi_ants.task.rules.policy import value_at


def td_error(value, reward, discount, next_values, next_action, epsilon):
    """Return reward + discount * Q(s', a') - Q(s, a); the discount is 0 if no a' was drawn."""
    return reward + discount * value_at(next_values, next_action) - value


SARSA = td_learner(
    "sarsa", td_error, draws_next_action=True, summary="on-policy, bootstraps from the next action"
)
