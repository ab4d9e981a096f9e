"""TD errors as kernels call them, and the learners that are no more than a TD error."""

import functools
from collections.abc import Callable
from typing import Any

import taichi as ti
from taichi.lang.expr import Expr

from taichi_ants.learners.memory import discount_of, values_of
from taichi_ants.task.constants import ROW

_FLOATS = (ti.f16, ti.f32, ti.f64)


@functools.cache
def guarded(td_error: Any) -> Callable[..., object]:
    """A TD error, a `ti.func`, as one that returns an f32 or raises while it compiles.

    What is no float would end the process in Taichi's compiler.
    """

    @ti.func
    def checked(value, reward, discount, next_values, next_action, epsilon):
        # No next action is drawn where the transition terminated; 0 is as good as any there.
        action = ti.max(next_action, 0)
        return _as_f32(td_error(value, reward, discount, next_values, action, epsilon))

    return checked


def learn_by(td_error: Any) -> Callable[..., object]:
    """The `learn` of a learner that keeps no memory and updates by this TD error."""
    error_of = guarded(td_error)

    @ti.func
    def learn(memory: ti.template(), at, step, rates, random_state):
        place = at.table + step.state * ROW + step.action
        value = memory.q[place]
        discount = discount_of(rates, step.terminated)
        next_values = values_of(memory.q, at.table, step.next_state)
        error = error_of(value, step.reward, discount, next_values, step.next_action, rates.epsilon)
        memory.q[place] = value + rates.learning_rate * error
        return error, random_state

    return learn


def _as_f32(result: Any) -> object:
    """Called while a kernel compiles, on what a TD error returns."""
    if isinstance(result, (int, float)) and not isinstance(result, bool):
        return ti.cast(float(result), ti.f32)
    if not isinstance(result, Expr):
        what = "nothing" if result is None else f"a value of the type {type(result).__name__}"
    elif result.is_tensor():
        what = "a vector (the largest of next_values is next_values.max())"
    elif result.ptr.get_rvalue_type() not in _FLOATS:
        what = f"a number of the type {result.ptr.get_rvalue_type().to_string()}"
    else:
        return ti.cast(result, ti.f32)
    raise ti.TaichiCompilationError(f"it returns {what} where one float is needed")


# To have this mark at all is what Taichi asks of a Python function that is called in a kernel.
_as_f32._is_taichi_function = False
