"""Edits: the interventions that pages send, and the numbers that their sliders change.

An edit is JSON, a mapping from the name of an intervention to its settings or its short form, see
`taichi_ants.interventions`. "episode" ends the episode and begins the next one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.rules.rule import Parameters
from taichi_ants.settings import declared

Edit = dict[str, Any]


class Value(NamedTuple):
    """A number that a slider shows and changes."""

    value: float  # at present
    least: float
    most: float
    step: float  # of the slider; if it is an int, all values are whole numbers
    path: str  # the name of the intervention, for "task" followed by that of the setting
    edits: Mapping[str, Edit] | None = None  # the edits for "0" and "1", for a switch
    help: str = ""  # of a parameter of a rule that a user wrote


def values(interventions: Interventions) -> dict[str, Value]:
    """Return the values of the sliders for a colony, by name, if they have an effect there.

    - ants: the number of living ants, and if changed, also at the start of later episodes.
    - epsilon, learning_rate: if changed, they no longer decay.
    - deposit: the `level` of `Pheromone`; slope, cap, half_life, diffusion: as in `Pheromone`.
    - evaporation: 1 if trails evaporate, else 0.
    - RULE.PARAMETER: a parameter of a rule that you wrote.
    """
    colony, pheromone = interventions.colony, interventions.colony.pheromones[0]
    living, rules = int(np.count_nonzero(colony.living[0])), "task.pheromone"
    values = {"ants": Value(max(living, 1), 1, colony.capacity, 1, "ants")}
    if colony.task.choice.needs_table:
        values["epsilon"] = Value(colony.epsilon, 0.0, 1.0, 0.01, "epsilon")
    if colony.sharing != "frozen":
        values["learning_rate"] = Value(colony.learning_rate, 0.0, 1.0, 0.001, "learning_rate")
    numbers = (("deposit", "level", 1000), ("slope", "slope", 100), ("cap", "cap", 10_000))
    for name, setting, largest in numbers:
        number = getattr(pheromone, setting)
        if number is not None and not (setting == "level" and pheromone.deposit == "none"):
            values[name] = Value(int(number), 1, max(largest, int(number)), 1, f"{rules}.{setting}")
    falls, evaporating = pheromone.evaporation != "none", colony.task.pheromone
    if evaporating.evaporation == "none":
        evaporating = replace(evaporating, evaporation="linear")
    if (evaporating.lasting if falls else evaporating).dense == pheromone.dense:
        flag = "evaporation_in_training" if colony.learns else "evaporation_in_evaluation"
        switches: dict[str, Edit] = {str(n): {"task": {flag: bool(n)}} for n in (0, 1)}
        if colony.task.pheromone.evaporation == "none":
            switches["1"]["task"]["pheromone.evaporation"] = "linear"
        values["evaporation"] = Value(int(falls), 0, 1, 1, "task", switches)
    if pheromone.half_life is not None:
        half_life = float(pheromone.half_life)
        values["half_life"] = Value(
            half_life, min(1.0, half_life), max(1000.0, half_life), 0.5, f"{rules}.half_life"
        )
    if pheromone.dense:  # integer trails cannot diffuse, and dense trails cannot become integers
        least = 0.0 if pheromone.evaporation == "exponential" else min(0.01, pheromone.diffusion)
        values["diffusion"] = Value(
            float(pheromone.diffusion), float(least), 1.0, 0.01, f"{rules}.diffusion"
        )
    return values | _of_rules(colony.task.rules)


def _of_rules(rules: Mapping[str, Parameters]) -> dict[str, Value]:
    """Return the values of the parameters of rules, by RULE.PARAMETER."""
    values = {}
    for name, parameters in rules.items():
        for setting in declared(type(parameters)):
            value, rule = getattr(parameters, setting.name), setting.rule
            # A bound that is not declared leaves room on the side of the default.
            low = rule.above if rule.least is None else rule.least
            least = min(value, 0, 2 * setting.default) if low is None else low
            most = max(value, 2 * setting.default, least + 1) if rule.most is None else rule.most
            step = 1 if setting.kind is int else 10.0 ** math.floor(math.log10(most - least) - 2)
            least += step * (rule.least is None and rule.above is not None)
            help = f"{rule.help} of the rule {name}, by default {setting.default:g}"
            path = f"task.rules.{name}.{setting.name}"
            values[f"{name}.{setting.name}"] = Value(value, least, most, step, path, help=help)
    return values
