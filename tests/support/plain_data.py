"""Data sets as lists of episodes, the form that the reference uses."""

from __future__ import annotations

import numpy as np

from taichi_ants import Dataset, record
from taichi_ants.task import Task
from taichi_ants.worlds import World

COLUMNS = ("state", "action", "reward", "next_state", "terminated")


def episodes_of(data: Dataset) -> list[list[tuple]]:
    """Return steps (state, action, reward, next state, terminated) by episode."""
    rows = list(zip(*(getattr(data, name).tolist() for name in COLUMNS), strict=True))
    return [rows[a:b] for a, b in zip(data.begins, data.begins[1:], strict=False)]


def behaviour_of(data: Dataset) -> list[list[float]]:
    """Return the probabilities of the actions by episode."""
    chances = data.behaviour_probability.tolist()
    return [chances[a:b] for a, b in zip(data.begins, data.begins[1:], strict=False)]


def random_data(world: World, seed: int, episodes: int = 6, runs: int = 2) -> Dataset:
    """Return data of ants that follow random tables; some of their episodes end by delivery."""
    rng = np.random.default_rng(seed)
    tables = rng.normal(size=(runs, 128, 5))
    delivery = "truncates" if seed % 2 else "terminates"
    return record(
        world, tables, episodes, range(seed, seed + runs), 60, Task(delivery=delivery), epsilon=0.7
    )
