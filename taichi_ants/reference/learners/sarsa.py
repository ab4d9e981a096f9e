"""SARSA (Rummery and Niranjan 1994)."""

from __future__ import annotations

import numpy as np

from taichi_ants.reference.learners.learner import Learner
from taichi_ants.reference.records import Transition


class Sarsa(Learner):
    """The next state is worth what the action taken there is worth."""

    draws_next_action = True

    def next_value(self, step: Transition, epsilon: np.float32) -> np.float32:
        """See `Learner.next_value`; a' is not drawn where the step terminated."""
        return self.rows[step.next_state][step.next_action or 0]
