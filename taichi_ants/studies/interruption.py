"""Ctrl-C and SIGTERM: they end a command at any time, with a message of one line.

A signal is recorded and raises KeyboardInterrupt, because libraries may catch that exception or
turn it into their own errors. This module has few imports, so that commands can be stopped early.
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
    if not _holds or len(_noted) > 2:  # the third signal always stops
        raise KeyboardInterrupt


def _forget(unraisable: sys.UnraisableHookArgs) -> None:
    """Ignore interruptions that cannot be raised, as in callbacks; `_note` has recorded them."""
    if not issubclass(unraisable.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(unraisable)


@contextmanager
def stoppable(message: str = "Stopped.") -> Iterator[None]:
    """Return a context that exits at Ctrl-C and SIGTERM with status 128 + the signal's number.

    It prints the text of the KeyboardInterrupt, or `message`. Signals that the parent process
    ignores, for example nohup, remain ignored.
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
        if watched:  # this is the outermost block
            _noted.clear()


@contextmanager
def held() -> Iterator[Callable[[], bool]]:
    """Yield a function that returns whether a signal has come.

    Up to two signals take effect only after the block; the third one takes effect at once.
    """
    global _holds
    _holds = True
    try:
        yield lambda: bool(_noted)
    finally:
        _holds = False
    stop_if_noted()


def stop_if_noted() -> None:
    """Raise KeyboardInterrupt if a library has ignored a signal; do nothing inside `held`."""
    if _noted and not _holds:
        raise KeyboardInterrupt
