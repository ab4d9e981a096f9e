"""Q-learning (Watkins 1989)."""

from __future__ import annotations

import numpy as np

from taichi_ants.reference.learners.learner import Learner
from taichi_ants.reference.records import Transition


class QLearning(Learner):
    """The next state is worth what its best action is worth."""

    def next_value(self, step: Transition, epsilon: np.float32) -> np.float32:
        """See `Learner.next_value`."""
        return max(self.rows[step.next_state])
