"""Whole runs of one ant, a colony of one: training, and rollouts of a Q-table."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.grid.constants import STREAM_ROLLOUT
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.reference.colony import ReferenceColony
from taichi_ants.reference.random_stream import RandomStream, stream_state
from taichi_ants.reference.records import Transition

if TYPE_CHECKING:
    from taichi_ants.task import Task
    from taichi_ants.worlds.world import World


class Run:
    """A training run, with all that is needed to go on.

    Attributes:
        colony: The ant and its world after the run.
        trace: Of each step, if asked for.
        learner: The ant's learner.
        q_values: Its Q-table; (n_states, 5), float32.
        model: What it has seen, see `Learner`.
        epsilon: For the next episode.
        rng_state: State of the ant's random stream.
        returns, steps, deliveries: Of each episode.
    """

    def __init__(self, colony: ReferenceColony, trace: list[Transition]) -> None:
        self.colony, self.trace = colony, trace
        self.learner = colony.minds.tables[0]
        self.q_values = self.learner.table()
        self.model = self.learner.model
        self.epsilon = colony.epsilon
        self.rng_state = colony.streams[0].state
        self.returns = [record.episode_return for record in colony.records]
        self.steps = [record.ticks for record in colony.records]
        self.deliveries = [record.deliveries for record in colony.records]


def train(
    world: World,
    config: TrainingConfig,
    seed: int,
    episodes: int,
    max_steps: int,
    task: Task | None = None,
    trace: bool = False,
    start_from: Run | None = None,
    trace_tables: bool = False,
) -> Run:
    """Train one ant.

    Args:
        world: Every episode starts from it. Of its listed ants the first takes part, alone; if it
            lists none, the ant is placed by the seed.
        config: The learner and its settings.
        seed: Any integer.
        episodes: How many episodes to train (further ones, with `start_from`).
        max_steps: An episode is truncated after so many steps, at least 1.
        task: The rules of the game; the paper's if not given.
        trace: Whether to record each step.
        start_from: A run of the same arguments to go on from. It is left as it is; the result holds
            its episodes, and its trace, before the new ones.
        trace_tables: Whether the record of each step holds a copy of the Q-table (2.5 kB each).

    Raises:
        AntsError: See `ReferenceColony`.
    """
    if start_from is None:
        colony = ReferenceColony(world, task, config, seed, ends_at_delivery=True, sharing="own")
        steps = []
    else:
        colony, steps = copy.deepcopy(start_from.colony), list(start_from.trace)
    for _ in range(episodes):
        for [step] in colony.run_episode(max_steps):
            if trace_tables:
                step.q_values = colony.minds.tables[0].table()
            if trace:
                steps.append(step)
    return Run(colony, steps)


@dataclass(eq=False)
class Rollout:
    """One episode without learning.

    Attributes:
        episode_return: The sum of the rewards.
        steps: The number of steps.
        deliveries: 1 if the ant gave its food to the queen, else 0.
        rng_state: State of the rollout's random stream at the end.
        trace: Of each step, if asked for.
    """

    episode_return: int
    steps: int
    deliveries: int
    rng_state: int
    trace: list[Transition]


def rollout(
    world: World,
    q_values: np.ndarray,
    seed: int = 0,
    number: int = 0,
    max_steps: int = 600,
    task: Task | None = None,
    epsilon: float = 0.0,
    trace: bool = True,
) -> Rollout:
    """Play one episode with a Q-table that stays as it is.

    Args:
        world: The episode starts from it, as in `train`.
        q_values: (n_states, 5), taken as float32.
        seed: Any integer.
        number: Which rollout of the seed it is; each has a random stream of its own.
        max_steps: The episode is truncated after so many steps, at least 1.
        task: The rules of the game; the paper's if not given.
        epsilon: Probability of a random action.
        trace: Whether to record each step.

    Raises:
        AntsError: The world has no cell for the ant.
    """
    colony = follower(world, q_values, seed, number, task, epsilon)
    steps = [step for [step] in colony.run_episode(max_steps)]
    return Rollout(
        episode_return=colony.record.episode_return,
        steps=len(steps),
        deliveries=colony.record.deliveries,
        rng_state=colony.streams[0].state,
        trace=steps if trace else [],
    )


def follower(
    world: World,
    q_values: np.ndarray,
    seed: int = 0,
    number: int = 0,
    task: Task | None = None,
    epsilon: float = 0.0,
) -> ReferenceColony:
    """Return the ant of a rollout, before its episode; arguments as of `rollout`."""
    training = TrainingConfig("q_learning", 1.0, 1.0, epsilon, 1.0)
    colony = ReferenceColony(
        world, task, training, seed, ends_at_delivery=True, sharing="fixed", q_values=q_values
    )
    colony.streams[0] = RandomStream(stream_state(seed, STREAM_ROLLOUT, number))
    return colony
