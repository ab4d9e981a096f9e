"""Arguments of environments, checked: worlds, seeds, masks and actions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.error import InvalidAction
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode

from taichi_ants import checks
from taichi_ants.errors import AntsError, check_one_of, checked_whole, count, shown
from taichi_ants.task.constants import N_ACTIONS
from taichi_ants.worlds import World, build, from_text


def worlds_of(world: Any, most: int) -> tuple[World, ...]:
    """The worlds that were asked for, at most so many, all of the same ranges."""
    given = [world] if isinstance(world, (str, World)) else world
    if not isinstance(given, (list, tuple)) or not given:
        raise AntsError(
            f"world is {shown(world)}; give the name of a world, a World, or a list of them."
        )
    if len(given) > most:
        raise AntsError(f"world lists {count(len(given), 'world')}; there is room for {most}.")
    several = tuple(map(_built, given))
    ranges = {one.ranges for one in several}
    if len(ranges) > 1:
        raise AntsError(f"the worlds have the ranges {sorted(ranges)}; all must have the same.")
    return several


def _built(world: Any) -> World:
    """The world of a name, a path or the text of a map, or itself."""
    if isinstance(world, str):
        world = from_text(world) if "\n" in world else build(world)
    return checks.checked_world(world)


class StepLimit:
    """Base of environments whose `spec.max_episode_steps` is their own step limit.

    Gymnasium leaves it out of the spec of an environment that it does not wrap in a `TimeLimit`.
    """

    max_steps: int
    _spec: EnvSpec | None = None

    @property
    def spec(self) -> EnvSpec | None:
        """The specification of an environment that Gymnasium has made, else None."""
        return self._spec

    @spec.setter
    def spec(self, given: EnvSpec | None) -> None:
        self._spec = given and replace(given, max_episode_steps=self.max_steps)


def lower_limit(max_steps: int, max_episode_steps: int | None) -> int:
    """Return the lower one of two step limits; Gymnasium gives the second one, or None."""
    if max_episode_steps is None:
        return max_steps
    return min(checked_whole("max_episode_steps", max_episode_steps), max_steps)


def seeds_of(seed: Any, n: int) -> Sequence[int | None]:
    """The seed of each of n environments, None for those that go on, as Gymnasium counts them."""
    if seed is None:
        return [None] * n
    if isinstance(seed, (int, np.integer)):
        return range(int(seed), int(seed) + n)
    if not isinstance(seed, (list, tuple, np.ndarray)) or np.shape(seed)[:1] != (n,):
        raise ValueError(f"seed is {shown(seed)}; give a whole number, or a list of {n}.")
    for one in seed:
        if one is None:
            continue
        if not isinstance(one, (int, np.integer)):
            raise ValueError(f"a seed is {shown(one)}; it must be a whole number from 0 on.")
        seeding.np_random(int(one))  # says what Gymnasium says of negative ones
    return [None if one is None else int(one) for one in seed]


def checked_reset_mask(options: dict[str, Any] | None, n: int) -> np.ndarray:
    """Where to begin, bool (n,): the mask in the options of a reset, everywhere without one."""
    if not isinstance(options, (dict, type(None))):
        raise TypeError(f"options is {shown(options)}; it must be a dict or None.")
    mask = (options or {}).get("reset_mask")
    if mask is None:
        return np.ones(n, bool)
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
        raise TypeError(f"reset_mask is {shown(mask)}; it must be a NumPy array of bool.")
    if mask.shape != (n,) or not mask.any():
        raise ValueError(f"reset_mask is {shown(mask)}; it must have shape ({n},) and hold a True.")
    return mask.copy()


def checked_autoreset(mode: Any) -> AutoresetMode:
    """The mode of a name, or itself."""
    names = [one.value for one in AutoresetMode]
    check_one_of("autoreset_mode", getattr(mode, "value", mode), names)
    return AutoresetMode(mode)


def checked_actions(actions: Any, n: int) -> np.ndarray:
    """The actions of n ants, whole numbers (n,) from 0 to 4."""
    try:
        given = np.asarray(actions)
    except ValueError:  # lists of several lengths
        given = np.empty(0)
    if given.shape != (n,) or given.dtype.kind not in "iu":
        raise InvalidAction(
            f"the actions are {shown(actions)}; they must be an array of an integer type and of "
            f"shape ({n},)."
        )
    if given.min() < 0 or given.max() >= N_ACTIONS:
        wrong = given[(given < 0) | (given >= N_ACTIONS)][0]
        raise InvalidAction(f"an action is {wrong}; it must be 0, 1, 2, 3 or 4.")
    return given
