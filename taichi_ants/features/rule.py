"""The names of rules: those that the engine implements, and yours, which are functions."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from taichi_ants.features.feature import Input
from taichi_ants.registry import Registry
from taichi_ants.settings import Settings, declared

# The rules that the engine implements.
WORDS = {
    "choice": ("greedy", "softmax", "deneubourg"),
    "deposit": ("set", "add", "fading", "none"),
    "evaporation": ("linear", "exponential", "none"),
    "reward": ("by_event",),
}


class RuleKind(NamedTuple):
    """A kind of rule: its result and the range of its result, and its inputs by name."""

    result: str
    least: float
    most: float
    is_whole: bool
    inputs: Mapping[str, Input]
    of_fields: tuple[str, ...] = ()  # the beginnings of inputs that read a field


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
        form: The results and inputs of its kind.
        function: The function. Arguments without a default are inputs; `taichi_ants.rules.KINDS`
            has the inputs of each kind. In "choice" and "reward", `levels_NAME` are the levels of
            the field NAME in the three cells ahead, and `level_NAME` is that of the ant's own cell.
            In "deposit", `level_NAME` is that of the cell of the deposit.
            Arguments with a default are parameters, whole numbers or floats.
        inputs: The inputs by name, in the order of the arguments.
        fields: The names of the fields that the rule reads.
        settings: The class of the parameters.
        source: The source of the function for kernels.
    """

    name: str
    kind: str
    form: RuleKind
    function: Callable[..., Any]
    inputs: Mapping[str, Input]
    fields: tuple[str, ...]
    settings: type[Parameters]
    source: str = ""

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of the parameters, in the order of the arguments."""
        return tuple(setting.name for setting in declared(self.settings))

    def result(self, inputs: Mapping[str, Any], parameters: Mapping[str, Any]) -> float:
        """Return the result of the Python function; it is limited to the range of the kind.

        Actions and rewards are rounded down. A result that is not a number counts as the smallest.
        """
        numbers = {name: float(value) for name, value in parameters.items()}
        form, result = self.form, float(self.function(**inputs, **numbers))
        result = min(max(result, form.least), form.most) if result == result else form.least
        return math.floor(result) if form.is_whole else result


RULES: Registry[Rule] = Registry(
    *("rule", "taichi_ants.rules.register", {}),
    reserved=[name for names in WORDS.values() for name in names],
)
get = RULES.get


def _parameters(name: str, values: Mapping[str, Any]) -> Parameters:
    return RULES.get(name).settings(**values)


def registered(kind: str, name: str) -> Rule | None:
    """Return the rule of this name; None for the words that the engine implements."""
    return None if name in WORDS[kind] else get(name)


def names(kind: str | None = None) -> tuple[str, ...]:
    """Return the names of your rules, of one kind or of all.

    >>> rules.names("deposit")
    ()
    """
    return tuple(name for name in RULES.names() if kind in (None, get(name).kind))


def words(kind: str) -> tuple[str, ...]:
    """Return all words that name a rule of a kind, those that the engine implements first."""
    return (*WORDS[kind], *names(kind))
