"""FourRooms of gymnax, a grid of 13 x 13 squares, with random actions: vmap and scan."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnax
import jax

_STEPS = 100  # in a scan


def environments(n: int) -> Callable[[], int]:
    """Return work: steps of n environments with random actions, in one compiled scan."""
    env, params = gymnax.make("FourRooms-misc")

    def one(state: Any, key: Any) -> tuple[Any, Any]:
        for_action, for_step = jax.random.split(key)
        action = env.action_space(params).sample(for_action)
        seen, state, reward, *_ = env.step(for_step, state, action, params)
        return state, (seen, reward)

    def step(states: Any, key: Any) -> tuple[Any, Any]:
        states, (seen, rewards) = jax.vmap(one)(states, jax.random.split(key, n))
        return states, (seen.sum(), rewards.sum())  # else the compiler would remove them

    @jax.jit
    def scan(states: Any, key: Any) -> tuple[Any, Any]:
        return jax.lax.scan(step, states, jax.random.split(key, _STEPS))

    keys = jax.random.split(jax.random.key(0), n)
    _, states = jax.jit(jax.vmap(env.reset, in_axes=(0, None)))(keys, params)
    key = jax.random.key(1)

    def work() -> int:
        nonlocal states, key
        key, now = jax.random.split(key)
        states, came = scan(states, now)
        jax.block_until_ready(came)
        return _STEPS * n

    work()
    return work
