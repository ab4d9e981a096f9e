"""Expected SARSA (van Seijen et al. 2009)."""

from __future__ import annotations

import numpy as np

from taichi_ants.reference.learners.learner import Learner
from taichi_ants.reference.records import Transition


class ExpectedSarsa(Learner):
    """The next state is worth what the policy may expect there."""

    def next_value(self, step: Transition, epsilon: np.float32) -> np.float32:
        """See `Learner.next_value`."""
        q0, q1, q2, q3, q4 = self.rows[step.next_state]
        best = max(q0, q1, q2, q3, q4)
        mean = ((((q0 + q1) + q2) + q3) + q4) * np.float32(0.2)
        return best + epsilon * (mean - best)
