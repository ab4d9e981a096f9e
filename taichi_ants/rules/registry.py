"""The registry of rules that you write."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from taichi_ants.errors import AntsError, check_new_name, check_one_of, expect, shown
from taichi_ants.rules.inputs import KINDS, Input, drawn, field_of, input_of, values_shown
from taichi_ants.rules.language import LanguageError, kernel_source
from taichi_ants.settings import Setting, Settings, declared

TRIES = 2000  # drawn sets of inputs with which `register` tries a rule
BUILT_IN = {
    "choice": ("greedy", "softmax", "deneubourg"),
    "deposit": ("set", "add", "fading", "none"),
    "evaporation": ("linear", "exponential", "none"),
    "reward": ("by_event",),
}


@dataclass(frozen=True)
class Parameters(Settings, path="task.rules.NAME"):
    """The parameters of a rule; each rule has its own subclass."""

    @classmethod
    def entry_named(cls, name: str) -> type[Parameters]:
        """Return the class of the parameters of a rule; AntsError if it is not registered."""
        return get(name).settings

    def __reduce__(self) -> Any:
        # A pickle holds the name of the rule, because its class is made at registration.
        return _parameters, (type(self).__name__, vars(self))


@dataclass(frozen=True, eq=False)
class Rule:
    """A rule that you wrote: a function of inputs, and of parameters.

    Attributes:
        name: The name that tasks use.
        kind: "choice", "deposit", "evaporation" or "reward".
        function: The function. Arguments without a default are inputs; `taichi_ants.rules.KINDS`
            has the inputs of each kind. In "choice" and "reward", `levels_NAME` are the levels of
            the field NAME in the three cells ahead, and `level_NAME` is that of the ant's own cell.
            In "deposit", `level_NAME` is that of the cell of the deposit.
            Arguments with a default are parameters, whole numbers or floats.
        reference: The Python function that the reference calls; by default, `function` itself.
        inputs: The inputs by name, in the order of the arguments.
        settings: The class of the parameters.
        source: The source of the function for kernels.
        summary: A line for listings.
    """

    name: str
    kind: str
    function: Callable[..., Any]
    reference: Callable[..., Any]
    inputs: Mapping[str, Input]
    settings: type[Parameters]
    source: str
    summary: str = ""

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of the parameters, in the order of the arguments."""
        return tuple(one.name for one in declared(self.settings))

    @property
    def fields(self) -> tuple[str, ...]:
        """The names of the fields that the rule reads."""
        return tuple(dict.fromkeys(filter(None, map(field_of, self.inputs))))

    def result(self, inputs: Mapping[str, Any], parameters: Mapping[str, Any]) -> float:
        """Return the result of the Python function; it is limited to the range of the kind.

        Actions and rewards are rounded down. A result that is not a number counts as the smallest.
        """
        numbers = {name: float(value) for name, value in parameters.items()}
        kind, result = KINDS[self.kind], float(self.reference(**inputs, **numbers))
        result = min(max(result, kind.least), kind.most) if result == result else kind.least
        return math.floor(result) if kind.is_whole else result


_RULES: dict[str, Rule] = {}


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
        check_new_name("rule", called, (word for words in BUILT_IN.values() for word in words))
        if called in _RULES and _RULES[called].kind != kind:
            raise AntsError(
                f"{called!r} is the name of a rule of the kind {_RULES[called].kind!r}; choose "
                "another name."
            )
        rule = _rule(called, kind, function, reference, summary)
        _try(rule)
        _RULES[called] = rule
        return function

    return add


def get(name: str) -> Rule:
    """Return the rule of this name; AntsError, with a list of all names, if there is none."""
    if not isinstance(name, str) or name not in _RULES:
        known = ", ".join(_RULES) or "none is registered"
        raise AntsError(
            f"there is no rule {shown(name)} ({known}); give the file that registers it with "
            "--plugin, or register it with taichi_ants.rules.register."
        )
    return _RULES[name]


def own(kind: str, name: str) -> Rule | None:
    """Return your rule of this name; None for the built-in rules of a kind."""
    return None if name in BUILT_IN[kind] else get(name)


def names(kind: str | None = None) -> tuple[str, ...]:
    """Return the names of your rules, of one kind or of all, in the order of registration."""
    return tuple(name for name, rule in _RULES.items() if kind in (None, rule.kind))


def words(kind: str) -> tuple[str, ...]:
    """Return all words that name a rule of a kind: the built-in ones, then yours."""
    return (*BUILT_IN[kind], *names(kind))


def _rule(
    name: str,
    kind: str,
    function: Callable[..., Any],
    reference: Callable[..., Any] | None,
    summary: str,
) -> Rule:
    inputs: dict[str, Input] = {}
    arguments = inspect.signature(function).parameters
    for argument in arguments.values():
        if argument.kind is not argument.POSITIONAL_OR_KEYWORD:
            raise AntsError(f"the rule {name!r} has the argument {argument}; use plain arguments.")
        if argument.default is argument.empty:
            one = input_of(kind, argument.name)
            if one is None:
                more = "".join(f", {start}FIELD" for start in KINDS[kind].of_fields)
                raise AntsError(
                    f"the rule {name!r} has the argument {argument.name!r}, which is not an input "
                    f"of the kind {kind!r}; choose from {', '.join(KINDS[kind].inputs)}{more}, or "
                    "give it a default, which makes it a parameter."
                )
            inputs[argument.name] = one
    if reference is not None and list(inspect.signature(reference).parameters) != list(arguments):
        raise AntsError(
            f"reference of the rule {name!r} is {shown(reference)}; it must have the same "
            "arguments in the same order."
        )
    settings = _settings(name, function)
    lengths = {a: inputs[a].length if a in inputs else 0 for a in arguments}
    try:
        source = kernel_source(function, lengths)
    except LanguageError as error:
        raise _unusable(name, error) from None
    return Rule(name, kind, function, reference or function, inputs, settings, source, summary)


def _settings(name: str, function: Callable[..., Any]) -> type[Parameters]:
    """Return a class of settings for the arguments of a function with defaults."""
    hints, given = get_type_hints(function, include_extras=True), {}
    for argument in inspect.signature(function).parameters.values():
        if argument.default is not argument.empty:
            hint = hints.get(argument.name, type(argument.default))
            if get_origin(hint) is not Annotated:
                hint = Annotated[hint, Setting("parameter")]
            if get_args(hint)[0] not in (int, float):
                raise AntsError(
                    f"the parameter {argument.name!r} of the rule {name!r} is "
                    f"{argument.default!r}; declare a whole number (int) or a number (float)."
                )
            given[argument.name] = hint, argument.default
    body = {
        "__doc__": f"The parameters of the rule {name!r}.",
        "__annotations__": {one: hint for one, (hint, _) in given.items()},
        **{one: usual for one, (_, usual) in given.items()},
    }
    made: Any = type(name, (Parameters,), body, path=f"task.rules.{name}")
    settings = dataclass(frozen=True)(made)
    settings()  # checks the defaults
    return settings


def _parameters(name: str, values: Mapping[str, Any]) -> Parameters:
    return get(name).settings(**values)


def tries(rule: Rule, n: int = TRIES) -> Iterator[tuple[dict[str, Any], dict[str, float]]]:
    """Yield n drawn sets of inputs, and of parameters within their ranges, each by name."""
    import numpy as np

    rng, usual = np.random.default_rng(1), vars(rule.settings())
    for inputs in drawn(rule.inputs, n):
        parameters = {name: float(value) for name, value in usual.items()}
        for one in declared(rule.settings):
            least, most = one.rule.least, one.rule.most
            if least is not None and most is not None and rng.random() < 0.5:
                value = rng.choice([least, most, rng.uniform(least, most)])
                parameters[one.name] = float(round(value) if one.kind is int else value)
        yield inputs, parameters


def _try(rule: Rule) -> None:
    """Compute a rule in Python for many inputs; AntsError if it fails or leaves its range."""
    kind = KINDS[rule.kind]
    try:
        for inputs, parameters in tries(rule):
            try:
                result = rule.function(**inputs, **parameters)
            except ArithmeticError as error:
                shows = values_shown(inputs, parameters)
                raise ValueError(f"{type(error).__name__}: {error}, for {shows}") from error
            is_number = isinstance(result, (bool, int, float))
            whole = is_number and (
                not kind.is_whole or (math.isfinite(result) and result == math.floor(result))
            )
            if whole and kind.least <= result <= kind.most:
                continue
            shows = values_shown(inputs, parameters)
            if not is_number:
                raise ValueError(f"it returns {shown(result)}, which is not a number, for {shows}")
            form = "a whole number" if kind.is_whole else "a number"
            raise ValueError(
                f"it returns {result} for {shows}, but must return "
                f"{kind.result.split(':')[0]}, {form} from {kind.least} to {kind.most}"
            )
    except Exception as error:
        said = str(error) if type(error) is ValueError else f"{type(error).__name__}: {error}"
        raise _unusable(rule.name, said) from error


def _unusable(name: str, fault: object) -> AntsError:
    return AntsError(f"rule {name!r} cannot be used: {fault}; see help(taichi_ants.rules.Rule).")
