"""The registry of rules that you write, and how a function becomes a rule."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import field, make_dataclass, replace
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from taichi_ants.errors import AntsError, check_one_of, shown, unusable
from taichi_ants.rules.inputs import KINDS, Input, input_of
from taichi_ants.rules.language import LanguageError, kernel_source
from taichi_ants.rules.rule import BUILT_IN, RULES, Parameters, Rule, try_in_python
from taichi_ants.settings import Setting

get = RULES.get


def register(
    kind: str, *, name: str | None = None
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return a decorator that registers a function as a rule and returns the function.

    It replaces your own rule of the same name and kind. Existing colonies do not change.

    Args:
        kind: "choice", "deposit", "evaporation" or "reward".
        name: The name of the rule, by default that of the function.

    Raises:
        AntsError: A name is taken or not known, the function contains something that kernels cannot
            compute, or a result for drawn inputs is outside the range of the kind.
    """
    check_one_of("the kind of the rule", kind, tuple(KINDS))

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
        inputs, settings = _arguments(called, kind, function)
        arguments = inspect.signature(function).parameters
        lengths = {name: inputs[name].length if name in inputs else 0 for name in arguments}
        rule = Rule(called, kind, function, inputs, settings, "")
        try:
            rule = replace(rule, source=kernel_source(function, lengths))
        except LanguageError as error:
            raise unusable(rule, error) from None
        try_in_python(rule)
        RULES.add(called, rule)
        return function

    return add


def _arguments(
    name: str, kind: str, function: Callable[..., Any]
) -> tuple[dict[str, Input], type[Parameters]]:
    """Return the inputs of a function, and the class of its parameters, which have defaults."""
    inputs, parameters = {}, []
    hints = get_type_hints(function, include_extras=True)
    for argument in inspect.signature(function).parameters.values():
        hint = hints.get(argument.name, type(argument.default))
        hint = hint if get_origin(hint) is Annotated else Annotated[hint, Setting("parameter")]
        has_default = argument.default is not argument.empty
        is_plain = argument.kind is argument.POSITIONAL_OR_KEYWORD
        if is_plain and not has_default and (read := input_of(kind, argument.name)):
            inputs[argument.name] = read
        elif is_plain and has_default and get_args(hint)[0] in (int, float):
            parameters.append((argument.name, hint, field(default=argument.default)))
        else:
            more = "".join(f", {start}FIELD" for start in KINDS[kind].of_fields)
            raise AntsError(
                f"the rule {name!r} has the argument `{argument}`, which is not an input of the "
                f"kind {kind!r}; choose from {', '.join(KINDS[kind].inputs)}{more}, or make it a "
                "parameter by a default of type int or float."
            )
    settings: Any = make_dataclass(name, parameters, bases=(Parameters,), frozen=True)
    settings.path = f"task.rules.{name}"
    settings.__doc__ = f"The parameters of the rule {name!r}."
    settings()  # checks the defaults
    return inputs, settings


def registered(kind: str, name: str) -> Rule | None:
    """Return your rule of this name; None for the built-in rules of a kind."""
    return None if name in BUILT_IN[kind] else get(name)


def names(kind: str | None = None) -> tuple[str, ...]:
    """Return the names of your rules, of one kind or of all, in the order of registration."""
    return tuple(name for name, rule in RULES.yours.items() if kind in (None, rule.kind))


def words(kind: str) -> tuple[str, ...]:
    """Return all words that name a rule of a kind: the built-in ones, then yours."""
    return (*BUILT_IN[kind], *names(kind))
