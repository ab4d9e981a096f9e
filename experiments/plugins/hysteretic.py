"""An example of a learner of one's own: hysteretic Q-learning (Matignon et al. 2007).

It learns from bad surprises more slowly than from good ones, which helps where other ants, not the
ant's own action, may be to blame. Try it beside Q-learning:

    python experiments/compare.py --plugin experiments/plugins/hysteretic.py \
        --learners q_learning hysteretic --out results/hysteretic
"""

import taichi as ti

from taichi_ants.learners import register, td_learner

PATIENCE = 0.2  # the share of a bad surprise that is learned


@ti.func
def td_error(value, reward, discount, next_values, next_action, epsilon):
    """The TD error of Q-learning, made smaller where it is negative."""
    error = reward + discount * next_values.max() - value
    return ti.select(error < 0, PATIENCE * error, error)


register(td_learner("hysteretic", td_error, summary="Q-learning that is slow to give up"))
