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

    If there is none, the call runs here, when the function is called. The called function must be
    at the top level of a module of this folder or of the package.
    """
    here = partial(call, *given, **named)
    return here if _process is None else _process.submit(here).result


def results_of(calls: dict[Any, Begun], progress: Callable[[float], None]) -> dict[Any, Any]:
    """Return the results of calls that have begun; raises the first error after all have ended."""
    results, errors = dict[Any, Any](), list[Exception]()
    for name, call in calls.items():
        progress((len(results) + len(errors)) / len(calls))
        try:
            results[name] = call()
        except Exception as error:
            errors.append(error)
    if errors:
        raise errors[0]
    return results
