"""Prioritized sweeping (Moore and Atkeson 1993): plans first where the error is largest."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from taichi_ants.reference.ants import Pair, Transition
from taichi_ants.reference.learners.dyna_q import DynaQ
from taichi_ants.reference.random_stream import RandomStream


class PrioritizedSweeping(DynaQ):
    """All updates come from the model, that of the present step too."""

    shares = False
    hyperparameters: ClassVar = {"planning_steps": 5, "threshold": 0.0001}

    def begin_run(self) -> None:
        """Begin without priorities."""
        self._priorities: dict[Pair, np.float32] = {}  # in the order of the model

    def learn(self, step: Transition, epsilon: float, stream: RandomStream) -> np.float32:
        error = self.error(step, epsilon)
        self.remember(step)
        self._priorities.setdefault(step.pair, np.float32(0))
        if self._matters(error):
            self._priorities[step.pair] = abs(error)
        for _ in range(int(self.settings["planning_steps"])):
            first = max(self._priorities, key=self._priorities.__getitem__)
            if self._priorities[first] > 0:
                self._sweep(first, epsilon)
        return error

    def _matters(self, error: np.float32) -> bool:
        return bool(abs(error) > np.float32(self.settings["threshold"]))

    def _sweep(self, pair: Pair, epsilon: float) -> None:
        """Update a pair; pairs that lead to its state may have got an error by this."""
        self._priorities[pair] = np.float32(0)
        self.update(pair, self.learning_rate, self.error(self.model[pair], epsilon))
        for before, seen in self.model.items():
            if seen.terminated or seen.next_state != pair[0]:
                continue
            error = self.error(seen, epsilon)
            if self._matters(error):
                self._priorities[before] = max(self._priorities[before], abs(error))
