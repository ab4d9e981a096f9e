"""Division of labour by response thresholds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal, get_args

from taichi_ants.settings import Setting, Settings
from taichi_ants.task.choice import Exponent

LabourRule = Literal["none", "thresholds"]
Stimulus = Annotated[float | None, Setting(least=0, most=1e6)]
_DIVIDES = Setting(only=("rule", "thresholds"))


@dataclass(frozen=True)
class Labour(Settings, path="task.labour"):
    """The rule by which ants start and stop foraging; by default, they always forage.

    With "thresholds", after Bonabeau, Theraulaz and Deneubourg (1996), each nest has a stimulus. It
    rises by `demand` in each tick and falls by `relief` with each delivery, but not below 0. An
    idle ant with the threshold t starts foraging with the probability s^n / (s^n + t^n) per tick,
    for a stimulus s and n = `exponent`. A forager without food next to its queen becomes idle with
    the probability `stop_probability` per tick. See `docs/colony.md`.
    """

    rule: Annotated[LabourRule, Setting("rule by which ants start and stop foraging")] = "none"
    demand: Annotated[
        Stimulus,
        Setting("rise of the stimulus of each nest", unit="units of stimulus per tick", usual=1.0),
        _DIVIDES,
    ] = None
    relief: Annotated[
        Stimulus,
        Setting("fall of the stimulus with each delivery", unit="units of stimulus", usual=10.0),
        _DIVIDES,
    ] = None
    exponent: Annotated[
        Exponent,
        Setting("exponent of the response to the stimulus; larger values make it steeper"),
        Setting(usual=2.0, only=("rule", "thresholds")),
    ] = None
    stop_probability: Annotated[
        float | None,
        Setting("probability per tick that a forager without food next to its queen becomes idle"),
        Setting(least=0, most=1, usual=0.2, only=("rule", "thresholds")),
    ] = None

    @classmethod
    def named(cls) -> Mapping[str, Labour]:
        """Return the named values: "none" and "thresholds"."""
        return {rule: cls(rule) for rule in get_args(LabourRule)}

    @property
    def divides(self) -> bool:
        """Whether ants can be idle."""
        return self.rule != "none"

    @property
    def numbers(self) -> tuple[float, float, float]:
        """The numbers `demand`, `relief` and `exponent`, as kernels read them."""
        return self.demand or 0.0, self.relief or 0.0, self.exponent or 0.0
