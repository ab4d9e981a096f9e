"""One ant as a Gymnasium environment, and many such ants as one vector environment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium.error import InvalidAction, ResetNeeded
from gymnasium.spaces import Discrete, MultiDiscrete
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from taichi_ants import checks
from taichi_ants.engines.runs.batched import BatchedEnvironments
from taichi_ants.envs.arguments import (
    StepLimit,
    checked_actions,
    checked_autoreset,
    checked_reset_mask,
    lower_limit,
    seeds_of,
    worlds_of,
)
from taichi_ants.envs.formats import ObservationFormat, Shown
from taichi_ants.errors import AntsError, check_one_of, checked_flag, checked_whole, shown
from taichi_ants.task import Task
from taichi_ants.task.constants import (
    EMPTY,
    EPISODE_STEPS,
    FOOD,
    GIVE,
    N_ACTIONS,
    N_STATES,
    OBSTACLE,
    PICK_UP,
    QUEEN,
)
from taichi_ants.task.events import Event, Reason
from taichi_ants.task.states import state_from_index
from taichi_ants.worlds import World, text_map

if TYPE_CHECKING:
    from taichi_ants.engines.records import Snapshot
    from taichi_ants.rendering import Scene

DELIVERIES = ("terminates", "truncates", "continues")
RENDER_MODES = ("rgb_array", "ansi")
_GROUNDS = {
    EMPTY: text_map.EMPTY,
    OBSTACLE: text_map.OBSTACLE,
    FOOD: text_map.FOOD,
    QUEEN: text_map.QUEEN,
}
# Of all environments together, with room for some more: 4 GiB.
_MOST_CELLS = (1 << 30) - (1 << 24)


def _action_masks() -> np.ndarray:
    """What can succeed, by percept: int8 (128, 5)."""
    masks = np.zeros((N_STATES, N_ACTIONS), np.int8)
    for percept, mask in enumerate(masks):
        state = state_from_index(percept)
        mask[:PICK_UP] = [code % 2 == 0 for code in state.view]  # E, T and S can be entered
        mask[GIVE if state.carries else PICK_UP] = 3 in state.view
        if not mask.any():  # a dead end, which an ant leaves by turning
            mask[:PICK_UP] = 1
    return masks


ACTION_MASKS = _action_masks()
# Rows as single numbers of 8 bytes, which NumPy takes three times as fast.
_PACKED_MASKS = np.pad(ACTION_MASKS, ((0, 0), (0, 8 - N_ACTIONS))).view(np.int64)[:, 0]


class _Ants:
    """What both environments have: the ants, what they see, and what is said of them."""

    def __init__(
        self,
        n: int,
        world: str | World | Sequence[World],
        task: Task | Mapping[str, Any] | None,
        delivery: str | None,
        evaporation: bool | None,
        max_steps: int,
        observation_format: ObservationFormat,
        render_mode: str | None,
    ) -> None:
        task = Task.from_dict(task) if isinstance(task, Mapping) else task  # as JSON holds it
        self.task = checks.checked_runs_task(task)
        delivery = self.task.delivery if delivery is None else delivery
        check_one_of("delivery", delivery, DELIVERIES)
        falls = self.task.evaporation_in_training
        if evaporation is not None:
            falls = checked_flag("evaporation", evaporation)
        if render_mode is not None:
            check_one_of("render_mode", render_mode, RENDER_MODES)
        self.max_steps = max_steps = checks.checked_max_steps(max_steps, self.task)
        self.shown = Shown(self.task.sees, observation_format)
        worlds = worlds_of(world, n)
        most = _MOST_CELLS // worlds[0].grid.size
        if n > most:
            raise AntsError(f"num_envs is {n}; of this world there can be at most {most} at once.")
        self.batched = BatchedEnvironments(worlds, self.task, n, max_steps, delivery, falls)
        self._seeded, self._render_mode = False, render_mode
        self._scene: Scene | None = None

    def seed(
        self, seeds: Sequence[int | None], which: np.ndarray, chance: np.random.Generator
    ) -> None:
        """Seed those ants, of bool (n,), that are given a seed; by chance if none ever was."""
        if not self._seeded and None in seeds:
            first = int(chance.integers(2**62))
            seeds = [first + i if seed is None else seed for i, seed in enumerate(seeds)]
        given = {i: one for i, one in enumerate(seeds) if which[i] and one is not None}
        if given:
            self.batched.seed(list(given.values()), np.array(list(given)))
        self._seeded = True

    def observations(self) -> np.ndarray:
        """What the ants see, (n, ...)."""
        return self.shown.show(self.batched.arrays["states"])

    def draw(self, number: int) -> Any:
        """The world of an ant: uint8 (720, 1280, 3), or text; None without a render mode."""
        if self._render_mode is None:
            return None
        arrays, sees = self.batched.arrays, self.task.sees
        now, state = self.batched.snapshot(number), int(arrays["states"][number])
        facts = (
            ("step", str(arrays["steps"][number])),
            ("reward", f"{arrays['rewards_of'][number]:g}"),
            ("state", sees.name_of(state)),
        )
        if self._render_mode == "ansi":
            return f"; {', '.join(map(' '.join, facts))}\n{_text_of(now)}"
        from taichi_ants import rendering

        if self._scene is None:
            strongest = self.task.pheromone.level
            self._scene = rendering.Scene(now.grid, view=True, strongest=strongest)
        return self._scene.draw(now, rendering.Status(facts, state, observation=sees))

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "_scene": None}  # it is drawn anew


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

    ## Description
    The ant stands on a cell and looks along one of six headings. It sees the three cells ahead:
    left, forward and right. It picks up a food in view, finds its way back and gives the food to
    the queen. With food it lays a trail, which it sees later without food. The rules are those of
    "Ants and Reinforcement Learning Algorithms", see `docs/environments.md`.

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

    ## Rewards
    As the task pays, by default 0 for a step onto an empty cell, 1 onto a cell that was seen as 2,
    3 for a pick-up, 10 for a delivery, and -1 for an action that fails.

    ## Starting State
    The world as it was given, with the ant where the world lists it; else beside the queen, at a
    place and with a heading that the seed decides.

    ## Episode End
    Terminated when the food is delivered ("terminates"); truncated then ("truncates"); or neither:
    food grows back at once and the ant goes on ("continues"). Truncated after `max_steps` steps.

    ## Info
    - `state`: int64, the state's index.
    - `action_mask`: int8 (5,), 1 for actions that can succeed; in a dead end for the moves, which
      turn the ant.
    - `event`: int64, the result of the action, a `taichi_ants.envs.Event`; NONE after `reset`.
    - `reason`: int64, why the action was blocked or failed, a `taichi_ants.envs.Reason`; NONE if
      it did not fail.

    `action_masks()` returns the mask as bool, as MaskablePPO of sb3-contrib asks for it.

    ## Arguments
    world: Name of a registered world, path of a text map, its text, or a World.
    task: The rules, a `taichi_ants.Task`, or its `as_dict()`; None is the paper's.
    delivery: "terminates", "truncates" or "continues"; None is the task's, by default "terminates".
    evaporation: Whether trails evaporate; None is as the task says of training, by default not.
    max_steps: Steps after which an episode is truncated.
    observation_format: "cells", "index" or "one_hot".
    render_mode: "rgb_array": `render` draws uint8 (720, 1280, 3). "ansi": it writes a text map of
        the world as it is, its heading for the ant.

    Raises:
        AntsError: An argument is not allowed, or the task has what only colonies have.
    """

    metadata = {"render_modes": list(RENDER_MODES), "render_fps": 10}  # noqa: RUF012

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
        self._ants = _Ants(
            *(1, world, task, delivery, evaporation, max_steps, observation_format, render_mode)
        )
        self.render_mode, self.max_steps = render_mode, self._ants.max_steps
        self.observation_space = self._ants.shown.space
        self.action_space = Discrete(N_ACTIONS)
        self._all, self._over, self._begun = np.ones(1, bool), True, False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode. With a seed, which decides all chance, episodes repeat exactly."""
        super().reset(seed=seed)
        self._ants.seed([seed], self._all, self.np_random)
        self._ants.batched.begin(self._all)
        self._over, self._begun = False, True
        return self._ants.observations()[0], self._info()

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Do an action, 0 to 4.

        Raises:
            ResetNeeded: No episode has begun, or it has ended.
            InvalidAction: There is no such action.
        """
        if self._over:
            raise ResetNeeded("no episode is under way; call reset() before step().")
        ants, arrays = self._ants, self._ants.batched.arrays
        if not self.action_space.contains(action):
            raise InvalidAction(f"the action is {shown(action)}; it must be 0, 1, 2, 3 or 4.")
        ants.batched.step(action, begins=0)
        terminated, truncated = bool(arrays["terminations"][0]), bool(arrays["truncations"][0])
        self._over = terminated or truncated
        reward = float(arrays["rewards_of"][0])
        return ants.observations()[0], reward, terminated, truncated, self._info()

    def _info(self) -> dict[str, Any]:
        arrays = self._ants.batched.arrays
        return {
            "state": np.int64(arrays["states"][0]),
            "action_mask": ACTION_MASKS[arrays["percepts"][0]].copy(),
            "event": np.int64(arrays["events"][0]),
            "reason": np.int64(arrays["reasons"][0]),
        }

    def action_masks(self) -> np.ndarray:
        """Return which actions can succeed now, bool (5,), as `info["action_mask"]` does.

        Raises:
            ResetNeeded: No episode has begun.
        """
        if not self._begun:
            raise ResetNeeded("no episode is under way; call reset() before action_masks().")
        return ACTION_MASKS[self._ants.batched.arrays["percepts"][0]].astype(bool)

    def render(self) -> Any:
        """A picture or a text map of the world as it is, see `render_mode`; None without one.

        Raises:
            ResetNeeded: No episode has begun.
        """
        if not self._begun:
            raise ResetNeeded("no episode is under way; call reset() before render().")
        return self._ants.draw(0)


class HexForageVectorEnv(StepLimit, VectorEnv[Any, Any, Any]):
    """Many ants, each alone in a world of its own: all of them do a step in one launch.

    Environment i is a `HexForageEnv` with seed `seed + i`, step by step. What it sees, is paid and
    is told is described there; arrays have a leading axis of `num_envs`.

    ## Arguments
    num_envs: How many; each takes 4 bytes for each cell of its world.
    world: As of `HexForageEnv`, or a list of worlds of the same ranges: environment i lives in
        number i modulo their number.
    autoreset_mode: What follows the end of an episode, `gymnasium.vector.AutoresetMode` or its
        name. "NextStep": the next step begins an episode, whatever the action. "SameStep": the step
        that ends one begins the next; `infos["final_obs"]` and `infos["final_info"]` tell how it
        ended. "Disabled": the caller resets with `options={"reset_mask": ended}`.
    max_episode_steps: Another step limit, as `gymnasium.make` has; the lower one counts.
    All others: as of `HexForageEnv`; `render` draws all worlds.

    ## Info
    `infos` has an array for each name, and one of the same name with an underscore that tells which
    environments it is of, as Gymnasium's own vector environments have.

    Raises:
        AntsError: An argument is not allowed, or the task has what only colonies have.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 10}  # noqa: RUF012

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
        max_steps = lower_limit(max_steps, max_episode_steps)
        self.num_envs = n = checked_whole("num_envs", num_envs)
        self.autoreset_mode = checked_autoreset(autoreset_mode)
        self._ants = _Ants(
            *(n, world, task, delivery, evaporation, max_steps, observation_format, render_mode)
        )
        self.render_mode, self.max_steps = render_mode, self._ants.max_steps
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self.single_observation_space = self._ants.shown.space
        self.observation_space = batch_space(self.single_observation_space, n)
        self.single_action_space = Discrete(N_ACTIONS)
        self.action_space = MultiDiscrete(np.full(n, N_ACTIONS))
        self._over: np.ndarray | None = None  # whose episode is over, bool (n,); None: none began
        self._all = np.ones(n, bool)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode in all environments, or in some.

        Args:
            seed: Of the first environment, the others have the next ones; or one for each, None to
                go on with its stream. Seeds decide all chance: episodes repeat exactly.
            options: "reset_mask", bool (num_envs,): where to begin; the other episodes go on.

        Raises:
            TypeError, ValueError: Seeds or mask have not this form.
            ResetNeeded: There is a mask, but there are no other episodes to go on with.
        """
        which = checked_reset_mask(options, self.num_envs)
        if self._over is None and not which.all():
            raise ResetNeeded("no episode is under way; call reset() without a reset_mask first.")
        super().reset(seed=int(seed) if isinstance(seed, (int, np.integer)) else None)
        self._ants.seed(seeds_of(seed, self.num_envs), which, self.np_random)
        self._ants.batched.begin(which)
        self._over = np.zeros(self.num_envs, bool) if self._over is None else self._over & ~which
        arrays = self._ants.batched.arrays
        infos = _infos(arrays, arrays["states"], arrays["percepts"], which, ~self._all)
        return self._ants.observations(), infos

    def step(
        self, actions: Any
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Do an action in each environment, int (num_envs,), 0 to 4.

        Raises:
            ResetNeeded: No episode has begun; or one has ended, and autoreset_mode is "Disabled".
            InvalidAction: There are not as many actions, or one of them is none.
        """
        ants, arrays, mode = self._ants, self._ants.batched.arrays, self.autoreset_mode
        if self._over is None:
            raise ResetNeeded("no episode is under way; call reset() before step().")
        if mode == AutoresetMode.DISABLED and self._over.any():
            raise ResetNeeded(
                f"the episode of environment {self._over.argmax()} has ended; call reset() with "
                'options={"reset_mask": ...} before step().'
            )
        ants.batched.step(
            checked_actions(actions, self.num_envs),
            begins=self._over if mode == AutoresetMode.NEXT_STEP else 0,
            same_step=mode == AutoresetMode.SAME_STEP,
        )
        # Copies: the next step writes into the arrays of this one.
        terminations = arrays["terminations"].astype(bool)
        truncations = arrays["truncations"].astype(bool)
        ended, goes_on = terminations | truncations, self._all
        if mode == AutoresetMode.SAME_STEP:
            goes_on = ~ended
        else:
            self._over = ended
        infos = _infos(arrays, arrays["states"], arrays["percepts"], self._all, goes_on)
        if mode == AutoresetMode.SAME_STEP and ended.any():
            states, percepts = arrays["final_states"], arrays["final_percepts"]
            final = np.full(self.num_envs, None, dtype=object)
            final[ended] = np.fromiter(ants.shown.show(states[ended]), dtype=object)
            infos |= {"final_obs": final, "_final_obs": ended}
            infos["final_info"] = _infos(arrays, states, percepts, ended, ended)
            infos["_final_info"] = ended.copy()
        rewards = arrays["rewards_of"].copy()
        return ants.observations(), rewards, terminations, truncations, infos

    def render(self) -> tuple[Any, ...] | None:
        """A picture or a text map of each world as it is, see `render_mode`; None without one.

        Raises:
            ResetNeeded: No episode has begun.
        """
        if self.render_mode is None:
            return None
        if self._over is None:
            raise ResetNeeded("no episode is under way; call reset() before render().")
        return tuple(self._ants.draw(number) for number in range(self.num_envs))


def _infos(
    arrays: Mapping[str, np.ndarray],
    states: np.ndarray,
    percepts: np.ndarray,
    which: np.ndarray,
    done: np.ndarray,
) -> dict[str, Any]:
    """The infos of some environments, `which` bool (n,); zeros for the others.

    The results of actions are told where `done`, bool (n,), is True.
    """
    packed = _PACKED_MASKS.take(percepts, mode="clip")
    masks = packed.view(np.int8).reshape(-1, 8)[:, :N_ACTIONS]
    if not which.all():
        states, masks = np.where(which, states, 0), masks * which[:, None]
    events, reasons = arrays["events"].astype(np.int64), arrays["reasons"].astype(np.int64)
    if not done.all():
        events[~done], reasons[~done] = Event.NONE, Reason.NONE
    infos = {
        "state": states.astype(np.int64),
        "action_mask": masks,
        "event": events,
        "reason": reasons,
    }
    return infos | {f"_{name}": which.copy() for name in infos}
