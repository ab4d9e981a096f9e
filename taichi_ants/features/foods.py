"""The kinds of food."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import astuple, dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

from taichi_ants.features.feature import Feature, Task
from taichi_ants.features.life import Ticks
from taichi_ants.grid.constants import MAX_FOOD_KINDS, MOST_REWARD
from taichi_ants.settings import Setting, Settings

if TYPE_CHECKING:
    import numpy as np

Reward = Annotated[int, Setting(least=-MOST_REWARD, most=MOST_REWARD)]


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
    loads: Annotated[int, Setting("loads in a cell", least=1, most=1_000_000)] = 1
    regrowth: Annotated[Ticks, Setting("time until an empty cell is full again", least=0)] = None


def food_numbers(task: Task) -> np.ndarray:
    """Return the settings of the kinds of food, int32 (settings, kinds); None is -1.

    Without kinds, there is one, with the rewards of the task.
    """
    import numpy as np

    rewards = task.rewards
    kinds = [*task.foods.values()] or [Food(rewards.pick_up, rewards.deliver)]
    numbers = [[-1 if number is None else number for number in astuple(kind)] for kind in kinds]
    return np.array(numbers, np.int32).T.copy()


def _faults(task: Task) -> Iterator[str]:
    if task.foods and task.life.regrowth is not None:
        yield (
            f"`task.life.regrowth` is {task.life.regrowth}; with `task.foods`, set the regrowth of "
            "each kind instead."
        )
    if task.life.pile_move_interval and (len(task.foods) > 1 or task.has_loads):
        yield (
            f"`task.life.pile_move_interval` is {task.life.pile_move_interval}; only food of one "
            "kind with one load in a cell can wander, so leave it out."
        )


FOODS = Feature(Food, uses=lambda task: bool(task.foods), faults=_faults)
