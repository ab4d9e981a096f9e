"""Baselines to hold learned policies against: exact bounds, and two policies without learning."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from taichi_ants.analysis.bounds.episodes import Outcome, exact_bounds
from taichi_ants.analysis.statistics import bootstrap_interval
from taichi_ants.errors import AntsError
from taichi_ants.learners.policies import random_policy, trail_follower
from taichi_ants.task import Task
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
# In the paper's protocol; the first word tells what the rows are held against.
TRAINING_SETTING = "training, no evaporation"
GREEDY_SETTING = "greedy, evaporation"
_CONDITIONS = ("no evaporation", "evaporation")
_PAPER_SETTINGS: Mapping[str, bool] = {TRAINING_SETTING: False, GREEDY_SETTING: True}

_ENDLESS = (
    "there is no optimal policy: without a discount below 1 the return of an episode without step "
    "limit may grow without bound"
)

# One row of baselines.csv; None for an empty field.
BaselineRow = dict[str, Any]


# Called as evaluate(world, q_values, rollouts=, epsilon=, max_steps=, task=, seeds=), with
# one table for each seed: q_values (seeds, 128, 5). What it returns has returns, steps and
# deliveries, (seeds, rollouts) each.
Evaluate = Callable[..., Any]


def baseline_rows(
    world: World,
    evaluate: Evaluate,
    seeds: Sequence[int],
    rollouts: int = 50,
    discounts: Sequence[float] = (0.9, 0.99),
    max_steps: int = 600,
    train_evaporation: bool = False,
    greedy_evaporation: bool = True,
) -> list[BaselineRow]:
    """All baselines of a world, as rows with the columns BASELINE_COLUMNS.

    Args:
        world: The world.
        evaluate: What rolls out policies, such as `taichi_ants.engines.evaluate`.
        seeds: The seeds of the rollouts; figures are means over them, with 95 % intervals.
        rollouts: Rollouts for each seed.
        discounts: Discount factors whose optimal policies are wanted.
        max_steps: The step limit of an episode.
        train_evaporation, greedy_evaporation: Whether trails evaporate in training and in the
            greedy evaluation of what is compared.

    Returns:
        The rows of `bound_rows`, or one row whose note says why there are none; then those of
        `policy_rows`.
    """
    training = f"training, {_CONDITIONS[train_evaporation]}"
    try:
        if train_evaporation:
            raise AntsError("exact bounds are known for worlds without evaporation only.")
        bounds = bound_rows(world, discounts, max_steps)
    except AntsError as error:
        bounds = [_row("exact bounds", training, note=str(error))]
    settings = {
        training: train_evaporation,
        f"greedy, {_CONDITIONS[greedy_evaporation]}": greedy_evaporation,
    }
    return bounds + policy_rows(world, evaluate, seeds, rollouts, max_steps, settings)


def bound_rows(world: World, discounts: Sequence[float], max_steps: int) -> list[BaselineRow]:
    """The exact bounds of `dynamic_programming.exact_bounds` as rows.

    A discount of 1 has a row without figures, whose note says why.

    Raises:
        AntsError: As `exact_bounds` does, above all if the world is too large.
    """
    bounds = exact_bounds(world, [discount for discount in discounts if discount < 1], max_steps)
    if bounds.shortest is None:
        shortest = _row("shortest delivery", TRAINING_SETTING, note="no delivery is possible")
    else:
        note = "exact: fewest steps to a delivery, then largest return, whatever the step limit"
        shortest = _outcome_row("shortest delivery", bounds.shortest, note)
    note = f"exact: largest undiscounted return within {max_steps} steps, then fewest steps"
    rows = [shortest, _outcome_row("largest return", bounds.largest, note)]
    for optimal in bounds.optimal:
        note = (
            f"exact: optimal for an episode without step limit (discounted return "
            f"{optimal.value:.6g}), followed for at most {max_steps} steps"
        )
        row = _outcome_row("optimal policy", optimal.outcome, note)
        rows.append({**row, "discount": optimal.discount})
    endless = [discount for discount in discounts if discount >= 1]
    for discount in dict.fromkeys(endless):
        row = _row("optimal policy", TRAINING_SETTING, note=_ENDLESS)
        rows.append({**row, "discount": discount})
    return rows


def policy_rows(
    world: World,
    evaluate: Evaluate,
    seeds: Sequence[int],
    rollouts: int,
    max_steps: int,
    settings: Mapping[str, bool] = _PAPER_SETTINGS,
) -> list[BaselineRow]:
    """The random policy and the trail follower as rows, in settings with or without evaporation."""
    note = f"mean over {len(seeds)} seeds of {rollouts} rollouts, 95 % interval over seeds (BCa)"
    rows = []
    for name, policy in (("random policy", random_policy()), ("trail follower", trail_follower())):
        for setting, evaporation in settings.items():
            outcome = evaluate(
                world,
                np.repeat(policy[None], len(seeds), axis=0),
                rollouts=rollouts,
                epsilon=0.0,
                max_steps=max_steps,
                task=Task(evaporation_in_evaluation=evaporation),
                seeds=list(seeds),
            )
            returns = np.asarray(outcome.returns, float).mean(axis=1)
            low, high = bootstrap_interval(returns[None])
            figures = {
                "return_mean": float(returns.mean()),
                # One seed has no interval.
                "return_ci_low": None if np.isnan(low[0]) else float(low[0]),
                "return_ci_high": None if np.isnan(high[0]) else float(high[0]),
                "steps_mean": float(np.mean(outcome.steps)),
                "deliveries_mean": float(np.mean(outcome.deliveries)),
            }
            rows.append(_row(name, setting, note=note, **figures))
    return rows


def _outcome_row(baseline: str, outcome: Outcome, note: str) -> BaselineRow:
    return _row(
        baseline,
        TRAINING_SETTING,
        note=note,
        return_mean=outcome.episode_return,
        steps_mean=outcome.steps,
        deliveries_mean=outcome.deliveries,
    )


def _row(baseline: str, setting: str, **figures: Any) -> BaselineRow:
    return {**dict.fromkeys(BASELINE_COLUMNS), "baseline": baseline, "setting": setting, **figures}
