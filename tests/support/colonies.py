"""Colonies for tests: set up from a drawing, with actions that the test decides."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from taichi_ants import TrainingConfig
from taichi_ants.reference import ReferenceColony
from taichi_ants.reference.geometry import Cell
from taichi_ants.task import Life, Task
from taichi_ants.task.constants import FOOD
from taichi_ants.worlds import World, from_text

GAMMA = 0x9E3779B97F4A7C15


def training(learner: str = "q_learning", **settings: object) -> TrainingConfig:
    """Learning rate and discount 1/2, so that values stay exact; greedy."""
    defaults = {
        "learning_rate": 0.5,
        "discount": 0.5,
        "epsilon": 0.0,
        "epsilon_decay": 1.0,
        "min_epsilon": 0.0,
        **({"planning_steps": 3} if learner == "dyna_q" else {}),
    }
    return TrainingConfig(learner, **{**defaults, **settings})


def begun(
    world: World | str,
    learning: TrainingConfig | None = None,
    sharing: str = "frozen",
    seed: int = 0,
    q_values: np.ndarray | None = None,
    **options: object,
) -> ReferenceColony:
    """A colony in its first episode; as many ants as the world lists, unless options say more."""
    world = from_text(world) if isinstance(world, str) else world
    names = {field.name for field in fields(Life)}
    life = Life(**{name: options.pop(name) for name in names & options.keys()})
    named = ("pheromone", "delivery", "observation", "rewards", "traffic")
    rules = {name: options.pop(name) for name in named if name in options}
    task = Task(evaporation_in_training=True, life=life, **rules)
    colony = ReferenceColony(
        world,
        task,
        learning or training(),
        seed,
        **{"ants": len(world.ants), **options},
        sharing=sharing,
        q_values=q_values,
    )
    colony.begin_episode()
    return colony


def act(colony: ReferenceColony, *actions: int) -> None:
    """One tick in which the ants, by ascending slot, do these actions."""
    ants = [colony.ants[slot] for slot in sorted(colony.ants)]
    for ant, action in zip(ants, actions, strict=True):
        ant.chosen = action
    colony.tick()


def load(colony: ReferenceColony, *slots: int) -> None:
    """Let the ants in these slots carry food that comes from nowhere."""
    for slot in slots:
        ant = colony.ants[slot]
        ant.carries = True
        colony.observe(ant)


def cells_of(colony: ReferenceColony) -> list[Cell]:
    """Where the ants stand, by ascending slot."""
    return [colony.ants[slot].cell for slot in sorted(colony.ants)]


def foods_of(colony: ReferenceColony) -> set[Cell]:
    """The cells with food on the ground."""
    return {cell for cell, held in colony.world.ground.items() if held == FOOD}


def n_draws(state: int, start: int) -> int:
    """How many draws lead from one state of a stream to another, at most 99."""
    return next(n for n in range(100) if (start + n * GAMMA) % 2**64 == state)
