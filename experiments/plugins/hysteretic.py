"""An example of your own learner: hysteretic Q-learning (Matignon et al. 2007).

It learns more slowly from negative TD errors than from positive ones, which helps if other ants may
have caused a bad outcome. To compare it with Q-learning:

    python experiments/compare.py --plugin experiments/plugins/hysteretic.py \
        --learners q_learning hysteretic --out results/hysteretic
"""

from taichi_ants.kernel_functions import ti
from taichi_ants.learners import register, td_learner

PATIENCE = 0.2  # factor on negative TD errors


def td_error(value, reward, discount, next_values, next_action, epsilon):
    """Return the TD error of Q-learning, reduced if it is negative."""
    error = reward + discount * next_values.max() - value
    return ti.select(error < 0, PATIENCE * error, error)


register(td_learner("hysteretic", td_error, summary="Q-learning that is slow to lower values"))
