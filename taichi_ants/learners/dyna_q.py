"""Dyna-Q (Sutton 1990): Q-learning with additional updates from a model of the world."""

from taichi_ants.arithmetic.random_bits import advance, below, bits_of, high_word
from taichi_ants.kernel_functions import kernel_function
from taichi_ants.learners import model
from taichi_ants.learners.learner import Learner
from taichi_ants.learners.memory import update
from taichi_ants.learners.q_learning import td_error
from taichi_ants.task.constants import ROW


@kernel_function
def remember(memory, at, step, rates):
    """Update from the step, store it in the model, and return its TD error."""
    pair = step.state * ROW + step.action
    transition = model.pack_transition(step.next_state, step.reward, step.terminated)
    error = model.error_of(memory, at, rates, pair, transition)
    update(memory, at.table + pair, memory.q[at.table + pair] + rates.learning_rate * error)
    model.remember(memory, at, pair, transition)
    return error


@kernel_function
def replay(memory, at, rates, slot):
    """Return the place of the value of a pair in the model, and the value after an update."""
    pair, transition = model.recall(memory, at, slot)
    error = model.error_of(memory, at, rates, pair, transition)
    return at.table + pair, memory.q[at.table + pair] + rates.learning_rate * error


def learn(memory, at, step, rates, random_state):
    """Update from the step, then from random pairs of the model."""
    error = remember(memory, at, step, rates)
    rng, n_visited = random_state, model.visited(memory, at)
    for _ in range(rates.planning_steps):
        rng = advance(rng)
        entry, value = replay(memory, at, rates, below(high_word(bits_of(rng)), n_visited))
        update(memory, entry, value)
    return error, rng


DYNA_Q = Learner(
    "dyna_q",
    learn,
    td_error=td_error,
    parts=(remember, replay),
    plans=True,
    hyperparameters=model.Planning,
    memory=lambda settings, n_states: model.model_memory(n_states),
    cost=lambda settings: 1 + 0.25 * settings.planning_steps,
    summary="Q-learning that replays a model of the world",
)
