"""Q-learning (Watkins 1989): off-policy, bootstraps from the best next action.

The target of an update is `r + discount * max Q(s', .)`.
"""

from taichi_ants.learners.learner import td_learner
from taichi_ants.task.rules.policy import best_value


def td_error(value, reward, discount, next_values, next_action, epsilon):
    """Return reward + discount * max Q(s', .) - Q(s, a)."""
    return reward + discount * best_value(next_values) - value


Q_LEARNING = td_learner("q_learning", td_error, summary="off-policy, bootstraps from max Q(s', .)")
