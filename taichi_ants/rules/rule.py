"""The registration of rules that are functions, and their trial on drawn inputs."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterator
from dataclasses import field, make_dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_origin, get_type_hints

from taichi_ants.errors import AntsError, check_one_of, refuse, shown, unusable
from taichi_ants.features.feature import Input
from taichi_ants.features.rule import RULES, Parameters, Rule
from taichi_ants.rules.inputs import KINDS, drawn, field_of, input_of, values_shown
from taichi_ants.rules.language import LanguageError, kernel_source
from taichi_ants.settings import Setting, declared

if TYPE_CHECKING:
    import numpy as np

TRIES = 2000  # drawn sets of inputs with which `register` tries a rule


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

    >>> @rules.register("deposit")
    ... def refresh(level, carries, most=200):
    ...     return max(level, most * carries)
    >>> rules.names("deposit")
    ('refresh',)
    >>> Task(pheromone=Pheromone(deposit="refresh")).rules["refresh"].most
    200
    """
    check_one_of("the kind of the rule", kind, tuple(KINDS))

    def add(function: Callable[..., Any]) -> Callable[..., Any]:
        if not inspect.isfunction(function) or function.__name__ == "<lambda>":
            refuse("the rule", function, "a function defined with def")
        called = function.__name__ if name is None else name
        RULES.check_new(called)
        if called in RULES.yours and RULES.yours[called].kind != kind:
            raise AntsError(
                f"{called!r} is the name of a rule of the kind {RULES.yours[called].kind!r}; "
                "choose another name."
            )
        rule = _rule(called, kind, function)
        _try_in_python(rule)
        RULES.add(called, rule)
        return function

    return add


def _rule(name: str, kind: str, function: Callable[..., Any]) -> Rule:
    """Return a function as a rule; AntsError if kernels cannot compute it."""
    inputs, settings = _arguments(name, kind, function)
    arguments = inspect.signature(function).parameters
    lengths = {name: inputs[name].length if name in inputs else 0 for name in arguments}
    fields = tuple(dict.fromkeys(filter(None, map(field_of, inputs))))
    rule = Rule(name, kind, KINDS[kind], function, inputs, fields, settings)
    try:
        return replace(rule, source=kernel_source(function, lengths))
    except LanguageError as error:
        raise unusable(rule, error) from None


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


def drawn_parameters(rule: Rule, rng: np.random.Generator) -> dict[str, Any]:
    """Return drawn values, within their ranges, of half of the parameters that have a range."""
    values: dict[str, Any] = {}
    for setting in declared(rule.settings):
        least, most = setting.rule.least, setting.rule.most
        if least is not None and most is not None and rng.random() < 0.5:
            value = float((least, most, rng.uniform(least, most))[rng.integers(3)])
            values[setting.name] = round(value) if setting.kind is int else value
    return values


def tries(rule: Rule, n: int = TRIES) -> Iterator[dict[str, Any]]:
    """Yield n drawn sets of the arguments of a rule by name: floats, and Vectors of floats."""
    import numpy as np

    rng, defaults = np.random.default_rng(0), vars(rule.settings())
    for _ in range(n):
        parameters = defaults | drawn_parameters(rule, rng)
        inputs = {name: drawn(rng, name, read.length) for name, read in rule.inputs.items()}
        yield inputs | {name: float(value) for name, value in parameters.items()}


def _try_in_python(rule: Rule) -> None:
    """Compute a rule in Python for many inputs; AntsError if it fails or leaves its range."""
    kind = KINDS[rule.kind]
    form = f"{'a whole number' if kind.is_whole else 'a number'} from {kind.least} to {kind.most}"
    for values in tries(rule):
        try:
            result = rule.function(**values)
            fault = f"it returns {shown(result)}"
            is_number = isinstance(result, (bool, int, float))
            if is_number and kind.least <= result <= kind.most:
                fault = fault if kind.is_whole and result != math.floor(result) else ""
        except Exception as error:
            fault = f"{type(error).__name__}: {error}"
        if fault:
            must = f"it must return {kind.result.split(':')[0]}, {form}"
            raise unusable(rule, f"{fault} for {values_shown(values)}, but {must}")
