"""Q-learning (Watkins 1989)."""

from __future__ import annotations

import numpy as np

from taichi_ants.reference.ants import Transition
from taichi_ants.reference.learners.learner import Learner


class QLearning(Learner):
    """The next state is worth what its best action is worth."""

    def next_value(self, step: Transition, epsilon: np.float32) -> np.float32:
        return max(self.rows[step.next_state])
