"""The registry of rules that you write."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from taichi_ants.errors import AntsError, check_one_of, expect, shown, unusable
from taichi_ants.rules.inputs import KINDS, Input, input_of
from taichi_ants.rules.language import LanguageError, kernel_source
from taichi_ants.rules.rule import BUILT_IN, RULES, Parameters, Rule, try_in_python
from taichi_ants.settings import Is

get = RULES.get


def register(
    kind: str,
    *,
    name: str | None = None,
    twin: Callable[..., Any] | None = None,
    summary: str = "",
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return a decorator that registers a function as a rule and returns the function.

    It replaces your own rule of the same name and kind. Existing colonies do not change.

    Args:
        kind: "choice", "deposit", "evaporation" or "reward".
        name: The name of the rule, by default that of the function.
        twin: Another function of the same arguments, which the reference calls instead.
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
        rule = _rule(called, kind, function, twin, summary)
        try_in_python(rule)
        RULES.add(called, rule)
        return function

    return add


def own(kind: str, name: str) -> Rule | None:
    """Return your rule of this name; None for the built-in rules of a kind."""
    return None if name in BUILT_IN[kind] else get(name)


def names(kind: str | None = None) -> tuple[str, ...]:
    """Return the names of your rules, of one kind or of all, in the order of registration."""
    return tuple(name for name, rule in RULES.yours.items() if kind in (None, rule.kind))


def words(kind: str) -> tuple[str, ...]:
    """Return all words that name a rule of a kind: the built-in ones, then yours."""
    return (*BUILT_IN[kind], *names(kind))


def _rule(
    name: str,
    kind: str,
    function: Callable[..., Any],
    twin: Callable[..., Any] | None,
    summary: str,
) -> Rule:
    inputs: dict[str, Input] = {}
    arguments = inspect.signature(function).parameters
    for argument in arguments.values():
        if argument.kind is not argument.POSITIONAL_OR_KEYWORD:
            raise AntsError(f"the rule {name!r} has the argument {argument}; use plain arguments.")
        if argument.default is argument.empty:
            read = input_of(kind, argument.name)
            if read is None:
                more = "".join(f", {start}FIELD" for start in KINDS[kind].of_fields)
                raise AntsError(
                    f"the rule {name!r} has the argument {argument.name!r}, which is not an input "
                    f"of the kind {kind!r}; choose from {', '.join(KINDS[kind].inputs)}{more}, or "
                    "give it a default, which makes it a parameter."
                )
            inputs[argument.name] = read
    if twin is not None and list(inspect.signature(twin).parameters) != list(arguments):
        raise AntsError(
            f"twin of the rule {name!r} is {shown(twin)}; it must have the same arguments in the "
            "same order."
        )
    settings = _settings(name, function)
    rule = Rule(name, kind, function, twin or function, inputs, settings, "", summary)
    lengths = {a: inputs[a].length if a in inputs else 0 for a in arguments}
    try:
        return replace(rule, source=kernel_source(function, lengths))
    except LanguageError as error:
        raise unusable(rule, error) from None


def _settings(name: str, function: Callable[..., Any]) -> type[Parameters]:
    """Return a class of settings for the arguments of a function with defaults."""
    hints, parameters = get_type_hints(function, include_extras=True), {}
    for argument in inspect.signature(function).parameters.values():
        if argument.default is not argument.empty:
            hint = hints.get(argument.name, type(argument.default))
            if get_origin(hint) is not Annotated:
                hint = Annotated[hint, Is("parameter")]
            if get_args(hint)[0] not in (int, float):
                raise AntsError(
                    f"the parameter {argument.name!r} of the rule {name!r} is "
                    f"{argument.default!r}; declare a whole number (int) or a number (float)."
                )
            parameters[argument.name] = hint, argument.default
    body = {
        "__doc__": f"The parameters of the rule {name!r}.",
        "__annotations__": {parameter: hint for parameter, (hint, _) in parameters.items()},
        **{parameter: default for parameter, (_, default) in parameters.items()},
    }
    subclass: Any = type(name, (Parameters,), body, path=f"task.rules.{name}")
    settings = dataclass(frozen=True)(subclass)
    settings()  # checks the defaults
    return settings
