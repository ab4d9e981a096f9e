"""The kinds of food."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from taichi_ants.features.life import Ticks
from taichi_ants.settings import Setting, Settings
from taichi_ants.task.constants import MAX_FOOD_KINDS
from taichi_ants.task.rewards import Reward

MAX_LOADS = 1_000_000


@dataclass(frozen=True)
class Food(Settings, path="task.foods.NAME"):
    """A kind of food, for colonies only.

    A cell with food has a number of loads, of which an ant takes one. The cell is food until its
    last load is taken; `regrowth` ticks later, it has all its loads again.
    """

    sentences: ClassVar[dict[str, str]] = {
        "": "A cell has {loads} loads; the rewards are {pick_up} for picking up and {deliver} for "
        "giving.",
        "regrowth": "An empty cell has all its loads again after {regrowth} ticks.",
    }

    most_entries = MAX_FOOD_KINDS

    pick_up: Annotated[Reward, Setting("reward for picking up this food")] = 3
    deliver: Annotated[Reward, Setting("reward for giving this food to the queen")] = 10
    loads: Annotated[int, Setting("loads in a cell", least=1, most=MAX_LOADS)] = 1
    regrowth: Annotated[
        Ticks, Setting("time until an empty cell has all its loads again", least=0)
    ] = None
