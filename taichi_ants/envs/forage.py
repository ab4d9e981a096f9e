"""A lone ant as a Gymnasium environment, and many such ants as a vector environment."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import Any, Literal, get_args

import gymnasium
import numpy as np
from gymnasium.error import InvalidAction, ResetNeeded
from gymnasium.spaces import Discrete
from gymnasium.vector import AutoresetMode, VectorEnv

from taichi_ants.arguments import checked_share
from taichi_ants.engines.layout import TERMINATED, TRUNCATED, Command
from taichi_ants.engines.runs.batched import BatchedEnvironments
from taichi_ants.envs import vector
from taichi_ants.envs.formats import ObservationFormat
from taichi_ants.envs.vector import Ants, AntVectorEnv, Arguments, Place, RenderMode, Rules, Worlds
from taichi_ants.errors import check_one_of, checked_whole, enough_memory, shown, whole
from taichi_ants.features.support import CHOICE, LONE
from taichi_ants.grid.constants import STREAM_ROLLOUT
from taichi_ants.grid.randomness import stream_state
from taichi_ants.learners.policies import checked_table, frozen_policy
from taichi_ants.task import Task
from taichi_ants.task.constants import EPISODE_STEPS, N_ACTIONS

__all__ = ["HexForageEnv", "HexForageVectorEnv", "Rollout"]

_WHOLE = (int, np.int64)  # the types of most actions
SUPPORTS = LONE - CHOICE - {"choice.rule=softmax"}  # actions are given
Delivery = Literal["terminates", "truncates", "continues"]
DELIVERIES: tuple[str, ...] = get_args(Delivery)
# The cells of all environments together take up to 4 GiB, with a margin.
_MOST_CELLS = (1 << 30) - (1 << 24)
_NUMBERS_OF_ANT = 24  # at least those in `BatchedEnvironments` beside the cells
_MOST_OUTCOMES = 1 << 12  # a few megabytes
# The command to an ant after the last step of an episode.
_AFTER_END = {
    AutoresetMode.SAME_STEP: Command.STEP,
    AutoresetMode.NEXT_STEP: Command.BEGIN,
    AutoresetMode.DISABLED: Command.WAIT,
}
# Each row as a number of 8 bytes, because `take` of numbers is three times as fast.
_PACKED_MASKS = np.pad(vector.ACTION_MASKS, ((0, 0), (0, 8 - N_ACTIONS))).view(np.int64)[:, 0]


class LoneAnts(Ants):
    """Many ants, each alone in its world; a single launch steps all of them."""

    def __init__(self, n: int, delivery: str | None, arguments: Arguments) -> None:
        what, instead = "an environment of one ant", "leave it out, or use a Colony"
        super().__init__(n, arguments, what, SUPPORTS, instead)
        task = self.task
        delivery = task.delivery if delivery is None else delivery
        check_one_of("delivery", delivery, DELIVERIES)
        size = self.worlds[0].grid.size
        # Kernels read four numbers of each cell of all different worlds.
        most = (_MOST_CELLS - 4 * size * len(self.worlds)) // (size + _NUMBERS_OF_ANT)
        checked_whole("num_envs", n, 1, most, " for a world of this size")
        self.batched = BatchedEnvironments(
            self.worlds, task, n, self.max_steps, delivery, task.evaporation_in_training
        )
        self.outcomes: dict[bytes, tuple[Any, ...]] = {}

    def begin(self, which: np.ndarray, seeds: Sequence[int | None]) -> None:
        seed_of = {i: seed for i, seed in enumerate(seeds) if which[i] and seed is not None}
        if seed_of:
            self.batched.seed(list(seed_of.values()), np.array(list(seed_of)))
        self.batched.step(0, np.where(which, Command.BEGIN, Command.WAIT))

    def advance(self, actions: np.ndarray, waiting: np.ndarray) -> vector.Step:
        begins = waiting if self.mode is AutoresetMode.NEXT_STEP else 0
        self.batched.step(actions, begins, _AFTER_END[self.mode])
        return self._results()

    def _results(self) -> vector.Step:
        arrays = self.batched.arrays
        results, rewards = arrays["results"], arrays["rewards_of"].astype(np.float64)
        return rewards, results & TERMINATED != 0, results & TRUNCATED != 0

    def outcome(self, results: bytes) -> tuple[Any, ...]:
        """Return what `step` has to copy and return, after a step with these `results`."""
        if len(self.outcomes) >= _MOST_OUTCOMES:
            self.outcomes.clear()
        info = {name: numbers[0] for name, numbers in self.facts().items()}
        reward, *over = (numbers.item() for numbers in self._results())
        seen, mask = self.shown.table[info["state"]], info["action_mask"]
        return self.outcomes.setdefault(results, (seen, reward, *over, mask, info))

    def __getstate__(self) -> dict[str, Any]:
        return {**super().__getstate__(), "outcomes": {}}

    def over(self) -> np.ndarray:
        return self.batched.arrays["results"] >= TRUNCATED

    def facts(self, last: bool = False) -> dict[str, np.ndarray]:
        arrays, when = self.batched.arrays, "final_" if last else ""
        packed = _PACKED_MASKS.take(arrays[f"{when}paper_states"], mode="clip")
        return {
            "state": arrays[f"{when}states"].astype(np.int64),
            "action_mask": packed.view(np.int8).reshape(-1, 8)[:, :N_ACTIONS],
            "event": (arrays["results"] & (TRUNCATED - 1)).astype(np.int64),
            "reason": arrays["reasons"].astype(np.int64),
            "deliveries": arrays[f"{when}deliveries"].astype(np.int64),
        }

    def draw(self, world: int) -> Any:
        """Return a picture of an ant's world, uint8 (720, 1280, 3)."""
        arrays, sees = self.batched.arrays, self.task.sees
        now, state = self.batched.snapshot(world), int(arrays["states"][world])
        facts = (
            ("step", str(arrays["steps"][world])),
            ("reward", f"{arrays['rewards_of'][world]:g}"),
            ("state", sees.name_of(state)),
        )
        from taichi_ants import rendering

        if self._scene is None:
            self._scene = rendering.Scene(now.grid, view=True, task=self.task)
        return self._scene.draw(now, rendering.Status(facts, state, observation=sees))


class HexForageEnv(gymnasium.Env[Any, Any]):
    """An ant on a hexagonal grid that searches for food and carries it to its queen.

    The rules are those of "Ants and Reinforcement Learning Algorithms"; see
    `docs/reference/environments.md`, also for what codes in observations mean.

    **Spaces.** Observations have k parts of sizes p1, ..., pk, which depend on the task. In the
    paper's, these are (2, 4, 4, 4): the load, then a code for each cell left, forward and right.

    - "cells": `MultiDiscrete([p1, ..., pk])`, int64 (k,).
    - "index": `Discrete(p1 * ... * pk)`, the state index.
    - "one_hot": `Box(0, 1, (p1 + ... + pk,), float32)`, each part one-hot.

    Actions are `Discrete(5)`: 0, 1 and 2 turn the ant to the cell left, forward or right and enter
    it, 3 picks up food in view, and 4 gives it to the queen in view. A blocked move still turns.

    **Info.**

    - `state`: int64, the state index.
    - `action_mask`: int8 (5,), 1 for actions that can succeed; in a dead end, for the moves.
    - `event`: int64, the result of the action, a `taichi_ants.envs.Event`; NONE after `reset`.
    - `reason`: int64, the reason why the action failed, a `taichi_ants.envs.Reason`, or NONE.
    - `deliveries`: int64, the deliveries of this episode. Report them beside the return, because
      under the paper's rewards walking a trail can pay more than delivering.

    Args:
        world: The name of a registered world, the path or the text of a map, or a World.
        task: The rules, a `taichi_ants.Task` or its name; by default, the paper's. Trails evaporate
            if its `evaporation_in_training` is True. AntsError if a rule is only for colonies.
        delivery: "terminates", "truncates" or "continues" the episode; by default, the task's.
        max_steps: The number of steps after which an episode is truncated.
        observation_format: "cells", "index" or "one_hot".
        render_mode: "rgb_array" for pictures, uint8 (720, 1280, 3), or None.

    >>> env = gymnasium.make("taichi_ants/HexForage-v0", render_mode="rgb_array")
    >>> seen, info = env.reset(seed=0)
    >>> seen, reward, terminated, truncated, info = env.step(1)  # forward
    >>> envs.Event(info["event"]).name, envs.Reason(info["reason"]).name
    ('ENTERED_CUE', 'NONE')
    >>> env.unwrapped.action_masks().tolist(), env.render().shape
    ([True, True, True, False, False], (720, 1280, 3))
    """

    metadata = vector.METADATA
    _ants: LoneAnts

    def __init__(
        self,
        world: Place = "paper",
        task: Rules | None = None,
        delivery: Delivery | None = None,
        max_steps: int = EPISODE_STEPS,
        observation_format: ObservationFormat = "cells",
        render_mode: RenderMode | None = None,
    ) -> None:
        arguments = Arguments(world, task, max_steps, observation_format, render_mode)
        self._ants = LoneAnts(1, delivery, arguments)
        self.render_mode = render_mode
        self.observation_space, self.action_space = self._ants.shown.space, Discrete(N_ACTIONS)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Return the first observation and info of a new episode.

        The seed determines all random numbers, so episodes with a seed repeat exactly. There are no
        options.
        """
        super().reset(seed=seed)
        if seed is None and not self._ants.begun:
            seed = int(self.np_random.integers(2**63))
        self._ants.begin(np.ones(1, bool), [seed])
        self._ants.begun = True
        results = self._ants.batched.alone.tobytes()
        seen, *_, mask, info = self._ants.outcomes.get(results) or self._ants.outcome(results)
        return seen.copy(), {**info, "action_mask": mask.copy()}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Take an action, 0 to 4.

        Returns:
            Observation, reward, terminated, truncated, info.

        Raises:
            ResetNeeded: No episode has begun, or it has ended.
            InvalidAction: The action does not exist.
        """
        ants = self._ants
        batched = ants.batched
        if batched.alone[2] >= TRUNCATED:  # the result; also before the first episode
            ants.check_begun("step()")
            raise ResetNeeded("the episode has ended; call reset() before step().")
        quick = type(action) in _WHOLE  # `contains` takes a microsecond, and no large numbers
        if not (0 <= action < N_ACTIONS if quick else self.action_space.contains(action)):
            raise InvalidAction(f"the action is {shown(action)}; it must be 0, 1, 2, 3 or 4.")
        results = batched.step_alone(action)
        outcome = ants.outcomes.get(results) or ants.outcome(results)
        seen, reward, terminated, truncated, mask, info = outcome
        info = info.copy()
        info["action_mask"] = mask.copy()
        return seen.copy(), reward, terminated, truncated, info

    def action_masks(self) -> np.ndarray:
        """Return `info["action_mask"]` as bool (5,), for MaskablePPO of sb3-contrib."""
        self._ants.check_begun("action_masks()")
        return vector.ACTION_MASKS[self._ants.batched.arrays["paper_states"][0]].astype(bool)

    def render(self) -> Any:
        """Return a picture, uint8 (720, 1280, 3), or None without a render mode."""
        self._ants.check_begun("render()")
        return None if self.render_mode is None else self._ants.draw(0)


class Rollout:
    """The results of several steps of n environments; row t of each array is step t.

    On a GPU, an array stays there until you read it. Iteration yields all arrays, in this order.
    """

    _NAMES = "observations", "actions", "rewards", "terminated", "truncated", "events"

    def __init__(
        self,
        seen: np.ndarray,
        rows: Callable[[str], np.ndarray],
        shows: Callable[[np.ndarray], np.ndarray] | None,
    ) -> None:
        """Take the observations, a function that fills rows, and one that shows final states.

        The latter is None if the observation after each step is the last one of its episode.
        """
        self._seen, self._rows, self._shows = seen, rows, shows

    def __iter__(self) -> Iterator[np.ndarray]:
        return (getattr(self, name) for name in (*self._NAMES, "final_observations"))

    def __getstate__(self) -> dict[str, np.ndarray]:
        """Return all arrays, for copies and pickles."""
        return dict(zip((*self._NAMES, "final_observations"), self, strict=True))

    @cached_property
    def observations(self) -> np.ndarray:
        """The observations before each step and after the last one, (steps + 1, n, ...).

        Their dtype is that of the observation space. `observations[1:]` are those of `step`.
        """
        self._rows("seen")
        return self._seen

    @cached_property
    def actions(self) -> np.ndarray:
        """The actions taken, int64 (steps, n)."""
        return self._rows("taken")

    @cached_property
    def rewards(self) -> np.ndarray:
        """The rewards, float64 (steps, n)."""
        return self._rows("rewards_of")

    @cached_property
    def terminated(self) -> np.ndarray:
        """Whether a step terminated the episode, bool (steps, n)."""
        return self._rows("result_rows") & TERMINATED != 0

    @cached_property
    def truncated(self) -> np.ndarray:
        """Whether a step truncated the episode, bool (steps, n)."""
        return self._rows("result_rows") & TRUNCATED != 0

    @cached_property
    def events(self) -> np.ndarray:
        """The results of the actions, codes of `Event` as uint8 (steps, n).

        `NONE` in steps that only begin an episode, or of environments that wait for a reset.
        """
        return self._rows("result_rows") & (TRUNCATED - 1)

    @cached_property
    def final_observations(self) -> np.ndarray:
        """The last observation of each episode that ended, (episodes, ...).

        They are in the order of `np.argwhere(terminated | truncated)`.
        """
        over = self.terminated | self.truncated
        if self._shows is None:
            return self.observations[1:][over]
        return self._shows(self._rows("final_states")[over])


class HexForageVectorEnv(AntVectorEnv, VectorEnv):  # skrl looks only at direct bases
    """Many ants, each alone in its world; a single launch steps all of them.

    Environment i equals a `HexForageEnv` with seed `seed + i` in each step. Arrays have a leading
    axis of `num_envs`, and infos have the format of Gymnasium's vector environments.

    Args:
        num_envs: The number of environments; each takes 4 bytes for each cell of its world.
        world: See `HexForageEnv`; or a list of n worlds with the same ranges, of which environment
            i has entry i modulo n.
        autoreset_mode: A `gymnasium.vector.AutoresetMode` or its name; by default, "NextStep".
        task, delivery, max_steps, observation_format, render_mode: See `HexForageEnv`; `render`
            draws all worlds.

    >>> ants = gymnasium.make_vec("taichi_ants/HexForage-v0", num_envs=4)
    >>> seen, infos = ants.reset(seed=0)
    >>> seen, rewards, terminated, truncated, infos = ants.step(np.array([0, 1, 2, 3]))
    >>> ants.rollout("trail_follower", steps=50).rewards.shape
    (50, 4)
    """

    _ants: LoneAnts

    def __init__(
        self,
        num_envs: int = 1,
        world: Worlds = "paper",
        task: Rules | None = None,
        delivery: Delivery | None = None,
        max_steps: int = EPISODE_STEPS,
        observation_format: ObservationFormat = "cells",
        render_mode: RenderMode | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
    ) -> None:
        n = checked_whole("num_envs", num_envs)
        arguments = Arguments(world, task, max_steps, observation_format, render_mode)
        ants = LoneAnts(n, delivery, arguments)
        super().__init__(ants, n, autoreset_mode)

    @enough_memory("so many steps or environments")
    def rollout(
        self,
        policy: Any,
        steps: int | None = None,
        *,
        epsilon: float = 0.0,
        seed: int | None = None,
    ) -> Rollout:
        """Return the results of several steps, with given actions or by a policy.

        The results are equal to those of `step` with the same actions, in all autoreset modes, and
        you can mix both. In mode "Disabled", an environment whose episode has ended waits in the
        remaining steps, with reward 0 and the same observation.

        Args:
            policy: The actions, integers 0 to 4 (steps, num_envs). Or a policy that all ants
                follow: action values, float (n_states, 5), an object with such `q_values`, the name
                of a policy ("trail_follower", "random"), or the path of a policy file.
            steps: The number of steps, if a policy is given.
            epsilon: The probability with which an ant that follows a policy acts at random.
            seed: The seed of the policy's random numbers, which also break ties. None draws one
                from `np_random`, which `reset(seed=...)` seeds.

        Raises:
            ResetNeeded: No episode has begun, or autoreset_mode is "Disabled" and one has ended.
            InvalidAction: The actions have another shape or type, or an action does not exist.
            AntsError: The policy or another argument is not allowed.
        """
        waiting, ants, n = self._waiting("rollout"), self._ants, self.num_envs
        length, actions, q_values = _checked_plan(policy, steps, n, ants.task)
        epsilon, choices = checked_share("epsilon", epsilon), None
        shape, table = (length, n), ants.shown.table
        if q_values is not None:
            drawn = int(self.np_random.integers(2**63)) if seed is None else whole("seed", seed)
            best = q_values >= q_values.max(axis=1, keepdims=True)
            streams = stream_state(drawn, STREAM_ROLLOUT, np.arange(n))
            choices = best @ (1 << np.arange(N_ACTIONS)), streams, epsilon
        same_step = ants.mode is AutoresetMode.SAME_STEP
        seen = np.empty((length + 1, n, *table.shape[1:]), table.dtype)
        seen[0] = ants.shown.show(ants.batched.arrays["states"])
        rows = {
            "taken": np.empty(shape, np.int64) if actions is None else actions,
            "seen": seen[1:],
            "rewards_of": np.empty(shape),
            "result_rows": np.empty(shape, np.uint8),
            # Kernels write no other rows.
            "final_states": np.empty((length, n if same_step else 1), np.int32),
        }
        fetch = ants.batched.rollout(rows, table, waiting, _AFTER_END[ants.mode], choices)
        return Rollout(seen, fetch, ants.shown.show if same_step else None)


def _checked_plan(
    policy: Any, steps: int | None, n: int, task: Task
) -> tuple[int, np.ndarray | None, np.ndarray | None]:
    """Return the number of steps, and either actions, int64 (steps, n), or action values.

    Raises:
        AntsError, InvalidAction: The policy or the number of steps is not allowed.
    """
    if isinstance(policy, (str, os.PathLike)):
        table = frozen_policy(policy, task.observation)
    else:
        try:
            plan = np.asarray(getattr(policy, "q_values", policy))
        except ValueError:  # lists of several lengths
            plan = np.empty(0)
        if plan.dtype.kind in "iu":
            length = steps or max(1, np.atleast_1d(plan).shape[0])
            actions = vector.checked_actions(plan, (length, n))
            return length, np.ascontiguousarray(actions, np.int64), None
        table = checked_table(policy, task)
    return checked_whole("steps", steps), None, table
