"""SARSA(lambda) with a short list of replacing traces (Singh and Sutton 1996).

The error of SARSA also changes earlier pairs, in proportion to their traces. A trace is 1 after a
visit, and fades by `discount * trace_decay` in each step; the last `trace_length` pairs have one.
"""

from dataclasses import dataclass
from typing import Annotated

from taichi_ants.kernel_functions import ti
from taichi_ants.learners.config import Hyperparameters
from taichi_ants.learners.learner import Learner, Memory
from taichi_ants.learners.memory import discount_of
from taichi_ants.settings import Setting, Share
from taichi_ants.task.constants import ROW


@dataclass(frozen=True)
class Traces(Hyperparameters):
    """The hyperparameters of SARSA(lambda); a new trace replaces the oldest if there is no room."""

    trace_decay: Annotated[
        Share, Setting("lambda: factor on traces per step, in addition to the discount")
    ] = 0.9
    trace_length: Annotated[
        int, Setting("largest number of eligibility traces", least=1, most=256)
    ] = 32


def begin(memory, at):
    memory.integers[at.integers] = 0


def learn(memory, at, step, rates, random_state):
    """Update this pair and those before it, in proportion to their traces.

    The integers are the number of traces, then their pairs from the newest to the oldest.
    """
    pair = step.state * ROW + step.action
    discount = discount_of(rates, step.terminated)
    next_value = memory.q[at.table + step.next_state * ROW + ti.max(step.next_action, 0)]
    error = step.reward + discount * next_value - memory.q[at.table + pair]
    scaled = rates.learning_rate * error
    fade = rates.discount * rates.trace_decay
    known = memory.integers[at.integers]
    # This pair becomes the first; those that were before it move back by one.
    moved, trace = pair, ti.f32(1.0)
    places = known
    for i in range(known):
        there = memory.integers[at.integers + 1 + i]
        faded = memory.floats[at.floats + i] * fade
        if i < places:
            memory.integers[at.integers + 1 + i] = moved
            memory.floats[at.floats + i] = trace
            memory.q[at.table + moved] = memory.q[at.table + moved] + scaled * trace
            moved, trace = there, faded
            if there == pair:
                places = i + 1
        else:
            memory.floats[at.floats + i] = faded
            memory.q[at.table + there] = memory.q[at.table + there] + scaled * faded
    if (known == 0 or moved != pair) and known < rates.trace_length:
        memory.integers[at.integers] = known + 1
        memory.integers[at.integers + 1 + known] = moved
        memory.floats[at.floats + known] = trace
        memory.q[at.table + moved] = memory.q[at.table + moved] + scaled * trace
    return error, random_state


SARSA_LAMBDA = Learner(
    "sarsa_lambda",
    learn,
    begin,
    draws_next_action=True,
    hyperparameters=Traces,
    memory=lambda settings, _: Memory(0, settings.trace_length, 1 + settings.trace_length),
    cost=lambda settings: 1 + 0.05 * settings.trace_length,
    summary="SARSA that also updates earlier pairs, in proportion to their traces",
)
