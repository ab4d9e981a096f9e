"""The settings by which ants choose actions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, ClassVar

from taichi_ants.errors import shown
from taichi_ants.features.castes import Attraction, Caste, Exponent, Temperature
from taichi_ants.features.cues import CUES
from taichi_ants.features.feature import Feature, Task
from taichi_ants.features.rule import Rule, registered, words
from taichi_ants.settings import Setting, Settings, declared

if TYPE_CHECKING:
    import numpy as np

WITHOUT_VALUES = ("deneubourg",)  # rules without action values and exploration
_CELLS = Setting(only=("rule", *WITHOUT_VALUES))


@dataclass(frozen=True)
class Choice(Settings, path="task.choice"):
    """The rule by which ants choose actions.

    Only colonies support "deneubourg", which needs no action values, and the names of your rules,
    see `taichi_ants.rules`. "deneubourg" compares levels of the outbound cue; for ants with food,
    those of `carriers_follow` or a homing pheromone.

    >>> Task(choice="softmax").choice.temperature
    1.0
    """

    sentences: ClassVar[dict[str, str]] = {
        "rule=greedy": "With probability ε, the exploration rate, an ant takes any of the five "
        "actions. Otherwise it takes one with the largest value `Q(s, a)`; ties are broken at "
        "random.",
        "rule=softmax": "With probability ε, the exploration rate, an ant takes any of the five "
        "actions. Otherwise it takes action a with a probability proportional to `exp(Q(s, a) / "
        "{temperature})`.",
        "rule=deneubourg": "An ant gives if it sees its queen, and picks up if it sees food. "
        "Otherwise it enters an open cell ahead with a probability proportional to `({k} + "
        "c)^{exponent}`, where c is the level of the cell; with food, only cells nearer to the "
        "queen if there are any (Deneubourg et al. 1990).",
        "carriers_follow": "Ants with food compare the levels of `{carriers_follow}`.",
    }

    rule: Annotated[
        str, Setting("rule by which ants choose actions", choices=partial(words, "choice"))
    ] = "greedy"
    temperature: Annotated[
        Temperature,
        Setting("difference of action values that makes an action e times as likely"),
        Setting(usual=1.0, only=("rule", "softmax")),
    ] = None
    k: Annotated[
        Attraction,
        Setting("attraction of a cell without a trail", unit="units of trail level"),
        Setting(usual=20.0),
        _CELLS,
    ] = None
    exponent: Annotated[
        Exponent, Setting("exponent of the attraction of a cell", usual=2.0), _CELLS
    ] = None
    carriers_follow: Annotated[
        str | None, Setting("pheromone that ants with food and a compass follow"), _CELLS
    ] = None

    @classmethod
    def named(cls) -> Mapping[str, Choice]:
        """Return the named values: "greedy", "softmax", "deneubourg", and your rules.

        >>> sorted(task.Choice.named())
        ['deneubourg', 'greedy', 'softmax']
        """
        return {rule: cls(rule) for rule in words("choice")}

    @property
    def own_rule(self) -> Rule | None:
        """Your rule, if it is one."""
        return registered("choice", self.rule)

    def weights(self, values: np.ndarray) -> np.ndarray | None:
        """Return numbers proportional to the probabilities of actions without exploration.

        float64 (..., 5); None if ants take one of the best actions.
        """
        import numpy as np

        largest = values.max(axis=-1, keepdims=True)
        if self.rule == "softmax":
            return np.exp((values.astype(float) - largest) / self.temperature)
        return None

    @property
    def needs_table(self) -> bool:
        """Whether ants choose by action values."""
        if self.own_rule is not None:
            return "values" in self.own_rule.inputs
        return self.rule not in WITHOUT_VALUES


def _of_castes(name: str) -> Callable[[Task, Caste], float]:
    """Return a function of a number of a caste, by default that of the task; 0 is unused."""

    def of(task: Task, caste: Caste) -> float:
        own = getattr(caste, name, None)  # castes do not have all of them
        return (getattr(task.choice, name) or 0.0) if own is None else own

    return of


_NUMBERS = ("temperature", "k", "exponent")
# Settings of castes that need a table of action values, or certain rules of choice.
_OF_TABLES = ("policy", "epsilon", "epsilon_spread", "learning_rate", "discount")
_OF_RULES = {one.name: one.rule.only or () for one in declared(Choice) if one.name in _NUMBERS}


def _faults(task: Task) -> Iterator[str]:
    choice = task.choice
    without_states = choice.rule in WITHOUT_VALUES or (choice.own_rule and task.noise.misread)
    if without_states and task.observation != "paper":
        yield (
            f"`task.observation` is {task.observation!r}; it must be 'paper' if `task.choice.rule` "
            f"is {choice.rule!r} and `task.noise.misread` {task.noise.misread}."
        )
    if choice.carriers_follow is not None and task.homing_cue not in CUES:
        yield (
            f"`task.choice.carriers_follow` is {choice.carriers_follow!r}, but `task.homing_cue` "
            f"is {task.homing_cue!r}, which ants with food follow already; leave one of them out."
        )
    unused = [] if choice.needs_table else [*_OF_TABLES]
    unused += [name for name, rules in _OF_RULES.items() if choice.rule not in rules]
    for name, caste in task.castes.items():
        for setting in unused:
            if getattr(caste, setting, None) is not None:
                yield (
                    f"`task.castes.{name}.{setting}` is {shown(getattr(caste, setting))}; leave it "
                    f"out, because `task.choice.rule` is {choice.rule!r}."
                )


CHOICE = Feature(
    Choice,
    uses=lambda task: True,
    numbers=_NUMBERS,
    of_castes={name: _of_castes(name) for name in _NUMBERS},
    faults=_faults,
)
