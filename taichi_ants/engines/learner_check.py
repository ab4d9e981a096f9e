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

_STATES = 128
_UNDRAWN = (
    "its TD error uses next_action, but no next action is drawn; give draws_next_action=True or, "
    "if the learner plans, compute the error without it"
)


def fault_of(learner: Learner) -> str:
    """Return the fault of a learner, or an empty string; restart Taichi with checks of indices.

    It learns twice for 1000 steps, from small action values and from values of up to 10 000, with
    the memory of the second of two runs; that of the first must not change.
    """
    runtime.start_with_checks()
    settings = learner.hyperparameters()
    memory = learner.memory(settings, _STATES)
    sizes = ((1 + memory.tables) * _STATES * ROW, memory.floats, memory.integers)
    learn, compute_error = _kernels(learner, sizes)
    numbers, more = np.arange(sizes[0]), np.array([*vars(settings).values(), 0.0])
    for values in (0.0, np.where(numbers % 3, 1, -1) * 10.0 ** (numbers % 13 / 2 - 2)):
        kinds = zip(sizes, ("f4", "f4", "i4"), strict=True)
        arrays = [np.zeros((2, size), dtype) for size, dtype in kinds]
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
        try:
            compute_error()
        except ti.TaichiCompilationError:
            return _UNDRAWN
    return ""


def _kernels(learner: Learner, sizes: tuple[int, int, int]) -> tuple[Any, Any]:
    """Return kernels of 1000 steps of the second of two runs, and of an error without an action."""
    f32, i32, f64 = (ti.types.ndarray(dtype, ndim=1) for dtype in (ti.f32, ti.i32, ti.f64))
    read, has_begin = read_rates(learner.hyperparameters), learner.begin is not None

    @ti.kernel
    def learn(q: f32, floats: f32, integers: i32, numbers: f64):
        memory = ti.static(LearnerArrays(q, floats, integers, _STATES))
        at = At(*sizes)
        rates = read(0.1, 0.9, 0.3, numbers, 0)
        random_state = ti.u64(1)
        begins = 1
        ti.loop_config(serialize=True)
        for i in range(1000):
            if ti.static(has_begin):
                if begins == 1:
                    learner.begin(memory, at)
            terminated = ti.cast(i % 7 == 0, ti.i32)
            begins = ti.cast(i % 50 == 49 or terminated == 1, ti.i32)
            has_next = (terminated == 0) & learner.draws_next_action
            step = Transition(
                state=i * 7 % _STATES,
                action=i // 5 % N_ACTIONS,
                reward=ti.cast(i % 15 - 1, ti.f32),
                next_state=(i + 1) * 7 % _STATES,
                next_action=ti.select(has_next, (i + 1) // 5 % N_ACTIONS, -1),
                terminated=terminated,
                truncated=begins - terminated,
            )
            _, random_state = learner.learn(memory, at, step, rates, random_state)

    @ti.kernel
    def compute_error() -> ti.f32:
        return learner.td_error(0.0, 0.0, 0.0, ti.Vector([0.0] * N_ACTIONS), (), 0.0)

    return learn, compute_error
