"""The paper's world and Q-learning in JAX: pure functions of one run, vmap over runs, scan."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from systems.paper_world import (
    CONFIGS,
    CUE,
    DEPOSIT,
    GIVE,
    GOAL,
    N_ACTIONS,
    N_STATES,
    PICK_UP,
    Settings,
    layout,
    settings,
)
from taichi_ants import TrainingConfig

_STEPS = 100  # in a scan
_WORLD = layout()
_GROUND, _TRAIL, _CLOSER, _AHEAD = map(jnp.asarray, _WORLD[:4])


class Run(NamedTuple):
    """The state of a run."""

    cell: Any
    heading: Any
    carries: Any
    ground: Any
    trail: Any
    state: Any
    returned: Any
    steps: Any
    epsilon: Any
    q: Any


def look(run: Run) -> Any:
    """Return the codes of the cells in view, int (3,)."""
    view = run.cell + _AHEAD[:, run.heading]
    looks = run.ground[view]
    empty = looks == 0
    levels = jnp.where(empty, run.trail[view], 0)
    to_forager = jnp.where(2 * levels >= jnp.maximum(levels.max(), 2), CUE, looks & 3)
    nearer = _CLOSER[:, run.cell, run.heading]
    to_carrier = jnp.where(nearer & empty, CUE, looks >> 2)
    return jnp.where(run.carries, to_carrier, to_forager).astype(jnp.int32)


def state_of(carries: Any, codes: Any) -> Any:
    """Return the state index of the ant."""
    return carries * 64 + codes[0] * 16 + codes[1] * 4 + codes[2]


def begun(epsilon: Any, q: Any) -> Run:
    """Return a run at the start of an episode."""
    cell, heading = jnp.int32(_WORLD.cell), jnp.int32(_WORLD.heading)
    none, no = jnp.int32(0), jnp.bool_(False)
    run = Run(cell, heading, no, _GROUND, _TRAIL, none, none, none, epsilon, q)
    return run._replace(state=state_of(no, look(run)))


def step(run: Run, numbers: Settings, words: Any, max_steps: int) -> tuple[Run, Any]:
    """Return a run after one step, and its outcome; `words` are random numbers 0 to 1, (6,)."""
    values = run.q[run.state]
    allowed = (values == values.max()) | (words[5] < run.epsilon)
    action = jnp.where(allowed, words[:5], -1.0).argmax()
    codes = run.state >> jnp.array([4, 2, 0]) & 3
    moves, position = action < PICK_UP, jnp.minimum(action, 2)
    code, view = codes[position], run.cell + _AHEAD[:, run.heading]
    enters = moves & ((code & 1) == 0)
    sees = (codes == GOAL).any()
    takes = (action == PICK_UP) & sees & ~run.carries
    gives = (action == GIVE) & sees & run.carries
    cell = jnp.where(enters, view[position], run.cell)
    turn = jnp.where(moves, action + 5, jnp.where(takes, 3, 0))
    lays = (enters & run.carries) | takes
    food = view[(codes == GOAL).argmax()]
    ground = run.ground.at[food].set(jnp.where(takes, 0, run.ground[food]))
    trail = run.trail.at[cell].set(jnp.where(lays, DEPOSIT, run.trail[cell]))
    trail = trail.at[food].set(jnp.where(takes, DEPOSIT, trail[food]))
    reward = jnp.where(enters, (code == CUE).astype(jnp.int32), -1)
    reward = jnp.where(takes, 3, jnp.where(gives, 10, reward))
    after = run._replace(
        cell=cell,
        heading=(run.heading + turn) % 6,
        carries=(run.carries | takes) & ~gives,
        ground=ground,
        trail=trail,
        returned=run.returned + reward,
        steps=run.steps + 1,
    )
    seen = state_of(after.carries, look(after))
    error = reward + numbers.discount * run.q[seen].max() - values[action]
    q = run.q.at[run.state, action].add(numbers.learning_rate * error)
    after = after._replace(state=seen, q=q)
    ended = gives | (after.steps >= max_steps)
    decayed = jnp.maximum(numbers.least, run.epsilon * numbers.decay)
    fresh = begun(decayed, q)
    # Both share the table, which should not be copied.
    chosen = jax.tree.map(partial(jnp.where, ended), fresh[:-1], after[:-1])
    return Run(*chosen, q), (ended, after.returned, after.steps)


def follow(runs: Run, numbers: Settings, words: Any, max_steps: int) -> tuple[Run, Any]:
    """Return all runs after steps with random numbers (steps, n, 6), and outcomes (steps, n).

    The outcomes are whether the episode ended, its return and its steps.
    """

    def of_all(runs: Run, words: Any) -> tuple[Run, Any]:
        return jax.vmap(partial(step, max_steps=max_steps))(runs, numbers, words)

    return jax.lax.scan(of_all, runs, words)


@partial(jax.jit, static_argnames="max_steps", donate_argnames="runs")
def advance(runs: Run, numbers: Settings, key: Any, max_steps: int) -> tuple[Run, Any]:
    """Return all runs after steps with new random numbers, and outcomes; see `follow`."""
    words = jax.random.uniform(key, (_STEPS, len(runs.cell), 6))
    return follow(runs, numbers, words, max_steps)


def first(configs: Sequence[TrainingConfig], each: int) -> tuple[Run, Settings]:
    """Return all runs at their start, and their settings."""
    numbers = Settings(*map(jnp.asarray, settings(configs, each)))
    q = jnp.zeros((len(numbers.epsilon), N_STATES, N_ACTIONS), jnp.float32)
    return jax.jit(jax.vmap(begun))(jnp.copy(numbers.epsilon), q), numbers


def train(
    configs: Sequence[TrainingConfig], each: int, episodes: int, max_steps: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the returns and steps of the first episodes of all runs, (n, episodes)."""
    runs, numbers = first(configs, each)
    n, key, pieces = len(numbers.epsilon), jax.random.key(0), []
    done = np.zeros(n, np.int64)
    while done.min() < episodes:
        key, now = jax.random.split(key)
        runs, came = advance(runs, numbers, now, max_steps)
        pieces.append(jax.device_get(came))
        done += pieces[-1][0].sum(axis=0)
    ended, returned, steps = (np.concatenate(part) for part in zip(*pieces, strict=True))
    places = [np.nonzero(ended[:, i])[0][:episodes] for i in range(n)]
    pairs = [(returned[at, i], steps[at, i]) for i, at in enumerate(places)]
    outcomes = np.array(pairs).swapaxes(0, 1)
    return outcomes[0], outcomes[1]


def training(each: int) -> Callable[[], int]:
    """Return work on the paper's grid: the next 100 steps of all runs."""
    runs, numbers = first(CONFIGS, each)
    key = jax.random.key(0)

    def work() -> int:
        nonlocal runs, key
        key, now = jax.random.split(key)
        runs, came = advance(runs, numbers, now, 600)
        jax.block_until_ready(came)
        return _STEPS * len(runs.cell)

    work()
    return work
