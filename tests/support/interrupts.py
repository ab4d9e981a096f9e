"""Ctrl-C at its likeliest moment: Python raises it right after the launch during which it came."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from taichi_ants import runtime


@contextmanager
def interrupted_after_launch(number: int = 1) -> Iterator[None]:
    """A context in which launch `number` is done, and then interrupted."""
    runtime.start()
    from taichi_ants.engines.launch import Launch

    usual, done = Launch._launch, []

    def launch(self: Launch) -> None:
        usual(self)
        done.append(self)
        if len(done) == number:
            raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Launch, "_launch", launch)
        patch.setattr(Launch, "repeat", Launch.__call__)  # which uses `_launch`
        with pytest.raises(KeyboardInterrupt):
            yield
