"""A model of the world: the latest transition of each visited pair of state and action.

The integers of a learner's memory store it. Index 0 is the number of visited pairs. From index 2,
in the order of first visits, each slot has a pair (its offset in the table) and its packed
transition. After the slots of all pairs follows, for each pair, its slot plus 1, or 0 if unvisited.
"""

from dataclasses import dataclass
from typing import Annotated

import taichi as ti

from taichi_ants.learners.config import Hyperparameters
from taichi_ants.learners.learner import Memory
from taichi_ants.learners.memory import values_of
from taichi_ants.settings import Setting
from taichi_ants.task.constants import MOST_REWARD, N_ACTIONS, ROW
from taichi_ants.task.rules.policy import best_value

# A transition packs the next state (20 bits), the reward (11 bits) and whether the step terminated.
_REWARD_AT, _TERMINATED_AT = 20, 31
# Pairs and slots are below this. The mask shows the compiler that an index is not negative, which
# saves one instruction each time; planning consists mostly of such look-ups.
_PAIRS = (ROW << _REWARD_AT) - 1


@dataclass(frozen=True)
class Planning(Hyperparameters):
    """The hyperparameters of learners that plan."""

    planning_steps: Annotated[
        int, Setting("updates from the model after each step", least=1, most=1000)
    ] = 5


def model_memory(n_states: int, floats: int = 0) -> Memory:
    """Return the size of the memory of a model, plus `floats` further floats."""
    return Memory(floats=floats, integers=2 + 3 * N_ACTIONS * n_states)


@ti.func
def pack_transition(next_state, reward, terminated):
    """Return a transition packed into one i32; the reward is a whole number as f32."""
    paid = ti.cast(reward, ti.i32) + MOST_REWARD
    return next_state | paid << _REWARD_AT | terminated << _TERMINATED_AT


@ti.func
def next_state_of(transition):
    return transition & (1 << _REWARD_AT) - 1


@ti.func
def reward_of(transition):
    """Return the reward of a transition, f32."""
    return ti.cast((transition >> _REWARD_AT & 2047) - MOST_REWARD, ti.f32)


@ti.func
def terminated_of(transition):
    """Return 1 if a transition terminated, else 0."""
    return ti.cast(transition < 0, ti.i32)


@ti.func
def visited(memory: ti.template(), at):
    return memory.integers[at.integers]


@ti.func
def remember(memory: ti.template(), at, pair, transition):
    """Store the latest transition of a pair, and return its slot."""
    state, action = (pair & _PAIRS) // ROW, (pair & _PAIRS) % ROW
    key = at.integers + 2 + (2 * memory.n_states + state) * N_ACTIONS + action
    entry = memory.integers[key]
    if entry == 0:
        entry = memory.integers[at.integers] + 1
        memory.integers[at.integers] = entry
        memory.integers[key] = entry
        memory.integers[at.integers + 2 * entry] = pair
    memory.integers[at.integers + 2 * entry + 1] = transition
    return entry - 1


@ti.func
def recall(memory: ti.template(), at, slot):
    """Return the pair in a slot, and its transition."""
    entry = at.integers + 2 + 2 * (slot & _PAIRS)
    return memory.integers[entry] & _PAIRS, memory.integers[entry + 1]


@ti.func
def error_of(memory: ti.template(), at, rates, pair, transition):
    """Return the TD error of Q-learning for a transition of a pair."""
    target = reward_of(transition)
    if terminated_of(transition) == 0:
        next_values = values_of(memory.q, at.table, next_state_of(transition))
        target += rates.discount * best_value(next_values)
    return target - memory.q[at.table + pair]
