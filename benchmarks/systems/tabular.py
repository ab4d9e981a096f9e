"""Tabular Q-learning in Python, as in Gymnasium's tutorials, in one discrete environment."""

from __future__ import annotations

from collections.abc import Callable

import gymnasium
import numpy as np

_STEPS = 2000  # in a call of the work


def _learning(name: str, **settings: object) -> Callable[[], int]:
    env = gymnasium.make(name, **settings)
    rng = np.random.default_rng(0)
    q = np.zeros((env.observation_space.n, env.action_space.n))
    state, _ = env.reset(seed=0)

    def work() -> int:
        nonlocal state
        for _ in range(_STEPS):
            if rng.random() < 0.1:
                action = int(rng.integers(q.shape[1]))
            else:
                action = int(rng.choice(np.flatnonzero(q[state] == q[state].max())))
            seen, reward, terminated, truncated, _ = env.step(action)
            target = float(reward) + 0.9 * (not terminated) * q[seen].max()
            q[state, action] += 0.1 * (target - q[state, action])
            state = env.reset()[0] if terminated or truncated else seen
        return _STEPS

    work()
    return work


def frozen_lake() -> Callable[[], int]:
    """Return work: steps of learning in Gymnasium's FrozenLake."""
    return _learning("FrozenLake-v1")


def hex_forage() -> Callable[[], int]:
    """Return work: steps of learning in our environment with one ant."""
    return _learning("taichi_ants/HexForage-v0", observation_format="index")
