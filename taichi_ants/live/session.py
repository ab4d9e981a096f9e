"""A colony that people watch and change: deterministic, recorded, replayed to the bit."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from taichi_ants import learners, worlds
from taichi_ants.checks import MAX_ANTS, checked_q_values, checked_seeds, checked_share
from taichi_ants.engines.colony.colony import Colony
from taichi_ants.engines.colony.hand import Hand
from taichi_ants.engines.stored import FileKind
from taichi_ants.errors import AntsError, check_one_of, checked_whole, expect, shown
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.live import edits
from taichi_ants.task import Task
from taichi_ants.task.constants import MAX_STEPS
from taichi_ants.viewer import Recorder
from taichi_ants.worlds.world import World

MOST_CELLS = 1_000_000
MOST_TICKS = 1_000_000_000

_KIND = FileKind("taichi-ants session 1", "session", "Session.save")


@dataclass(frozen=True, eq=False)
class Setup:
    """How a session begins.

    Attributes:
        world: The name of a registered world, or the text of a map.
        task: The rules of the game.
        policy: How ants learn; or the action values that they follow, float (n_states, 5).
        ants: How many start each episode.
        capacity: How many ants can live at once; None: 2 * `ants` + 64.
        seed: Of the colony.
        ticks_per_episode: 0 for one episode without an end.
        sharing: Of ants that learn: "shared" or "own", see `Colony`.
        epsilon: With which ants follow action values.
        world_seed: Of a world that is drawn.
        world_settings: Of a registered world, see `worlds.build`.

    Raises:
        AntsError: A value is not allowed. Whether the world, and a colony in it, can be built tells
            `Session`.
    """

    world: str
    task: Task
    policy: TrainingConfig | np.ndarray
    ants: int = 64
    capacity: int | None = None
    seed: int = 0
    ticks_per_episode: int = 0
    sharing: str = "shared"
    epsilon: float = 0.01
    world_seed: int = 0
    world_settings: Mapping[str, Any] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        expect("world", self.world, str)
        expect("task", self.task, Task)
        if self.learns:
            check_one_of("sharing", self.sharing, ("shared", "own"))
            learners.get(self.policy.learner)  # type: ignore[union-attr]
        else:
            object.__setattr__(self, "policy", checked_q_values(self.policy, self.task))
        checked_whole("ants", self.ants, 1, MAX_ANTS)
        if self.capacity is None:
            object.__setattr__(self, "capacity", min(2 * self.ants + 64, MAX_ANTS))
        checked_whole("capacity", self.capacity, 1, MAX_ANTS)
        for seed in (self.seed, self.world_seed):
            checked_seeds([seed])
        checked_whole("ticks_per_episode", self.ticks_per_episode, 0, MAX_STEPS)
        checked_share("epsilon", self.epsilon)
        expect("world_settings", self.world_settings, Mapping)

    @property
    def learns(self) -> bool:
        """Whether ants learn, not follow action values."""
        return isinstance(self.policy, TrainingConfig)

    def build_world(self) -> World:
        """The world; raises AntsError if there is none of that name, or the map is damaged."""
        if "\n" in self.world:
            built = worlds.from_text(self.world)
        elif self.world not in worlds.names():  # never a path
            raise AntsError(
                f"there is no world named {shown(self.world)}; choose one of "
                f"{', '.join(worlds.names())}, or give the text of a map."
            )
        else:
            built = worlds.build(self.world, self.world_seed, **self.world_settings)
        if built.grid.count > MOST_CELLS:
            raise AntsError(
                f"the world has {built.grid.count} cells; take one of at most {MOST_CELLS}."
            )
        return built

    def build_colony(self) -> Colony:
        """The colony, before its first episode; raises AntsError if it cannot be."""
        options: dict[str, Any] = {"ants": self.ants, "capacity": self.capacity}
        if isinstance(self.policy, TrainingConfig):
            options |= {"sharing": self.sharing}
            training = self.policy
        else:
            options |= {"sharing": "fixed", "q_values": self.policy}
            steady = {"epsilon_decay": 1.0, "min_epsilon": 0.0}
            training = TrainingConfig("q_learning", 1.0, 0.0, self.epsilon, **steady)
        return Colony(self.build_world(), self.task, training, self.seed, **options)

    def to_json(self) -> dict[str, Any]:
        """The setup as JSON holds it, but for action values, of which it says "table" only."""
        facts = {field.name: getattr(self, field.name) for field in fields(self)}
        policy = self.policy.as_dict() if isinstance(self.policy, TrainingConfig) else "table"
        settings = dict(self.world_settings)
        return {**facts, "task": self.task.as_dict(), "policy": policy, "world_settings": settings}

    @classmethod
    def from_json(cls, facts: object, table: np.ndarray | None = None) -> Setup:
        """The setup of `to_json`.

        Args:
            facts: What `to_json` gave; what is left out is as usual.
            table: The action values, if the policy is "table".

        Raises:
            AntsError: A value is not allowed.
        """
        expect("a setup", facts, Mapping)
        assert isinstance(facts, Mapping)
        known = [field.name for field in fields(cls)]
        for name in facts:
            if name not in known:
                raise AntsError(f"a setup has no {shown(name)}; choose among {', '.join(known)}.")
        policy = facts.get("policy")
        if policy == "table" and table is not None:
            policy = table
        elif isinstance(policy, Mapping):
            try:
                policy = TrainingConfig(**policy)
            except TypeError:  # other names than it has
                raise AntsError(f"policy is {shown(policy)}; it must be a training.") from None
        else:
            raise AntsError(f"policy is {shown(policy)}; it must be a training.")
        task = Task.from_dict(facts.get("task", {}))
        given = {"world": "paper", **facts, "task": task, "policy": policy}
        return cls(**given)


class Session:
    """A colony in a world, from its first tick on, and all that a hand has changed.

    It depends on its setup and its edits alone: `load` replays them.

    Args:
        setup: How it begins.

    Attributes:
        colony: As it is now; nobody else may move it on.
        ticks: How many have passed in all episodes.
        edits: (ticks, edit) of each edit, in order.

    Raises:
        AntsError: The world or the colony cannot be built.
    """

    def __init__(self, setup: Setup) -> None:
        expect("setup", setup, Setup)
        self.setup, self.colony = setup, setup.build_colony()
        self.hand = Hand(self.colony)
        self.ticks = 0
        self.edits: list[tuple[int, edits.Edit]] = []
        self.hand.begin_episode(self._length)
        self.colony.look()  # changes nothing, but compiles what the first edit needs
        self._recorder = Recorder(self.colony)
        self._recorder.moment()
        self._named = set(self._recorder.names())

    @property
    def _length(self) -> int | None:
        return self.setup.ticks_per_episode or None

    @property
    def ended(self) -> bool:
        """Whether the episode has ended; the next step of time, or edit, begins another one."""
        return self.colony.ticks == self._length

    def header(self) -> dict[str, Any]:
        """What all frames are about, see `Recorder.header`."""
        return self._recorder.header()

    def news(self) -> dict[int, tuple[str, str, list[str]]]:
        """The names of states that have been seen since this was asked last."""
        if len(self._named) == self.colony.task.n_states:
            return {}
        names = self._recorder.names()
        new = {state: name for state, name in names.items() if state not in self._named}
        self._named |= new.keys()
        return new

    def moment(self) -> bytes:
        """A frame that holds all as it is now, for a page that has read none."""
        return self._recorder.whole()

    def advance(self, n: int = 1) -> bytes:
        """Let n ticks pass, fewer where the episode ends before; a frame of what has changed.

        If the episode has ended, the next one begins instead, and no tick passes: so pages see both
        the end of an episode and the beginning of the next.

        Raises:
            AntsError: n is not allowed.
        """
        n = checked_whole("n", n)
        if self.ended:
            self.hand.begin_episode(self._length)
            return self._recorder.moment()
        n = min(n, self._length - self.colony.ticks if self._length else MOST_TICKS - self.ticks)
        if n < 1:
            raise AntsError(f"{self.ticks} ticks have passed, the most of a session; begin anew.")
        frame = self._recorder.tick(n)
        self.ticks += n
        return frame

    def apply(self, edit: object) -> bytes:
        """Do an edit now, see `edits`, and record it; a frame of what has changed.

        If the episode has ended, the next one begins before.

        Raises:
            AntsError: It is none, or there is no room for it; nothing has changed.
        """
        plain = edits.checked(edit, self.hand)
        edits.apply(plain, self.hand, self._length)
        self.edits.append((self.ticks, plain))
        return self._recorder.moment()

    def values(self) -> dict[str, dict[str, float]]:
        """What the edit "set" can change, by name: value, least, most and step."""
        return {name: value._asdict() for name, value in edits.values(self.hand).items()}
