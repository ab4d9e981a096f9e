"""What all learners of the reference have in common."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from taichi_ants.errors import AntsError
from taichi_ants.reference.ants import Pair, Transition
from taichi_ants.reference.random_stream import RandomStream
from taichi_ants.task.constants import N_ACTIONS

if TYPE_CHECKING:
    from taichi_ants.learners.config import TrainingConfig


class Learner:
    """A learner and what it keeps: a table of action values, and the memory of its kind.

    All numbers are np.float32, with one rounding per operation; the order of the operations is part
    of the rules. The simple learners say no more than `next_value`. Those with a memory of their
    own override `learn`, and `begin_run` or `begin`.

    Attributes:
        name: Its name.
        draws_next_action: Whether a' is drawn before the update, and executed (as SARSA does).
        shares: Whether all ants of a world can learn into one table: the update is `error` alone.
        hyperparameters: What it has besides the settings of all learners, with the usual values.
        settings: The values of these.
        learning_rate, discount: Of the present episode, and of the configuration.
        rows: The table, n_states lists of 5 np.float32: plain lists are several times faster here
            than an array.
        model: Of each visited pair, in the order of first visit, the last seen transition; filled
            by learners that plan.
    """

    draws_next_action = False
    shares = True
    hyperparameters: ClassVar[Mapping[str, float]] = {}

    def __init__(
        self, config: TrainingConfig, n_states: int, q_values: np.ndarray | None = None
    ) -> None:
        """Begin with a copy of a table (n_states, 5) or with `initial_q`; without memories."""
        self.name = config.learner
        given = dict(config.hyperparameters)
        for name in given.keys() - self.hyperparameters.keys():
            raise AntsError(f"{name!r} is no hyperparameter of the learner {self.name!r}.")
        self.settings = {**self.hyperparameters, **given}
        self.learning_rate = np.float32(config.learning_rate)
        self.discount = np.float32(config.discount)
        if q_values is None:
            q_values = np.full((n_states, N_ACTIONS), config.initial_q)
        self.rows = [list(row) for row in np.asarray(q_values, np.float32)]
        self.model: dict[Pair, Transition] = {}
        self.begin_run()
        self.begin()

    def table(self) -> np.ndarray:
        """A copy of the table; (n_states, 5), float32."""
        return np.array(self.rows, np.float32)

    def begin_run(self) -> None:
        """Make the memory that lives through all episodes."""

    def begin(self) -> None:
        """Make the memory of an episode, at its start."""

    def learn(self, step: Transition, epsilon: float, stream: RandomStream) -> np.float32:
        """Learn from a transition; its TD error.

        Args:
            step: What the ant did, and what came of it.
            epsilon: Of the policy.
            stream: Of the ant, for what the learner draws.
        """
        error = self.error(step, epsilon)
        self.update(step.pair, self.learning_rate, error)
        return error

    def error(self, step: Transition, epsilon: float) -> np.float32:
        """The TD error of a transition by the table of now."""
        next_value = self.next_value(step, np.float32(epsilon))
        target = np.float32(step.reward) + self.discount_of(step) * next_value
        return target - self.rows[step.state][step.action]

    def next_value(self, step: Transition, epsilon: np.float32) -> np.float32:
        """What the next state is worth by the table of now."""
        raise NotImplementedError

    def discount_of(self, step: Transition) -> np.float32:
        """The discount of what comes after a step: 0 where it terminated."""
        return np.float32(0) if step.terminated else self.discount

    def update(self, pair: Pair, weight: np.float32, error: np.float32) -> None:
        """Add weight * error to the value of a pair."""
        state, action = pair
        self.rows[state][action] = self.rows[state][action] + weight * error
