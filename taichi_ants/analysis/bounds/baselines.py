"""Baselines to hold learned policies against: exact bounds, and two policies without learning."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from taichi_ants.analysis.bounds.episodes import EpisodeBounds, Outcome
from taichi_ants.errors import AntsError, count
from taichi_ants.learners.policies import random_policy, trail_follower
from taichi_ants.task import Task
from taichi_ants.task.constants import EPISODE_STEPS
from taichi_ants.worlds.world import World


class Baseline(NamedTuple):
    """Return, steps and deliveries of a policy in an episode: a row of baselines.csv.

    `discount` is the one for which it is optimal; means are None if unknown; `note` says how they
    were computed, or why they are not known.
    """

    baseline: str
    discount: float | None = None
    return_mean: float | None = None
    steps_mean: float | None = None
    deliveries_mean: float | None = None
    note: str = ""

    @property
    def label(self) -> str:
        """Its name and discount, for example "optimal policy, discount 0.9"."""
        discount = "" if self.discount is None else f", discount {self.discount:g}"
        return self.baseline + discount


# Called as evaluate(world, q_values, rollouts=, max_steps=, task=, seeds=), with one table for
# each seed: q_values (seeds, n_states, 5). What it returns has returns, steps and deliveries,
# (seeds, rollouts) each.
Evaluate = Callable[..., Any]


def policy_rows(
    world: World,
    task: Task,
    evaluate: Evaluate,
    seeds: Sequence[int],
    rollouts: int = 50,
    max_steps: int = EPISODE_STEPS,
) -> list[Baseline]:
    """Return what the random policy and the trail follower bring.

    Trails evaporate as in training; `evaluate` rolls out policies, such as `taichi_ants.evaluate`.
    """
    rows = []
    # Both policies are tables of the paper's observation.
    as_trained = replace(
        task, observation="paper", evaporation_in_evaluation=task.evaporation_in_training
    )
    note = f"mean over {count(len(seeds), 'seed')} of {count(rollouts, 'rollout')}"
    for name, policy in (("random policy", random_policy()), ("trail follower", trail_follower())):
        found = evaluate(
            world,
            np.repeat(policy[None], len(seeds), axis=0),
            rollouts=rollouts,
            max_steps=max_steps,
            task=as_trained,
            seeds=list(seeds),
        )
        means = (float(np.mean(one)) for one in (found.returns, found.steps, found.deliveries))
        rows.append(_row(name, note, Outcome(*means)))
    return rows


def bound_rows(
    world: World,
    task: Task,
    discounts: Sequence[float] = (0.9, 0.99),
    max_steps: int = EPISODE_STEPS,
) -> list[Baseline]:
    """Return the exact bounds, or one row whose note says why there are none.

    Trails evaporate as in training; the optimal policies of the discounts are followed for
    `max_steps`.
    """
    try:
        bounds = EpisodeBounds(world, task)
    except AntsError as error:
        return [_row("exact bounds", str(error))]
    shortest = bounds.shortest()
    note = "exact: fewest steps to a delivery, then largest return, whatever the step limit"
    rows = [_row("shortest delivery", note if shortest else "no delivery is possible", shortest)]
    for discount in dict.fromkeys(discounts):
        try:
            value, outcome = bounds.optimal(discount, max_steps)
        except AntsError as error:
            rows.append(_row("optimal policy", str(error), discount=discount))
            continue
        note = (
            f"exact: optimal for an episode without step limit (discounted return {value:.6g}), "
            f"followed for at most {max_steps} steps"
        )
        rows.append(_row("optimal policy", note, outcome, discount))
    return rows


def _row(
    name: str, note: str, found: Outcome | None = None, discount: float | None = None
) -> Baseline:
    if found is None:
        return Baseline(name, discount, note=note)
    return Baseline(name, discount, found.episode_return, found.steps, found.deliveries, note)
