"""Colonies for tests, made from a map, with actions that the test chooses."""

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
    """Return a greedy configuration with learning rate and discount 1/2, so values are exact."""
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
    """Return a colony in its first episode, by default with the ants that the world lists."""
    world = from_text(world) if isinstance(world, str) else world
    names = {field.name for field in fields(Life)}
    life = Life(**{name: options.pop(name) for name in names & options.keys()})
    named = ("pheromone", "delivery", "observation", "rewards", "traffic")
    named += ("fields", "outbound_cue", "homing_cue")
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
    """Advance by a tick with the given actions, by ascending slot."""
    ants = [colony.ants[slot] for slot in sorted(colony.ants)]
    for ant, action in zip(ants, actions, strict=True):
        ant.chosen = action
    colony.tick()


def load(colony: ReferenceColony, *slots: int) -> None:
    """Give food to the ants in these slots, without taking it from the world."""
    for slot in slots:
        ant = colony.ants[slot]
        ant.carries = True
        colony.observe(ant)


def cells_of(colony: ReferenceColony) -> list[Cell]:
    """Return the cells of the ants, by ascending slot."""
    return [colony.ants[slot].cell for slot in sorted(colony.ants)]


def foods_of(colony: ReferenceColony) -> set[Cell]:
    """Return the cells with food."""
    return {cell for cell, held in colony.world.ground.items() if held == FOOD}


def n_draws(state: int, start: int) -> int:
    """Return the number of draws between two states of a stream, at most 99."""
    return next(n for n in range(100) if (start + n * GAMMA) % 2**64 == state)
