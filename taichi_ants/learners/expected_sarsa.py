"""Expected SARSA (van Seijen et al. 2009): bootstraps from the mean over the policy's actions.

The target is `r + discount * E Q(s', .)`, the expectation under the epsilon-greedy policy.
"""

from taichi_ants.kernel_functions import ti
from taichi_ants.learners.learner import td_learner
from taichi_ants.task.rules.policy import best_value


def td_error(value, reward, discount, next_values, next_action, epsilon):
    """Return reward + discount * E Q(s', a') - Q(s, a) under the epsilon-greedy policy."""
    best = best_value(next_values)
    expected = best + epsilon * (next_values.sum() * ti.f32(0.2) - best)
    return reward + discount * expected - value


EXPECTED_SARSA = td_learner(
    "expected_sarsa", td_error, summary="on-policy, bootstraps from the mean over next actions"
)
