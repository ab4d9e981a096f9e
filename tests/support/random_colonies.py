"""Colonies drawn at random: crowded micro-worlds, all options, learners and ways of sharing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from random_worlds import random_world

from taichi_ants import TrainingConfig
from taichi_ants.engines.colony.population import SHARINGS
from taichi_ants.task import Life, Pheromone, Rewards, Task
from taichi_ants.task.constants import EMPTY, GIVE, N_ACTIONS, N_STATES, PICK_UP
from taichi_ants.worlds import World
from taichi_ants.worlds.starts import STARTS

LEARNERS = [("q_learning", 0), ("sarsa", 0), ("expected_sarsa", 0), ("dyna_q", 2)]


@dataclass(frozen=True)
class RandomColony:
    """What makes a colony."""

    world: World
    task: Task
    population: dict[str, Any]
    training: TrainingConfig
    seed: int
    sharing: str
    q_values: np.ndarray | None


def random_colony(
    seed: int,
    most_ants: int = 24,
    sharing: str | None = None,
    largest_range: int = 5,
    rewards: Rewards | None = None,
) -> RandomColony:
    """The same seed gives the same colony; `sharing` may be given instead of drawn."""
    rng = np.random.default_rng([seed, 2])
    world = random_world(seed, largest_range)
    room = int(np.count_nonzero(world.ground() == EMPTY))
    sharing = str(rng.choice(SHARINGS)) if sharing is None else sharing
    population, task = _rules(rng, min(room, most_ants))
    training, delivery = _training(rng)
    return RandomColony(
        world=world,
        task=replace(task, delivery=delivery, rewards=rewards or Rewards()),
        population=population,
        training=training,
        seed=int(rng.integers(-5, 2**40)),
        sharing=sharing,
        q_values=forager() if sharing == "fixed" or rng.random() < 0.6 else None,
    )


def forager() -> np.ndarray:
    """A table that takes food in view, gives to a queen in view, and follows what lures."""
    q_values = np.zeros((N_STATES, N_ACTIONS), np.float32)
    for state in range(N_STATES):
        codes = (state >> 4 & 3, state >> 2 & 3, state & 3)
        if 3 in codes:
            q_values[state, GIVE if state >= 64 else PICK_UP] = 8
        for side, code in enumerate(codes):
            q_values[state, side] = {0: 0.5, 1: -1.0, 2: 1.25, 3: -1.0}[code]
    return q_values


def _rules(rng: np.random.Generator, most_ants: int) -> tuple[dict[str, Any], Task]:
    # One ant, any number, or as many as there is room for.
    ants = int(rng.choice([1, rng.integers(1, most_ants + 1), most_ants]))
    births = bool(rng.random() < 0.5)
    capacity = ants + int(rng.integers(0, 6)) if rng.random() < 0.5 else None
    pheromone = _pheromone(rng)
    lifespan = int(rng.integers(1, 30)) if rng.random() < 0.5 else None
    regrowth = int(rng.choice([0, 0, 1, 2, 7])) if rng.random() < 0.7 else None
    wander = int(rng.choice([1, 2, 5])) if rng.random() < 0.5 else None
    ends = ants == 1 and not births and bool(rng.random() < 0.5)
    start = str(rng.choice(STARTS))
    task = Task(
        pheromone=pheromone,
        evaporation_in_training=True,
        life=Life(births, lifespan, regrowth, wander),
    )
    return {"ants": ants, "capacity": capacity, "ends_at_delivery": ends, "start": start}, task


def _pheromone(rng: np.random.Generator) -> Pheromone:
    evaporation = str(rng.choice(["linear", "exponential", "none"]))
    half_life = float(rng.choice([0.5, 3.0, 50.0]))
    diffusion = float(rng.choice([0.0, 0.0, 0.05, 0.6, 1.0]))
    deposit = str(rng.choice(["set", "add", "none"]))
    return Pheromone(
        evaporation=evaporation,
        half_life=half_life if evaporation == "exponential" else None,
        diffusion=diffusion,
        deposit=deposit,
        level=int(rng.choice([1, 7, 250])),
        cap=int(rng.choice([1, 10, 1000])) if deposit == "add" else None,
    )


def _training(rng: np.random.Generator) -> tuple[TrainingConfig, str]:
    """Values far from each other and from round ones."""
    learner, planning_steps = LEARNERS[rng.integers(len(LEARNERS))]
    config = TrainingConfig(
        learner=learner,
        learning_rate=float(rng.choice([0.001, 0.01, 0.37, 1.0])),
        discount=float(rng.choice([0.0, 0.9, 0.99])),
        epsilon=float(rng.choice([0.0, 0.05, 0.3, 1.0])),
        epsilon_decay=float(rng.choice([0.3, 0.99, 1.0])),
        min_epsilon=float(rng.choice([0.0, 0.01, 0.2])),
        hyperparameters={"planning_steps": planning_steps} if planning_steps else {},
    )
    return config, str(rng.choice(["absorbing", "continuing"]))
