"""Prioritized sweeping (Moore and Atkeson 1993): plans first where the error is largest."""

from dataclasses import dataclass

import taichi as ti

from taichi_ants.learners.dyna_q import Planning
from taichi_ants.learners.hyperparameters import number
from taichi_ants.learners.memory import discount_of, values_of
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
from taichi_ants.learners.registry import Learner, Memory
from taichi_ants.task.constants import N_ACTIONS, ROW
from taichi_ants.task.rules.policy import best_value


@dataclass(frozen=True)
class Sweeping(Planning):
    """Attributes:
    planning_steps: Updates from the model after each step, at most.
    threshold: Errors up to this size wait for no update.
    """

    threshold: float = number(0.0001, 0, 1e9)


@ti.func
def error_of(memory: ti.template(), at, rates, pair, outcome):
    """The TD error of Q-learning for an outcome of a pair."""
    best = best_value(values_of(memory.q, at.table, next_state_of(outcome)))
    discount = discount_of(rates, terminated_of(outcome))
    return reward_of(outcome) + discount * best - memory.q[at.table + pair]


@ti.func
def most_urgent(memory: ti.template(), at):
    """The slot of the model with the largest priority, the lowest of several; the priority."""
    first, largest = 0, memory.floats[at.floats]
    for slot in range(1, visited(memory, at)):
        priority = memory.floats[at.floats + slot]
        if priority > largest:
            first, largest = slot, priority
    return first, largest


@ti.func
def learn(memory: ti.template(), at, step, rates, random_state):
    """Note how wrong the value of the pair is; then update the pairs that are most wrong.

    The integers are the model, the floats the priority of each of its slots.
    """
    pair = step.state * ROW + step.action
    outcome = pack_outcome(step.next_state, step.reward, step.terminated)
    error = error_of(memory, at, rates, pair, outcome)
    slot = remember(memory, at, pair, outcome)
    if ti.abs(error) > rates.threshold:
        memory.floats[at.floats + slot] = ti.abs(error)
    planned = 0
    urgent, priority = most_urgent(memory, at)
    while planned < rates.planning_steps and priority > 0:
        memory.floats[at.floats + urgent] = 0.0
        updated, seen = recall(memory, at, urgent)
        change = error_of(memory, at, rates, updated, seen)
        memory.q[at.table + updated] += rates.learning_rate * change
        # Pairs that lead to its state may have got an error by this.
        for before in range(visited(memory, at)):
            leading, led_to = recall(memory, at, before)
            if terminated_of(led_to) == 0 and next_state_of(led_to) == updated // ROW:
                size = ti.abs(error_of(memory, at, rates, leading, led_to))
                if size > rates.threshold and size > memory.floats[at.floats + before]:
                    memory.floats[at.floats + before] = size
        planned += 1
        urgent, priority = most_urgent(memory, at)
    return error, random_state


PRIORITIZED_SWEEPING = Learner(
    "prioritized_sweeping",
    learn,
    hyperparameters=Sweeping,
    memory=lambda settings, n_states: Memory(
        floats=N_ACTIONS * n_states, integers=model_memory(n_states).integers
    ),
    cost=lambda settings: 1 + 12 * settings.planning_steps,
    summary="updates from a model of the world, the largest errors first",
)
