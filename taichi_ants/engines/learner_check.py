"""A trial of a learner from outside the package, in Taichi's debug mode, which checks indices.

Taichi's compiler can crash on unexpected code, and compiled code can crash when it reads outside an
array. So the command `taichi-ants check FILE` runs it in a separate process.
"""

from typing import Any

import numpy as np
import taichi as ti

from taichi_ants import runtime
from taichi_ants.engines.launch import last_line
from taichi_ants.learners.learner import Learner
from taichi_ants.learners.memory import At, LearnerArrays, Transition, read_rates
from taichi_ants.task.constants import N_ACTIONS, ROW

UPDATES = 1000
_STATES = 128


def fault_of(learner: Learner) -> str:
    """Return the fault of a learner, or an empty string; restart Taichi with checks of indices.

    It learns twice for 1000 steps, from small action values and from values of up to 10 000, with
    the memory of the second of two runs; that of the first must not change.
    """
    runtime.start_with_checks()
    settings = learner.hyperparameters()
    memory = learner.memory(settings, _STATES)
    sizes = ((1 + memory.tables) * _STATES * ROW, memory.floats, memory.integers)
    learn, more = _kernel(learner, sizes), np.array([*vars(settings).values(), 0.0])
    numbers = np.arange(sizes[0])
    for values in (0.0, np.where(numbers % 3, 1, -1) * 10.0 ** (numbers % 13 / 2 - 2)):
        types = (np.float32, np.float32, np.int32)
        arrays = [np.zeros((2, size), dtype) for size, dtype in zip(sizes, types, strict=True)]
        arrays[0][:] = values
        first = [array[0].copy() for array in arrays]
        try:
            learn(*[array.reshape(-1) for array in arrays], more)
        except Exception as error:
            # Only Taichi's debug mode checks the user's own assertions; training ignores them.
            if not isinstance(error, ti.TaichiAssertionError) or "Out of bound" in str(error):
                return last_line(error)
        if not all(map(np.array_equal, first, [array[0] for array in arrays])):
            return "it writes outside the memory of its run, which begins at `at`"
    if learner.td_error and (learner.plans or not learner.draws_next_action):
        return _fault_without_next_action(learner)
    return ""


def _fault_without_next_action(learner: Learner) -> str:
    """Return a fault if the TD error uses the next action, which here is not a number."""

    @ti.kernel
    def compute() -> ti.f32:
        return learner.td_error(0.0, 0.0, 0.0, ti.Vector([0.0] * N_ACTIONS), (), 0.0)

    try:
        compute()
    except ti.TaichiCompilationError:
        return (
            "its TD error uses next_action, but no next action is drawn; give "
            "draws_next_action=True or, if the learner plans, compute the error without it"
        )
    return ""


def _kernel(learner: Learner, sizes: tuple[int, int, int]) -> Any:
    """Return a kernel of 1000 steps of the second of two runs, in episodes of at most 50 steps."""
    f32 = ti.types.ndarray(dtype=ti.f32, ndim=1)
    i32 = ti.types.ndarray(dtype=ti.i32, ndim=1)
    f64 = ti.types.ndarray(dtype=ti.f64, ndim=1)
    read = read_rates(learner.hyperparameters)
    has_begin = learner.begin is not None

    @ti.kernel
    def learn(q: f32, floats: f32, integers: i32, numbers: f64):
        memory = ti.static(LearnerArrays(q, floats, integers, _STATES))
        at = At(*sizes)
        rates = read(0.1, 0.9, 0.3, numbers, 0)
        random_state = ti.u64(1)
        begins = 1
        ti.loop_config(serialize=True)
        for i in range(UPDATES):
            if ti.static(has_begin):
                if begins == 1:
                    learner.begin(memory, at)
            terminated = ti.cast(i % 7 == 0, ti.i32)
            begins = ti.cast(i % 50 == 49 or terminated == 1, ti.i32)
            next_action = -1
            if ti.static(learner.draws_next_action):
                if terminated == 0:
                    next_action = (i + 1) // 5 % N_ACTIONS
            step = Transition(
                state=i * 7 % _STATES,
                action=i // 5 % N_ACTIONS,
                reward=ti.cast(i % 15 - 1, ti.f32),
                next_state=(i + 1) * 7 % _STATES,
                next_action=next_action,
                terminated=terminated,
                truncated=begins - terminated,
            )
            _, random_state = learner.learn(memory, at, step, rates, random_state)

    return learn
