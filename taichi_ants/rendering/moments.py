"""Moments of ants: a world as it is, and what is said of it beside the picture.

An episode is played by a colony of one ant, so what is drawn is what the engine has done.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np

from taichi_ants.checks import checked_count
from taichi_ants.engines.colony.colony import Colony
from taichi_ants.engines.runs.traces import Trace, rollout
from taichi_ants.errors import AntsError, expect, whole
from taichi_ants.grid.constants import STREAM_ROLLOUT
from taichi_ants.grid.randomness import stream_state
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.rendering.panel import Status, range_with_zero
from taichi_ants.rendering.scene import DEFAULT_SIZE, Scene
from taichi_ants.rendering.snapshot import Snapshot
from taichi_ants.task import Task
from taichi_ants.worlds.world import World

Moment = tuple[Snapshot, Status]


def frames(
    moments: Iterable[Moment], size: tuple[int, int] = DEFAULT_SIZE, **look: Any
) -> Iterator[np.ndarray]:
    """The pictures of moments of one world, uint8 (height, width, 3), as they come.

    Args:
        moments: Of an `Episode`, of `colony_moments`, or made by hand.
        size: Width and height in pixels.
        look: What to draw, see `Scene`.
    """
    scene = None
    for snapshot, status in moments:
        expect("the snapshot", snapshot, Snapshot)
        scene = scene or Scene(snapshot.grid, size, **look)
        yield scene.draw(snapshot, status)


@dataclass(frozen=True, eq=False)
class Episode:
    """A rollout with what it takes to draw it.

    Attributes:
        world: Where it happened.
        q_values: float (n_states, 5), the action values that the ant followed.
        trace: Its n steps.
        seed, number, task, epsilon: Of the rollout.
        name: What the head-up lines call it.
        whole: Whether it ended with its last step; the beginning of an episode has no outcome.
    """

    world: World
    q_values: np.ndarray
    trace: Trace
    seed: int
    number: int
    task: Task
    epsilon: float
    name: str
    whole: bool = True

    @classmethod
    def play(
        cls,
        world: World,
        q_values: np.ndarray,
        *,
        seed: int = 0,
        number: int = 0,
        max_steps: int = 600,
        task: Task | None = None,
        epsilon: float = 0.0,
    ) -> Episode:
        """Roll a policy out; arguments and errors are those of `rollout`."""
        expect("world", world, World)
        trace = rollout(world, q_values, seed, number, max_steps, task, epsilon)
        name = "greedy" if epsilon == 0 else f"epsilon {epsilon:g}"
        return cls(world, q_values, trace, seed, number, task or Task(), epsilon, name)

    @property
    def delivered(self) -> bool:
        """Whether it ended with the food given to the queen."""
        return bool(self.trace.delivered[-1])

    def __len__(self) -> int:
        """The number of its moments, n + 1."""
        return len(self.trace) + 1

    def moments(self) -> Iterator[Moment]:
        """The world before each step with what the ant is about to do, and the world at the end."""
        colony = self._colony()
        bars = range_with_zero(self.trace.q_values)
        returns = np.concatenate([[0], np.cumsum(self.trace.rewards)]).tolist()
        for step, gained in enumerate(returns):
            if step:
                colony.tick()
            seen = self._seen(step)
            yield (
                colony.snapshot(),
                Status(step, gained, self.name, q_range=bars, observation=self.task.sees, **seen),
            )

    def _seen(self, step: int) -> dict[str, Any]:
        """What the ant sees and is about to do, or how the episode has ended."""
        trace = self.trace
        if step < len(trace):
            state, action = int(trace.states[step]), int(trace.actions[step])
            return {"state": state, "action": action, "q_values": trace.q_values[step]}
        outcome = "delivered" if self.delivered else "step limit"
        return {"state": int(trace.next_states[-1]), "outcome": outcome if self.whole else ""}

    def moment(self, step: int) -> Moment:
        """The moment of one step, 0 to len(episode) - 1.

        Raises:
            AntsError: There is no such step.
        """
        if whole("step", step) not in range(len(self)):
            raise AntsError(f"there is no step {step!r}; the episode has 0 to {len(self) - 1}.")
        return next(islice(self.moments(), step, None))

    def _colony(self) -> Colony:
        """A colony of one ant that does what the rollout does, since it has the same stream."""
        steady = TrainingConfig("q_learning", 1.0, 0.0, self.epsilon, 1.0, min_epsilon=0.0)
        colony = Colony(
            self.world, self.task, steady, self.seed, sharing="fixed", q_values=self.q_values
        )
        colony.begin_episode()
        colony.arrays["streams"][0] = stream_state(self.seed, STREAM_ROLLOUT, self.number)
        return colony


def colony_moments(
    colony: Colony, ticks: int = 0, every: int = 1, world: int = 0
) -> Iterator[Moment]:
    """A world of a colony as it is now, then every few ticks while time passes.

    Args:
        colony: In an episode; it is moved on by `ticks`.
        ticks: How many; 0 gives the moment as it is. The last step is shorter if need be.
        every: Ticks from one moment to the next, at least 1.
        world: Number of the world.

    Raises:
        AntsError: A number is not allowed, or no episode has begun.
    """
    expect("colony", colony, Colony)
    ticks = checked_count("ticks", ticks, least=0)
    every = checked_count("every", every)
    yield _moment(colony, world)
    for done in range(0, ticks, every):
        colony.tick(min(every, ticks - done))
        yield _moment(colony, world)


def _moment(colony: Colony, world: int) -> Moment:
    snapshot = colony.snapshot(world)
    more = (
        ("ants", str(len(snapshot.ant_cells))),
        ("with food", str(int(snapshot.ant_carries.sum()))),
        ("delivered", str(int(colony.outcome().deliveries[0, world]))),
    )
    return snapshot, Status(colony.ticks, more=more, step_name="tick")
