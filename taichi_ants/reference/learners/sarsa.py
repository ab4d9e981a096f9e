"""SARSA (Rummery and Niranjan 1994)."""

from __future__ import annotations

import numpy as np

from taichi_ants.reference.ants import Transition
from taichi_ants.reference.learners.learner import Learner


class Sarsa(Learner):
    """The next state is worth what the action taken there is worth."""

    draws_next_action = True

    def next_value(self, step: Transition, epsilon: np.float32) -> np.float32:
        return self.rows[step.next_state][step.next_action or 0]  # none where it terminated
