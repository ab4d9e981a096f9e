"""Baselines to hold learned policies against: exact bounds, and two policies without learning."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from taichi_ants.analysis.bounds.episodes import EpisodeBounds, Outcome
from taichi_ants.analysis.statistics import bootstrap_interval
from taichi_ants.errors import AntsError
from taichi_ants.learners.policies import random_policy, trail_follower
from taichi_ants.task import Task
from taichi_ants.task.constants import EPISODE_STEPS
from taichi_ants.worlds.world import World

BASELINE_COLUMNS: tuple[str, ...] = (
    "baseline",
    "setting",
    "discount",
    "return_mean",
    "return_ci_low",
    "return_ci_high",
    "steps_mean",
    "deliveries_mean",
    "note",
)
_CONDITIONS = ("no evaporation", "evaporation")

# Called as evaluate(world, q_values, rollouts=, max_steps=, task=, seeds=), with one table for
# each seed: q_values (seeds, n_states, 5). What it returns has returns, steps and deliveries,
# (seeds, rollouts) each.
Evaluate = Callable[..., Any]


def baseline_rows(
    world: World,
    task: Task,
    evaluate: Evaluate,
    seeds: Sequence[int],
    rollouts: int = 50,
    discounts: Sequence[float] = (0.9, 0.99),
    max_steps: int = EPISODE_STEPS,
) -> list[dict[str, Any]]:
    """All baselines of a world, as rows with the columns BASELINE_COLUMNS.

    Args:
        world: The world.
        task: What is paid, and whether trails evaporate in training and in the greedy evaluation
            of what is compared.
        evaluate: What rolls out policies, such as `taichi_ants.evaluate`.
        seeds: The seeds of the rollouts; figures are means over them, with 95 % intervals.
        rollouts: Rollouts for each seed.
        discounts: Discount factors whose optimal policies are wanted.
        max_steps: The step limit of an episode.

    Returns:
        The exact bounds, or a row whose note says why there are none; then the random policy and
        the trail follower, each as in training and as in the greedy evaluation.
    """
    training = f"training, {_CONDITIONS[task.evaporation_in_training]}"
    greedy = f"greedy, {_CONDITIONS[task.evaporation_in_evaluation]}"
    # Both policies are tables of the paper's observation.
    as_greedy = replace(task, observation="paper")
    as_trained = replace(as_greedy, evaporation_in_evaluation=task.evaporation_in_training)
    rows = _bounds(world, task, discounts, max_steps, training)
    for name, policy in (("random policy", random_policy()), ("trail follower", trail_follower())):
        for setting, followed in {training: as_trained, greedy: as_greedy}.items():
            outcome = evaluate(
                world,
                np.repeat(policy[None], len(seeds), axis=0),
                rollouts=rollouts,
                max_steps=max_steps,
                task=followed,
                seeds=list(seeds),
            )
            returns = np.asarray(outcome.returns, float).mean(axis=1)
            low, high = (float(end[0]) for end in bootstrap_interval(returns[None]))
            figures = {
                "return_mean": float(returns.mean()),
                # One seed has no interval.
                "return_ci_low": None if np.isnan(low) else low,
                "return_ci_high": None if np.isnan(high) else high,
                "steps_mean": float(np.mean(outcome.steps)),
                "deliveries_mean": float(np.mean(outcome.deliveries)),
                "note": f"mean over {len(seeds)} seeds of {rollouts} rollouts, 95 % interval over "
                "seeds (BCa)",
            }
            rows.append(_row(name, setting, **figures))
    return rows


def _bounds(
    world: World, task: Task, discounts: Sequence[float], max_steps: int, setting: str
) -> list[dict[str, Any]]:
    try:
        bounds = EpisodeBounds(world, task)
    except AntsError as error:
        return [_row("exact bounds", setting, note=str(error))]
    shortest = bounds.shortest()
    note = "exact: fewest steps to a delivery, then largest return, whatever the step limit"
    if shortest is None:
        note = "no delivery is possible"
    rows = [_row("shortest delivery", setting, **_exact(shortest), note=note)]
    for discount in dict.fromkeys(discounts):
        try:
            value, outcome = bounds.optimal(discount, max_steps)
        except AntsError as error:
            figures: dict[str, Any] = {"note": str(error)}
        else:
            note = (
                f"exact: optimal for an episode without step limit (discounted return "
                f"{value:.6g}), followed for at most {max_steps} steps"
            )
            figures = {**_exact(outcome), "note": note}
        rows.append(_row("optimal policy", setting, discount=discount, **figures))
    return rows


def _exact(outcome: Outcome | None) -> dict[str, float]:
    if outcome is None:
        return {}
    return {
        "return_mean": outcome.episode_return,
        "steps_mean": outcome.steps,
        "deliveries_mean": outcome.deliveries,
    }


def _row(baseline: str, setting: str, **figures: Any) -> dict[str, Any]:
    return {**dict.fromkeys(BASELINE_COLUMNS), "baseline": baseline, "setting": setting, **figures}
