"""Dyna-Q (Sutton 1990): Q-learning, and updates from a model of what was seen last."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from taichi_ants.reference.ants import Transition
from taichi_ants.reference.learners.q_learning import QLearning
from taichi_ants.reference.random_stream import RandomStream, pick


class DynaQ(QLearning):
    """Q-learning, and `planning_steps` updates from drawn pairs of the model."""

    hyperparameters: ClassVar = {"planning_steps": 5}

    def learn(self, step: Transition, epsilon: float, stream: RandomStream) -> np.float32:
        error = super().learn(step, epsilon, stream)
        self.remember(step)
        for _ in range(int(self.settings["planning_steps"])):
            seen = self.draw_seen(stream)
            self.update(seen.pair, self.learning_rate, self.error(seen, epsilon))
        return error

    def remember(self, step: Transition) -> None:
        """Store a transition; it replaces the one of this pair that was seen before."""
        self.model[step.pair] = step

    def draw_seen(self, stream: RandomStream) -> Transition:
        """Draw one of the transitions of the model."""
        high, _ = stream.draw()
        return list(self.model.values())[pick(high, len(self.model))]
