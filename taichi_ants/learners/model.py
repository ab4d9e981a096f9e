"""A model of the world: the outcome that was seen last of each visited pair of row and action.

It lies in the integers of a learner's memory: the number of visited pairs; from 2 on, in the order
of first visits, each pair (its offset in the table) and its packed outcome; behind the room for all
pairs, for each pair its place in this order plus 1, or 0.
"""

import taichi as ti

from taichi_ants.learners.registry import Memory
from taichi_ants.task.constants import N_ACTIONS, ROW
from taichi_ants.task.rewards import MOST

# An outcome packs the next row (20 bits), the reward (11 bits) and whether the step terminated.
_REWARD_AT, _TERMINATED_AT = 20, 31


def model_memory(n_states: int) -> Memory:
    """The memory that a model takes."""
    return Memory(integers=2 + 3 * N_ACTIONS * n_states)


@ti.func
def pack_outcome(next_state, reward, terminated):
    """An outcome as one i32; the reward is a whole number as f32."""
    paid = ti.cast(reward, ti.i32) + MOST
    return next_state | paid << _REWARD_AT | terminated << _TERMINATED_AT


@ti.func
def next_state_of(outcome):
    """The next row of an outcome."""
    return outcome & (1 << _REWARD_AT) - 1


@ti.func
def reward_of(outcome):
    """The reward of an outcome, f32."""
    return ti.cast((outcome >> _REWARD_AT & 2047) - MOST, ti.f32)


@ti.func
def terminated_of(outcome):
    """1 if the step of an outcome terminated, else 0."""
    return ti.cast(outcome < 0, ti.i32)


@ti.func
def visited(memory: ti.template(), at):
    """The number of visited pairs."""
    return memory.integers[at.integers]


@ti.func
def remember(memory: ti.template(), at, pair, outcome):
    """Store what was seen last of a pair, new pairs behind all others; the pair's slot."""
    key = at.integers + 2 + 2 * N_ACTIONS * memory.n_states + pair // ROW * N_ACTIONS + pair % ROW
    number = memory.integers[key]
    if number == 0:
        number = memory.integers[at.integers] + 1
        memory.integers[at.integers] = number
        memory.integers[key] = number
        memory.integers[at.integers + 2 * number] = pair
    memory.integers[at.integers + 2 * number + 1] = outcome
    return number - 1


@ti.func
def recall(memory: ti.template(), at, slot):
    """The pair in a slot, and its outcome."""
    place = at.integers + 2 + 2 * slot
    return memory.integers[place], memory.integers[place + 1]
