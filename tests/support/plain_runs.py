"""Runs of one ant in the reference, in the form that tests need."""

from __future__ import annotations

import copy

from taichi_ants.reference import ReferenceColony, beginner, follower
from taichi_ants.reference.ants import Transition


class Run:
    """A run: the colony of one ant, and its steps so far."""

    def __init__(self, colony: ReferenceColony, trace: list[Transition]) -> None:
        self.colony, self.trace = colony, trace
        self.learner = colony.learners.tables[0]
        self.q_values = self.learner.table()
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
    return Run(colony, trace + colony.run(episodes, max_steps))


def train_with_tables(world, config, seed, episodes, max_steps, task=None):
    """Return a run, and the ant's table after each step."""
    colony, trace, tables = beginner(world, config, seed, task), [], []
    for _ in range(episodes):
        for [step] in colony.run_episode(max_steps):
            trace.append(step)
            tables.append(colony.q_values[0])
    return Run(colony, trace), tables


def rollout(world, q_values, seed=0, number=0, max_steps=600, task=None, epsilon=0.0) -> Run:
    """Return an episode that follows a table."""
    colony = follower(world, q_values, seed, number, task, epsilon)
    return Run(colony, colony.run(1, max_steps))
