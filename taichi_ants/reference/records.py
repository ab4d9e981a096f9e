"""What the reference returns: runs, rollouts, and the record of each step."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from taichi_ants.reference.ant import Event
from taichi_ants.reference.geometry import Cell

Pair = tuple[int, int]  # state, action
Outcome = tuple[int, int, bool]  # reward, next state, terminated
# Of each visited pair, in the order of first visit, the last seen outcome.
Model = dict[Pair, Outcome]


@dataclass(frozen=True)
class Step:
    """One step of an ant.

    Attributes:
        episode: Its number in the run, from 0; always 0 in a rollout.
        step: Its number in the episode, from 0; also the clock at which `state` was seen.
        cell, heading, state: Of the ant before the step.
        action, reward, event: What it did, and what came of it.
        next_cell, next_heading, next_state: Of the ant after the step, at clock `step` + 1.
        delivered: Whether the episode ended because the ant gave its food.
        truncated: Whether the episode ended because the step limit was reached (not both).
    """

    episode: int
    step: int
    cell: Cell
    heading: int
    state: int
    action: int
    reward: int
    event: Event
    next_cell: Cell
    next_heading: int
    next_state: int
    delivered: bool
    truncated: bool


@dataclass(frozen=True)
class LearningStep(Step):
    """One step of an ant that learns.

    Attributes:
        terminated: Whether the update took the delivery for a terminal state; only then does it
            not bootstrap. So it is true only where `delivered` is, and only if the delivery is
            configured as "absorbing".
        td_error: Of the update from this step (planning updates are not recorded).
        rng_state: The state of the ant's random stream after all draws of the step.
        q_values: The Q-table after the step, planning included; (128, 5), float32. None unless
            asked for.
    """

    terminated: bool
    td_error: np.float32
    rng_state: int
    q_values: np.ndarray | None


@dataclass(eq=False)
class Run:
    """A training run, with all that is needed to go on.

    Attributes:
        q_values: The Q-table; (128, 5), float32.
        epsilon: For the next episode.
        rng_state: State of the ant's random stream.
        model: What a planning learner has seen; empty for all others.
        returns, steps, deliveries: Of each episode.
        trace: Of each step, if asked for.
    """

    q_values: np.ndarray
    epsilon: float
    rng_state: int
    model: Model = field(default_factory=dict)
    returns: list[int] = field(default_factory=list)
    steps: list[int] = field(default_factory=list)
    deliveries: list[int] = field(default_factory=list)
    trace: list[LearningStep] = field(default_factory=list)


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
    trace: list[Step]
