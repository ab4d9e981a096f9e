"""Several agents with random actions in PettingZoo's parallel interface."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numpy as np

_STEPS = 50  # in a call of the work


def knights() -> Callable[[], int]:
    """Return work: steps of PettingZoo's example of knights and archers, without rendering."""
    os.environ.setdefault("SDL_VIDEODRIVER", "dummy")  # no display is needed
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    from pettingzoo.butterfly import knights_archers_zombies_v11

    return _agents(knights_archers_zombies_v11.parallel_env())


def ants() -> Callable[[], int]:
    """Return work: steps of a colony of 64 ants in the open world."""
    from taichi_ants.envs import colony_v0

    return _agents(colony_v0.parallel_env(world="open", ants=64))


def _agents(env: Any) -> Callable[[], int]:
    rng = np.random.default_rng(0)
    env.reset(seed=0)
    n_actions = env.action_space(env.possible_agents[0]).n

    def work() -> int:
        steps = 0
        for _ in range(_STEPS):
            actions = rng.integers(n_actions, size=len(env.agents)).tolist()
            steps += len(actions)
            env.step(dict(zip(env.agents, actions, strict=True)))
            if not env.agents:
                env.reset()
        return steps

    work()
    return work
