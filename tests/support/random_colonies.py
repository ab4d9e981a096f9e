"""Colonies drawn at random: crowded micro-worlds, all options, learners and ways of sharing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from random_worlds import random_world

from taichi_ants import TrainingConfig
from taichi_ants.task.colony import SHARINGS, STARTS, ColonyConfig, Pheromone
from taichi_ants.task.constants import EMPTY, GIVE, N_ACTIONS, N_STATES, PICK_UP
from taichi_ants.worlds import World

LEARNERS = [("q_learning", 0), ("sarsa", 0), ("expected_sarsa", 0), ("dyna_q", 2)]


@dataclass(frozen=True)
class RandomColony:
    """What makes a colony."""

    world: World
    config: ColonyConfig
    training: TrainingConfig
    seed: int
    sharing: str
    q_values: np.ndarray | None


def random_colony(
    seed: int, most_ants: int = 24, sharing: str | None = None, largest_range: int = 5
) -> RandomColony:
    """The same seed gives the same colony; `sharing` may be given instead of drawn."""
    rng = np.random.default_rng([seed, 2])
    world = random_world(seed, largest_range)
    room = int(np.count_nonzero(world.ground() == EMPTY))
    sharing = str(rng.choice(SHARINGS)) if sharing is None else sharing
    return RandomColony(
        world=world,
        config=_config(rng, min(room, most_ants)),
        training=_training(rng),
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


def _config(rng: np.random.Generator, most_ants: int) -> ColonyConfig:
    # One ant, any number, or as many as there is room for.
    ants = int(rng.choice([1, rng.integers(1, most_ants + 1), most_ants]))
    births = bool(rng.random() < 0.5)
    return ColonyConfig(
        ants=ants,
        capacity=ants + int(rng.integers(0, 6)) if rng.random() < 0.5 else None,
        pheromone=_pheromone(rng),
        births=births,
        lifespan=int(rng.integers(1, 30)) if rng.random() < 0.5 else None,
        regrowth=int(rng.choice([0, 0, 1, 2, 7])) if rng.random() < 0.7 else None,
        wander=int(rng.choice([1, 2, 5])) if rng.random() < 0.5 else None,
        ends_at_delivery=ants == 1 and not births and bool(rng.random() < 0.5),
        start=str(rng.choice(STARTS)),
    )


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


def _training(rng: np.random.Generator) -> TrainingConfig:
    """Values far from each other and from round ones."""
    learner, planning_steps = LEARNERS[rng.integers(len(LEARNERS))]
    return TrainingConfig(
        learner=learner,
        learning_rate=float(rng.choice([0.001, 0.01, 0.37, 1.0])),
        discount=float(rng.choice([0.0, 0.9, 0.99])),
        epsilon=float(rng.choice([0.0, 0.05, 0.3, 1.0])),
        epsilon_decay=float(rng.choice([0.3, 0.99, 1.0])),
        min_epsilon=float(rng.choice([0.0, 0.01, 0.2])),
        planning_steps=planning_steps,
        delivery=str(rng.choice(["absorbing", "continuing"])),
    )
