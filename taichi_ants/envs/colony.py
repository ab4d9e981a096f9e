"""Worlds of ants whose actions are given: what the environments of a colony have in common."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from taichi_ants import checks
from taichi_ants.engines.colony.colony import Colony
from taichi_ants.envs.arguments import worlds_of
from taichi_ants.envs.forage import ACTION_MASKS
from taichi_ants.envs.formats import ObservationFormat, Shown
from taichi_ants.errors import check_one_of, checked_flag
from taichi_ants.task import Task
from taichi_ants.task.constants import RIGHT
from taichi_ants.task.events import Event
from taichi_ants.worlds import World

# The usual length of an episode of a colony, in ticks.
MAX_STEPS = 1000
METADATA: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 10}


class ColonyWorlds:
    """W worlds of ants that do what is given; all arrays are by world and slot, (W, slots).

    Attributes:
        colony: The ants.
        shown: How they show what they see.
        max_steps: Ticks of an episode.
        acted: Which slots held an ant that acted in the last step.
        rewards: float64, what that paid.
        events: The result, int64, an `Event`; NONE where no ant acted.
    """

    def __init__(
        self,
        world: str | World | Sequence[str | World],
        n_worlds: int,
        task: Task | None,
        ants: int,
        start: str,
        capacity: int | None,
        max_steps: int,
        observation_format: ObservationFormat,
        evaporation: bool | None,
        render_mode: str | None,
    ) -> None:
        task = checks.checked_task(Task() if task is None else task)
        falls = task.evaporation_in_training
        if evaporation is not None:
            falls = checked_flag("evaporation", evaporation)
        if render_mode is not None:
            check_one_of("render_mode", render_mode, METADATA["render_modes"])
        self.max_steps = checks.checked_max_steps(max_steps, task)
        worlds = worlds_of(world, n_worlds)
        self.shown = Shown(task.sees, observation_format)
        self.colony = Colony(
            [worlds[w % len(worlds)] for w in range(n_worlds)],
            replace(task, evaporation_in_evaluation=falls),
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
        self._scene: Any = None

    def begin(self, which: np.ndarray, seeds: Sequence[int | None] | None = None) -> None:
        """Begin an episode in some worlds, `which` bool (W,).

        A world with a seed, of all W, begins a new life; one with None goes on, with other random
        numbers.
        """
        if seeds is None:
            seeds = [None] * len(which)
        new = np.array([seed is not None for seed in seeds]) & which
        if new.any():
            # As for one ant, only 64 bits of a seed count.
            given = [seed % 2**64 for seed, one in zip(seeds, new, strict=True) if one]  # type: ignore[operator]
            self.colony.begin_some(new, given)
        if (which & ~new).any():
            self.colony.begin_some(which & ~new)

    def step(self, actions: np.ndarray) -> None:
        """Let each ant do what is given, integers 0 to 4; stopped worlds stand still."""
        colony = self.colony
        self.acted = colony.living & colony.running[:, None]
        colony.act(actions)
        events = np.where(self.acted, colony.events, Event.NONE)
        self.rewards = colony.task.rewards.by_event()[events].astype(np.float64)
        self.events = events.astype(np.int64)

    @property
    def ended(self) -> np.ndarray:
        """In which worlds the episode has come to its last step, bool (W,)."""
        return self.colony.episode_ticks >= self.max_steps

    def action_masks(self) -> np.ndarray:
        """Which actions can succeed, int8 (W, slots, 5).

        A move onto another ant counts if the traffic lets ants of this load enter such cells at
        all. Whether it does succeed depends on what the others do in the same tick. In a dead end
        the moves count, which turn the ant.
        """
        colony, traffic = self.colony, self.colony.task.traffic
        masks = ACTION_MASKS.take(colony.percepts, axis=0, mode="clip")
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

    def render(self) -> tuple[np.ndarray, ...]:
        """A picture of each world, uint8 (height, width, 3)."""
        from taichi_ants.rendering import Scene, Status

        if self._scene is None:
            self._scene = Scene(self.colony.grid)
        pictures = []
        deliveries = self.colony.deliveries
        for world, ticks in enumerate(self.colony.episode_ticks.tolist()):
            snapshot = self.colony.snapshot(world)
            lines = {
                "step": ticks,
                "ants": len(snapshot.ant_cells),
                "with food": snapshot.ant_carries.sum(),
                "delivered": deliveries[world],
            }
            status = Status(tuple((name, str(value)) for name, value in lines.items()))
            pictures.append(self._scene.draw(snapshot, status))
        return tuple(pictures)

    def __getstate__(self) -> dict[str, Any]:
        """All but what draws, which is made when it is used."""
        return {**vars(self), "_scene": None}
