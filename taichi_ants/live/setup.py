"""Setups of sessions: the world, the rules, the policy or learner, and the number of ants."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from taichi_ants import files, worlds
from taichi_ants.arguments import checked_seeds, checked_task
from taichi_ants.engines.colony.colony import Colony
from taichi_ants.errors import AntsError, check_one_of, checked_whole, expect, shown
from taichi_ants.features.support import BASE, CASTES, COLONY, FIELDS, FOODS, OWN_RULES
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.policies import NAMED, checked_table
from taichi_ants.task import Task
from taichi_ants.task.constants import MAX_STEPS, ROW
from taichi_ants.worlds import text_map
from taichi_ants.worlds.validation import parse_ranges
from taichi_ants.worlds.world import World

# Limits for the form of the page, for files and for Python; small enough for any machine.
MOST_ANTS = 100_000
MOST_TEXT = 50_000
_MOST = {
    "characters of a map": MOST_TEXT,
    "cells in the arrays of the world": 1_500_000,  # see `AxialGrid.size`
    "action values in independent tables": 1 << 27,
    "edits": 10_000,
    "cells in all edits": 400_000,
    "ticks": 1_000_000_000,
}

FORM_SUPPORTS = BASE - OWN_RULES - CASTES - FOODS - FIELDS  # of the form of the page


@dataclass(frozen=True, eq=False)
class Setup:
    """The initial conditions of a session.

    Raises AntsError if a value is not allowed; `Session` raises it if the world or colony cannot be
    built.
    """

    world: str  # the name of a registered world, or the text of a map
    task: Task
    # A learner, or action values (n_states, 5) to follow; unused if the task's rule needs neither.
    policy: TrainingConfig | np.ndarray
    ants: int = 64  # ants at the start of each episode
    capacity: int | None = None  # largest number of living ants; None means 2 * `ants` + 64
    seed: int = 0  # seed of the colony
    ticks_per_episode: int = 0  # 0 means a single episode without an end
    sharing: str = "shared"  # or "independent", for learners, see `Colony`
    epsilon: float = 0.01  # exploration rate of ants that follow action values
    world_seed: int = 0  # seed of a random world
    world_settings: Mapping[str, Any] = field(default_factory=dict)  # see `worlds.build`

    def __post_init__(self) -> None:
        expect("world", self.world, str)
        checked_task(self.task, "the live page", COLONY)
        for name, caste in self.task.castes.items():
            if caste.policy not in (None, *NAMED):  # pages must not name files
                raise AntsError(
                    f"`task.castes.{name}.policy` is {shown(caste.policy)}, but the live page "
                    f"reads no files; choose one of {', '.join(NAMED)}, or leave it out."
                )
        if not isinstance(self.policy, TrainingConfig):
            object.__setattr__(self, "policy", checked_table(self.policy, self.task).copy())
        checked_whole("ants", self.ants, 1, MOST_ANTS)
        if self.capacity is None:
            object.__setattr__(self, "capacity", min(2 * self.ants + 64, MOST_ANTS))
        checked_whole("capacity", self.capacity, 1, MOST_ANTS)
        checked_seeds([self.seed])
        checked_whole("ticks_per_episode", self.ticks_per_episode, 0, MAX_STEPS)
        expect("world_settings", self.world_settings, Mapping)
        settings = json.loads(files.to_json(dict(self.world_settings)))
        object.__setattr__(self, "world_settings", settings)

    @property
    def learns(self) -> bool:
        """Whether ants learn rather than follow a policy."""
        return isinstance(self.policy, TrainingConfig)

    def build_world(self) -> World:
        """Return the world; AntsError if it is unknown, too large, or cannot be built."""
        settings = self.world_settings
        if "\n" in self.world:
            check_most("characters of a map", len(self.world))
            _check_cells(text_map.ranges_of(self.world))
            return worlds.from_text(self.world)
        check_one_of("the world", self.world, worlds.names())  # excludes paths
        # Where the size is known before, it is checked before, because building takes memory.
        if settings.get("ranges") is not None:
            _check_cells(parse_ranges(settings["ranges"]))
        world = worlds.build(self.world, self.world_seed, **settings)
        _check_cells(world.ranges)
        return world

    def build_colony(self) -> Colony:
        """Return the colony before its first episode; raise AntsError if it cannot be built."""
        options: dict[str, Any] = {"ants": self.ants, "capacity": self.capacity}
        training: TrainingConfig | None = None
        if not self.task.needs_table:
            options["sharing"] = "frozen"
        elif isinstance(self.policy, TrainingConfig):
            training, options["sharing"] = self.policy, self.sharing
        else:
            training = TrainingConfig.frozen(self.epsilon)
            options |= {"sharing": "frozen", "q_values": self.policy}
        if options["sharing"] == "independent":
            numbers = options["capacity"] * self.task.n_states * ROW
            check_most("action values in independent tables", numbers)
        return Colony(self.build_world(), self.task, training, self.seed, **options)

    def to_json(self) -> dict[str, Any]:
        """Return the setup, JSON-compatible; a table of action values becomes the word "table"."""
        facts = {attribute.name: getattr(self, attribute.name) for attribute in fields(self)}
        policy = self.policy.as_dict() if isinstance(self.policy, TrainingConfig) else "table"
        settings = dict(self.world_settings)
        return {**facts, "task": self.task.as_dict(), "policy": policy, "world_settings": settings}

    @classmethod
    def from_json(cls, facts: Mapping[str, Any], table: np.ndarray | None = None) -> Setup:
        """Return the setup of `to_json`; `table` are action values if the policy is "table".

        Missing values have their defaults. Raises AntsError if a value is not allowed, and a
        TypeError if one is unknown.
        """
        policy: Any = facts.get("policy")
        policy = TrainingConfig(**policy) if policy != "table" or table is None else table
        task = Task.from_dict(facts.get("task", {}))
        return cls(**{"world": "paper", **facts, "task": task, "policy": policy})


def check_most(what: str, number: int) -> None:
    """Raise AntsError if a session has more of something, a key of `_MOST`, than is allowed."""
    if number > _MOST[what]:
        raise AntsError(
            f"the session has {number} {what}, but at most {_MOST[what]} are allowed; begin a "
            "smaller one."
        )


def _check_cells(ranges: tuple[int, int, int]) -> None:
    check_most("cells in the arrays of the world", AxialGrid(ranges).size)
