"""Taichi Ants, as its users run it."""

from __future__ import annotations

from collections.abc import Callable

import gymnasium
import numpy as np

import taichi_ants.envs  # noqa: F401  # registers the environments
from systems.paper_world import CONFIGS
from taichi_ants import Task, TrainingConfig, runtime, train, worlds
from taichi_ants.engines.colony.colony import Colony
from taichi_ants.task import foraging

_TRUNCATES = Task(delivery="truncates")
_BATCHES = 16  # of actions that are drawn before the measurement
# The settings of the colony study.
SARSA = TrainingConfig("sarsa", 0.1, 0.9, 0.3, 0.98, initial_q=10.0)


def training(each: int) -> Callable[[], int]:
    """Return work on the paper's grid, with `each` runs per configuration."""
    train(worlds.paper(), CONFIGS, 0, 1, 1)  # compiles kernels
    return lambda: int(train(worlds.paper(), CONFIGS, range(each), task=_TRUNCATES).steps.sum())


def environments(n: int) -> Callable[[], int]:
    """Return work: steps of n environments of one ant, with random actions drawn before."""
    runtime.start()
    env = gymnasium.make_vec("taichi_ants/HexForage-v0", num_envs=n)
    env.reset(seed=0)
    actions = np.random.default_rng(0).integers(0, 5, (_BATCHES, n))

    def work() -> int:
        for batch in actions:
            env.step(batch)
        return _BATCHES * n

    work()
    return work


def colony(ants: int, ranges: int | None = None) -> Callable[[], int]:
    """Return work: ticks of a colony that forages and learns into one table; ten cells per ant."""
    side = ranges or max(10, round((10 * ants / 3) ** 0.5))
    world = worlds.open_world(0, (side, side, side))
    colony = Colony(world, foraging(), SARSA, ants=ants, start="spread")
    colony.begin_episode()
    ticks = max(1, 50_000 // ants)

    def work() -> int:
        colony.tick(ticks)
        return ticks * ants

    work()
    return work
