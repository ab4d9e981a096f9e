"""From a Python function to a kernel: one way for features, observations, learners and rules."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from importlib import import_module
from inspect import signature
from typing import Any

Function = Callable[..., Any]
# The arguments that are no values of the kernel: views of ants, nests and cells, arrays of a run.
TEMPLATES = {"a", "nest", "cell", "memory"}


class KernelFunction:
    """A plain function that becomes a Taichi function when a kernel first calls it.

    So its file does not import Taichi, and commands start quickly.
    """

    _is_taichi_function = False  # Taichi requires this attribute, with any value

    def __init__(self, body: Function) -> None:
        self.body, self.__doc__ = body, body.__doc__

    @cached_property
    def _func(self) -> Function:
        import taichi as ti

        templates = TEMPLATES & signature(self.body).parameters.keys()
        self.body.__annotations__ = dict.fromkeys(templates, ti.template())
        return ti.func(self.body)

    def __call__(self, *arguments: Any) -> Any:
        return self._func(*arguments)


def kernel_function(body: Function) -> Function:
    """Return a function that kernels can call; those decorated with @ti.func stay as they are."""
    return body if hasattr(body, "_is_taichi_function") else KernelFunction(body)


def while_compiling(function: Function) -> Function:
    """Return a Python function that kernels call while they compile, as a decorator."""
    function._is_taichi_function = False  # type: ignore[attr-defined]  # as above
    return function


class Named:
    """An object with attributes that a function returns by name, while a kernel compiles."""

    _data_oriented = True  # Taichi requires it of objects whose attributes kernels read

    def __init__(self, read: Callable[[str], Any]) -> None:
        self._read = read

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):  # of Python
            raise AttributeError(name)
        return self._read(name)


# Modules that are imported at their first use, when a kernel compiles.
ti: Any = Named(lambda name: getattr(import_module("taichi"), name))
bits: Any = Named(lambda name: getattr(import_module("taichi_ants.arithmetic.random_bits"), name))
numbers: Any = Named(lambda name: getattr(import_module("taichi_ants.arithmetic.numbers"), name))
