"""Checks of what callers pass: a wrong kind of thing is named where it comes in."""

from __future__ import annotations

import os

import numpy as np

from taichi_ants.errors import AntsError


def expect(name: str, value: object, *kinds: type) -> None:
    """Make sure that an argument is of one of the kinds.

    Raises:
        AntsError: It is not; the message names it and says what it must be.
    """
    if not isinstance(value, kinds):
        words = " or ".join(_NAMES.get(kind, f"a {kind.__name__}") for kind in kinds)
        raise AntsError(f"{name} is {shown(value)}; it must be {words}.")


def shown(value: object) -> str:
    """A value in a message: arrays by their type and shape, other long ones by their beginning."""
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype} {value.shape}"
    words = repr(value)
    return words if len(words) <= 60 else f"{words[:57]}..."


_NAMES = {str: "text", type(None): "None", np.ndarray: "an array", os.PathLike: "a path"}
