"""The paper's world and Q-learning as plain loops, which numba compiles.

Random numbers and arithmetic are those of the package, so the runs are bit-for-bit equal.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import numba
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
    Layout,
    layout,
)
from taichi_ants import TrainingConfig
from taichi_ants.grid.constants import STREAM_ANT
from taichi_ants.grid.randomness import GAMMA, stream_state

_WORD = np.uint64(0xFFFFFFFF)
_GAMMA = np.uint64(GAMMA)
_EACH = 4  # runs of each configuration in a call of the work


@numba.njit
def _bits(state):
    z = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@numba.njit
def _below(word, n):
    return np.int64((word * np.uint64(n)) >> np.uint64(32))


@numba.njit
def _look(world, ground, trail, cell, heading, carries):
    state = np.int64(carries)
    if carries:
        for k in range(3):
            look = ground[cell + world.ahead[k, heading]]
            shows_cue = look == 0 and world.closer[k, cell, heading]
            state = state << 2 | (CUE if shows_cue else look >> 2)
        return state
    strongest = 2
    for k in range(3):
        there = cell + world.ahead[k, heading]
        if ground[there] == 0:
            strongest = max(strongest, trail[there])
    for k in range(3):
        there = cell + world.ahead[k, heading]
        shows_cue = ground[there] == 0 and 2 * trail[there] >= strongest
        state = state << 2 | (CUE if shows_cue else ground[there] & 3)
    return state


@numba.njit
def _best(q, state):
    best = q[state, 0]
    for a in range(1, N_ACTIONS):
        best = max(best, q[state, a])
    return best


@numba.njit
def _choose(q, state, bits, explore_below):
    if bits >> np.uint64(32) < explore_below:
        return _below(bits & _WORD, N_ACTIONS)
    best, ties = _best(q, state), 0
    for a in range(N_ACTIONS):
        ties += q[state, a] == best
    skipped = _below(bits & _WORD, ties)
    for a in range(N_ACTIONS):
        if q[state, a] == best:
            if skipped == 0:
                return a
            skipped -= 1
    return 0


@numba.njit
def _goal(state):
    """Return the position of the goal in view, or -1."""
    for k in range(3):
        if state >> (4 - 2 * k) & 3 == GOAL:
            return k
    return -1


@numba.njit
def _run(world, stream, rate, discount, epsilon, decay, least, max_steps, q, returns, steps):
    """Train one run; write q (128, 5), returns and steps (episodes,)."""
    ground, trail = np.empty_like(world.ground), np.empty_like(world.trail)
    for episode in range(len(returns)):
        ground[:], trail[:] = world.ground, world.trail
        cell, heading, carries, delivered = world.cell, world.heading, False, False
        explore_below = np.uint64(epsilon * 4294967296.0)
        state = _look(world, ground, trail, cell, heading, carries)
        step, total = 0, 0
        while step < max_steps and not delivered:
            stream += _GAMMA
            action = _choose(q, state, _bits(stream), explore_below)
            reward, goal = -1, _goal(state)
            if action < PICK_UP:
                target = cell + world.ahead[action, heading]
                heading = (heading + action + 5) % 6
                code = state >> (4 - 2 * action) & 3
                if code & 1 == 0:
                    reward = np.int64(code == CUE)
                    cell = target
                    if carries:
                        trail[cell] = DEPOSIT
            elif goal >= 0 and (action == GIVE) == carries:
                if carries:
                    reward, carries, delivered = 10, False, True
                else:
                    food = cell + world.ahead[goal, heading]
                    ground[food] = 0
                    trail[food] = trail[cell] = DEPOSIT
                    reward, carries, heading = 3, True, (heading + 3) % 6
            seen = _look(world, ground, trail, cell, heading, carries)
            error = np.float32(reward) + discount * _best(q, seen) - q[state, action]
            q[state, action] += rate * error
            total += reward
            state = seen
            step += 1
        returns[episode], steps[episode] = total, step
        epsilon = max(epsilon * decay, least)


def _all_runs(world, streams, rate, discount, epsilon, decay, least, max_steps, q, returns, steps):
    for i in numba.prange(len(streams)):
        _run(
            *(world, streams[i], rate[i], discount[i], epsilon[i], decay[i], least[i]),
            *(max_steps, q[i], returns[i], steps[i]),
        )


_ONE_BY_ONE, _IN_PARALLEL = numba.njit(_all_runs), numba.njit(parallel=True)(_all_runs)


def train(
    configs: Sequence[TrainingConfig],
    each: int,
    episodes: int,
    max_steps: int,
    parallel: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the returns and steps of all runs with seeds 0, 1, ..., (n, episodes)."""
    runs = list(itertools.product(configs, range(each)))
    streams = np.array([stream_state(seed, STREAM_ANT, 0) for _, seed in runs], np.uint64)
    numbers = [[getattr(config, name) for config, _ in runs] for name in _NUMBERS]
    rate, discount = np.array(numbers[:2], np.float32)
    q = np.zeros((len(runs), N_STATES, N_ACTIONS), np.float32)
    returns, steps = np.zeros((2, len(runs), episodes), np.int32)
    of_runs: tuple[Any, ...] = (streams, rate, discount, *np.array(numbers[2:]))
    go = _IN_PARALLEL if parallel else _ONE_BY_ONE
    go(Layout(*layout()), *of_runs, max_steps, q, returns, steps)
    return returns, steps


_NUMBERS = ("learning_rate", "discount", "epsilon", "epsilon_decay", "least_epsilon")


def _training(parallel: bool) -> Callable[[], int]:
    train(CONFIGS[:1], 1, 1, 1, parallel)
    return lambda: int(train(CONFIGS, _EACH, 500, 600, parallel)[1].sum())


def one_by_one() -> Callable[[], int]:
    """Return work on the paper's grid, one run after another."""
    return _training(parallel=False)


def in_parallel() -> Callable[[], int]:
    """Return work on the paper's grid, with runs distributed to threads."""
    return _training(parallel=True)
