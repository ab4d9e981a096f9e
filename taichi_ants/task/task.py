"""The rules of traffic and of life, and the class of all rules."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from functools import cache, partial
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Literal

from taichi_ants.errors import shown
from taichi_ants.features import FEATURES, probabilities, used_by
from taichi_ants.features.castes import ALL, NOTHING, Caste, parts_in
from taichi_ants.features.choice import Choice
from taichi_ants.features.cues import COMPASS, CUES
from taichi_ants.features.fields import TRAIL, Field
from taichi_ants.features.foods import Food
from taichi_ants.features.labour import Labour
from taichi_ants.features.life import Life
from taichi_ants.features.noise import Noise
from taichi_ants.features.pheromone import Pheromone
from taichi_ants.features.rule import Parameters, Rule, registered, words
from taichi_ants.settings import Named, Setting, Settings
from taichi_ants.task import observations
from taichi_ants.task.observations import Observation
from taichi_ants.task.rewards import Rewards

Delivery = Literal["terminates", "truncates"]


@dataclass(frozen=True)
class Traffic(Settings, path="task.traffic"):
    """Rules for entering a cell with an ant on it; by default, as in the paper, no ant may.

    A pushed ant gets the reward of a move onto an empty cell. With `follow`, all ants of a queue
    move at once, but a ring of ants does not move.

    >>> Task(traffic=task.Traffic(swap=True)).traffic.follow
    False
    """

    sentences: ClassVar[dict[str, str]] = {
        "": "If several ants want a cell or a food item, one of them wins, by a hash of its cell "
        "and the tick. A move that fails turns the ant nevertheless.",
        "swap": "An ant with food that wins a cell changes places with an ant without food on it, "
        "unless that ant enters a cell itself or tries to pick up food.",
        "follow": "An ant can enter a cell whose ant leaves it in the same tick.",
        "carriers_first": "For a cell, ants with food win against ants without food.",
        "reward_pushed": "An ant that is pushed onto the cell that it wanted gets the reward of "
        "that move.",
    }

    swap: Annotated[bool, Setting("let ants with food change places with ants without")] = False
    follow: Annotated[bool, Setting("let ants enter cells that ants leave in the tick")] = False
    carriers_first: Annotated[
        bool, Setting("let carriers win cells that foragers want too; requires swap or follow")
    ] = False
    reward_pushed: Annotated[
        bool, Setting("reward a push onto the cell that the ant wanted", only=("swap", True))
    ] = False

    def _faults(self) -> Iterator[str]:
        if self.carriers_first and not self.shared:
            yield (
                "`task.traffic.carriers_first` is True; leave it out unless `swap` or `follow` is "
                "True."
            )

    @classmethod
    def named(cls) -> Mapping[str, Traffic]:
        """Return the named values: "blocking", "right_of_way" and "following".

        >>> sorted(task.Traffic.named())
        ['blocking', 'following', 'right_of_way']
        """
        return {
            "blocking": cls(),
            "right_of_way": cls(swap=True),
            "following": cls(swap=True, follow=True, carriers_first=True, reward_pushed=True),
        }

    @property
    def shared(self) -> bool:
        """Whether any ant may enter a cell with an ant on it."""
        return self.swap or self.follow


@dataclass(frozen=True, repr=False)
class Task(Settings, path="task"):
    """The rules of perception, action and reward; by default, those of the paper.

    `traffic` and `choice` can be names of `Traffic.named` and `Choice.named`. If `delivery`
    "terminates", the target of the update is the reward alone; if it "truncates", the update
    bootstraps from the next observation. Both end an episode of one ant. Kernels are compiled for
    an observation, a kind of pheromone, and rules of choice and noise; they read all other settings
    as numbers.

    >>> Task(traffic="right_of_way").traffic.swap
    True
    """

    sentences: ClassVar[dict[str, str]] = {
        "": "An ant sees a cell in view as O if it cannot be entered, as F (food) if the ant has "
        "no food, as Q (its queen) if it has, and else as E or as its cue: T without food, S with "
        "food. A move (left, forward, right) turns the ant and enters the cell there if that is "
        "possible. Picking up takes food in view, and the ant turns around. Giving needs the queen "
        "in view.",
        "outbound_cue": "Ants without food see cells as T by the levels of `{outbound_cue}`.",
        **{f"homing_cue={name}": f"With food, cells {c.words} are S." for name, c in CUES.items()},
        "homing_cue": "With food, cells are S by the levels of `{homing_cue}`.",
        "turns_at_queen": "An ant turns around after a delivery.",
        "delivery=terminates": "At a delivery, the target of an update is the reward alone.",
        "delivery=truncates": "At a delivery, the target also has the value of the next state.",
        "evaporation_in_training=no": "Pheromones do not evaporate while ants learn.",
        "evaporation_in_evaluation=no": "Pheromones do not evaporate in the evaluation.",
    }

    observation: Annotated[str, Setting("what an ant sees", choices=observations.names)] = "paper"
    rewards: Annotated[Rewards, Setting("reward of each event")] = Rewards()
    pheromone: Annotated[Pheromone, Setting("rules of the trail")] = Pheromone()
    fields: Annotated[Named[Field], Setting("further pheromones, by name")] = field(
        default_factory=Named
    )
    outbound_cue: Annotated[
        str, Setting("pheromone that ants without food see as T: trail, or the name of a field")
    ] = TRAIL
    homing_cue: Annotated[
        str,
        Setting(f"what ants with food see as S: {', '.join(CUES)}, trail, or the name of a field"),
    ] = COMPASS
    traffic: Annotated[Traffic, Setting("rules for entering a cell with an ant on it")] = Traffic()
    turns_at_queen: Annotated[bool, Setting("turn ants around after a delivery")] = False
    delivery: Annotated[
        Delivery, Setting("end of an episode at a delivery; updates bootstrap if it truncates")
    ] = "terminates"
    evaporation_in_training: Annotated[bool, Setting("evaporate trails while ants learn")] = False
    evaporation_in_evaluation: Annotated[bool, Setting("evaporate trails in evaluations")] = True
    life: Annotated[Life, Setting("changes of ants and food in colonies")] = Life()
    choice: Annotated[Choice, Setting("rule by which ants choose actions")] = Choice()
    noise: Annotated[Noise, Setting("failures of actions and observations")] = Noise()
    foods: Annotated[
        Named[Food],
        Setting("kinds of food, in the order of their numbers in worlds; colonies only"),
    ] = field(default_factory=Named)
    castes: Annotated[
        Named[Caste], Setting("castes of ants, in the order of their numbers; colonies only")
    ] = field(default_factory=Named)
    labour: Annotated[Labour, Setting("rule by which ants start and stop foraging")] = Labour()
    reward: Annotated[
        str,
        Setting("rule of rewards: by_event (task.rewards), or yours; colonies only"),
        Setting(choices=partial(words, "reward")),
    ] = "by_event"
    rules: Annotated[
        Named[Parameters], Setting("parameters of rules that are functions, by name")
    ] = field(default_factory=Named)

    def check(self) -> None:
        """Check each value, and complete the parameters of your rules."""
        super().check()
        used = {rule.name: self.rules.get(rule.name) or rule.settings() for rule in self.own_rules}
        others = {name: self.rules[name] for name in self.rules if name not in used}
        object.__setattr__(self, "rules", Named({**used, **others}))

    def _faults(self) -> Iterator[str]:
        for what, field_name, *more in self._names_of_fields():
            known = (*more, *self.pheromones)
            if field_name is not None and field_name not in known:
                yield (
                    f"{what} is {shown(field_name)}; it must be one of {', '.join(known)}, or the "
                    "name of a field that you add to `task.fields`."
                )
        for feature in FEATURES:
            yield from feature.faults(self)
        nests = {caste.nest for caste in self.castes.values() if caste.nest is not None}
        for nest in (nests or {0}) if self.castes else ():
            parts_in(self.castes, nest)  # raises AntsError
        rules = {rule.name: rule for rule in self.own_rules}
        for name in self.rules:
            if name not in rules:
                yield (
                    f"`task.rules` has parameters of {name!r}, a rule that the task does not use; "
                    "leave them out, or name the rule, for example in `task.choice.rule`."
                )
            for read in rules[name].inputs if name in rules else ():
                owner = next((one for one in FEATURES if read in one.inputs), None)
                if owner is not None and not owner.is_used(self):
                    example = owner.example[owner.group]
                    yield (
                        f"the rule {name!r} reads `{read}`; set `task.{owner.group}`, for example "
                        f"to {example!r}."
                    )

    def _names_of_fields(self) -> Iterator[tuple[Any, ...]]:
        """Yield each name of a pheromone in the settings, after what it is, with further words."""
        yield "`task.choice.carriers_follow`", self.choice.carriers_follow
        for name in self.sees.reads:
            yield f"a field that the observation {self.observation!r} reads", name
        for rule in self.own_rules:
            for name in rule.fields:
                yield f"a field that the rule {rule.name!r} reads", name
        owners: dict[str, Any] = {f"task.castes.{n}": caste for n, caste in self.castes.items()}
        owners["task"] = self
        for path, owner in owners.items():
            yield f"`{path}.outbound_cue`", owner.outbound_cue
            yield f"`{path}.homing_cue`", owner.homing_cue, *CUES
            if isinstance(owner, Caste):
                for name in owner.pheromones_laid([*self.pheromones]):
                    yield f"a name in `{path}.lays`", name, ALL, NOTHING

    @property
    def needs_table(self) -> bool:
        """Whether ants choose by action values."""
        return self.choice.needs_table

    @property
    def own_reward(self) -> Rule | None:
        """Your rule of rewards, if the task has one."""
        return registered("reward", self.reward)

    @property
    def own_rules(self) -> tuple[Rule, ...]:
        """Your rules that the task uses, each once."""
        pheromones = self.pheromones.values()
        of_fields = [r for p in pheromones for r in (p.own_deposit, p.own_evaporation)]
        return tuple(
            dict.fromkeys(filter(None, (self.choice.own_rule, self.own_reward, *of_fields)))
        )

    def replace(self, /, **changes: Any) -> Task:
        """Return the task with changes; rules that it no longer uses lose their parameters.

        >>> Task().replace(pheromone={"level": 300}).pheromone.level
        300
        """
        bare, parameters = self, changes.pop("rules", {})
        if self.rules:
            bare = copy.copy(self)
            object.__setattr__(bare, "rules", Named())
        task = super(Task, bare).replace(**changes)
        kept = {name: self.rules.get(name, default) for name, default in task.rules.items()}
        object.__setattr__(task, "rules", Named(kept))
        return task if parameters == {} else super(Task, task).replace(rules=parameters)

    @property
    def food_changes(self) -> bool:
        """Whether food grows back or wanders."""
        grows = any(food.regrowth is not None for food in self.foods.values())
        return self.life.regrowth is not None or self.life.pile_move_interval is not None or grows

    @property
    def ants_change(self) -> bool:
        """Whether ants are born or die."""
        return self.life.births or any("aged" in feature.hooks for feature in used_by(self))

    def cues_of(self, caste: Caste | None) -> tuple[int, int]:
        """Return the numbers of the outbound and the homing cue of a caste, or of the task."""
        outbound, homing = (
            getattr(caste, setting, None) or getattr(self, setting)
            for setting in ("outbound_cue", "homing_cue")
        )
        return self.number_of(outbound), self.number_of(homing)

    @property
    def all_cues(self) -> tuple[tuple[int, int], ...]:
        """The numbers of the outbound and homing cues of all castes, without repetitions."""
        if not self.castes:
            return (self.cues_of(None),)
        return tuple(sorted({self.cues_of(caste) for caste in self.castes.values()}))

    @classmethod
    @cache
    def named(cls) -> Mapping[str, Task]:
        """Return the named tasks: "paper", "fetching", "foraging" and "queueing".

        >>> sorted(Task.named())
        ['fetching', 'foraging', 'paper', 'queueing']
        """
        built = (paper, fetching, foraging, queueing)
        return MappingProxyType({function.__name__: function() for function in built})

    @property
    def sees(self) -> Observation:
        """The registered observation."""
        return observations.get(self.observation)

    def uses(self) -> dict[str, str]:
        """Return the features in use; one is `reads`, fields that the observation reads."""
        reads = ", ".join(self.sees.reads)
        words = f"the observation {self.observation!r} reads {reads}"
        return super().uses() | ({"reads": words} if reads else {})

    @property
    def n_states(self) -> int:
        """The number of states."""
        return self.sees.n_states

    @property
    def numbers(self) -> dict[str, Any]:
        """The numbers of all rules but the pheromone's, as kernels read them; -1 is off."""
        life, off = self.life, -1
        return {
            "turns_at_queen": int(self.turns_at_queen),
            "delivery_terminates": int(self.delivery != "truncates"),
            "births": int(life.births),
            "lifespan": life.lifespan or off,
            "regrowth": off if life.regrowth is None else life.regrowth,
            "pile_move_interval": life.pile_move_interval or off,
            **probabilities(self),
        }

    @property
    def pheromones(self) -> dict[str, Pheromone]:
        """The trail, then the fields, by name."""
        return {TRAIL: self.pheromone, **self.fields}

    def pheromones_while(self, learning: bool) -> tuple[Pheromone, ...]:
        """Return the trail, then the fields, for learning or evaluation, by number.

        They do not evaporate if that is off.
        """
        falls = self.evaporation_in_training if learning else self.evaporation_in_evaluation
        pheromones = self.pheromones.values()
        return tuple(pheromone if falls else pheromone.lasting for pheromone in pheromones)

    @property
    def cues(self) -> tuple[str, ...]:
        """The names of all cues by number, the trail and fields first; -1 is the compass."""
        return (*self.pheromones, *reversed(CUES))

    def number_of(self, cue: str) -> int:
        """Return the number of a cue; those of pheromones are not negative."""
        return self.cues.index(cue) - (len(self.cues) if cue in CUES else 0)

    def as_dict(self) -> dict[str, Any]:
        """Return the task as names and numbers; `from_dict` reads it.

        >>> Task.from_dict(Task(turns_at_queen=True).as_dict()).turns_at_queen
        True
        """
        return asdict(self)


def foraging() -> Task:
    """Return a task: trails rise towards food, carriers have right of way, ants see each other.

    >>> task.foraging().traffic.swap
    True
    """
    return Task(
        observation="ants",
        pheromone=Pheromone(deposit="fading", level=500, view="strongest"),
        traffic=Traffic.named()["right_of_way"],
        evaporation_in_training=True,
    )


def queueing() -> Task:
    """Return `foraging` with queues whose ants move at once, and ants that see which to follow.

    If an ant with food is on the strongest trail in view, no weaker trail is seen as T.

    >>> task.queueing().observation
    'queues'
    """
    view = {"view": "strongest_under_carriers"}
    return foraging().replace(
        observation="queues", pheromone=view, traffic="following", turns_at_queen=True
    )


def fetching() -> Task:
    """Return the paper's task without its reward for moves onto a trail or nearer to the queen.

    An episode of one ant rewards only one pick-up and one delivery. Therefore circling does not
    pay, and the best policy delivers, at discounts from 0.9 to 0.999; see
    `docs/how-to/train_an_agent.md`.

    >>> task.fetching().rewards.shaping
    0
    """
    return Task(rewards=Rewards(shaping=0))


def paper() -> Task:
    """Return the paper's task, which is the default everywhere.

    >>> task.paper() == Task()
    True
    """
    return Task()
