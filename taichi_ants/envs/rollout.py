"""Rollouts of vector environments: several steps in one call, as arrays."""

from __future__ import annotations

import os
from typing import Any, NamedTuple

import numpy as np
from gymnasium.error import InvalidAction

from taichi_ants.errors import checked_whole, shown
from taichi_ants.learners.policies import checked_table, frozen_policy
from taichi_ants.task import Task
from taichi_ants.task.constants import N_ACTIONS


class Rollout(NamedTuple):
    """The results of several steps of n environments; row t of each array is step t.

    Attributes:
        observations: The observations before each step, and after the last one: (steps + 1, n, ...)
            of the dtype of the observation space. `observations[1:]` are those that `step` returns.
        actions: The actions taken, int64 (steps, n).
        rewards: float64 (steps, n).
        terminated, truncated: bool (steps, n).
        events: The results of the actions, codes of `Event` as uint8 (steps, n). `NONE` in steps
            that only begin an episode, or of environments that wait for a reset.
        final_observations: The last observation of each episode that ended, (episodes, ...), in
            the order of `np.argwhere(terminated | truncated)`.
    """

    observations: np.ndarray
    actions: np.ndarray
    rewards: np.ndarray
    terminated: np.ndarray
    truncated: np.ndarray
    events: np.ndarray
    final_observations: np.ndarray


def checked_actions(actions: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Return actions as an array of integers of a shape; InvalidAction for others."""
    try:
        chosen = np.asarray(actions)
    except ValueError:  # lists of several lengths
        chosen = np.empty(0)
    if chosen.shape != shape or chosen.dtype.kind not in "iu":
        raise InvalidAction(
            f"the actions are {shown(actions)}; they must be an array of an integer type and of "
            f"shape {shape}."
        )
    # A negative number is a large one without its sign.
    if chosen.view(chosen.dtype.str.replace("i", "u")).max() >= N_ACTIONS:
        wrong = chosen[(chosen < 0) | (chosen >= N_ACTIONS)][0]
        raise InvalidAction(f"an action is {wrong}; it must be 0, 1, 2, 3 or 4.")
    return chosen


def checked_plan(
    policy: Any, steps: int | None, n: int, task: Task
) -> tuple[int, np.ndarray | None, np.ndarray | None]:
    """Return the number of steps, and either actions, int64 (steps, n), or action values.

    Raises:
        AntsError, InvalidAction: The policy or the number of steps is not allowed.
    """
    if isinstance(policy, (str, os.PathLike)):
        table = frozen_policy(policy, task.observation)
    else:
        try:
            plan = np.asarray(getattr(policy, "q_values", policy))
        except ValueError:  # lists of several lengths
            plan = np.empty(0)
        if plan.dtype.kind in "iu":
            length = steps or max(1, np.atleast_1d(plan).shape[0])
            actions = checked_actions(plan, (length, n))
            return length, np.ascontiguousarray(actions, np.int64), None
        table = checked_table(policy, task)
    return checked_whole("steps", steps), None, table
