"""n-step SARSA (Sutton and Barto, chapter 7): targets of n rewards, and a value after them."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from taichi_ants.reference.ants import Transition
from taichi_ants.reference.learners.sarsa import Sarsa
from taichi_ants.reference.random_stream import RandomStream


class NStepSarsa(Sarsa):
    """SARSA that updates a pair n steps later, or at the end of the episode."""

    shares = False
    hyperparameters: ClassVar = {"n_steps": 4}

    def begin(self) -> None:
        """Forget the steps that wait for their update."""
        self._waiting: list[Transition] = []  # oldest first

    def learn(self, step: Transition, epsilon: float, stream: RandomStream) -> np.float32:
        # The error returned is that of one-step SARSA, before the update.
        error = self.error(step, epsilon)
        self._waiting.append(step)
        ends = step.terminated or step.truncated
        while self._waiting and (ends or len(self._waiting) == self.settings["n_steps"]):
            self._update_oldest(np.float32(epsilon))
        return error

    def _update_oldest(self, epsilon: np.float32) -> None:
        value = self.next_value(self._waiting[-1], epsilon)
        for step in reversed(self._waiting):
            value = np.float32(step.reward) + self.discount_of(step) * value
        state, action = self._waiting.pop(0).pair
        self.update((state, action), self.learning_rate, value - self.rows[state][action])
