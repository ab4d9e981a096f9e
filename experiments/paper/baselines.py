"""Baselines for learned policies: exact bounds, and two policies without learning."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from taichi_ants.analysis.bounds import EpisodeBounds, ExpectedEpisode
from taichi_ants.errors import AntsError, count
from taichi_ants.learners.policies import random_policy, trail_follower
from taichi_ants.task import Task
from taichi_ants.task.constants import EPISODE_STEPS
from taichi_ants.worlds.world import World


class Baseline(NamedTuple):
    """A row of baselines.csv: return, steps and deliveries of a policy in an episode.

    `discount` is the discount for which the policy is optimal. Unknown means are None. `note` has
    the method of computation, or the reason why the means are unknown.
    """

    baseline: str
    discount: float | None = None
    return_mean: float | None = None
    steps_mean: float | None = None
    deliveries_mean: float | None = None
    note: str = ""

    @property
    def label(self) -> str:
        """The name and the discount, for example "optimal policy, discount 0.9"."""
        discount = "" if self.discount is None else f", discount {self.discount:g}"
        return self.baseline + discount


def policy_rows(
    world: World,
    task: Task,
    evaluate: Callable[..., Any],
    seeds: Sequence[int],
    rollouts: int = 50,
    max_steps: int = EPISODE_STEPS,
) -> list[Baseline]:
    """Return the results of the random policy and the trail follower.

    Trails evaporate as in training. `evaluate` is `taichi_ants.evaluate`; it gets one table of
    action values per seed.
    """
    # Both policies are tables of the paper's observation.
    as_trained = replace(
        task, observation="paper", evaporation_in_evaluation=task.evaporation_in_training
    )
    how = {"rollouts": rollouts, "max_steps": max_steps, "task": as_trained, "seeds": list(seeds)}
    note = f"mean over {count(len(seeds), 'seed')} of {count(rollouts, 'rollout')}"
    rows = []
    for name, policy in (("random policy", random_policy()), ("trail follower", trail_follower())):
        result = evaluate(world, np.repeat(policy[None], len(seeds), axis=0), **how)
        means = map(np.mean, (result.returns, result.steps, result.deliveries))
        rows.append(Baseline(name, None, *ExpectedEpisode(*map(float, means)), note))
    return rows


def bound_rows(
    world: World,
    task: Task,
    discounts: Sequence[float] = (0.9, 0.99),
    max_steps: int = EPISODE_STEPS,
) -> list[Baseline]:
    """Return the exact bounds, or one row with the reason why there are none.

    Trails evaporate as in training. The rows have the shortest delivery and, for each discount, an
    optimal policy, which is followed for at most `max_steps` steps.
    """
    try:
        bounds = EpisodeBounds(world, task)
    except AntsError as error:
        return [Baseline("exact bounds", note=str(error))]
    rows = [Baseline("shortest delivery", note="no delivery is possible")]
    if shortest := bounds.shortest():
        note = "exact: fewest steps to a delivery, then largest return, without step limit"
        rows = [Baseline("shortest delivery", None, *shortest, note)]
    for discount in dict.fromkeys(discounts):
        try:
            value, outcome = bounds.optimal(discount, max_steps)
        except AntsError as error:
            rows.append(Baseline("optimal policy", discount, note=str(error)))
            continue
        note = (
            f"exact: optimal for an episode without step limit (discounted return {value:.6g}), "
            f"followed for at most {max_steps} steps"
        )
        rows.append(Baseline("optimal policy", discount, *outcome, note))
    return rows
