"""Exact bounds on what an ant can achieve in one episode, by dynamic programming.

They hold for an ant that knows the whole world, its own place in it and what it has taken, so no
policy on the 128 states of an ant's view can do better. One ant, evaporation off, the episode ends
at the first delivery (as in the paper's training).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import repeat
from typing import NamedTuple

import numpy as np

from taichi_ants.analysis.bounds.transitions import Phase, Transitions, build_transitions
from taichi_ants.errors import AntsError, shown
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task.constants import FORWARD, LEFT, MAX_STEPS, RIGHT
from taichi_ants.worlds.world import World

# Limits on the memory and the time that the bounds of a world may take, about a minute on one core.
MAX_STATES = 5_000_000
MAX_BACKUPS = 600 * MAX_STATES
# What a backup of all states costs besides, in backups of one state.
_BACKUP_OVERHEAD = 1000

# Two goals in one whole number, the first in units of this: far above any sum of the second.
_UNIT = 1 << 32
# Below all scores of episodes that are possible.
_NEVER = -(1 << 61)

# Action values this close count as equal, since the same sums in another order differ by rounding:
# relative to the value of the state, and, for sums that cancel to almost nothing, relative to the
# largest value. So a goal of 10 that is discounted to less than about 1e-13 goes unnoticed, with a
# discount factor of 0.9 after 300 steps.
_RELATIVE_TOLERANCE = 1e-12
_ABSOLUTE_TOLERANCE = 1e-14
# The discount of what an evaluation may leave out of the sum without end.
_NEGLIGIBLE = 1e-18


@dataclass(frozen=True)
class Outcome:
    """What an episode yields; means where a pick-up chooses among several foods.

    Attributes:
        episode_return: Undiscounted sum of rewards, the episode's return.
        steps: Length of the episode, in steps.
        deliveries: 1 if it ends with a delivery, 0 if at the step limit.
    """

    episode_return: float
    steps: float
    deliveries: float


@dataclass(frozen=True)
class OptimalPolicy:
    """What is optimal for one discount factor, and what it does.

    Attributes:
        discount: The discount factor.
        value: The largest expected discounted return from the start, without a step limit.
        outcome: What following an optimal policy yields within the step limit. Where several
            actions are optimal, it takes the one with the lowest number.
    """

    discount: float
    value: float
    outcome: Outcome


@dataclass(frozen=True)
class ExactBounds:
    """The bounds of one world and step limit.

    Attributes:
        shortest: The episode with the fewest steps to a delivery, whatever the step limit, and
            among these one with the largest return; None if no delivery is possible.
        largest: The episode with the largest return within the step limit, and among these one
            with the fewest steps; the ant is lucky where a pick-up chooses among several foods.
        optimal: One per discount factor, in the order asked for.
    """

    shortest: Outcome | None
    largest: Outcome
    optimal: tuple[OptimalPolicy, ...]


def exact_bounds(world: World, discounts: Sequence[float], max_steps: int = 600) -> ExactBounds:
    """Compute the bounds for an ant that starts where `world.start(seed=0)` places it.

    Args:
        world: The world as it is when the episode starts.
        discounts: Discount factors in [0, 1).
        max_steps: The step limit of an episode, at least 1.

    Raises:
        AntsError: A discount or the step limit is out of range, no ant can start, or the world is
            too large.
    """
    for discount in discounts:
        if not 0 <= discount < 1:
            raise AntsError(
                f"the discount is {shown(discount)}; for a return without end it must be at least "
                "0 and below 1."
            )
    if not hasattr(max_steps, "__index__") or not 1 <= max_steps <= MAX_STEPS:
        raise AntsError(
            f"max_steps is {shown(max_steps)}; it must be a whole number from 1 to {MAX_STEPS}."
        )
    _check_size(N_HEADINGS * world.grid.count, 0, max_steps)
    transitions = build_transitions(world)
    _check_size(transitions.foraging.n_states, transitions.n_foods, max_steps)
    return ExactBounds(
        shortest=_shortest(transitions),
        largest=_largest(transitions, max_steps),
        optimal=tuple(_optimal(transitions, discount, max_steps) for discount in discounts),
    )


def _check_size(states: int, foods: int, max_steps: int) -> None:
    """Refuse a world with too many states of one phase, counted for all its phases."""
    phases = 1 + foods
    if phases * states > MAX_STATES:
        raise AntsError(
            f"the exact bounds of this world need {phases * states} states, more than the "
            f"{MAX_STATES} that are allowed; choose a smaller world or fewer foods to get them."
        )
    if phases * max_steps * (states + _BACKUP_OVERHEAD) > MAX_BACKUPS:
        raise AntsError(
            f"the exact bounds of this world, {phases * states} states over {max_steps} steps, "
            "take more than the minute of work that is allowed; choose a smaller world, fewer "
            "foods or fewer steps to get them."
        )


def _shortest(transitions: Transitions) -> Outcome | None:
    """Every step costs one unit, which outweighs all rewards: few steps first, then return."""
    best_after = np.full(transitions.after_pick_up.size, _NEVER)
    for food in range(transitions.n_foods):
        phase = transitions.carrying(food).scored(1, -_UNIT)
        values = _without_limit(phase, np.zeros(phase.exits.size, np.int64))
        ends, starts = transitions.pick_ups(food)
        best_after[ends] = np.maximum(best_after[ends], values[starts])
    phase = transitions.foraging.scored(1, -_UNIT)
    score = int(_without_limit(phase, best_after)[transitions.start])
    if score == _NEVER:
        return None
    steps = (_UNIT // 2 - score) // _UNIT
    return Outcome(float(score + steps * _UNIT), float(steps), 1.0)


def _largest(transitions: Transitions, max_steps: int) -> Outcome:
    """A reward counts one unit, which outweighs all steps: return first, then few steps.

    Below the units, a step costs 2 and a delivery earns 1, which also tells whether an episode of
    the full length ends with a delivery.
    """
    best_after = np.full((max_steps, transitions.after_pick_up.size), _NEVER)
    for food in range(transitions.n_foods):
        phase = transitions.carrying(food).scored(_UNIT, -2)
        delivered = np.ones(phase.exits.size, np.int64)
        ends, starts = transitions.pick_ups(food)
        horizon = _within_limit(phase, repeat(delivered, max_steps - 1))
        for best, values in zip(best_after, horizon, strict=True):
            best[ends] = np.maximum(best[ends], values[starts])
    score = 0
    for values in _within_limit(transitions.foraging.scored(_UNIT, -2), best_after):
        score = int(values[transitions.start])
    episode_return = -(-score // _UNIT)
    below_units = episode_return * _UNIT - score
    steps = (below_units + 1) // 2
    return Outcome(float(episode_return), float(steps), float(2 * steps - below_units))


def _backup(phase: Phase, values: np.ndarray, end_values: np.ndarray) -> np.ndarray:
    """The value of the best action in each state, from the values of what follows."""
    best = values + phase.failed_reward
    for move in (LEFT, FORWARD, RIGHT):
        moved = values.take(phase.successors[move])
        moved += phase.rewards[move]
        np.maximum(best, moved, out=best)
    best[phase.exits] = np.maximum(best[phase.exits], end_values + phase.exit_reward)
    return best


def _within_limit(phase: Phase, end_values: Iterable[np.ndarray]) -> Iterator[np.ndarray]:
    """The values (6 n,) with 0, 1, 2 ... steps left, given those of the ends after each step."""
    values = np.zeros(phase.n_states, np.int64)
    yield values
    for ends in end_values:
        values = _backup(phase, values, ends)
        yield values


def _without_limit(phase: Phase, end_values: np.ndarray) -> np.ndarray:
    """The values (6 n,) where every step costs, _NEVER where no end can be reached."""
    values = np.full(phase.n_states, _NEVER)
    while True:
        # What costs more than never is not possible either.
        better = np.maximum(_backup(phase, values, end_values), _NEVER)
        if np.array_equal(better, values):
            return values
        values = better


def _optimal(transitions: Transitions, discount: float, max_steps: int) -> OptimalPolicy:
    sums = np.zeros(transitions.after_pick_up.size)
    policies = []
    for food in range(transitions.n_foods):
        phase = transitions.carrying(food)
        values, policy = _solve(phase, np.zeros(phase.exits.size), discount)
        ends, starts = transitions.pick_ups(food)
        sums[ends] += values[starts]
        policies.append(policy)
    choices = (transitions.foods_in_view >= 0).sum(axis=1)
    values, policy = _solve(transitions.foraging, sums / choices, discount)
    outcome = _follow(transitions, policy, policies, max_steps)
    return OptimalPolicy(float(discount), float(values[transitions.start]), outcome)


def _solve(phase: Phase, end_values: np.ndarray, discount: float) -> tuple[np.ndarray, np.ndarray]:
    """The optimal values and policy of one phase for a discounted return, by policy iteration.

    Args:
        phase: Its actions and rewards.
        end_values: float64 (S,): the values of its ends, what follows the action that leads there.
        discount: The discount factor, in [0, 1).

    Returns:
        float64 (6 n,): the largest discounted return from each state, and int8 (6 n,): the action
        to take there, the lowest number among the optimal ones.
    """
    states = np.arange(phase.n_states)
    policy = phase.rewards.argmax(axis=0)
    while True:
        values = _evaluate(phase, policy, end_values, discount)
        backup = phase.rewards + discount * np.append(values, end_values)[phase.successors]
        best = backup.max(axis=0)
        tolerance = _RELATIVE_TOLERANCE * np.abs(best) + _ABSOLUTE_TOLERANCE * np.abs(best).max()
        improvable = best > backup[policy, states] + tolerance
        if not improvable.any():
            return values, (backup >= best - tolerance).argmax(axis=0).astype(np.int8)
        policy = np.where(improvable, backup.argmax(axis=0), policy)


def _evaluate(
    phase: Phase, policy: np.ndarray, end_values: np.ndarray, discount: float
) -> np.ndarray:
    """The discounted return of following a policy from each state, float64 (6 n,).

    Exact, by doubling, as a phase is a deterministic graph: the sum of the first 2k rewards is that
    of the first k, plus the discounted sum of k from where these lead.
    """
    states = np.arange(phase.n_states)
    ends = phase.n_states + np.arange(phase.exits.size)
    later = np.concatenate([phase.successors[policy, states], ends])
    # The value of an end counts with the action that leads there; after that nothing follows.
    known = np.append(np.zeros(states.size), end_values)
    values = np.append(phase.rewards[policy, states] + discount * known[later[states]], 0 * ends)
    factor = discount
    while factor > _NEGLIGIBLE:
        values = values + factor * values[later]
        later = later[later]
        factor *= factor
    return values[states]


def _follow(
    transitions: Transitions,
    foraging: np.ndarray,
    carrying: Sequence[np.ndarray],
    max_steps: int,
) -> Outcome:
    """The outcome of following one policy (6 n,) to the pick-up, then that of the food taken."""
    walk = _walk(transitions.foraging, foraging, transitions.start, max_steps)
    if walk.end is None:
        return Outcome(float(walk.reward), float(walk.steps), 0.0)
    start = int(transitions.after_pick_up[walk.end])
    walks_home = [
        _walk(transitions.carrying(food), carrying[food], start, max_steps - walk.steps)
        for food in transitions.foods_in_view[walk.end]
        if food >= 0
    ]
    return Outcome(
        walk.reward + float(np.mean([home.reward for home in walks_home])),
        walk.steps + float(np.mean([home.steps for home in walks_home])),
        float(np.mean([home.end is not None for home in walks_home])),
    )


class _Walk(NamedTuple):
    reward: int
    steps: int
    end: int | None  # the end of the phase that it leads to within the limit, if any


def _walk(phase: Phase, policy: np.ndarray, state: int, max_steps: int) -> _Walk:
    states = np.arange(phase.n_states)
    successors = phase.successors[policy, states].tolist()
    rewards = phase.rewards[policy, states].tolist()
    reward = 0
    for step in range(max_steps):
        reward += rewards[state]
        state = successors[state]
        if state >= phase.n_states:
            return _Walk(reward, step + 1, state - phase.n_states)
    return _Walk(reward, max_steps, None)
