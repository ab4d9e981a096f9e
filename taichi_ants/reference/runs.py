"""Whole runs of one ant: training, and rollouts of a Q-table."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.grid.constants import STREAM_ROLLOUT
from taichi_ants.reference.episode import Episode
from taichi_ants.reference.learning import Learning
from taichi_ants.reference.policy import choose_action
from taichi_ants.reference.random_stream import RandomStream, stream_state
from taichi_ants.reference.records import LearningStep, Rollout, Run, Step
from taichi_ants.reference.start import start
from taichi_ants.task import Task

if TYPE_CHECKING:
    from taichi_ants.learners.config import TrainingConfig
    from taichi_ants.worlds.world import World


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
        start_from: A run of the same world, configuration and seed to go on from. It is left as it
            is; the result holds its episodes, and its trace, before the new ones.
        trace_tables: Whether the record of each step holds a copy of the Q-table (2.5 kB each).

    Raises:
        AntsError: The learner is unknown, or `planning_steps` does not fit it; or the world has no
            cell for the ant.
    """
    learning = Learning(config, seed, start_from)
    task = task or Task()
    falls, rewards = task.evaporation_in_training, task.rewards
    absorbing = task.delivery == "absorbing"
    [begin] = start(world, seed)
    returns, lengths, deliveries, recorded = _history(start_from)
    for number in range(len(returns), len(returns) + episodes):
        episode = Episode(world, begin, learning.stream, falls, rewards, max_steps, number)
        steps = _train_episode(episode, learning, absorbing, trace_tables)
        learning.end_episode()
        returns.append(sum(step.reward for step in steps))
        lengths.append(len(steps))
        deliveries.append(sum(step.delivered for step in steps))
        if trace:
            recorded += steps
    return Run(
        q_values=learning.table(),
        epsilon=learning.epsilon,
        rng_state=learning.stream.state,
        model=learning.model,
        returns=returns,
        steps=lengths,
        deliveries=deliveries,
        trace=recorded,
    )


def _history(
    run: Run | None,
) -> tuple[list[int], list[int], list[int], list[LearningStep]]:
    if run is None:
        return [], [], [], []
    return list(run.returns), list(run.steps), list(run.deliveries), list(run.trace)


def _train_episode(
    episode: Episode, learning: Learning, absorbing: bool, trace_tables: bool
) -> list[LearningStep]:
    steps: list[LearningStep] = []
    action = None
    while not episode.over:
        if action is None:
            action = learning.choose(episode.state)
        step = episode.step(action)
        terminated = step.delivered and absorbing
        # Where the episode ends without termination, a' is for the target only: the next episode
        # begins with a choice of its own.
        action = None
        if learning.learner.draws_next_action and not terminated:
            action = learning.choose(episode.state)
        td_error = learning.learn(step, terminated, action)
        steps.append(
            LearningStep(
                **vars(step),
                terminated=terminated,
                td_error=td_error,
                rng_state=learning.stream.state,
                q_values=learning.table() if trace_tables else None,
            )
        )
    return steps


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
        q_values: (128, 5), taken as float32.
        seed: Any integer.
        number: Which rollout of the seed it is; each has a random stream of its own.
        max_steps: The episode is truncated after so many steps, at least 1.
        task: The rules of the game; the paper's if not given.
        epsilon: Probability of a random action.
        trace: Whether to record each step.

    Raises:
        AntsError: The world has no cell for the ant.
    """
    rows = [list(row) for row in np.asarray(q_values, np.float32)]
    stream = RandomStream(stream_state(seed, STREAM_ROLLOUT, number))
    [begin] = start(world, seed)
    task = task or Task()
    falls = task.evaporation_in_evaluation
    episode = Episode(world, begin, stream, falls, task.rewards, max_steps)
    steps: list[Step] = []
    while not episode.over:
        action = choose_action(rows[episode.state], epsilon, stream)
        steps.append(episode.step(action))
    return Rollout(
        episode_return=sum(step.reward for step in steps),
        steps=len(steps),
        deliveries=sum(step.delivered for step in steps),
        rng_state=stream.state,
        trace=steps if trace else [],
    )
