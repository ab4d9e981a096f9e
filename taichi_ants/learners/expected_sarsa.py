"""Expected SARSA (van Seijen et al. 2009): bootstraps from the mean over the policy's actions."""

import taichi as ti

from taichi_ants.learners.registry import Learner
from taichi_ants.rules.policy import best_value


@ti.func
def td_error(value, reward, discount, next_values, next_action, epsilon):
    """reward + discount * E Q(s', a') - Q(s, a) under the epsilon-greedy policy."""
    total = next_values[0] + next_values[1] + next_values[2] + next_values[3] + next_values[4]
    best = best_value(next_values)
    expected = best + epsilon * (total * ti.f32(0.2) - best)
    return reward + discount * expected - value


EXPECTED_SARSA = Learner(
    "expected_sarsa", td_error, summary="on-policy, towards the mean over the next actions"
)
