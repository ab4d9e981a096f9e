"""The memory layout of engines and kernels: names of columns and rows, and packed cells.

A packed cell is one i32, so that kernels load it at once. An empty cell stores its trail, 0 or
more. Other cells store their ground - 16, which is negative and has the ground in its lower four
bits. This module does not import Taichi.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum, auto
from typing import Any

import numpy as np

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.task.constants import BEST_AT, EMPTY, N_ACTIONS, ROW
from taichi_ants.worlds.world import World

# The settings of a run: columns before the hyperparameters of its learner.
SETTINGS = (
    *("discount", "epsilon_decay", "least_epsilon"),
    *("learning_rate_decay", "least_learning_rate"),
)
N_SETTINGS = len(SETTINGS)
DISCOUNT, EPSILON_DECAY, MIN_EPSILON, LEARNING_RATE_DECAY, MIN_LEARNING_RATE = range(N_SETTINGS)

# The outcomes of an episode.
OUTCOMES = ("returns", "steps", "deliveries")
RETURNS, STEPS, DELIVERIES = range(len(OUTCOMES))

# The columns of a trace, which has one row per step, by the names of fields of `Trace`.
TRACE = (
    *("episodes", "steps", "cells", "headings", "paper_states", "states", "actions", "rewards"),
    *("next_paper_states", "next_states", "terminated", "events", "executed"),
)


class Command(IntEnum):
    """The command to an ant of batched environments."""

    STEP = 0
    BEGIN = auto()  # start an episode
    WAIT = auto()


# The result of a step in a rollout is one byte: its event, and these bits if the episode ends.
TRUNCATED, TERMINATED = 1 << 6, 1 << 7

# After the cells of a run: the first and last cell that the episode has changed.
EXTRA_CELLS = 2
_OCCUPIED = 16


def pack_cells(world: World) -> np.ndarray:
    """Return the packed cells of a world at the start of an episode, i32 (grid.size,)."""
    ground = world.ground()
    packed = np.where(ground == EMPTY, world.trail_levels(), ground.astype(np.int32) - _OCCUPIED)
    return np.ascontiguousarray(packed, dtype=np.int32)


def unpack_cells(packed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the ground, uint8 (n,), and the stored trails, int32 (n,), of packed cells (n,)."""
    ground = np.where(packed >= 0, EMPTY, packed + _OCCUPIED).astype(np.uint8)
    return ground, np.maximum(packed, 0)


def join(arrays: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """Return int32 arrays as one, `memory`, and where each begins, `name_at`; see `split`.

    A launch takes 0.6 microseconds for each array. Kernels read the parts by `runs.step.parts_of`.
    """
    ends = np.cumsum([array.size for array in arrays.values()]).tolist()
    places = {f"{name}_at": end for name, end in zip(arrays, [0, *ends], strict=False)}
    memory = np.concatenate([array.reshape(-1) for array in arrays.values()], dtype=np.int32)
    return {"memory": memory, **places}


def split(joined: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Return the arrays that `join` has joined, by name, as flat views."""
    memory, *names = joined
    parts = np.split(joined[memory], [joined[name] for name in names[1:]])
    return {name.removesuffix("_at"): part for name, part in zip(names, parts, strict=True)}


def compass_of(grid: AxialGrid) -> np.ndarray:
    """Return index steps and turns by heading, and set bits, i32 (294,); see `rules.actions`."""
    headings = np.arange(N_HEADINGS)
    steps = grid.offsets[(np.arange(N_HEADINGS + 2) - 1) % N_HEADINGS]
    turns = [(headings + by) % N_HEADINGS for by in (-1, 0, 1, 0, 0)]
    bits = np.zeros((1 << N_ACTIONS, 8), np.int64)
    for mask in range(1 << N_ACTIONS):
        (numbers,) = np.nonzero(mask >> np.arange(N_ACTIONS) & 1)
        bits[mask, : len(numbers)] = numbers
    return np.concatenate([steps, *turns, bits.reshape(-1)]).astype(np.int32)


def note_best_actions(q: np.ndarray) -> None:
    """Store the best actions of each state, see `BEST_AT`, in tables of f32 (..., ROW) or flat."""
    rows = q.reshape(-1, ROW)
    values = rows[:, :N_ACTIONS]
    rows[:, BEST_AT] = (values >= values.max(axis=1, keepdims=True)) @ (1 << np.arange(N_ACTIONS))
