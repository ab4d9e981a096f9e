"""Rules that you write, and their parameters: how a function becomes a rule, and its trial."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from taichi_ants.errors import AntsError, shown, unusable
from taichi_ants.registry import Registry
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
        return RULES.get(name).settings

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
        return tuple(setting.name for setting in declared(self.settings))

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


# Built-in rules are words, which the engine implements.
RULES: Registry[Rule] = Registry(
    *("rule", "taichi_ants.rules.register", {}),
    reserved=[name for names in BUILT_IN.values() for name in names],
)


def _parameters(name: str, values: Mapping[str, Any]) -> Parameters:
    return RULES.get(name).settings(**values)


def rule_of(
    name: str,
    kind: str,
    function: Callable[..., Any],
    reference: Callable[..., Any] | None,
    summary: str,
) -> Rule:
    """Return a rule; AntsError if kernels cannot compute it, or an argument is not an input."""
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
    if reference is not None and list(inspect.signature(reference).parameters) != list(arguments):
        raise AntsError(
            f"reference of the rule {name!r} is {shown(reference)}; it must have the same "
            "arguments in the same order."
        )
    settings = _settings(name, function)
    rule = Rule(name, kind, function, reference or function, inputs, settings, "", summary)
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
                hint = Annotated[hint, Setting("parameter")]
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


def tries(rule: Rule, n: int = TRIES) -> Iterator[tuple[dict[str, Any], dict[str, float]]]:
    """Yield n drawn sets of inputs, and of parameters within their ranges, each by name."""
    import numpy as np

    rng, defaults = np.random.default_rng(1), vars(rule.settings())
    for inputs in drawn(rule.inputs, n):
        parameters = {name: float(value) for name, value in defaults.items()}
        for setting in declared(rule.settings):
            least, most = setting.rule.least, setting.rule.most
            if least is not None and most is not None and rng.random() < 0.5:
                value = rng.choice([least, most, rng.uniform(least, most)])
                parameters[setting.name] = float(round(value) if setting.kind is int else value)
        yield inputs, parameters


def try_in_python(rule: Rule) -> None:
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
        raise unusable(rule, said) from error
