"""The kinds of food."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from taichi_ants.settings import Is, Settings
from taichi_ants.task.constants import MAX_STEPS
from taichi_ants.task.rewards import Reward

MAX_LOADS = 1_000_000


@dataclass(frozen=True)
class Food(Settings, path="task.foods.NAME"):
    """A kind of food, for colonies only.

    A cell with food has a number of loads, of which an ant takes one. The cell is food until its
    last load is taken; `regrowth` ticks later, it has all its loads again.
    """

    pick_up: Annotated[Reward, Is("reward for picking up this food")] = 3
    deliver: Annotated[Reward, Is("reward for giving this food to the queen")] = 10
    loads: Annotated[int, Is("loads in a cell", least=1, most=MAX_LOADS)] = 1
    regrowth: Annotated[
        int | None,
        Is("time until an empty cell has all its loads again", unit="ticks"),
        Is(least=0, most=MAX_STEPS),
    ] = None
