"""Learners in kernels: their memory, steps, rates, and updates by a TD error."""

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import taichi as ti
from taichi.lang.expr import Expr

from taichi_ants.kernel_functions import while_compiling
from taichi_ants.learners.config import Hyperparameters
from taichi_ants.settings import declared
from taichi_ants.task.constants import N_ACTIONS, ROW

__all__ = ["At", "LearnerArrays", "Transition", "discount_of", "values_of"]


class LearnerArrays(NamedTuple):
    """The memory of many runs or ants, one after the other.

    `q`, f32, has tables of n_states rows of `ROW` numbers, of which the first 5 are action values.
    The table that a run acts by precedes its additional tables. `floats` are f32, `integers` i32,
    and n_states is a Python int.
    """

    q: Any
    floats: Any
    integers: Any
    n_states: int


# The offset of the memory of one run in each of these arrays. Its additional table k (from 1) is at
# table + k * n_states * ROW.
At = ti.types.struct(table=ti.i32, floats=ti.i32, integers=ti.i32)

# The mask shows the compiler that `row + a` does not overflow, which saves two instructions each.
_ROWS = 2**31 - ROW

# One step of an ant, with state indices. The next action is -1 if none was drawn. A step is
# `truncated` if the episode ends with it without terminating.
Transition = ti.types.struct(
    state=ti.i32,
    action=ti.i32,
    reward=ti.f32,
    next_state=ti.i32,
    next_action=ti.i32,
    terminated=ti.i32,
    truncated=ti.i32,
)


def read_rates(kind: type[Hyperparameters]) -> Callable[..., Any]:
    """Return a `ti.func` (learning_rate, discount, epsilon, numbers, begin) -> rates of a learner.

    The rates are a struct of the first three arguments, f32, and of the hyperparameters by name,
    i32 or f32, which it reads from the f64 array `numbers`, starting at `begin`.
    """
    more = {setting.name: ti.i32 if setting.kind is int else ti.f32 for setting in declared(kind)}
    rates_type = ti.types.struct(learning_rate=ti.f32, discount=ti.f32, epsilon=ti.f32, **more)
    kinds = tuple(more.values())

    @ti.func
    def read(learning_rate, discount, epsilon, numbers: ti.template(), begin):
        return rates_type(
            learning_rate,
            discount,
            epsilon,
            *[ti.cast(numbers[begin + i], kinds[i]) for i in ti.static(range(len(kinds)))],
        )

    return read


@ti.func
def values_of(q: ti.template(), table, state):
    """Return the five action values of a state in the table at offset `table`."""
    row = (table + state * ROW) & _ROWS
    return ti.Vector([q[row + a] for a in ti.static(range(N_ACTIONS))])


@ti.func
def discount_of(rates, terminated):
    """Return the discount of the next value: 0 if the step terminated."""
    discount = rates.discount
    if terminated == 1:
        discount = 0.0
    return discount


@functools.cache
def guarded(td_error: Any) -> Callable[..., object]:
    """Return a TD error as a `ti.func` that returns an f32, or raises while it compiles."""

    @ti.func
    def checked(value, reward, discount, next_values, next_action, epsilon):
        # A step that terminated has no next action; any valid index does, because it is not used.
        action = ti.max(next_action, 0)
        return _as_f32(td_error(value, reward, discount, next_values, action, epsilon))

    return checked


@functools.cache
def error_function(td_error: Any) -> Callable[..., Any]:
    """Return a `ti.func` (memory, table, step, rates) of the TD error of a step.

    It returns the place of the updated value, the value, and the error.
    """
    error_of = guarded(td_error)

    @ti.func
    def error(memory: ti.template(), table, step, rates):
        entry = table + step.state * ROW + step.action
        value = memory.q[entry]
        discount = discount_of(rates, step.terminated)
        next_values = values_of(memory.q, table, step.next_state)
        error = error_of(value, step.reward, discount, next_values, step.next_action, rates.epsilon)
        return entry, value, error

    return error


def learn_by(td_error: Any) -> Callable[..., object]:
    """Return the `learn` of a learner without memory that updates by this TD error."""
    error_of = error_function(td_error)

    @ti.func
    def learn(memory: ti.template(), at, step, rates, random_state):
        entry, value, error = error_of(memory, at.table, step, rates)
        memory.q[entry] = value + rates.learning_rate * error
        return error, random_state

    return learn


@while_compiling
def _as_f32(result: Any) -> object:
    """Return the result of a TD error as f32; called while a kernel compiles."""
    if isinstance(result, Expr) and result.is_tensor():  # which would end the process
        what = "a vector where one float is needed (the largest of them is next_values.max())"
        raise ti.TaichiCompilationError(f"it returns {what}")
    return ti.cast(result, ti.f32)
