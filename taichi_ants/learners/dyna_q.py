"""Dyna-Q (Sutton 1990): Q-learning, and updates from a model of what was seen last."""

from dataclasses import dataclass

import taichi as ti

from taichi_ants.learners.hyperparameters import MAX_PLANNING_STEPS, Hyperparameters, whole_number
from taichi_ants.learners.model import (
    model_memory,
    next_state_of,
    pack_outcome,
    recall,
    remember,
    reward_of,
    terminated_of,
    visited,
)
from taichi_ants.learners.q_learning import td_error
from taichi_ants.learners.registry import Learner
from taichi_ants.learners.td_errors import guarded, update
from taichi_ants.task.constants import ROW
from taichi_ants.task.rules.random_bits import advance, below, bits_of, high_word


@dataclass(frozen=True)
class Planning(Hyperparameters):
    """Attributes:
    planning_steps: Updates from the model after each step.
    """

    planning_steps: int = whole_number(5, 1, MAX_PLANNING_STEPS)


def learn_and_plan(error_of):
    """The `learn` of a learner that keeps a model and updates by this TD error."""
    error_of = guarded(error_of)

    @ti.func
    def learn(memory: ti.template(), at, step, rates, random_state):
        pair = step.state * ROW + step.action
        error = update(
            error_of, memory, at, rates, pair, step.reward, step.terminated, step.next_state, -1
        )
        remember(memory, at, pair, pack_outcome(step.next_state, step.reward, step.terminated))
        rng, n_visited = random_state, visited(memory, at)
        for _ in range(rates.planning_steps):
            rng = advance(rng)
            drawn, seen = recall(memory, at, below(high_word(bits_of(rng)), n_visited))
            update(
                error_of,
                memory,
                at,
                rates,
                drawn,
                reward_of(seen),
                terminated_of(seen),
                next_state_of(seen),
                -1,
            )
        return error, rng

    return learn


DYNA_Q = Learner(
    "dyna_q",
    learn_and_plan(td_error),
    td_error=td_error,
    plans=True,
    hyperparameters=Planning,
    memory=lambda settings, n_states: model_memory(n_states),
    cost=lambda settings: 1 + 0.25 * settings.planning_steps,
    summary="Q-learning that replays a model of the world",
)
