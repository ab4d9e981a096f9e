"""Turns a policy of any kind, such as a neural network, into a table of action values."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from taichi_ants.envs.formats import ObservationFormat, Shown
from taichi_ants.errors import AntsError, shown
from taichi_ants.task import observations
from taichi_ants.task.constants import N_ACTIONS


def tabulate(
    function: Callable[[np.ndarray], Any],
    observation: str = "paper",
    observation_format: ObservationFormat = "one_hot",
) -> npt.NDArray[np.float32]:
    """The table of a policy that is a function of what an ant sees.

    The function is called once, with all states. Its table does what the function does, but
    greedily: of a policy with probabilities it keeps the most probable action.

        table = tabulate(lambda seen: model.predict(seen, deterministic=True)[0])

    Args:
        function: Takes all states as an environment shows them, (n_states, ...) of the dtype of its
            observation space. Returns action values, logits or probabilities, real (n_states, 5);
            or the action in each state, integers (n_states,).
        observation: Name of the registered observation.
        observation_format: The environment's: "cells", "index" or "one_hot".

    Returns:
        Action values, float32 (n_states, 5). Of actions: 1 for the action, 0 for the others.

    Raises:
        AntsError: There is no such observation or format, or the function returns something else.
    """
    if not callable(function):
        raise AntsError(f"function is {shown(function)}; it must be a function of what is seen.")
    seen = Shown(observations.get(observation), observation_format).table
    n_states, returned = len(seen), function(seen)
    try:
        given = np.asarray(returned)
    except (TypeError, ValueError, RuntimeError) as error:  # what NumPy and torch raise
        raise AntsError(
            f"function returned {shown(returned)}, which is no array ({shown(str(error))}); return "
            "one array, without what else a library gives, and detached from gradients."
        ) from error
    if given.shape == (n_states,) and given.dtype.kind in "iu":
        if given.min() < 0 or given.max() >= N_ACTIONS:
            wrong = given[(given < 0) | (given >= N_ACTIONS)][0]
            raise AntsError(f"function returned the action {wrong}; it must be 0, 1, 2, 3 or 4.")
        return np.eye(N_ACTIONS, dtype=np.float32)[given]
    if given.shape != (n_states, N_ACTIONS) or given.dtype.kind not in "fiu":
        raise AntsError(
            f"function returned an array of shape {given.shape} and type {given.dtype}; it must be "
            f"real numbers of ({n_states}, {N_ACTIONS}), or actions, integers of ({n_states},)."
        )
    with np.errstate(over="ignore"):  # a float64 that float32 cannot hold becomes infinite
        table = given.astype(np.float32)
    if not np.isfinite(table).all():
        state, action = np.argwhere(~np.isfinite(table))[0]
        raise AntsError(
            f"function returned {table[state, action]} for state {state} and action {action}; "
            "numbers must be finite, so give an action that shall never be taken a low one."
        )
    return table
