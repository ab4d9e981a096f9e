"""The paper's world and grid as plain arrays, for the same task with other libraries.

The task is that of `throughput.py`: one food item, trails that do not evaporate, and deliveries
that truncate.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from taichi_ants import TrainingConfig, worlds

N_STATES, N_ACTIONS = 128, 5
PICK_UP, GIVE = 3, 4
CUE, GOAL = 2, 3  # codes of cells in view
DEPOSIT = 250

# The paper's grid: learning rate, discount, epsilon and its decay.
GRID = tuple(product((0.001, 0.01), (0.9, 0.99), (0.3, 0.5), (0.99, 0.995)))
CONFIGS = [TrainingConfig("q_learning", *point) for point in GRID]


class Layout(NamedTuple):
    """The world in flat arrays, in which neighbours are a fixed step apart.

    Attributes:
        ground: int8 (size,), the code of a cell: two bits for foragers, and above two for carriers.
        trail: int16 (size,), levels at the start of an episode.
        closer: bool (3, size, 6), by position in view, cell and heading: whether the cell in view
            is nearer to the queen.
        ahead: int32 (3, 6), steps to the cells in view at a heading.
        cell, heading: The start of the ant.
    """

    ground: np.ndarray
    trail: np.ndarray
    closer: np.ndarray
    ahead: np.ndarray
    cell: int
    heading: int


def layout() -> Layout:
    """Return the paper's world."""
    world = worlds.paper()
    (cell,), (heading,) = world.start(0)
    seen = (np.arange(6) + np.arange(-1, 2)[:, None]) % 6  # the headings of the cells in view
    return Layout(
        world.ground().astype(np.int8),
        world.trail_levels().astype(np.int16),
        (world.closer()[None, :, None] >> seen[:, None, :] & 1).astype(bool),
        world.grid.offsets[seen].astype(np.int32),
        int(cell),
        int(heading),
    )


class Settings(NamedTuple):
    """The settings of n runs, arrays (n,)."""

    learning_rate: np.ndarray
    discount: np.ndarray
    epsilon: np.ndarray
    decay: np.ndarray
    least: np.ndarray


def settings(configs: Sequence[TrainingConfig], each: int) -> Settings:
    """Return the settings of `each` runs for every configuration, in this order; float32."""
    rows = [
        (one.learning_rate, one.discount, one.epsilon, one.epsilon_decay, one.least_epsilon)
        for one in configs
    ]
    return Settings(*np.repeat(np.array(rows, np.float32), each, axis=0).T)
