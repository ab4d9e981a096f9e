"""The rules of the game."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Annotated, Any, Literal, get_args

from taichi_ants.settings import Is, Settings
from taichi_ants.task import observations
from taichi_ants.task.life import Life
from taichi_ants.task.observations import Observation
from taichi_ants.task.pheromone import Pheromone
from taichi_ants.task.rewards import Rewards
from taichi_ants.task.traffic import Traffic

Delivery = Literal["terminates", "truncates"]
DELIVERIES: tuple[str, ...] = get_args(Delivery)


@dataclass(frozen=True, repr=False)
class Task(Settings, path="task"):
    """The rules of perception, action and reward; the paper's by default.

    `observation` and the kind of pheromone are compiled into the kernels; all else is numbers that
    kernels read. `traffic` may be one of the names of `Traffic.named`. A delivery that "terminates"
    is a terminal state, so its target is the reward alone; the update of one that "truncates"
    bootstraps from what the ant then sees. An episode of one ant ends in both.

    Raises:
        AntsError: A value is not allowed; the message names it.
    """

    observation: Annotated[str, Is("what an ant sees", choices=observations.names)] = "paper"
    rewards: Annotated[Rewards, Is("reward of each event")] = field(default_factory=Rewards)
    pheromone: Annotated[Pheromone, Is("how trails are laid, evaporate and spread")] = field(
        default_factory=Pheromone
    )
    traffic: Annotated[Traffic, Is("who may enter a cell with an ant on it")] = field(
        default_factory=Traffic
    )
    turns_at_queen: Annotated[bool, Is("turn ants round when they have given their food")] = False
    delivery: Annotated[Delivery, Is("whether the update at a delivery bootstraps")] = "terminates"
    evaporation_in_training: Annotated[bool, Is("evaporate trails while ants learn")] = False
    evaporation_in_evaluation: Annotated[bool, Is("evaporate trails while nobody learns")] = True
    life: Annotated[Life, Is("what comes and goes (colonies only)")] = field(default_factory=Life)

    @classmethod
    def named(cls) -> Mapping[str, Task]:
        """Tasks that have names: "paper", "foraging" and "queueing"."""
        return {"paper": paper(), "foraging": foraging(), "queueing": queueing()}

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
        """The number of states."""
        return self.sees.n_states

    @property
    def numbers(self) -> dict[str, int]:
        """The numbers of all rules but the pheromone's, as kernels read them; -1 is off."""
        life, off = self.life, -1
        return {
            "turns_at_queen": int(self.turns_at_queen),
            "delivery_terminates": int(self.delivery != "truncates"),
            "births": int(life.births),
            "lifespan": life.lifespan or off,
            "regrowth": off if life.regrowth is None else life.regrowth,
            "wander": life.wander or off,
        }

    def pheromone_while(self, learning: bool) -> Pheromone:
        """The pheromone while ants learn, or while nobody does: with evaporation or without."""
        falls = self.evaporation_in_training if learning else self.evaporation_in_evaluation
        return self.pheromone if falls else self.pheromone.lasting

    def as_dict(self) -> dict[str, Any]:
        """The task as names and numbers, for files; `from_dict` reads it."""
        return asdict(self)


def foraging() -> Task:
    """A task: trails rise towards food, carriers have right of way, ants see each other."""
    return Task(
        observation="ants",
        pheromone=Pheromone(deposit="fading", level=500, view="strongest"),
        traffic=Traffic.named()["right_of_way"],
        evaporation_in_training=True,
    )


def queueing() -> Task:
    """As `foraging`; besides, queues move as one, and ants see which ones are worth following.

    Where the trail that leads to food lies under an ant with food, no weaker one looks like it.
    """
    view = {"view": "strongest_under_carriers"}
    return foraging().but(
        observation="queues", pheromone=view, traffic="following", turns_at_queen=True
    )


def paper() -> Task:
    """The paper's task, which is the default everywhere."""
    return Task()
