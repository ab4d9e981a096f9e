"""Colonies whose ants take given actions, and the vector environment of their ants."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv

from taichi_ants.engines.colony.colony import Colony
from taichi_ants.envs import vector
from taichi_ants.envs.formats import ObservationFormat
from taichi_ants.envs.vector import Ants, AntVectorEnv, Arguments, RenderMode, Rules, Worlds
from taichi_ants.errors import AntsError, checked_whole
from taichi_ants.features.support import BASE, CASTES, CHOICE
from taichi_ants.task.constants import N_ACTIONS, RIGHT, Event

__all__ = ["HexColonyVectorEnv"]

# The default length of a colony's episode, in ticks.
MAX_STEPS = 1000
SUPPORTS = BASE - CHOICE - CASTES - {"choice.rule=softmax"}  # actions are given


class ColonyWorlds(Ants):
    """Worlds of ants that take given actions; arrays are by world and slot, (W, slots).

    Attributes:
        colony: The ants.
        acted: Whether the slot had an ant that acted in the last step, bool.
        rewards: The rewards of these actions, float64.
        events: The results of these actions, `Event` as int64; NONE if no ant acted.
        deliveries: The deliveries of the ant in this episode, int64.
    """

    def __init__(
        self,
        n_worlds: int,
        arguments: Arguments,
        ants: int,
        start: str,
        capacity: int | None = None,
        supports: Collection[str] = SUPPORTS,
    ) -> None:
        super().__init__(n_worlds, arguments, "this environment", supports, "leave it out")
        self.colony = Colony(
            [self.worlds[w % len(self.worlds)] for w in range(n_worlds)],
            replace(self.task, evaporation_in_evaluation=self.task.evaporation_in_training),
            training=None,
            seeds=range(n_worlds),
            ants=ants,
            capacity=capacity,
            start=start,  # type: ignore[arg-type]  # the colony checks it
            sharing="frozen",
        )
        shape = n_worlds, self.colony.capacity
        self.acted, self.rewards = np.zeros(shape, bool), np.zeros(shape)
        self.events = np.full(shape, Event.NONE, np.int64)
        self.deliveries = np.zeros(shape, np.int64)
        self._last: dict[str, np.ndarray] = {}  # at the end of episodes

    def begin(self, which: np.ndarray, seeds: Sequence[int | None]) -> None:
        new = np.array([seed is not None for seed in seeds]) & which
        if new.any():
            # As for one ant, seeds count modulo 2**64.
            new_seeds = [seed % 2**64 for seed, is_new in zip(seeds, new, strict=True) if is_new]  # type: ignore[operator]
            self.colony.reset_worlds(new, new_seeds)
        if (which & ~new).any():
            self.colony.reset_worlds(which & ~new)
        self.events = np.where(which[:, None], Event.NONE, self.events)
        self.deliveries[which] = 0

    def step(self, actions: np.ndarray) -> None:
        """Take the actions of all ants, integers 0 to 4; worlds at their end do not change."""
        colony = self.colony
        colony._stop(self.over())
        self.acted = colony.living & colony.running[:, None]
        colony.act(actions)
        events = np.where(self.acted, colony.events, Event.NONE)
        self.rewards = np.where(self.acted, colony.rewards, 0).astype(np.float64)
        self.events = events.astype(np.int64)
        # A newborn ant starts at 0 in a slot that was free.
        counted = (self.deliveries + (events == Event.DELIVERED)) * self.acted
        self.deliveries = np.where(colony.running[:, None], counted, self.deliveries)

    def over(self) -> np.ndarray:
        return self.colony.episode_ticks >= self.max_steps

    def advance(self, actions: np.ndarray, waiting: np.ndarray) -> vector.Step:
        if self.task.delivery == "terminates":  # the next episode of these ants has begun
            delivered = self.colony.events == Event.DELIVERED
            self.deliveries = np.where(delivered, 0, self.deliveries)
        self.step(actions.reshape(self.acted.shape))
        over = self.over()
        terminated = (self.events == Event.DELIVERED) & (self.task.delivery == "terminates")
        if over.any() or terminated.any():
            self._last = self.facts()
        if over.any():
            self.begin(over, [None] * len(over))
        truncated = np.repeat(over, self.colony.capacity)
        return self.rewards.reshape(-1), terminated.reshape(-1), truncated

    def facts(self, last: bool = False) -> dict[str, np.ndarray]:
        if last:
            return self._last
        return {
            "state": self.colony.states.reshape(-1).astype(np.int64),
            "action_mask": self.action_masks().reshape(-1, N_ACTIONS),
            "event": self.events.reshape(-1),
            "deliveries": self.deliveries.reshape(-1),
        }

    def action_masks(self) -> np.ndarray:
        """Return 1 for actions that can succeed, int8 (W, slots, 5).

        A move onto another ant counts if the traffic rules ever allow it for this load. Its success
        depends on the actions of other ants in the same tick. In a dead end all moves count,
        because they turn the ant.
        """
        colony, traffic = self.colony, self.task.traffic
        masks = vector.ACTION_MASKS.take(colony.paper_states, axis=0, mode="clip")
        if traffic.shared:
            base = np.arange(len(masks))[:, None] * colony.grid.size
            towards = colony.headings[..., None] + np.arange(-1, RIGHT)
            steps = colony.grid.offsets.take(towards, mode="wrap")
            ahead = (base + colony.cells)[..., None] + steps
            enters = colony.occupied.take(ahead)
            if not traffic.follow:
                enters &= colony.carrying[..., None]
            masks[..., : RIGHT + 1] |= enters
        return masks

    def draw(self, world: int) -> np.ndarray:
        """Return a picture of a world, uint8 (height, width, 3)."""
        from taichi_ants.rendering import Scene, Status

        if self._scene is None:
            self._scene = Scene(self.colony.grid, task=self.colony.task)
        snapshot = self.colony.snapshot(world)
        lines = {
            "step": self.colony.episode_ticks[world],
            "ants": len(snapshot.ant_cells),
            "with food": snapshot.ant_carries.sum(),
            "delivered": self.colony.deliveries[world],
        }
        status = Status(tuple((name, str(value)) for name, value in lines.items()))
        return self._scene.draw(snapshot, status)


class HexColonyVectorEnv(AntVectorEnv, VectorEnv):  # skrl looks only at direct bases
    """The ants of one or more worlds, each as an environment of a `gymnasium.vector.VectorEnv`.

    Environment number w * ants + i is ant number i of world number w. The ants of a world share its
    cells, its food and its trails, and act at the same time. A library that trains one agent on a
    vector environment therefore trains one policy for all ants ("parameter sharing"). Spaces,
    rewards of an ant's own action, and infos except `reason` are those of `HexForageVectorEnv`; its
    mask is 1 for actions that succeed unless another ant comes first.

    After `max_steps` steps, all ants of a world are truncated, and the world is reset. After a
    delivery, the ant continues from its cell. If the task's `delivery` is "terminates", the
    default, its next observation nevertheless begins its next episode. If it is "truncates", no
    ant is terminated. The autoreset mode is `SAME_STEP`, because episodes of ants begin in the step
    of a delivery.

    Args:
        num_envs: The number of ants in all worlds together, a multiple of `ants`.
        ants: The number of ants in each world.
        task: See `HexForageEnv`; without births and lifespan.
        start, max_steps: See `HexColonyParallelEnv`.
        world, observation_format, render_mode: See `HexForageEnv`; `render` draws each ant's world.

    >>> ants = gymnasium.make_vec("taichi_ants/HexColony-v0", num_envs=8, ants=4)
    >>> seen, infos = ants.reset(seed=0)
    >>> ants.step(np.ones(8, int))[1].shape  # the reward of each ant
    (8,)
    """

    def __init__(
        self,
        num_envs: int = 64,
        world: Worlds = "paper",
        task: Rules | None = None,
        ants: int = 64,
        start: str = "nest",
        max_steps: int = MAX_STEPS,
        observation_format: ObservationFormat = "cells",
        render_mode: RenderMode | None = None,
    ) -> None:
        n, ants = checked_whole("num_envs", num_envs), checked_whole("ants", ants)
        if n % ants:
            raise AntsError(
                f"num_envs is {num_envs}; it counts ants, so it must be a multiple of ants, {ants}."
            )
        arguments = Arguments(world, task, max_steps, observation_format, render_mode)
        # The number of ants is fixed.
        supports = SUPPORTS - {"life.births", "life.lifespan"}
        worlds = ColonyWorlds(n // ants, arguments, ants, start, supports=supports)
        super().__init__(worlds, n, AutoresetMode.SAME_STEP)
