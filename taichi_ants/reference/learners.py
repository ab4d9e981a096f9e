"""The twin of each learner: its TD error in np.float32, one rounding per operation.

The order of the operations is part of the rules, since float32 sums depend on it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from taichi_ants.errors import AntsError

# (value, reward, discount, next_values, next_action, epsilon) -> TD error.
#   value        Q(s, a)
#   reward       of the step
#   discount     0 where the transition terminated
#   next_values  Q(s', .), 5 values
#   next_action  a', an int; 0 where none was drawn
#   epsilon      the present one
# All numbers but next_action are np.float32, and so is the result.
TdError = Callable[
    [np.float32, np.float32, np.float32, Sequence[np.float32], int, np.float32], np.float32
]


@dataclass(frozen=True)
class Learner:
    """A learner of the reference.

    Attributes:
        td_error: See `TdError`.
        draws_next_action: Whether a' is drawn before the update, and executed (as SARSA does).
        plans: Whether updates from a model of the last seen transitions follow each step; they
            have no a'.
    """

    td_error: TdError
    draws_next_action: bool
    plans: bool


_learners: dict[str, Learner] = {}


def register(
    name: str, td_error: TdError, draws_next_action: bool = False, plans: bool = False
) -> None:
    """Make a learner known under a name.

    Raises:
        AntsError: The name is taken.
    """
    if name in _learners:
        raise AntsError(f"the reference has a learner {name!r} already; choose another name.")
    _learners[name] = Learner(td_error, draws_next_action, plans)


def learner_named(name: str) -> Learner:
    """Return the learner of this name.

    Raises:
        AntsError: There is none.
    """
    if name not in _learners:
        known = ", ".join(learner_names())
        raise AntsError(f"the reference has no learner {name!r}; it must be one of {known}.")
    return _learners[name]


def learner_names() -> tuple[str, ...]:
    """Return the names of all learners, in the order of their registration."""
    return tuple(_learners)


def _td_error_q_learning(value, reward, discount, next_values, next_action, epsilon):
    return (reward + discount * max(next_values)) - value


def _td_error_sarsa(value, reward, discount, next_values, next_action, epsilon):
    return (reward + discount * next_values[next_action]) - value


def _td_error_expected_sarsa(value, reward, discount, next_values, next_action, epsilon):
    q0, q1, q2, q3, q4 = next_values
    best = max(next_values)
    mean = ((((q0 + q1) + q2) + q3) + q4) * np.float32(0.2)
    return (reward + discount * (best + epsilon * (mean - best))) - value


register("q_learning", _td_error_q_learning)
register("sarsa", _td_error_sarsa, draws_next_action=True)
register("expected_sarsa", _td_error_expected_sarsa)
register("dyna_q", _td_error_q_learning, plans=True)
