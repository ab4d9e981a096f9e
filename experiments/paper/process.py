"""A second process, which computes bounds and draws; threads of one would take turns at that."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from functools import partial
from typing import Any

from taichi_ants.runtime import available_threads
from taichi_ants.studies.executors import Workers

Begun = Callable[[], Any]  # waits for the result of a call

_process: Workers | None = None


@contextmanager
def second(wanted: bool) -> Iterator[None]:
    """Yield while there is a second process, if it is wanted and the machine can run two."""
    global _process
    with Workers(1) if wanted and available_threads() > 1 else nullcontext() as _process:
        yield
    _process = None


def begin(call: Callable[..., Any], *given: Any, **named: Any) -> Begun:
    """Return a function that waits for the result of a call, which the second process runs.

    The call runs here, when the function is called, if the second process has not begun it, or if
    there is none. The called function must be at the top level of a module of this folder or of the
    package.
    """
    here = partial(call, *given, **named)
    if _process is None:
        return here
    future = _process.submit(here)
    return lambda: here() if future.cancel() else future.result()


def results_of(calls: dict[Any, Begun], progress: Callable[[float], None]) -> dict[Any, Any]:
    """Return the results of calls that have begun; raises an error of one after all have ended.

    The last ones come first, because the second process has not begun them.
    """
    results, errors = dict[Any, Any](), list[Exception]()
    for name, call in reversed(calls.items()):
        progress((len(results) + len(errors)) / len(calls))
        try:
            results[name] = call()
        except Exception as error:
            errors.append(error)
    if errors:
        raise errors[-1]
    return results
