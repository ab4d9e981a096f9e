"""One ant as a Gymnasium environment, and many such ants as one vector environment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import InvalidAction, ResetNeeded
from gymnasium.spaces import Discrete
from gymnasium.vector import AutoresetMode

from taichi_ants import checks
from taichi_ants.engines.records import Snapshot
from taichi_ants.engines.runs.batched import BatchedEnvironments
from taichi_ants.envs.formats import ObservationFormat
from taichi_ants.envs.vector import ACTION_MASKS, Ants, AntVectorEnv, StepLimit, Worlds
from taichi_ants.errors import AntsError, check_one_of, checked_whole, shown
from taichi_ants.task import Task
from taichi_ants.task.constants import (
    EMPTY,
    EPISODE_STEPS,
    FOOD,
    N_ACTIONS,
    OBSTACLE,
    QUEEN,
)
from taichi_ants.worlds import World, text_map

DELIVERIES = ("terminates", "truncates", "continues")
METADATA: dict[str, Any] = {"render_modes": ["rgb_array", "ansi"], "render_fps": 10}
_GROUNDS = {
    EMPTY: text_map.EMPTY,
    OBSTACLE: text_map.OBSTACLE,
    FOOD: text_map.FOOD,
    QUEEN: text_map.QUEEN,
}
# Of all environments together, with room for some more: 4 GiB.
_MOST_CELLS = (1 << 30) - (1 << 24)
# Rows as single numbers of 8 bytes, which NumPy takes three times as fast.
_PACKED_MASKS = np.pad(ACTION_MASKS, ((0, 0), (0, 8 - N_ACTIONS))).view(np.int64)[:, 0]


class LoneAnts(Ants):
    """n ants, each in a world of its own; all of them do a step in one launch."""

    def __init__(
        self,
        n: int,
        world: Worlds,
        task: Task | Mapping[str, Any] | None,
        delivery: str | None,
        evaporation: bool | None,
        max_steps: int,
        observation_format: ObservationFormat,
        render_mode: str | None,
        max_episode_steps: int | None = None,
    ) -> None:
        task = Task.from_dict(task) if isinstance(task, Mapping) else task  # as JSON holds it
        task = checks.checked_runs_task(task)
        super().__init__(
            *(world, n, task, max_steps, max_episode_steps, observation_format, evaporation),
            *(render_mode, METADATA["render_modes"]),
        )
        delivery = task.delivery if delivery is None else delivery
        check_one_of("delivery", delivery, DELIVERIES)
        most = _MOST_CELLS // self.worlds[0].grid.size
        if n > most:
            raise AntsError(f"num_envs is {n}; of this world there can be at most {most} at once.")
        self._text = render_mode == "ansi"
        self.batched = BatchedEnvironments(
            self.worlds, task, n, self.max_steps, delivery, self.evaporates
        )

    def begin(self, which: np.ndarray, seeds: Sequence[int | None]) -> None:
        """Begin an episode of the ants `which`, bool (n,), those with a seed by their seed."""
        given = {i: one for i, one in enumerate(seeds) if which[i] and one is not None}
        if given:
            self.batched.seed(list(given.values()), np.array(list(given)))
        self.batched.begin(which)

    def advance(
        self, actions: np.ndarray, mode: AutoresetMode, waiting: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Let all ants act; see the base."""
        begins = waiting if mode is AutoresetMode.NEXT_STEP else 0
        self.batched.step(actions, begins, same_step=mode is AutoresetMode.SAME_STEP)
        arrays = self.batched.arrays
        ends = (arrays[name].astype(bool) for name in ("terminations", "truncations"))
        return arrays["rewards_of"].copy(), *ends

    def facts(self, last: bool = False) -> dict[str, np.ndarray]:
        """The infos of all ants; see the base."""
        arrays, when = self.batched.arrays, "final_" if last else ""
        packed = _PACKED_MASKS.take(arrays[f"{when}percepts"], mode="clip")
        return {
            "state": arrays[f"{when}states"].astype(np.int64),
            "action_mask": packed.view(np.int8).reshape(-1, 8)[:, :N_ACTIONS],
            "event": arrays["events"].astype(np.int64),
            "reason": arrays["reasons"].astype(np.int64),
        }

    def draw(self, world: int) -> Any:
        """The world of an ant: uint8 (720, 1280, 3), or text."""
        arrays, sees = self.batched.arrays, self.task.sees
        now, state = self.batched.snapshot(world), int(arrays["states"][world])
        facts = (
            ("step", str(arrays["steps"][world])),
            ("reward", f"{arrays['rewards_of'][world]:g}"),
            ("state", sees.name_of(state)),
        )
        if self._text:
            return f"; {', '.join(map(' '.join, facts))}\n{_text_of(now)}"
        from taichi_ants import rendering

        if self._scene is None:
            strongest = self.task.pheromone.level
            self._scene = rendering.Scene(now.grid, view=True, strongest=strongest)
        return self._scene.draw(now, rendering.Status(facts, state, observation=sees))


def _text_of(now: Snapshot) -> str:
    """A text map, see `worlds.text_map`; the ant is its heading."""
    ground = np.where(now.grid.exists, now.ground, -1)
    where = [(ground == kind, mark) for kind, mark in _GROUNDS.items()]
    where.append(((now.trail > 0) & (now.ground == EMPTY), text_map.TRAIL))
    marks = [(now.grid.cells(np.flatnonzero(cells)), mark) for cells, mark in where]
    on_trail = now.trail[now.ant_cells[0]] > 0
    letters = text_map.ANTS_ON_TRAIL if on_trail else text_map.ANTS
    marks.append((now.grid.cells(now.ant_cells), letters[now.ant_headings[0]]))
    return text_map.drawing(now.grid.ranges, marks)


class HexForageEnv(StepLimit, gymnasium.Env[Any, Any]):
    """One ant on a hexagonal grid looks for food and carries it to its queen.

    The rules, those of "Ants and Reinforcement Learning Algorithms", are in `docs/environments.md`.

    ## Observation Space
    By `observation_format`, for a task whose observation has states of parts (p1, ..., pk), in the
    paper's case 128 states of (2, 4, 4, 4): the load, then the codes of the cells left, forward and
    right (0 empty, 1 obstacle, 2 trail or, with food, nearer to the queen, 3 food or, with food,
    queen).

    - "cells": `MultiDiscrete([p1, ..., pk])`, int64 (k,).
    - "index": `Discrete(p1 * ... * pk)`, the state index.
    - "one_hot": `Box(0, 1, (p1 + ... + pk,), float32)`, each part one-hot.

    ## Action Space
    `Discrete(5)`: 0, 1, 2 turn to the cell left, forward or right and enter it; 3 picks up a food
    in view, 4 gives the food to the queen in view. A move that is blocked turns the ant all the
    same.

    ## Info
    - `state`: int64, the state's index.
    - `action_mask`: int8 (5,), 1 for actions that can succeed; in a dead end for the moves, which
      turn the ant. `action_masks()` returns it as bool, for MaskablePPO of sb3-contrib.
    - `event`: int64, the result of the action, a `taichi_ants.envs.Event`; NONE after `reset`.
    - `reason`: int64, why the action was blocked or failed, a `taichi_ants.envs.Reason`; NONE if
      it did not fail.

    ## Arguments
    world: Name of a registered world, path of a text map, its text, or a World.
    task: The rules, a `taichi_ants.Task`, or its `as_dict()`; None is the paper's. AntsError if it
        has what only colonies have.
    delivery: A delivery "terminates" or "truncates" the episode, or it "continues"; None is the
        task's, by default "terminates".
    evaporation: Whether trails evaporate; None is as the task says of training, by default not.
    max_steps: Steps after which an episode is truncated.
    observation_format: "cells", "index" or "one_hot".
    render_mode: "rgb_array": `render` draws uint8 (720, 1280, 3). "ansi": it writes a text map of
        the world as it is, its heading for the ant.
    """

    metadata = METADATA
    _ants: LoneAnts

    def __init__(
        self,
        world: str | World = "paper",
        task: Task | Mapping[str, Any] | None = None,
        delivery: str | None = None,
        evaporation: bool | None = None,
        max_steps: int = EPISODE_STEPS,
        observation_format: ObservationFormat = "cells",
        render_mode: str | None = None,
    ) -> None:
        self._ants = LoneAnts(
            *(1, world, task, delivery, evaporation, max_steps, observation_format, render_mode)
        )
        self._arrays, self.render_mode = self._ants.batched.arrays, render_mode
        self.observation_space, self.action_space = self._ants.shown.space, Discrete(N_ACTIONS)
        self._over, self._begun = True, False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode. With a seed, which decides all chance, episodes repeat exactly."""
        super().reset(seed=seed)
        if seed is None and not self._begun:
            seed = int(self.np_random.integers(2**63))
        self._ants.begin(np.ones(1, bool), [seed])
        self._over, self._begun = False, True
        return self._seen()

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Do an action, 0 to 4.

        Raises:
            ResetNeeded: No episode has begun, or it has ended.
            InvalidAction: There is no such action.
        """
        if self._over:
            raise ResetNeeded("no episode is under way; call reset() before step().")
        if not self.action_space.contains(action):
            raise InvalidAction(f"the action is {shown(action)}; it must be 0, 1, 2, 3 or 4.")
        self._ants.batched.step(action)
        arrays = self._arrays
        terminated, truncated = bool(arrays["terminations"][0]), bool(arrays["truncations"][0])
        self._over = terminated or truncated
        observation, info = self._seen()
        return observation, float(arrays["rewards_of"][0]), terminated, truncated, info

    def _seen(self) -> tuple[Any, dict[str, Any]]:
        """The observation and the info."""
        arrays = self._arrays
        return self._ants.shown.show(arrays["states"])[0], {
            "state": np.int64(arrays["states"][0]),
            "action_mask": ACTION_MASKS[arrays["percepts"][0]].copy(),
            "event": np.int64(arrays["events"][0]),
            "reason": np.int64(arrays["reasons"][0]),
        }

    def action_masks(self) -> np.ndarray:
        """Return which actions can succeed now, bool (5,), as `info["action_mask"]` does."""
        if not self._begun:
            raise ResetNeeded("no episode is under way; call reset() before action_masks().")
        return ACTION_MASKS[self._arrays["percepts"][0]].astype(bool)

    def render(self) -> Any:
        """A picture or a text map of the world as it is, see `render_mode`; None without one."""
        if not self._begun:
            raise ResetNeeded("no episode is under way; call reset() before render().")
        return None if self.render_mode is None else self._ants.draw(0)


class HexForageVectorEnv(AntVectorEnv):
    """Many ants, each alone in a world of its own: all of them do a step in one launch.

    Environment i is a `HexForageEnv` with seed `seed + i`, step by step; arrays have a leading axis
    of `num_envs`, and infos are as those of Gymnasium's own vector environments.

    ## Arguments
    num_envs: How many; each takes 4 bytes for each cell of its world.
    world: As of `HexForageEnv`, or a list of worlds of the same ranges: environment i lives in
        number i modulo their number.
    autoreset_mode: A `gymnasium.vector.AutoresetMode` or its name; the default is "NextStep".
    max_episode_steps: Another step limit, as `gymnasium.make` has; the lower one counts.
    All others: as of `HexForageEnv`; `render` draws all worlds.
    """

    metadata = METADATA

    def __init__(
        self,
        num_envs: int = 1,
        world: str | World | Sequence[World] = "paper",
        task: Task | Mapping[str, Any] | None = None,
        delivery: str | None = None,
        evaporation: bool | None = None,
        max_steps: int = EPISODE_STEPS,
        observation_format: ObservationFormat = "cells",
        render_mode: str | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
    ) -> None:
        n = checked_whole("num_envs", num_envs)
        ants = LoneAnts(
            *(n, world, task, delivery, evaporation, max_steps, observation_format, render_mode),
            max_episode_steps,
        )
        super().__init__(ants, n, n, autoreset_mode, render_mode)
