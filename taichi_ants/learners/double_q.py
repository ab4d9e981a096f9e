"""Double Q-learning (van Hasselt 2010): one table selects the best action, the other rates it.

The target is `r + discount * B(s', argmax A(s', .))`, towards which A(s, a) moves. Each step draws
which of the two tables is A; the other is B. The ant acts by their mean.
"""

from taichi_ants.arithmetic.random_bits import advance, below, bits_of, high_word
from taichi_ants.kernel_functions import ti
from taichi_ants.learners.learner import Learner, Memory
from taichi_ants.learners.memory import discount_of, values_of
from taichi_ants.task.constants import N_ACTIONS, ROW


def learn(memory, at, step, rates, random_state):
    """Update table A or B, drawn at random; the ant acts by their mean."""
    rng = advance(random_state)
    drawn = below(high_word(bits_of(rng)), 2)
    table = memory.n_states * ROW
    updated, other = at.table + (1 + drawn) * table, at.table + (2 - drawn) * table
    next_values = values_of(memory.q, updated, step.next_state)
    best, largest = 0, next_values[0]
    for a in ti.static(range(1, N_ACTIONS)):
        if next_values[a] > largest:
            best, largest = a, next_values[a]
    pair = step.state * ROW + step.action
    value = memory.q[updated + pair]
    worth = memory.q[other + step.next_state * ROW + best]
    error = step.reward + discount_of(rates, step.terminated) * worth - value
    value += rates.learning_rate * error
    memory.q[updated + pair] = value
    memory.q[at.table + pair] = (value + memory.q[other + pair]) * 0.5
    return error, rng


DOUBLE_Q = Learner(
    "double_q",
    learn,
    memory=lambda settings, n_states: Memory(tables=2),
    summary="Q-learning with two tables, which do not overestimate the best action",
)
