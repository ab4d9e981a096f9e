"""Dyna-Q (Sutton 1990): Q-learning with additional updates from a model of the world.

After the update of Q-learning, `planning_steps` pairs are drawn from the model, which holds the
last outcome of each visited pair, and updated in the same way.
"""

from taichi_ants.arithmetic.random_bits import advance, below, bits_of, high_word
from taichi_ants.kernel_functions import kernel_function
from taichi_ants.learners import model
from taichi_ants.learners.learner import Learner
from taichi_ants.learners.q_learning import td_error
from taichi_ants.task.constants import ROW


@kernel_function
def update(memory, at, rates, pair, transition):
    error = model.error_of(memory, at, rates, pair, transition)
    memory.q[at.table + pair] = memory.q[at.table + pair] + rates.learning_rate * error
    return error


def learn(memory, at, step, rates, random_state):
    """Update from the step, then from random pairs of the model."""
    pair = step.state * ROW + step.action
    transition = model.pack_transition(step.next_state, step.reward, step.terminated)
    error = update(memory, at, rates, pair, transition)
    model.remember(memory, at, pair, transition)
    rng, n_visited = random_state, model.visited(memory, at)
    for _ in range(rates.planning_steps):
        rng = advance(rng)
        drawn, seen = model.recall(memory, at, below(high_word(bits_of(rng)), n_visited))
        update(memory, at, rates, drawn, seen)
    return error, rng


DYNA_Q = Learner(
    "dyna_q",
    learn,
    td_error=td_error,
    plans=True,
    hyperparameters=model.Planning,
    memory=lambda settings, n_states: model.model_memory(n_states),
    cost=lambda settings: 1 + 0.25 * settings.planning_steps,
    summary="Q-learning that replays a model of the world",
)
