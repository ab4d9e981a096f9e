"""What an ant knows: a table of action values and, if its learner plans, a model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.errors import AntsError
from taichi_ants.reference.learners import learner_named
from taichi_ants.reference.random_stream import RandomStream, pick
from taichi_ants.reference.records import Model, Outcome, Pair
from taichi_ants.task.constants import N_ACTIONS, N_STATES

if TYPE_CHECKING:
    from taichi_ants.learners.config import TrainingConfig


class Knowledge:
    """A Q-table, and a model of what was seen last.

    Attributes:
        learner: The twin of the configuration's learner.
        learning_rate: np.float32.
        rows: The table as rows of np.float32 scalars: plain lists are several times faster here
            than an array.
        model: See `records.Model`; filled by planning learners only.
    """

    def __init__(
        self,
        config: TrainingConfig,
        q_values: np.ndarray | None = None,
        model: Model | None = None,
    ) -> None:
        """Begin with copies of a table (128, 5) and a model; zeros and nothing if not given.

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
        if q_values is None:
            q_values = np.zeros((N_STATES, N_ACTIONS), np.float32)
        self.learning_rate = np.float32(config.learning_rate)
        self._discount = np.float32(config.discount)
        self.rows = [list(row) for row in np.asarray(q_values, np.float32)]
        self.model: Model = {} if model is None else dict(model)
        # A dictionary keeps the order of first insertion, the order of first visit; the list of its
        # keys is there to draw from.
        self._visited = list(self.model)

    def table(self) -> np.ndarray:
        """Return a copy of the Q-table; (128, 5), float32."""
        return np.array(self.rows, np.float32)

    def td_error(
        self, pair: Pair, outcome: Outcome, next_action: int | None, epsilon: float
    ) -> np.float32:
        """Return the TD error of a transition by the table of now.

        Args:
            pair: The state and the action.
            outcome: What came of them.
            next_action: a', if it was drawn.
            epsilon: Of the policy.
        """
        state, action = pair
        reward, next_state, terminated = outcome
        return self.learner.td_error(
            self.rows[state][action],
            np.float32(reward),
            np.float32(0) if terminated else self._discount,
            self.rows[next_state],
            0 if next_action is None else next_action,
            np.float32(epsilon),
        )

    def update(self, pair: Pair, weight: np.float32, error: np.float32) -> None:
        """Add weight * error to the value of a pair."""
        state, action = pair
        self.rows[state][action] = self.rows[state][action] + weight * error

    def remember(self, pair: Pair, outcome: Outcome) -> None:
        """Store what came of a pair; it replaces what was seen before."""
        if pair not in self.model:
            self._visited.append(pair)
        self.model[pair] = outcome

    def draw_visited(self, stream: RandomStream) -> Pair:
        """Draw one of the pairs of the model."""
        high, _ = stream.draw()
        return self._visited[pick(high, len(self._visited))]
