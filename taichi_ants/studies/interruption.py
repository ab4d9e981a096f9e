"""Ctrl-C and SIGTERM: they end a command in one line, whatever it is doing.

A signal is noted besides raising KeyboardInterrupt, which libraries may swallow or turn into errors
of their own. The imports are few, so that a command can be stopped from its first moment on.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

_noted: list[int] = []
_holds = False


def _note(number: int, frame: FrameType | None) -> None:
    _noted.append(number)
    if not _holds or len(_noted) > 2:  # who insists is not held up
        raise KeyboardInterrupt


def _forget(unraisable: sys.UnraisableHookArgs) -> None:
    """An interruption that cannot be raised where it comes, as in a callback, is noted at least."""
    if not issubclass(unraisable.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(unraisable)


@contextmanager
def stoppable(message: str = "Stopped.") -> Iterator[None]:
    """End what is inside at Ctrl-C and SIGTERM, with status 128 + the signal's number.

    It prints the message of the interruption, or `message`. What the parent ignores, as nohup does,
    stays ignored.
    """
    usual: dict[int, Any] = {signal.SIGINT: signal.default_int_handler}
    usual[signal.SIGTERM] = signal.SIG_DFL
    watched = [number for number, handler in usual.items() if signal.getsignal(number) is handler]
    for number in watched:
        signal.signal(number, _note)
    hook, sys.unraisablehook = sys.unraisablehook, _forget
    try:
        yield
    except BaseException as error:
        interrupted = isinstance(error, KeyboardInterrupt)
        if isinstance(error, SystemExit) or not (_noted or interrupted):
            raise
        print(str(error) if interrupted and str(error) else message, file=sys.stderr)
        sys.exit(128 + (_noted[0] if _noted else signal.SIGINT))
    finally:
        sys.unraisablehook = hook
        for number in watched:
            signal.signal(number, usual[number])
        if watched:  # this is the outermost
            _noted.clear()


@contextmanager
def held() -> Iterator[Callable[[], bool]]:
    """Hold signals, up to the third, until what is inside is done; yield whether one came."""
    global _holds
    _holds = True
    try:
        yield lambda: bool(_noted)
    finally:
        _holds = False
    stop_if_noted()


def stop_if_noted() -> None:
    """Raise KeyboardInterrupt if a signal came that a library has swallowed; not where it waits."""
    if _noted and not _holds:
        raise KeyboardInterrupt
