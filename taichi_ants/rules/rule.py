"""Rules that you write, their parameters, and their trial on drawn inputs."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from taichi_ants.errors import shown, unusable
from taichi_ants.registry import Registry
from taichi_ants.rules.inputs import KINDS, Input, drawn, field_of, values_shown
from taichi_ants.settings import Settings, declared

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
        inputs: The inputs by name, in the order of the arguments.
        settings: The class of the parameters.
        source: The source of the function for kernels.
    """

    name: str
    kind: str
    function: Callable[..., Any]
    inputs: Mapping[str, Input]
    settings: type[Parameters]
    source: str

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
        kind, result = KINDS[self.kind], float(self.function(**inputs, **numbers))
        result = min(max(result, kind.least), kind.most) if result == result else kind.least
        return math.floor(result) if kind.is_whole else result


# Built-in rules are words, which the engine implements.
RULES: Registry[Rule] = Registry(
    *("rule", "taichi_ants.rules.register", {}),
    reserved=[name for names in BUILT_IN.values() for name in names],
)


def _parameters(name: str, values: Mapping[str, Any]) -> Parameters:
    return RULES.get(name).settings(**values)


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
    form = f"{'a whole number' if kind.is_whole else 'a number'} from {kind.least} to {kind.most}"
    for inputs, parameters in tries(rule):
        try:
            result = rule.function(**inputs, **parameters)
            said = f"it returns {shown(result)}"
            is_number = isinstance(result, (bool, int, float))
            if is_number and kind.least <= result <= kind.most:
                said = said if kind.is_whole and result != math.floor(result) else ""
        except Exception as error:
            said = f"{type(error).__name__}: {error}"
        if said:
            must = f"it must return {kind.result.split(':')[0]}, {form}"
            raise unusable(rule, f"{said} for {values_shown(inputs, parameters)}, but {must}")
