"""A check that wrong input is refused in one sentence, with the words that a test expects."""

from collections.abc import Callable
from typing import Any

import pytest

from taichi_ants import AntsError


def refused(says: str, make: Callable[..., Any], *given: Any, **named: Any) -> str:
    """Assert that a call is refused in one sentence that has some words; return the sentence."""
    with pytest.raises(AntsError) as caught:
        make(*given, **named)
    text = str(caught.value)
    assert says in text, text
    assert text.endswith("."), text
    assert "\n" not in text, text
    return text
