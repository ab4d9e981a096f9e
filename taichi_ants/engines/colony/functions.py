"""The functions of the kernels of a colony."""

from collections.abc import Callable
from typing import Any

import taichi as ti

TEMPLATES = ("c", "v", "cues", "field", "view", "row", "phase")


def function(python: Callable[..., Any]) -> Callable[..., Any]:
    """Return a `ti.func`, as a decorator; arguments with the names in `TEMPLATES` are templates.

    `c` has the arrays and numbers of a kernel, `v` is its `Variant`, `cues` are `Task.all_cues` of
    a caste, `field` has the arrays and numbers of a pheromone.
    """
    arguments = python.__code__.co_varnames[: python.__code__.co_argcount]
    python.__annotations__ |= {name: ti.template() for name in arguments if name in TEMPLATES}
    return ti.func(python)
