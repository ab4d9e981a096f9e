"""The learners of the package, implemented a second time in plain Python.

All numbers are np.float32, with one rounding per operation; the order of operations matters.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from taichi_ants.learners.config import TrainingConfig, update_weights
from taichi_ants.reference.ants import Pair, Transition
from taichi_ants.reference.random_stream import RandomStream, pick
from taichi_ants.task.constants import N_ACTIONS

_ONE = 1 << 32  # TD errors of ants that share a table are summed in units of 2**-32


class ReferenceLearner:
    """A learner with its table of action values and its memory.

    A simple learner overrides `next_value`; a learner with a memory also overrides `learn`, and
    `begin_run` or `begin`.
    """

    draws_next_action = False  # before the update, as in SARSA
    hyperparameters: ClassVar[Mapping[str, float]] = {}  # its own settings, with their defaults

    def __init__(
        self, config: TrainingConfig, n_states: int, q_values: np.ndarray | None = None
    ) -> None:
        """Start with a copy of a table (n_states, 5), or with `initial_q`, and without memories."""
        self.settings = {**self.hyperparameters, **dict(config.hyperparameters)}
        self.learning_rate = np.float32(config.learning_rate)
        self.discount = np.float32(config.discount)
        if q_values is None:
            q_values = np.full((n_states, N_ACTIONS), config.initial_q)
        # Lists of 5 np.float32 are faster here than an array.
        self.rows = [list(row) for row in np.asarray(q_values, np.float32)]
        self.model: dict[Pair, Transition] = {}  # the last of each pair, in order of first visits
        self.begin_run()
        self.begin()

    def begin_run(self) -> None:
        """Reset the memory that lasts through all episodes."""

    def begin(self) -> None:
        """Reset the memory that lasts for one episode."""

    def learn(self, step: Transition, epsilon: float, stream: RandomStream) -> np.float32:
        """Return the TD error of a transition, and learn from it; `stream` is that of the ant."""
        error = self.error(step, epsilon)
        self.update(step.pair, self.learning_rate, error)
        return error

    def error(self, step: Transition, epsilon: float) -> np.float32:
        """Return the TD error of a transition by the present table."""
        next_value = self.next_value(step, np.float32(epsilon))
        target = np.float32(step.reward) + self.discount_of(step) * next_value
        return target - self.rows[step.state][step.action]

    def next_value(self, step: Transition, epsilon: np.float32) -> np.float32:
        """Return the value of the next state by the present table."""
        raise NotImplementedError

    def discount_of(self, step: Transition) -> np.float32:
        """Return the discount of the next state's value, which is 0 if the step terminated."""
        return np.float32(0) if step.terminated else self.discount

    def update(self, pair: Pair, weight: np.float32, error: np.float32) -> None:
        state, action = pair
        self.rows[state][action] = self.rows[state][action] + weight * error


class QLearning(ReferenceLearner):
    """Q-learning (Watkins 1989): the next state has the value of its best action."""

    def next_value(self, step: Transition, epsilon: np.float32) -> np.float32:
        return max(self.rows[step.next_state])


class Sarsa(ReferenceLearner):
    """SARSA (Rummery and Niranjan 1994): the next state has the value of the next action."""

    draws_next_action = True

    def next_value(self, step: Transition, epsilon: np.float32) -> np.float32:
        return self.rows[step.next_state][step.next_action or 0]  # None if the step terminated


class ExpectedSarsa(ReferenceLearner):
    """Expected SARSA (van Seijen et al. 2009): the next state has the policy's expected value."""

    def next_value(self, step: Transition, epsilon: np.float32) -> np.float32:
        q0, q1, q2, q3, q4 = self.rows[step.next_state]
        best = max(q0, q1, q2, q3, q4)
        mean = ((((q0 + q1) + q2) + q3) + q4) * np.float32(0.2)
        return best + epsilon * (mean - best)


class DynaQ(QLearning):
    """Dyna-Q (Sutton 1990): Q-learning, and `planning_steps` updates from its model."""

    hyperparameters: ClassVar = {"planning_steps": 5}

    def learn(self, step: Transition, epsilon: float, stream: RandomStream) -> np.float32:
        error = super().learn(step, epsilon, stream)
        self.model[step.pair] = step
        for _ in range(int(self.settings["planning_steps"])):
            seen = self.draw_seen(stream)
            self.update(seen.pair, self.learning_rate, self.error(seen, epsilon))
        return error

    def draw_seen(self, stream: RandomStream) -> Transition:
        return list(self.model.values())[pick(stream.draw()[0], len(self.model))]


class DoubleQ(ReferenceLearner):
    """Double Q-learning (van Hasselt 2010): one table chooses the best action, the other values it.

    Ants act by the mean of both tables.
    """

    def begin_run(self) -> None:
        self._tables = [[list(row) for row in self.rows] for _ in "AB"]

    def learn(self, step: Transition, epsilon: float, stream: RandomStream) -> np.float32:
        chosen = pick(stream.draw()[0], 2)
        updated, other = self._tables[chosen], self._tables[1 - chosen]
        next_values = updated[step.next_state]
        next_value = other[step.next_state][next_values.index(max(next_values))]
        target = np.float32(step.reward) + self.discount_of(step) * next_value
        state, action = step.pair
        error = target - updated[state][action]
        updated[state][action] = updated[state][action] + self.learning_rate * error
        both = updated[state][action] + other[state][action]
        self.rows[state][action] = both * np.float32(0.5)
        return error


class SarsaLambda(Sarsa):
    """SARSA(lambda) with replacing traces (Singh and Sutton 1996) for the most recent pairs."""

    hyperparameters: ClassVar = {"trace_decay": 0.9, "trace_length": 32}

    def begin(self) -> None:
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


class NStepSarsa(Sarsa):
    """SARSA with targets of n rewards and the value after them (Sutton and Barto, chapter 7).

    A pair is updated n steps later, or at the end of the episode.
    """

    hyperparameters: ClassVar = {"n_steps": 4}

    def begin(self) -> None:
        self._waiting: list[Transition] = []  # transitions without an update yet, oldest first

    def learn(self, step: Transition, epsilon: float, stream: RandomStream) -> np.float32:
        # As in the package, the returned error is that of one-step SARSA before the update.
        error = self.error(step, epsilon)
        self._waiting.append(step)
        ends = step.terminated or step.truncated
        while self._waiting and (ends or len(self._waiting) == self.settings["n_steps"]):
            value = self.next_value(self._waiting[-1], np.float32(epsilon))
            for later in reversed(self._waiting):
                value = np.float32(later.reward) + self.discount_of(later) * value
            state, action = self._waiting.pop(0).pair
            self.update((state, action), self.learning_rate, value - self.rows[state][action])
        return error


class PrioritizedSweeping(DynaQ):
    """Prioritized sweeping (Moore and Atkeson 1993): updates pairs with the largest errors first.

    All updates use the model, also the update of the present step.
    """

    hyperparameters: ClassVar = {"planning_steps": 5, "threshold": 0.0001}

    def begin_run(self) -> None:
        self._priorities: dict[Pair, np.float32] = {}  # in the order of the model

    def learn(self, step: Transition, epsilon: float, stream: RandomStream) -> np.float32:
        error = self.error(step, epsilon)
        self.model[step.pair] = step
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
        """Update a pair, and the priorities of the pairs that lead to its state."""
        self._priorities[pair] = np.float32(0)
        self.update(pair, self.learning_rate, self.error(self.model[pair], epsilon))
        for before, seen in self.model.items():
            if not seen.terminated and seen.next_state == pair[0]:
                error = self.error(seen, epsilon)
                if self._matters(error):
                    self._priorities[before] = max(self._priorities[before], abs(error))


LEARNERS: dict[str, type[ReferenceLearner]] = {
    "q_learning": QLearning,
    "sarsa": Sarsa,
    "expected_sarsa": ExpectedSarsa,
    "dyna_q": DynaQ,
    "double_q": DoubleQ,
    "sarsa_lambda": SarsaLambda,
    "n_step_sarsa": NStepSarsa,
    "prioritized_sweeping": PrioritizedSweeping,
}


def learn_together(
    learner: ReferenceLearner,
    steps: Sequence[Transition],
    streams: Sequence[RandomStream],
    epsilon: float,
    most: int,
) -> None:
    """Learn from all transitions of a tick, and set the `td_error` of each.

    All TD errors of a tick, or of a round of planning, use the table from before it. The n errors
    of a pair are rounded to multiples of 2**-32, so that their sum is exact. They move the value by
    1 - (1 - alpha)**n of their mean, as n successive updates towards one target would. A single
    error is not rounded. `streams` are those of the ants, from which learners draw; `most` is the
    largest number of ants.
    """
    weights = update_weights(float(learner.learning_rate), most)
    for step, error in zip(steps, _update(learner, steps, epsilon, weights), strict=True):
        step.td_error = error
    if isinstance(learner, DynaQ):
        # If several ants have the same pair, the model keeps that of the highest number.
        for step in sorted(steps, key=lambda step: (step.pair, step.number)):
            learner.model[step.pair] = step
        for _ in range(int(learner.settings["planning_steps"])):
            _update(learner, [learner.draw_seen(stream) for stream in streams], epsilon, weights)


def _update(
    learner: ReferenceLearner, steps: Sequence[Transition], epsilon: float, weights: np.ndarray
) -> list[np.float32]:
    errors = [learner.error(step, epsilon) for step in steps]
    errors_of: dict[Pair, list[np.float32]] = defaultdict(list)
    for step, error in zip(steps, errors, strict=True):
        errors_of[step.pair].append(error)
    for pair, of_pair in errors_of.items():
        mean = of_pair[0] if len(of_pair) == 1 else mean_error(of_pair)
        learner.update(pair, weights[min(len(of_pair), len(weights) - 1)], mean)
    return errors


def mean_error(errors: Sequence[np.float32]) -> np.float32:
    """Return the mean of TD errors, each rounded to a multiple of 2**-32, rounded once at the end.

    The sum must fit into a signed 64-bit integer.
    """
    total = sum(int(np.floor(float(error) * _ONE + 0.5)) for error in errors)
    assert -(1 << 63) <= total < 1 << 63
    return np.float32(float(total) / (float(len(errors)) * _ONE))
