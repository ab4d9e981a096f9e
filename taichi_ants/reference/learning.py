"""The mind of an ant that learns alone: what it knows, its epsilon and its random stream."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.grid.constants import STREAM_ANT
from taichi_ants.reference.knowledge import Knowledge
from taichi_ants.reference.policy import choose_action
from taichi_ants.reference.random_stream import RandomStream, stream_state
from taichi_ants.reference.records import Model, Outcome, Pair, Run, Step

if TYPE_CHECKING:
    from taichi_ants.learners.config import TrainingConfig


def decayed_epsilon(epsilon: float, config: TrainingConfig) -> float:
    """Return the epsilon of the episode after one with this epsilon; float64."""
    return max(float(config.min_epsilon), epsilon * float(config.epsilon_decay))


class Learning:
    """What lives through all episodes of a run.

    Attributes:
        learner: The twin of the configuration's learner.
        stream: The ant's random stream.
        epsilon: Of the present episode, float64.
    """

    def __init__(self, config: TrainingConfig, seed: int, start_from: Run | None) -> None:
        """Begin a run, or go on from one, which is left as it is.

        Raises:
            AntsError: The learner is unknown, or `planning_steps` does not fit it.
        """
        if start_from is None:
            self._knowledge = Knowledge(config)
            self.stream = RandomStream(stream_state(seed, STREAM_ANT, 0))
            self.epsilon = float(config.epsilon)
        else:
            self._knowledge = Knowledge(config, start_from.q_values, start_from.model)
            self.stream = RandomStream(start_from.rng_state)
            self.epsilon = start_from.epsilon
        self.learner = self._knowledge.learner
        self._config = config

    @property
    def model(self) -> Model:
        """See `records.Model`; filled by planning learners only."""
        return self._knowledge.model

    def table(self) -> np.ndarray:
        """Return a copy of the Q-table; (128, 5), float32."""
        return self._knowledge.table()

    def choose(self, state: int) -> int:
        """Choose an action by the table and the epsilon of now."""
        return choose_action(self._knowledge.rows[state], self.epsilon, self.stream)

    def learn(self, step: Step, terminated: bool, next_action: int | None) -> np.float32:
        """Update from a step, then from the model if the learner plans.

        Args:
            step: The step that was made.
            terminated: Whether it led to a terminal state, so that the target is the reward alone.
            next_action: a', if it was drawn.

        Returns:
            The TD error of the step.
        """
        return learn_alone(
            self._knowledge,
            (step.state, step.action),
            (step.reward, step.next_state, terminated),
            next_action,
            self.epsilon,
            self.stream,
            self._config.planning_steps,
        )

    def end_episode(self) -> None:
        """Let epsilon decay."""
        self.epsilon = decayed_epsilon(self.epsilon, self._config)


def learn_alone(
    knowledge: Knowledge,
    pair: Pair,
    outcome: Outcome,
    next_action: int | None,
    epsilon: float,
    stream: RandomStream,
    planning_steps: int,
) -> np.float32:
    """Let one ant that has its table for itself learn from one transition.

    Args:
        knowledge: Changed: the table, and for learners that plan the model.
        pair, outcome, next_action: The transition, see `Knowledge.td_error`.
        epsilon: Of the policy.
        stream: What planning draws from.
        planning_steps: Updates from the model, for learners that plan.

    Returns:
        The TD error of the transition.
    """
    rate = knowledge.learning_rate
    error = knowledge.td_error(pair, outcome, next_action, epsilon)
    knowledge.update(pair, rate, error)
    if knowledge.learner.plans:
        knowledge.remember(pair, outcome)
        for _ in range(planning_steps):
            drawn = knowledge.draw_visited(stream)
            planned = knowledge.td_error(drawn, knowledge.model[drawn], None, epsilon)
            knowledge.update(drawn, rate, planned)
    return error
