"""Expected SARSA (van Seijen et al. 2009)."""

from __future__ import annotations

import numpy as np

from taichi_ants.reference.ants import Transition
from taichi_ants.reference.learners.learner import Learner


class ExpectedSarsa(Learner):
    """The next state is worth what the policy may expect there."""

    def next_value(self, step: Transition, epsilon: np.float32) -> np.float32:
        q0, q1, q2, q3, q4 = self.rows[step.next_state]
        best = max(q0, q1, q2, q3, q4)
        mean = ((((q0 + q1) + q2) + q3) + q4) * np.float32(0.2)
        return best + epsilon * (mean - best)
