"""The registry of rules that you write."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

from taichi_ants.errors import AntsError, check_one_of, expect, shown
from taichi_ants.rules.inputs import KINDS
from taichi_ants.rules.rule import BUILT_IN, RULES, Rule, rule_of, try_in_python

get = RULES.get


def register(
    kind: str,
    *,
    name: str | None = None,
    reference: Callable[..., Any] | None = None,
    summary: str = "",
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return a decorator that registers a function as a rule and returns the function.

    It replaces your own rule of the same name and kind. Existing colonies do not change.

    Args:
        kind: "choice", "deposit", "evaporation" or "reward".
        name: The name of the rule, by default that of the function.
        reference: Another function of the same arguments, which the reference calls instead.
        summary: A short description.

    Raises:
        AntsError: A name is taken or not known, the function contains something that kernels cannot
            compute, or a result for drawn inputs is outside the range of the kind.
    """
    check_one_of("the kind of the rule", kind, tuple(KINDS))
    expect("summary", summary, str)

    def add(function: Callable[..., Any]) -> Callable[..., Any]:
        if not inspect.isfunction(function) or function.__name__ == "<lambda>":
            raise AntsError(
                f"the rule is {shown(function)}; it must be a function defined with def."
            )
        called = function.__name__ if name is None else name
        RULES.check_new(called)
        if called in RULES.yours and RULES.yours[called].kind != kind:
            raise AntsError(
                f"{called!r} is the name of a rule of the kind {RULES.yours[called].kind!r}; "
                "choose another name."
            )
        rule = rule_of(called, kind, function, reference, summary)
        try_in_python(rule)
        RULES.add(called, rule)
        return function

    return add


def registered(kind: str, name: str) -> Rule | None:
    """Return your rule of this name; None for the built-in rules of a kind."""
    return None if name in BUILT_IN[kind] else get(name)


def names(kind: str | None = None) -> tuple[str, ...]:
    """Return the names of your rules, of one kind or of all, in the order of registration."""
    return tuple(name for name, rule in RULES.yours.items() if kind in (None, rule.kind))


def words(kind: str) -> tuple[str, ...]:
    """Return all words that name a rule of a kind: the built-in ones, then yours."""
    return (*BUILT_IN[kind], *names(kind))
