"""A colony for libraries that train one agent: every ant is an environment of its own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from taichi_ants.envs.arguments import (
    StepLimit,
    checked_actions,
    checked_autoreset,
    checked_reset_mask,
    lower_limit,
    seeds_of,
)
from taichi_ants.envs.colony import MAX_STEPS, METADATA, ColonyWorlds
from taichi_ants.envs.formats import ObservationFormat
from taichi_ants.errors import AntsError, checked_whole
from taichi_ants.task import Task
from taichi_ants.task.constants import N_ACTIONS
from taichi_ants.task.events import Event
from taichi_ants.worlds import World


class HexColonyVectorEnv(StepLimit, VectorEnv):
    """Ants of one or more worlds, each of them an environment of a `gymnasium.vector.VectorEnv`.

    Environment number w * ants + i is ant number i of world number w. The ants of a world share its
    cells, its food and its trails, and act at the same time. Any library that trains one agent on a
    vector environment so trains one policy that all ants follow ("parameter sharing"). Actions,
    observations and rewards are those of `HexForageEnv`; each ant gets what its own action pays.

    ## Episode End
    After `max_steps` steps all ants of a world are truncated at once. A delivery ends nothing in
    the world; its ant goes on from where it stands. If the task's delivery is "terminates", the
    default, the delivering ant is nevertheless `terminated`: what comes later is no longer credited
    to the delivery, as for all colonies here. The ant's next observation, from where it stands,
    begins its next episode. A single ant can begin anew only in the step in which it ends, so that
    a delivery that terminates needs the autoreset mode `SAME_STEP`; with delivery "truncates" no
    ant is ever terminated, and all modes are possible. All three modes reset whole worlds:
    `SAME_STEP` in the step of the truncation, with `final_obs` and `final_info`; `NEXT_STEP` in
    the next one, which ignores the actions of these ants and pays 0; `DISABLED` when `reset` is
    called, with `options={"reset_mask": ...}` for some worlds.

    ## Info
    Arrays with an entry for each ant, and for each key `_key`, bool, which ants have one:

    - `state`, `action_mask`, `event`: As of `HexForageEnv`; the mask is 1 for what can succeed if
      no other ant is faster.
    - `final_obs`, `final_info`: with `SAME_STEP`, the last observation and info of the ants whose
      episode has ended in this step; `event` is in `final_info` then, and NONE outside of it.

    ## Arguments
    num_envs: How many ants there are in all worlds together, a multiple of `ants`.
    world: A registered name, the path of a map, a `World`, or a list of these, of the same
        ranges: world number w is number w modulo their number.
    task: The rules; None: the paper's. Ants are neither born nor do they die here.
    ants: How many live in each world.
    start, max_steps, observation_format, evaporation: As of `HexColonyParallelEnv`.
    autoreset_mode: `SAME_STEP`, `NEXT_STEP` or `DISABLED` of `gymnasium.vector.AutoresetMode`.
    render_mode: "rgb_array": `render` gives a picture of each world. None: it is not called.
    max_episode_steps: Another step limit, which `gymnasium.make_vec` gives; the lower one counts.

    Raises:
        AntsError: An argument is not allowed.
    """

    def __init__(
        self,
        num_envs: int = 64,
        world: str | World | Sequence[str | World] = "paper",
        task: Task | None = None,
        ants: int = 64,
        start: str = "nest",
        max_steps: int = MAX_STEPS,
        observation_format: ObservationFormat = "cells",
        evaporation: bool | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.SAME_STEP,
        render_mode: str | None = None,
        max_episode_steps: int | None = None,
    ) -> None:
        max_steps = lower_limit(max_steps, max_episode_steps)
        self.num_envs, ants = checked_whole("num_envs", num_envs), checked_whole("ants", ants)
        if self.num_envs % ants:
            raise AntsError(
                f"num_envs is {num_envs}; it counts ants, so make it a multiple of ants, {ants}."
            )
        self._n_worlds = self.num_envs // ants
        self.autoreset_mode = checked_autoreset(autoreset_mode)
        self._worlds = ColonyWorlds(
            *(world, self._n_worlds, task, ants, start, None, max_steps),
            *(observation_format, evaporation, render_mode),
        )
        self.max_steps = self._worlds.max_steps
        rules = self._worlds.colony.task
        if rules.life.births or rules.life.lifespan is not None:
            raise AntsError(
                f"life of the task is {rules.life}; a vector environment has a fixed number of "
                "ants, so leave out births and lifespan, or take the parallel_env of colony_v0."
            )
        self._terminates = rules.delivery == "terminates"
        if self._terminates and self.autoreset_mode is not AutoresetMode.SAME_STEP:
            raise AntsError(
                f"autoreset_mode is {self.autoreset_mode.value!r}, but an ant that delivers goes "
                'on at once; take "SameStep", or a task with delivery "truncates".'
            )
        self.metadata = {**METADATA, "autoreset_mode": self.autoreset_mode}
        self.render_mode = render_mode
        self.single_observation_space = self._worlds.shown.space
        self.single_action_space = spaces.Discrete(N_ACTIONS)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._begun, self._everyone = False, np.ones(self.num_envs, bool)
        self._ended = np.zeros(self._n_worlds, bool)  # worlds that wait for their reset

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode in all worlds, or in some.

        Args:
            seed: Of world number w, `seed + w`; or one for each world, None where it goes on. The
                same seed gives the same episodes from then on. None: the random numbers of each
                world go on; in the first reset seeds are drawn.
            options: "reset_mask", bool (num_envs,): which environments to reset; a world is reset
                as a whole.

        Returns:
            Observations and infos.
        """
        which = self._reset_worlds(options)
        super().reset(seed=int(seed) if isinstance(seed, (int, np.integer)) else None)
        seeds = seeds_of(seed, self._n_worlds)
        if not self._begun:
            drawn = self.np_random.integers(2**63, size=self._n_worlds).tolist()
            seeds = [a if b is None else b for a, b in zip(drawn, seeds, strict=True)]
        self._worlds.begin(which, seeds)
        self._begun, self._ended = True, self._ended & ~which
        nothing = np.full(self.num_envs, Event.NONE, np.int64)
        return self._observations(), self._infos(self._by_ant(which), nothing)

    def _reset_worlds(self, options: dict[str, Any] | None) -> np.ndarray:
        """Which worlds the options of a reset name, bool (W,)."""
        by_world = checked_reset_mask(options, self.num_envs).reshape(self._n_worlds, -1)
        which = np.asarray(by_world.any(axis=1))
        if (which != by_world.all(axis=1)).any():
            raise ValueError("reset_mask names some ants of a world alone; name all or none of it.")
        if not self._begun and not which.all():
            raise ResetNeeded("no world has begun yet; call reset() without a reset_mask first.")
        return which

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Let all ants act at once.

        Args:
            actions: Integers (num_envs,), 0 to 4.

        Returns:
            Observations; rewards, float64; terminated and truncated, bool (num_envs,); infos.

        Raises:
            ResetNeeded: No episode has begun; or one has ended, and the mode is `DISABLED`.
            InvalidAction: There are not as many actions, or one of them is none.
        """
        if not self._begun:
            raise ResetNeeded("no episode is under way; call reset() before step().")
        actions, waited = checked_actions(actions, self.num_envs), self._ended
        if self.autoreset_mode is AutoresetMode.DISABLED and waited.any():
            raise ResetNeeded(
                f"the episode of world {waited.argmax()} has ended; call reset() with "
                'options={"reset_mask": ...} before step().'
            )
        worlds = self._worlds
        worlds.step(actions.reshape(self._n_worlds, -1))
        acted = worlds.acted.reshape(-1)
        rewards, events = worlds.rewards.reshape(-1), worlds.events.reshape(-1)
        terminated = acted & (events == Event.DELIVERED) & self._terminates
        ended = worlds.ended & ~waited
        truncated = self._by_ant(ended)
        over, final = terminated | truncated, {}
        observations = self._observations()
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            begins = ended
            if over.any():
                last = np.full(self.num_envs, None, dtype=object)
                last[over] = np.fromiter(observations[over], dtype=object)
                final = {"final_obs": last, "_final_obs": over}
                final |= {"final_info": self._infos(over, events), "_final_info": over.copy()}
                events = np.where(over, Event.NONE, events)
        else:
            worlds.colony.stop(ended)
            begins, self._ended = waited, ended
        if begins.any():
            worlds.begin(begins)
            observations = self._observations()
        infos = self._infos(self._everyone, events)
        return observations, rewards, terminated, truncated, {**infos, **final}

    def render(self) -> tuple[np.ndarray, ...] | None:
        """A picture of each world, uint8 (height, width, 3); None without a render mode."""
        if self.render_mode is None:
            return None
        if not self._begun:
            raise ResetNeeded("no episode is under way; call reset() before render().")
        return self._worlds.render()

    def _by_ant(self, of_worlds: np.ndarray) -> np.ndarray:
        """What holds for worlds, for each of their ants."""
        return np.repeat(of_worlds, self.num_envs // self._n_worlds)

    def _observations(self) -> np.ndarray:
        return self._worlds.shown.show(self._worlds.colony.states.reshape(-1))

    def _infos(self, have: np.ndarray, events: np.ndarray) -> dict[str, Any]:
        """Return the infos of the ants that `have` them, bool (num_envs,); 0 for the others."""
        worlds = self._worlds
        masks = worlds.action_masks().reshape(self.num_envs, N_ACTIONS)
        infos = {
            "state": worlds.colony.states.reshape(-1).astype(np.int64) * have,
            "action_mask": masks * have[:, None],
            "event": events * have,
        }
        return infos | {f"_{name}": have.copy() for name in infos}
