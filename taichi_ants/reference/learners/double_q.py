"""Double Q-learning (van Hasselt 2010): one table chooses the best action, the other values it."""

from __future__ import annotations

import numpy as np

from taichi_ants.reference.ants import Transition
from taichi_ants.reference.learners.learner import Learner
from taichi_ants.reference.random_stream import RandomStream, pick


class DoubleQ(Learner):
    """Two tables A and B; the ants act by their mean."""

    shares = False

    def begin_run(self) -> None:
        """Let A and B begin as copies of the table."""
        self._tables = [[list(row) for row in self.rows] for _ in "AB"]

    def learn(self, step: Transition, epsilon: float, stream: RandomStream) -> np.float32:
        high, _ = stream.draw()
        chosen = pick(high, 2)
        updated, other = self._tables[chosen], self._tables[1 - chosen]
        next_values = updated[step.next_state]
        best = next_values.index(max(next_values))
        next_value = other[step.next_state][best]
        target = np.float32(step.reward) + self.discount_of(step) * next_value
        state, action = step.pair
        error = target - updated[state][action]
        updated[state][action] = updated[state][action] + self.learning_rate * error
        a, b = self._tables
        self.rows[state][action] = (a[state][action] + b[state][action]) * np.float32(0.5)
        return error
