"""Checks of what callers pass: a wrong kind of thing is named where it comes in."""

from __future__ import annotations

import os

import numpy as np

from taichi_ants.errors import AntsError, shown


def expect(name: str, value: object, *kinds: type) -> None:
    """Make sure that an argument is of one of the kinds.

    Raises:
        AntsError: It is not; the message names it and says what it must be.
    """
    if not isinstance(value, kinds):
        words = " or ".join(_NAMES.get(kind) or _with_article(kind.__name__) for kind in kinds)
        raise AntsError(f"{name} is {shown(value)}; it must be {words}.")


def _with_article(noun: str) -> str:
    return f"{'an' if noun[0] in 'AEIOU' else 'a'} {noun}"


_NAMES = {str: "text", type(None): "None", np.ndarray: "an array", os.PathLike: "a path"}
