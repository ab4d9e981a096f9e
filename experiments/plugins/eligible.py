"""An example of a learner with a memory of its own: Q(lambda) of Watkins (1989).

Q-learning in which a surprise also changes the pairs that led to it, by their traces; a random
action cuts these. Here a trace is a number for each pair, so that its memory is as large as the
table. Try it beside Q-learning:

    python experiments/compare.py --plugin experiments/plugins/eligible.py \
        --learners q_learning eligible --out results/eligible
"""

from dataclasses import dataclass

import taichi as ti

from taichi_ants.learners import Hyperparameters, Learner, Memory, number, register
from taichi_ants.learners.memory import values_of

ROW = 8  # numbers of a row of a table, the first 5 of them action values


@dataclass(frozen=True)
class Traces(Hyperparameters):
    """Attributes:
    trace_decay: What a trace keeps in each step, besides the discount.
    """

    trace_decay: float = number(0.8, 0, 1)


@ti.func
def begin(memory: ti.template(), at):
    """Forget all traces: an episode begins."""
    for i in range(memory.n_states * ROW):
        memory.floats[at.floats + i] = 0.0


@ti.func
def learn(memory: ti.template(), at, step, rates, random_state):
    """Update all pairs by this step's TD error, each by its trace."""
    pair = step.state * ROW + step.action
    value = memory.q[at.table + pair]
    was_best = value >= values_of(memory.q, at.table, step.state).max()
    target = step.reward
    if step.terminated == 0:
        target += rates.discount * values_of(memory.q, at.table, step.next_state).max()
    error = target - value
    for i in range(memory.n_states * ROW):
        trace = memory.floats[at.floats + i] * rates.discount * rates.trace_decay
        if not was_best:
            trace = 0.0
        if i == pair:
            trace = 1.0
        memory.floats[at.floats + i] = trace
        memory.q[at.table + i] += rates.learning_rate * error * trace
    return error, random_state


register(
    Learner(
        "eligible",
        learn,
        begin,
        hyperparameters=Traces,
        memory=lambda settings, n_states: Memory(floats=n_states * ROW),
        cost=lambda settings: 110,
        summary="Q-learning that also updates the pairs before, by their traces",
    )
)
