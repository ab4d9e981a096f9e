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
from taichi_ants.task.traffic import Traffic

Delivery = Literal["absorbing", "continuing"]
DELIVERIES: tuple[str, ...] = get_args(Delivery)
_PARTS = {"rewards": Rewards, "pheromone": Pheromone, "traffic": Traffic, "life": Life}


@dataclass(frozen=True, repr=False)
class Task:
    """What an ant perceives, may do and is paid for; the paper's by default.

    `observation` and what kind of pheromone there is are compiled into the kernels; all else is
    numbers that kernels read.

    Attributes:
        observation: Name of a registered observation, which tells what row of its table an ant
            looks at, see `taichi_ants.task.observations`.
        rewards: What each event pays.
        pheromone: How trails are laid, fall and spread.
        traffic: Who may enter a cell on which another ant stands: a `Traffic`, or the name of one.
            "blocking": nobody. "right_of_way": an ant with food changes places with one without.
            "following": besides, queues move as one.
        turns_at_queen: Whether an ant turns round when it has given its food, as it does when it
            has picked one up.
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
    traffic: Traffic = field(default_factory=Traffic)
    turns_at_queen: bool = False
    delivery: Delivery = "absorbing"
    evaporation_in_training: bool = False
    evaporation_in_evaluation: bool = True
    life: Life = field(default_factory=Life)

    def __post_init__(self) -> None:
        observations.get(self.observation)
        if isinstance(self.traffic, str):
            object.__setattr__(self, "traffic", Traffic.named(self.traffic))
        for name, kind in _PARTS.items():
            expect(name, getattr(self, name), kind)
        check_one_of("delivery", self.delivery, DELIVERIES)
        for name in ("turns_at_queen", "evaporation_in_training", "evaporation_in_evaluation"):
            object.__setattr__(self, name, checked_flag(name, getattr(self, name)))

    def __repr__(self) -> str:
        """What is not as in the paper."""
        usual, own = vars(Task()), vars(self)
        given = [f"{name}={own[name]!r}" for name in own if own[name] != usual[name]]
        return f"Task({', '.join(given)})"

    @property
    def sees(self) -> Observation:
        """The observation itself."""
        return observations.get(self.observation)

    @property
    def n_states(self) -> int:
        """The rows of a table of action values."""
        return self.sees.n_states

    def pheromone_while(self, learning: bool) -> Pheromone:
        """The pheromone while ants learn, or while nobody does: with evaporation or without."""
        falls = self.evaporation_in_training if learning else self.evaporation_in_evaluation
        return self.pheromone if falls else self.pheromone.lasting

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
            if name in given and not (kind is Traffic and isinstance(given[name], str)):
                part = dict(_known(name, kind, given[name]))
                if part.get("deposit") == "none":  # older files have a level beside it
                    part.pop("level", None)
                given[name] = kind(**part)
        return cls(**given)


def foraging() -> Task:
    """A task in which the trails of a colony help.

    Trails rise towards food, ants with food have right of way, and ants see each other.
    """
    return Task(
        observation="ants",
        pheromone=Pheromone(deposit="fading", level=500, view="strongest"),
        traffic=Traffic.named("right_of_way"),
        evaporation_in_training=True,
    )


def queueing() -> Task:
    """As `foraging`; besides, queues move as one, and ants see which ones are worth following.

    Where the trail that leads to food lies under an ant with food, no weaker one looks like it.
    Ants turn round at the queen, back towards where they came from.
    """
    return Task(
        observation="queues",
        pheromone=Pheromone(deposit="fading", level=500, view="strongest_under_carriers"),
        traffic=Traffic.named("following"),
        turns_at_queen=True,
        evaporation_in_training=True,
    )


def paper() -> Task:
    """The paper's task, which is the default everywhere."""
    return Task()


def _known(what: str, kind: type, facts: Mapping[str, Any]) -> Mapping[str, Any]:
    """The facts, if each is a field of that kind."""
    expect(what, facts, Mapping)
    known = sorted(one.name for one in fields(kind))
    for name in facts:
        if name not in known:
            raise AntsError(f"{what} has no {shown(name)}; choose among {', '.join(known)}.")
    return facts
