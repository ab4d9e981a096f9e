"""Tries a learner from outside of the package before a kernel takes it up.

Taichi's compiler ends the process where it meets what it does not expect, and compiled code where
it reads outside an array. So such a TD error is compiled, and called a thousand times, in a forked
process first.
"""

import faulthandler
import os
import re
import signal
import sys
import warnings
from collections.abc import Callable
from functools import cache

import numpy as np

from taichi_ants import runtime
from taichi_ants.errors import AntsError
from taichi_ants.learners.registry import Learner

_SECONDS = 30  # until a trial is stopped; it takes less than one
_UPDATES = 1000


@cache
def tried(learner: Learner) -> Callable[..., object]:
    """The TD error of a learner for kernels; one from outside of the package has passed a trial.

    Raises:
        AntsError: It cannot be used; the message says why.
    """
    from taichi_ants.learners.td_errors import guarded

    td_error = guarded(learner)
    if not learner.td_error.__module__.startswith("taichi_ants."):
        arch = runtime.start().arch
        # A forked process has neither the GPU nor the fields of this one. That macOS lets a fork
        # go on is not sure, and Windows has none.
        apart = sys.platform == "linux" and arch == "cpu" and not runtime.holds_data()
        reason = _fault_apart(td_error) if apart else _fault(td_error)
        if reason:
            raise AntsError(
                f"the TD error of learner {learner.name!r} cannot be used: {reason}; see "
                "taichi_ants.learners.Learner for what it takes and returns."
            )
    return td_error


def _fault_apart(td_error: Callable[..., object]) -> str:
    """What is wrong with a TD error, found out in a forked process; empty if nothing is."""
    reader, writer = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # Python's, of a fork beside threads
        child = os.fork()
    if child == 0:
        _try_in_child(td_error, writer)
    os.close(writer)
    try:
        with open(reader, encoding="utf-8") as pipe:
            reason = pipe.read()
    except BaseException:
        os.kill(child, signal.SIGKILL)
        raise
    finally:
        _, status = os.waitpid(child, 0)
    code = os.waitstatus_to_exitcode(status)
    if code == -signal.SIGALRM:
        return f"it does not come to an end within {_SECONDS} seconds"
    return reason if code == 0 else "it ends the process, as an index outside of an array does"


def _try_in_child(td_error: Callable[..., object], writer: int) -> None:
    """Write what is wrong and end, with 0 if it came to that; whatever happens, do it silently."""
    import resource

    try:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(_SECONDS)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        faulthandler.disable()
        for stream in (1, 2):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
        runtime.start_for_trial()
        os.write(writer, (_fault(td_error) or _fault(td_error, wide=True)).encode())
        os._exit(0)
    finally:
        os._exit(1)


def _fault(td_error: Callable[..., object], wide: bool = False) -> str:
    """What is wrong with a TD error, in this process and the Taichi that runs; may end it.

    Args:
        td_error: As `guarded` returns it.
        wide: Start from action values up to ten thousand of either sign, not from zeros, to find
            an index that depends on them and is right only while they are small.
    """
    import taichi as ti

    from taichi_ants.engines.runs.learning import ROW, TABLE, Rates, update

    f32 = ti.types.ndarray(dtype=ti.f32, ndim=1)

    @ti.kernel
    def try_updates(q: f32, updates: ti.i32):  # type: ignore[no-untyped-def, valid-type]
        ti.loop_config(serialize=True)
        for i in range(updates):
            pair, reward, ended = (
                i * 11 % 128 * ROW + i % 5,
                i % 15 - 1,
                ti.cast(i % 7 == 0, ti.i32),
            )
            action = i // 5 % 5 if ended == 0 else -1
            rates = Rates(0.1, 0.9, 0.3)
            update(td_error, q, 0, rates, pair, reward, ended, i * 7 % 128, action)

    values = np.zeros(TABLE, np.float32)
    if wide:
        signs = np.where(np.arange(TABLE) % 3, 1, -1)
        values[:] = signs * 10.0 ** (np.arange(TABLE) % 13 / 2 - 2)
    try:
        try_updates(values, _UPDATES)
    except Exception as error:
        # Assertions of the learner's own hold in Taichi's debug mode only, not where it trains.
        theirs = isinstance(error, ti.TaichiAssertionError) and "Out of bound" not in str(error)
        return "" if theirs else _last_line(error)
    return ""


def _last_line(error: Exception) -> str:
    """What Taichi says, without the place in the source around it."""
    lines = str(error).splitlines()
    for line in lines:
        outside = re.search(
            r"Out of bound access to a \[(\d+)\] matrix with index \[(-?\d+)\]", line
        )
        if outside:
            return "it takes entry {1} of a vector of {0}".format(*outside.groups())
        if "Out of bound" in line:
            return "it uses an index outside of an array"
    said = [line for line in lines if line.strip()] or [type(error).__name__]
    return said[-1].strip().rstrip(".?").rsplit("Error: ", 1)[-1]
