"""The rules of the game."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any, Literal, get_args

from taichi_ants.errors import AntsError, check_one_of, checked_flag, expect, shown
from taichi_ants.task import observations
from taichi_ants.task.life import Life
from taichi_ants.task.observations import Observation
from taichi_ants.task.pheromone import Pheromone
from taichi_ants.task.rewards import Rewards

Delivery = Literal["absorbing", "continuing"]
DELIVERIES: tuple[str, ...] = get_args(Delivery)
_PARTS = {"rewards": Rewards, "pheromone": Pheromone, "life": Life}


@dataclass(frozen=True)
class Task:
    """What an ant perceives, may do and is paid for; the paper's by default.

    `observation` and what kind of pheromone there is are compiled into the kernels; all else is
    numbers that kernels read.

    Attributes:
        observation: Name of a registered observation, which tells what row of its table an ant
            looks at, see `taichi_ants.task.observations`.
        rewards: What each event pays.
        pheromone: How trails are laid, fall and spread.
        delivery: "absorbing": the delivery is a terminal state, its target is the reward alone.
            "continuing": the update at delivery bootstraps from what the ant then sees. An episode
            of one ant ends in both.
        evaporation_in_training: Whether trails fall, as the pheromone says, while ants learn.
        evaporation_in_evaluation: Whether they do while nobody learns.
        life: What comes and goes; colonies only.

    Raises:
        AntsError: A value is not allowed; the message names it.
    """

    observation: str = "paper"
    rewards: Rewards = field(default_factory=Rewards)
    pheromone: Pheromone = field(default_factory=Pheromone)
    delivery: Delivery = "absorbing"
    evaporation_in_training: bool = False
    evaporation_in_evaluation: bool = True
    life: Life = field(default_factory=Life)

    def __post_init__(self) -> None:
        observations.get(self.observation)
        for name, kind in _PARTS.items():
            expect(name, getattr(self, name), kind)
        check_one_of("delivery", self.delivery, DELIVERIES)
        for name in ("evaporation_in_training", "evaporation_in_evaluation"):
            object.__setattr__(self, name, checked_flag(name, getattr(self, name)))

    @property
    def sees(self) -> Observation:
        """The observation itself."""
        return observations.get(self.observation)

    @property
    def n_states(self) -> int:
        """The rows of a table of action values."""
        return self.sees.n_states

    def as_dict(self) -> dict[str, Any]:
        """The task as names and numbers, for files; `from_dict` reads it."""
        return asdict(self)

    @classmethod
    def from_dict(cls, facts: Mapping[str, Any]) -> Task:
        """The task of `as_dict`.

        Raises:
            AntsError: A value is not allowed, or there is no such field.
        """
        given = dict(_known("a task", cls, facts))
        for name, kind in _PARTS.items():
            if name in given:
                given[name] = kind(**_known(name, kind, given[name]))
        return cls(**given)


def _known(what: str, kind: type, facts: Mapping[str, Any]) -> Mapping[str, Any]:
    """The facts, if each is a field of that kind."""
    expect(what, facts, Mapping)
    known = sorted(one.name for one in fields(kind))
    for name in facts:
        if name not in known:
            raise AntsError(f"{what} has no {shown(name)}; choose among {', '.join(known)}.")
    return facts
