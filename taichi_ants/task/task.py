"""The rules of the game: who may enter a cell, what comes and goes, and all rules together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Annotated, Any, Literal, get_args

from taichi_ants.errors import AntsError
from taichi_ants.settings import Is, Settings
from taichi_ants.task import observations
from taichi_ants.task.constants import MAX_STEPS
from taichi_ants.task.observations import Observation
from taichi_ants.task.pheromone import Pheromone
from taichi_ants.task.rewards import Rewards

Delivery = Literal["terminates", "truncates"]
DELIVERIES: tuple[str, ...] = get_args(Delivery)
Ticks = Annotated[int | None, Is(unit="ticks", least=1, most=MAX_STEPS)]


@dataclass(frozen=True)
class Traffic(Settings, path="task.traffic"):
    """The ants that may enter a cell on which another ant stands; none by default, as in the paper.

    Where some may, every ant that tries to move claims the cell ahead of it, unless a rock, food,
    the queen or the end of the world is there. Of several claims to a cell the one with the
    smallest hash wins, see `docs/colony.md`. With `swap`, an ant with food that wins a cell changes
    places with the ant on it, if that ant has no food, does not move itself, and does not pick up a
    food in view; the ant that is pushed is paid as for a move onto an empty cell. With `follow`, a
    queue moves as one; a ring of ants that want each other's cells stays where it is.
    """

    swap: Annotated[bool, Is("let ants with food change places with ants without")] = False
    follow: Annotated[bool, Is("let ants enter a cell that its ant leaves in the same tick")] = (
        False
    )
    carriers_first: Annotated[bool, Is("let ants with food win a cell against ants without")] = (
        False
    )
    grant: Annotated[
        bool, Is("pay a pushed ant for the move that it wanted, if it got it", only=("swap", True))
    ] = False

    def __post_init__(self) -> None:
        self.check()
        if self.carriers_first and not self.shared:
            raise AntsError(
                "`task.traffic.carriers_first` is True; leave it out unless `swap` or `follow` is "
                "True."
            )

    @classmethod
    def named(cls) -> Mapping[str, Traffic]:
        """Values that have names: "blocking", "right_of_way" and "following"."""
        return {
            "blocking": cls(),
            "right_of_way": cls(swap=True),
            "following": cls(swap=True, follow=True, carriers_first=True, grant=True),
        }

    @property
    def shared(self) -> bool:
        """Whether any ant may enter a cell on which another one stands."""
        return self.swap or self.follow


@dataclass(frozen=True)
class Life(Settings, path="task.life"):
    """The ants and food that come and go; by default none do. Colonies only.

    None means that ants do not die, food does not grow back, or food stays. With `regrowth` 0, food
    grows back in the same tick.
    """

    births: Annotated[bool, Is("turn each food item that the queen is given into an ant")] = False
    lifespan: Annotated[Ticks, Is("age at which an ant dies")] = None
    regrowth: Annotated[Ticks, Is("time until food grows back where it was taken", least=0)] = None
    wander: Annotated[Ticks, Is("interval at which each pile of food moves by one cell")] = None

    @property
    def changes(self) -> bool:
        """Whether anything comes or goes."""
        return self != Life()


@dataclass(frozen=True, repr=False)
class Task(Settings, path="task"):
    """The rules of perception, action and reward; the paper's by default.

    `observation` and the kind of pheromone are compiled into the kernels; all else is numbers that
    kernels read. `traffic` may be one of the names of `Traffic.named`. A delivery that "terminates"
    is a terminal state, so its target is the reward alone; the update of one that "truncates"
    bootstraps from what the ant then sees. An episode of one ant ends in both.
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
