"""Observation formats (cells, index, one-hot), and conversion of policies to tables."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from taichi_ants.errors import as_array, check_one_of
from taichi_ants.learners.policies import finite
from taichi_ants.task import Observation, observations
from taichi_ants.task.constants import N_ACTIONS

ObservationFormat = Literal["cells", "index", "one_hot"]
FORMATS: tuple[str, ...] = get_args(ObservationFormat)


class ShownObservations:
    """The observations of an environment, in one of the formats.

    The index of a state consists of several parts, see `shape` of `taichi_ants.task.Observation`:
    in built-in observations, the load (1 with food) and a code for each cell in view.

    Attributes:
        space: The space of one ant. "cells": MultiDiscrete (k,), int64, the k parts of a state.
            "index": Discrete, the state index. "one_hot": Box (sum of the sizes of all parts,),
            float32, with a 1 for the value of each part, as in `gymnasium.spaces.flatten`.
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
            self.space = spaces.Box(0.0, 1.0, (sum(parts),), np.float32)

    @cached_property
    def table(self) -> np.ndarray:
        """The observation of each state, (n_states, *space.shape), of the space's dtype."""
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
        """Return the observations (..., *space.shape) of states, integers of any shape (...)."""
        # `take` with "clip" is ten times as fast as `table[states]`.
        return self.table.take(states, axis=0, mode="clip")


def tabulate(
    function: Callable[[np.ndarray], Any],
    observation: str = "paper",
    observation_format: ObservationFormat = "one_hot",
) -> npt.NDArray[np.float32]:
    """Return the table of a policy that is a function of observations.

    The function is called once, with the observations of all states. The table is a greedy policy:
    if the function returns probabilities, the most probable action is taken.

        table = tabulate(lambda seen: model.predict(seen, deterministic=True)[0])

    Args:
        function: A function of the observations of all states, (n_states, ...) of the dtype of the
            environment's observation space. It returns action values, logits or probabilities,
            real (n_states, 5), or the action in each state, integers (n_states,).
        observation: Name of the registered observation.
        observation_format: "cells", "index" or "one_hot", as in the environment.

    Returns:
        Action values, float32 (n_states, 5). For actions, 1 for the action and 0 for all others.

    >>> tabulate(lambda seen: seen[:, 0].astype(int)).shape  # an action in each state
    (128, 5)
    """
    seen = ShownObservations(observations.get(observation), observation_format).table
    n_states, given = len(seen), np.asarray(function(seen))
    what = "the result of your function"
    if given.ndim == 1:
        actions = as_array(what, given, "iu", (n_states,), 0, N_ACTIONS - 1)
        return np.eye(N_ACTIONS, dtype=np.float32)[actions]
    return finite("function returned", as_array(what, given, "fiu", (n_states, N_ACTIONS)))
