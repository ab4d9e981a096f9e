"""The plugin check: tests of code from outside the package before kernels include it.

Taichi's compiler can crash on unexpected code, and compiled code can crash when it reads outside an
array. So a new learner is first compiled in a forked process, in which it learns for 1000 steps.
"""

import faulthandler
import os
import re
import signal
import sys
import warnings
from collections.abc import Callable, Sequence
from functools import cache, partial

import numpy as np

from taichi_ants import runtime
from taichi_ants.errors import unusable
from taichi_ants.learners import registry
from taichi_ants.learners.learner import Learner
from taichi_ants.task.constants import N_ACTIONS, ROW

_SECONDS = 30  # time limit of a check, which takes less than one second
_UPDATES = 1000
_STATES = 128


@cache
def checked_plugin(learner: Learner) -> Learner:
    """Return the learner; AntsError if it does not pass the plugin check."""
    if learner.name in registry.BUILT_IN:
        return learner
    fault = fault_apart(partial(_fault_of, learner, False), partial(_fault_of, learner, True))
    if fault:
        raise unusable(learner, fault)
    return learner


def fault_apart(check: Callable[[], str], *more: Callable[[], str]) -> str:
    """Return the first fault that checks in a forked process find, or an empty string.

    Where Taichi cannot run in a forked process, only the first check runs, in this process.
    """
    arch = runtime.start().arch
    # A forked process cannot use the GPU or the fields of this one. Forks are unreliable on macOS
    # and missing on Windows.
    if not (sys.platform == "linux" and arch == "cpu" and not runtime.holds_data()):
        return check()
    reader, writer = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # Python warns of forks with threads
        child = os.fork()
    if child == 0:
        _check_in_child((check, *more), writer)
    os.close(writer)
    try:
        with open(reader, encoding="utf-8") as pipe:
            fault = pipe.read()
    except BaseException:
        os.kill(child, signal.SIGKILL)
        raise
    finally:
        _, status = os.waitpid(child, 0)
    code = os.waitstatus_to_exitcode(status)
    if code == -signal.SIGALRM:
        return f"it does not finish within {_SECONDS} seconds"
    return fault if code == 0 else "it crashes, for example with an index outside an array"


def _check_in_child(checks: Sequence[Callable[[], str]], writer: int) -> None:
    """Write the fault and end the process silently, with exit status 0 if the check completed."""
    import resource

    try:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(_SECONDS)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        faulthandler.disable()
        for stream in (1, 2):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
        runtime.start_for_plugin_check()
        # Taichi's handlers print a trace, and can wait forever for a lock that the fork copied.
        for fatal in (signal.SIGSEGV, signal.SIGBUS, signal.SIGFPE, signal.SIGILL, signal.SIGABRT):
            signal.signal(fatal, signal.SIG_DFL)
        os.write(writer, next(filter(None, (check() for check in checks)), "").encode())
        os._exit(0)
    finally:
        os._exit(1)


def _fault_of(learner: Learner, wide: bool) -> str:
    """Return the fault of a learner that learns for 1000 steps, or an empty string.

    The learner uses the memory of the second of two runs; that of the first must not change. If
    `wide`, initial action values range from -10 000 to 10 000, to find indices that depend on them.
    """
    import taichi as ti

    settings = learner.hyperparameters()
    memory = learner.memory(settings, _STATES)
    sizes = ((1 + memory.tables) * _STATES * ROW, memory.floats, memory.integers)
    types = (np.float32, np.float32, np.int32)
    arrays = [np.zeros((2, size), dtype) for size, dtype in zip(sizes, types, strict=True)]
    if wide:
        numbers = np.arange(sizes[0])
        arrays[0][:] = np.where(numbers % 3, 1, -1) * 10.0 ** (numbers % 13 / 2 - 2)
    before = [array[0].copy() for array in arrays]
    more = np.array([*vars(settings).values(), 0.0])
    try:
        _learn_by(learner, [array.reshape(-1) for array in arrays], more, sizes)
    except Exception as error:
        # Only Taichi's debug mode checks the user's own assertions; training ignores them.
        theirs = isinstance(error, ti.TaichiAssertionError) and "Out of bound" not in str(error)
        return "" if theirs else last_line(error)
    stays = all(map(np.array_equal, before, [array[0] for array in arrays]))
    return "" if stays else "it writes outside the memory of its run, which begins at `at`"


def _learn_by(
    learner: Learner, arrays: list[np.ndarray], hyperparameters: np.ndarray, sizes: tuple
) -> None:
    """Learn for 1000 steps of the second of two runs, in episodes of at most 50 steps."""
    import taichi as ti

    from taichi_ants.learners.memory import At, LearnerArrays, Transition, read_rates

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
        for i in range(_UPDATES):
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

    learn(*arrays, hyperparameters)


def last_line(error: Exception) -> str:
    """Return Taichi's error message in one line, without the place in the source."""
    lines = str(error).splitlines()
    for line in lines:
        outside = re.search(
            r"Out of bound access to a \[(\d+)\] matrix with index \[(-?\d+)\]", line
        )
        if outside:
            return "it uses index {1} of a vector of length {0}".format(*outside.groups())
        if "Out of bound" in line:
            return "it uses an index outside an array"
    said = [line for line in lines if line.strip()] or [type(error).__name__]
    return said[-1].strip().rstrip(".?").rsplit("Error: ", 1)[-1]
