"""A colony as a PettingZoo environment, whose agents act in parallel, are born and die."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding
from pettingzoo import ParallelEnv
from pettingzoo.utils.env_logger import EnvLogger

from taichi_ants.envs.colony import MAX_STEPS, ColonyWorlds
from taichi_ants.envs.formats import ObservationFormat
from taichi_ants.envs.vector import METADATA, Arguments, Place, RenderMode, Rules
from taichi_ants.errors import shown
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.task import Life
from taichi_ants.task.constants import N_ACTIONS

__all__ = ["HexColonyParallelEnv", "parallel_env"]
Infos = dict[str, dict[str, Any]]  # by agent and name


class HexColonyParallelEnv(ParallelEnv):
    """The ants of one world, as agents of a `pettingzoo.ParallelEnv`.

    Agent `"ant_7"` is ant number 7. The ants that start an episode have the numbers 0, 1, ... Each
    ant that is born gets the next number, is in `agents` from its birth, and acts from the next
    step. All agents act at once. Spaces, rewards of an ant's own action, and infos except `reason`
    are those of `HexForageEnv`. `action_mask` is 1 for actions that succeed unless another ant
    comes first, and `event` is also NONE in the step of an ant's birth.

    An ant that dies of age is terminated and leaves `agents`; its number is not used again. After
    `max_steps` steps, all ants are truncated. A delivery does not end the episode, for any
    `delivery` of the task: the ant continues, and `info["event"]` is DELIVERED.

    Args:
        ants: The number of ants at the start.
        start: "nest" for cells near the queen, or "spread" for any cells.
        capacity: The largest number of living ants; by default, `ants`, or 2 * `ants` + 64 if the
            task has births.
        max_steps: The number of steps of an episode.
        world, task, observation_format, render_mode: See `HexForageEnv`.

    Attributes:
        possible_agents: All agents that can live in an episode: the ants at the start and those
            that can be born, see `most_births`.
        agents: The living agents, after the first reset.

    >>> from taichi_ants.envs import colony_v0
    >>> env = colony_v0.parallel_env(ants=4, render_mode="rgb_array")
    >>> seen, infos = env.reset(seed=0)
    >>> actions = {agent: env.action_space(agent).sample() for agent in env.agents}
    >>> seen, rewards, terminated, truncated, infos = env.step(actions)
    >>> env.observation_space("ant_0").contains(seen["ant_0"]), env.render().shape
    (True, (720, 1280, 3))
    """

    metadata: ClassVar[dict] = {**METADATA, "name": "colony_v0", "is_parallelizable": True}

    def __init__(
        self,
        world: Place = "paper",
        task: Rules | None = None,
        ants: int = 64,
        start: str = "nest",
        capacity: int | None = None,
        max_steps: int = MAX_STEPS,
        observation_format: ObservationFormat = "cells",
        render_mode: RenderMode | None = None,
    ) -> None:
        arguments = Arguments(world, task, max_steps, observation_format, render_mode)
        self._worlds = ColonyWorlds(1, arguments, ants, start, capacity)
        self.render_mode = render_mode
        colony = self._worlds.colony
        foods, life = len(colony.worlds[0].foods), colony.task.life
        n = colony.ants + most_births(life, foods, self._worlds.max_steps)
        self.possible_agents = [f"ant_{number}" for number in range(n)]
        self.observation_spaces = dict.fromkeys(self.possible_agents, self._worlds.shown.space)
        self.action_spaces: dict[str, spaces.Space] = {
            name: spaces.Discrete(N_ACTIONS) for name in self.possible_agents
        }

    def observation_space(self, agent: str) -> spaces.Space:
        """Return the observation space, the same object for each agent."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space:
        """Return the action space, a different object for each agent, so that you can seed it."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], Infos]:
        """Begin an episode.

        Args:
            seed: The seed of this and all further episodes, which then repeat exactly. None
                continues the random numbers, or draws a seed in the first reset.
            options: There are none; any are ignored.

        Returns:
            Observations and infos by agent.
        """
        if seed is not None:
            seeding.np_random(seed)  # raises Gymnasium's error for invalid seeds
        elif not self._worlds.begun:
            seed = int(np.random.default_rng().integers(2**63))
        self._worlds.begin(np.ones(1, bool), [seed])
        self._worlds.begun = True
        self._slots = list(range(self._worlds.colony.ants))  # the slots of `agents`
        self.agents = self._names(self._slots)
        return self._told(self.agents, self._slots)

    def step(
        self, actions: dict[str, int]
    ) -> tuple[dict[str, Any], dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Take the actions of all agents.

        Args:
            actions: An action, 0 to 4, for each of `agents`.

        Returns:
            Observations, rewards, terminations, truncations and infos, of agents that acted and of
            agents that were born.

        Raises:
            AssertionError: No episode has begun, or an action is missing or does not exist.
        """
        if not self._worlds.begun:
            EnvLogger.error_step_before_reset()
        if not self.agents:
            EnvLogger.warn_step_after_terminated_truncated()
            return {}, {}, {}, {}, {}
        worlds, acting, slots = self._worlds, self.agents, self._slots
        agents = set(acting)
        for name in dict.fromkeys([*acting, *actions]):
            action = actions.get(name)
            if name not in agents or not self.action_spaces[name].contains(action):
                raise AssertionError(
                    f"the action of {name} is {shown(action)}; give each of `agents`, and no "
                    f"other, a whole number from 0 to {N_ACTIONS - 1}."
                )
        chosen = np.zeros((1, worlds.colony.capacity), np.int64)
        chosen[0, slots] = [actions[name] for name in acting]
        worlds.step(chosen)
        living, ended = worlds.colony.living[0], bool(worlds.over()[0])
        born = np.setdiff1d(np.flatnonzero(living & (not ended)), slots).tolist()
        names, seen = acting + self._names(born), slots + born
        observations, infos = self._told(names, seen)
        rewards = dict(zip(names, worlds.rewards[0, seen].tolist(), strict=True))
        terminated = dict(zip(names, (~living[seen]).tolist(), strict=True))
        truncated = dict.fromkeys(names, ended)
        stay = [] if ended else [k for k, slot in enumerate(seen) if living[slot]]
        self.agents, self._slots = [names[k] for k in stay], [seen[k] for k in stay]
        return observations, rewards, terminated, truncated, infos

    def _names(self, slots: list[int]) -> list[str]:
        numbers = self._worlds.colony.numbers[0, slots]
        return [f"ant_{number}" for number in numbers.tolist()]

    def _told(self, names: list[str], slots: list[int]) -> tuple[dict[str, Any], Infos]:
        facts = {key: values[slots] for key, values in self._worlds.facts().items()}
        observations = dict(zip(names, self._worlds.shown.show(facts["state"]), strict=True))
        infos = {
            name: {key: values[k] for key, values in facts.items()} for k, name in enumerate(names)
        }
        return observations, infos

    def render(self) -> np.ndarray | None:
        """Return a picture, uint8 (height, width, 3), or None without a render mode."""
        if not self._worlds.begun:
            EnvLogger.error_render_before_reset()
        return None if self.render_mode is None else self._worlds.draw(0)


def most_births(life: Life, foods: int, ticks: int) -> int:
    """Return an upper limit on the number of births in `ticks`.

    Each neighbour of the queen takes one ant per tick. Each food item becomes an ant,
    and can be taken again `life.regrowth` + 1 ticks later.
    """
    if not life.births:
        return 0
    again = 0 if life.regrowth is None else (ticks - 1) // (life.regrowth + 1)
    return min(N_HEADINGS * ticks, foods * (1 + again))


parallel_env = HexColonyParallelEnv
