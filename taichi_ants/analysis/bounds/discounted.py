"""Optimal policies for a discounted return without end, by policy iteration.

A phase is a deterministic graph, so a policy can be evaluated exactly by doubling: the sum of its
first 2k rewards is the sum of its first k, plus the discounted sum of k from where these lead.
"""

from __future__ import annotations

import numpy as np

from taichi_ants.analysis.bounds.transitions import Phase

# Action values this close count as equal, since the same sums in another order differ by rounding:
# relative to the value of the state, and, for sums that cancel to almost nothing, relative to the
# largest value. So a goal of 10 that is discounted to less than about 1e-13 goes unnoticed, with a
# discount factor of 0.9 after 300 steps.
_RELATIVE_TOLERANCE = 1e-12
_ABSOLUTE_TOLERANCE = 1e-14
# The discount of what an evaluation may leave out of the sum without end.
_NEGLIGIBLE = 1e-18


def solve_phase(
    phase: Phase, end_values: np.ndarray, discount: float
) -> tuple[np.ndarray, np.ndarray]:
    """The optimal values and policy of one phase.

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
    """The discounted return of following a policy from each state, float64 (6 n,)."""
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
