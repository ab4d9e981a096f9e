"""Runs of one ant in the reference, in the form that tests need."""

import copy

from taichi_ants import TrainingConfig
from taichi_ants.grid.constants import STREAM_ROLLOUT
from taichi_ants.reference import ReferenceColony
from taichi_ants.reference.ants import Transition
from taichi_ants.reference.random_stream import RandomStream, stream_state


def beginner(world, config, seed, task=None) -> ReferenceColony:
    """Return a colony of one ant before its training."""
    return ReferenceColony(world, task, config, seed, ends_at_delivery=True, sharing="independent")


def follower(world, q_values, seed=0, number=0, task=None, epsilon=0.0) -> ReferenceColony:
    """Return a colony of one ant that follows a table (n_states, 5) in rollout `number`."""
    given = world, task, TrainingConfig("q_learning", 1.0, 1.0, epsilon, 1.0), seed
    options = {"ends_at_delivery": True, "sharing": "frozen", "q_values": q_values}
    colony = ReferenceColony(*given, **options)
    colony.streams[0] = RandomStream(stream_state(seed, STREAM_ROLLOUT, number))
    return colony


def run_episode(colony, ticks):
    """Yield the transitions of each tick of an episode of `ticks`, or less if it ends early."""
    colony.begin_episode()
    while colony.record.ticks < ticks and not colony.over:
        colony.tick(last=colony.record.ticks == ticks - 1)
        yield colony.transitions
    colony.end_episode()


def run(colony, episodes, ticks) -> list[Transition]:
    """Return all transitions of some episodes."""
    ticked = (steps for _ in range(episodes) for steps in run_episode(colony, ticks))
    return [step for steps in ticked for step in steps]


class Run:
    """A run: the colony of one ant, and its steps so far."""

    def __init__(self, colony: ReferenceColony, trace: list[Transition]) -> None:
        self.colony, self.trace = colony, trace
        self.learner = colony.learners[0]
        self.q_values = colony.q_values[0]
        self.model = self.learner.model
        self.epsilon = colony.epsilon
        self.rng_state = colony.streams[0].state
        self.returns = [record.episode_return for record in colony.records]
        self.steps = [record.ticks for record in colony.records]
        self.deliveries = [record.deliveries for record in colony.records]


def train(world, config, seed, episodes, max_steps, task=None, start_from=None) -> Run:
    """Return the training of one ant, or the continuation of a run, which does not change."""
    colony, trace = beginner(world, config, seed, task), []
    if start_from is not None:
        colony, trace = copy.deepcopy((start_from.colony, start_from.trace))
    return Run(colony, trace + run(colony, episodes, max_steps))


def train_with_tables(world, config, seed, episodes, max_steps, task=None):
    """Return a run, and the ant's table after each step."""
    colony, trace, tables = beginner(world, config, seed, task), [], []
    for _ in range(episodes):
        for [step] in run_episode(colony, max_steps):
            trace.append(step)
            tables.append(colony.q_values[0])
    return Run(colony, trace), tables


def rollout(world, q_values, seed=0, number=0, max_steps=600, task=None, epsilon=0.0) -> Run:
    """Return an episode that follows a table."""
    colony = follower(world, q_values, seed, number, task, epsilon)
    return Run(colony, run(colony, 1, max_steps))
