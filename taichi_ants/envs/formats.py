"""Formats in which ants see their states: cells, index or one-hot; policies of them as tables."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from itertools import pairwise
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from taichi_ants.errors import AntsError, check_one_of, shown
from taichi_ants.learners.policies import finite
from taichi_ants.task import Observation, observations
from taichi_ants.task.constants import N_ACTIONS

ObservationFormat = Literal["cells", "index", "one_hot"]
FORMATS: tuple[str, ...] = get_args(ObservationFormat)
_MOST_NUMBERS = 1 << 25  # of the table of all states


class Shown:
    """What an ant sees, in one of the formats.

    A state is an index into a table of action values, see `taichi_ants.task.Observation`; in those
    of this package it is made of the load (1 with food) and a code for each cell in view.

    Attributes:
        space: The space of one ant. "cells": MultiDiscrete (k,), int64: the k parts of a state.
            "index": Discrete, the state itself. "one_hot": Box (sum of the sizes of all parts,),
            float32: a 1 for each part, at its value, as `gymnasium.spaces.flatten` of "cells".
    """

    def __init__(self, observation: Observation, form: ObservationFormat) -> None:
        check_one_of("observation_format", form, FORMATS)
        self.observation, self.form = observation, form
        parts, n_states = observation.parts, observation.n_states
        if form == "index":
            self.space: spaces.Space = spaces.Discrete(n_states)
        elif form == "cells":
            self.space = spaces.MultiDiscrete(list(parts))
        else:
            if sum(parts) * n_states > _MOST_NUMBERS:
                raise AntsError(
                    f"observation_format is 'one_hot', but {observation.name!r} has {n_states} "
                    'states of one part; use "index", or register it with a shape.'
                )
            self.space = spaces.Box(0.0, 1.0, (sum(parts),), np.float32)

    @cached_property
    def table(self) -> np.ndarray:
        """What each state is shown as: (n_states, ...) of the space's shape and dtype."""
        states = np.arange(self.observation.n_states)
        if self.form == "index":
            return states
        cells = np.stack(np.unravel_index(states, self.observation.parts), axis=-1)
        if self.form == "cells":
            return cells
        ends = np.cumsum(self.observation.parts)
        flat = np.zeros((len(states), ends[-1]), np.float32)
        np.put_along_axis(flat, cells + ends - self.observation.parts, 1.0, axis=1)
        return flat

    def show(self, states: np.ndarray) -> np.ndarray:
        """What these states are shown as: integers of any shape (...) -> (..., *space.shape)."""
        # Ten times as fast as `table[states]`.
        return self.table.take(states, axis=0, mode="clip")

    def states(self, shown: np.ndarray) -> np.ndarray:
        """The states of what was shown: (..., *space.shape) -> int64 (...)."""
        shown = np.asarray(shown)
        if self.form == "index":
            return shown.astype(np.int64)
        if self.form == "one_hot":
            begins = np.cumsum((0, *self.observation.parts))
            shown = np.stack([shown[..., a:b].argmax(-1) for a, b in pairwise(begins)], axis=-1)
        digits = tuple(np.moveaxis(shown.astype(np.int64), -1, 0))
        return np.ravel_multi_index(digits, self.observation.parts)


def tabulate(
    function: Callable[[np.ndarray], Any],
    observation: str = "paper",
    observation_format: ObservationFormat = "one_hot",
) -> npt.NDArray[np.float32]:
    """The table of a policy that is a function of what an ant sees.

    The function is called once, with all states. The table acts greedily: of a policy with
    probabilities it keeps the most probable action.

        table = tabulate(lambda seen: model.predict(seen, deterministic=True)[0])

    Args:
        function: Takes all states as an environment shows them, (n_states, ...) of the dtype of its
            observation space. Returns action values, logits or probabilities, real (n_states, 5);
            or the action in each state, integers (n_states,).
        observation: Name of the registered observation.
        observation_format: The environment's: "cells", "index" or "one_hot".

    Returns:
        Action values, float32 (n_states, 5). Of actions: 1 for the action, 0 for the others.
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
    return finite("function returned", given)
