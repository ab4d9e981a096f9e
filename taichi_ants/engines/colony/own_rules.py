"""Rules that you wrote in the kernels of a colony; `own_inputs` has what they read."""

from collections.abc import Callable, Sequence
from typing import Any

import taichi as ti

from taichi_ants.engines.own_rules import bounded_function, for_kernels
from taichi_ants.rules import Rule


class OwnRule:
    """A rule in kernels: its function, and the place of its parameters in `rule_numbers`."""

    def __init__(self, rule: Rule, column: int) -> None:
        self.inputs, self.function = tuple(rule.inputs), bounded_function(rule)
        self.places = range(column, column + len(rule.parameters))

    def bound(self, c: Any) -> Callable[..., Any]:
        """Return a function of inputs by name, for kernels; it ignores inputs that are not read."""

        def call(**inputs: Any) -> Any:
            numbers = [_number(c, column) for column in self.places]
            return self.function(*(inputs[name] for name in self.inputs), *numbers)

        return for_kernels(call)


def own_rule(rules: Sequence[Rule], name: str) -> OwnRule | None:
    """Return the rule of this name; None if there is none. `rules` are all rules of a task."""
    column = 0
    for rule in rules:
        if rule.name == name:
            return OwnRule(rule, column)
        column += len(rule.parameters)
    return None


@ti.func
def _number(c: ti.template(), column: ti.template()):
    """Return a parameter of a rule."""
    return c.rule_numbers[column]
