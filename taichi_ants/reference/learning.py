"""The mind of an ant: its table, its model, its epsilon and its random stream."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.constants import N_ACTIONS, N_STATES, STREAM_ANT
from taichi_ants.errors import AntsError
from taichi_ants.reference.learners import learner_named
from taichi_ants.reference.policy import choose_action
from taichi_ants.reference.random_stream import RandomStream, pick, stream_state
from taichi_ants.reference.records import Model, Run, Step

if TYPE_CHECKING:
    from taichi_ants.config import TrainingConfig


class Learning:
    """What lives through all episodes of a run.

    Attributes:
        learner: The twin of the configuration's learner.
        stream: The ant's random stream.
        epsilon: Of the present episode, float64.
        model: See `records.Model`; filled by planning learners only.
    """

    def __init__(self, config: TrainingConfig, seed: int, start_from: Run | None) -> None:
        """Begin a run, or go on from one, which is left as it is.

        Raises:
            AntsError: The learner is unknown, or `planning_steps` does not fit it.
        """
        self.learner = learner_named(config.learner)
        if self.learner.plans != (config.planning_steps > 0):
            allowed = "at least 1" if self.learner.plans else "0"
            raise AntsError(
                f"planning_steps is {config.planning_steps}; it must be {allowed} for the learner "
                f"{config.learner!r}."
            )
        self._config = config
        self._learning_rate = np.float32(config.learning_rate)
        self._discount = np.float32(config.discount)
        q_values = np.zeros((N_STATES, N_ACTIONS), np.float32)
        self.stream = RandomStream(stream_state(seed, STREAM_ANT, 0))
        self.epsilon = float(config.epsilon)
        self.model: Model = {}
        if start_from is not None:
            q_values = np.asarray(start_from.q_values, np.float32)
            self.stream = RandomStream(start_from.rng_state)
            self.epsilon = start_from.epsilon
            self.model = dict(start_from.model)
        # A dictionary keeps the order of first insertion, the order of first visit; the list of its
        # keys is there to draw from.
        self._visited = list(self.model)
        # Rows of np.float32 scalars: plain lists are several times faster here than an array.
        self._rows = [list(row) for row in q_values]

    def table(self) -> np.ndarray:
        """Return a copy of the Q-table; (128, 5), float32."""
        return np.array(self._rows, np.float32)

    def choose(self, state: int) -> int:
        """Choose an action by the table and the epsilon of now."""
        return choose_action(self._rows[state], self.epsilon, self.stream)

    def learn(self, step: Step, terminated: bool, next_action: int | None) -> np.float32:
        """Update from a step, then from the model if the learner plans.

        Args:
            step: The step that was made.
            terminated: Whether it led to a terminal state, so that the target is the reward alone.
            next_action: a', if it was drawn.

        Returns:
            The TD error of the step.
        """
        pair = (step.state, step.action)
        outcome = (step.reward, step.next_state, terminated)
        td_error = self._update(pair, outcome, next_action)
        if self.learner.plans:
            if pair not in self.model:
                self._visited.append(pair)
            self.model[pair] = outcome
            self._plan()
        return td_error

    def _plan(self) -> None:
        for _ in range(self._config.planning_steps):
            high, _ = self.stream.draw()
            pair = self._visited[pick(high, len(self._visited))]
            self._update(pair, self.model[pair], next_action=None)

    def _update(
        self, pair: tuple[int, int], outcome: tuple[int, int, bool], next_action: int | None
    ) -> np.float32:
        state, action = pair
        reward, next_state, terminated = outcome
        row = self._rows[state]
        td_error = self.learner.td_error(
            row[action],
            np.float32(reward),
            np.float32(0) if terminated else self._discount,
            self._rows[next_state],
            -1 if next_action is None else next_action,
            np.float32(self.epsilon),
        )
        row[action] = row[action] + self._learning_rate * td_error
        return td_error

    def end_episode(self) -> None:
        """Let epsilon decay."""
        decayed = self.epsilon * float(self._config.epsilon_decay)
        self.epsilon = max(float(self._config.min_epsilon), decayed)
