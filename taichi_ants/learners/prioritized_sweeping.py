"""Prioritized sweeping (Moore and Atkeson 1993): planning starts with the largest error.

Each step sets the priority of its pair to the absolute TD error of Q-learning, if that exceeds
`threshold`. Then up to `planning_steps` pairs of highest priority are updated from the model, and
the pairs that lead to them get new priorities.
"""

from dataclasses import dataclass
from typing import Annotated

from taichi_ants.kernel_functions import kernel_function, ti
from taichi_ants.learners import model
from taichi_ants.learners.learner import Learner
from taichi_ants.settings import Setting
from taichi_ants.task.constants import N_ACTIONS, ROW


@dataclass(frozen=True)
class Sweeping(model.Planning):
    """The hyperparameters of prioritized sweeping."""

    threshold: Annotated[
        float,
        Setting(
            "absolute TD error above which planning updates a state-action pair", least=0, most=1e9
        ),
    ] = 0.0001


@kernel_function
def most_urgent(memory, at):
    """Return the (lowest) slot of the model with the largest priority, and the priority."""
    first, largest = 0, memory.floats[at.floats]
    for slot in range(1, model.visited(memory, at)):
        priority = memory.floats[at.floats + slot]
        if priority > largest:
            first, largest = slot, priority
    return first, largest


def learn(memory, at, step, rates, random_state):
    """Store the error of the pair as its priority, then update the pairs of highest priority.

    The integers are the model, and the floats are the priority of each of its slots.
    """
    pair = step.state * ROW + step.action
    transition = model.pack_transition(step.next_state, step.reward, step.terminated)
    error = model.error_of(memory, at, rates, pair, transition)
    slot = model.remember(memory, at, pair, transition)
    if ti.abs(error) > rates.threshold:
        memory.floats[at.floats + slot] = ti.abs(error)
    planned = 0
    urgent, priority = most_urgent(memory, at)
    while planned < rates.planning_steps and priority > 0:
        memory.floats[at.floats + urgent] = 0.0
        updated, seen = model.recall(memory, at, urgent)
        change = model.error_of(memory, at, rates, updated, seen)
        memory.q[at.table + updated] = memory.q[at.table + updated] + rates.learning_rate * change
        # This update can increase the error of pairs that lead to its state.
        for before in range(model.visited(memory, at)):
            leading, led_to = model.recall(memory, at, before)
            if model.terminated_of(led_to) == 0 and model.next_state_of(led_to) == updated // ROW:
                size = ti.abs(model.error_of(memory, at, rates, leading, led_to))
                if size > rates.threshold and size > memory.floats[at.floats + before]:
                    memory.floats[at.floats + before] = size
        planned += 1
        urgent, priority = most_urgent(memory, at)
    return error, random_state


PRIORITIZED_SWEEPING = Learner(
    "prioritized_sweeping",
    learn,
    hyperparameters=Sweeping,
    memory=lambda settings, n_states: model.model_memory(n_states, floats=N_ACTIONS * n_states),
    cost=lambda settings: 1 + 12 * settings.planning_steps,
    summary="updates from a model of the world, starting with the largest errors",
)
