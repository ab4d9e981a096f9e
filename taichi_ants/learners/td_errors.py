"""TD errors as kernels call them: Python's max, min and sum work in them, and a float comes out."""

import functools
import operator
from collections.abc import Callable
from types import FunctionType
from typing import Any

import taichi as ti
from taichi.lang.expr import Expr

from taichi_ants.learners.memory import discount_of, values_of
from taichi_ants.task.constants import ROW
from taichi_ants.task.rules.policy import larger, smaller

_FLOATS = (ti.f16, ti.f32, ti.f64)


@functools.cache
def guarded(td_error: Any) -> Callable[..., object]:
    """A TD error, a `ti.func`, as one that returns an f32 or raises while it compiles.

    What is no float would end the process in Taichi's compiler.
    """
    original = td_error.func.func
    renewed = FunctionType(
        original.__code__,
        {"max": _largest, "min": _smallest, "sum": _sum, **original.__globals__},
        original.__name__,
        original.__defaults__,
        original.__closure__,
    )
    body = ti.func(functools.update_wrapper(renewed, original))

    @ti.func
    def checked(value, reward, discount, next_values, next_action, epsilon):
        # No next action is drawn where the transition terminated; 0 is as good as any there.
        action = ti.max(next_action, 0)
        return _as_f32(body(value, reward, discount, next_values, action, epsilon))

    return checked


@ti.func
def update(
    td_error: ti.template(),
    memory: ti.template(),
    at,
    rates,
    pair,
    reward,
    terminated,
    state,
    action,
):
    """Update a pair (an offset in the table) by its TD error, which is returned.

    `state` is the next row, `action` the next action (-1 where none was drawn).
    """
    value = memory.q[at.table + pair]
    error = td_error(
        value,
        reward,
        discount_of(rates, terminated),
        values_of(memory.q, at.table, state),
        action,
        rates.epsilon,
    )
    memory.q[at.table + pair] = value + rates.learning_rate * error
    return error


def learn_by(td_error: Any) -> Callable[..., object]:
    """The `learn` of a learner that keeps no memory and updates by this TD error."""
    error_of = guarded(td_error)

    @ti.func
    def learn(memory: ti.template(), at, step, rates, random_state):
        error = update(
            error_of,
            memory,
            at,
            rates,
            step.state * ROW + step.action,
            step.reward,
            step.terminated,
            step.next_state,
            step.next_action,
        )
        return error, random_state

    return learn


def _runs_while_compiling(function: Any) -> Callable[..., object]:
    """Mark a Python function that is meant to be called in Taichi's scope, on expressions."""
    function._is_taichi_function = False  # to have it at all is what Taichi asks for
    return function


@_runs_while_compiling
def _as_f32(result: object) -> object:
    if result is None:
        what = "nothing"
    elif isinstance(result, (int, float)) and not isinstance(result, bool):
        return ti.cast(float(result), ti.f32)
    elif not isinstance(result, Expr):
        what = f"a value of the type {type(result).__name__}"
    elif result.is_tensor():
        what = f"a vector or matrix of the shape {tuple(result.get_shape())}"
    elif result.ptr.get_rvalue_type() not in _FLOATS:
        what = f"a number of the type {result.ptr.get_rvalue_type().to_string()}"
    else:
        return ti.cast(result, ti.f32)
    raise ti.TaichiCompilationError(f"it returns {what} where one float is needed")


@ti.func
def _entry(vector: ti.template(), i: ti.template()):
    return vector[i]


def _entries(values: Any) -> list:
    """What max, min or sum is asked about: the entries of a vector, or of a tuple or list."""
    if isinstance(values, Expr) and values.is_tensor():
        return [_entry(values, i) for i in range(values.get_shape()[0])]
    return list(values)


def _in_pairs(better: Callable[..., object], own: Callable[..., object]) -> Callable[..., object]:
    """max or min: Taichi's `own` of several arguments; of one, pairs, and pairs of the winners."""

    @_runs_while_compiling
    def best(values, *others):
        if others:
            return own(values, *others)
        left = _entries(values)
        while len(left) > 1:
            last = left[len(left) // 2 * 2 :]
            left = [better(*pair) for pair in zip(left[::2], left[1::2], strict=False)] + last
        return left[0]

    return best


_largest = _in_pairs(larger, ti.max)
_smallest = _in_pairs(smaller, ti.min)


@_runs_while_compiling
def _sum(values, start=0):
    entries = _entries(values)
    return functools.reduce(operator.add, entries if start == 0 else [start, *entries])
