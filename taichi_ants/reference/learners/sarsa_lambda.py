"""SARSA(lambda) with replacing traces (Singh and Sutton 1996), of which a short list is kept."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from taichi_ants.reference.ants import Pair, Transition
from taichi_ants.reference.learners.sarsa import Sarsa
from taichi_ants.reference.random_stream import RandomStream


class SarsaLambda(Sarsa):
    """SARSA that updates the last pairs of the episode too."""

    shares = False
    hyperparameters: ClassVar = {"trace_decay": 0.9, "trace_length": 32}

    def begin(self) -> None:
        """Forget the traces."""
        self._traces: list[tuple[Pair, np.float32]] = []  # newest first

    def learn(self, step: Transition, epsilon: float, stream: RandomStream) -> np.float32:
        error = self.error(step, epsilon)
        fade = self.discount * np.float32(self.settings["trace_decay"])
        older = [(pair, trace * fade) for pair, trace in self._traces if pair != step.pair]
        length = int(self.settings["trace_length"])
        self._traces = [(step.pair, np.float32(1)), *older][:length]
        scaled = self.learning_rate * error
        for pair, trace in self._traces:
            self.update(pair, scaled, trace)
        return error
