"""The reward of each event, and the kinds of food."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

from taichi_ants.features.life import Ticks
from taichi_ants.settings import Setting, Settings
from taichi_ants.task.constants import MAX_FOOD_KINDS, MOST_REWARD
from taichi_ants.task.events import Event

if TYPE_CHECKING:
    import numpy as np

Reward = Annotated[int, Setting(least=-MOST_REWARD, most=MOST_REWARD)]


@dataclass(frozen=True)
class Rewards(Settings, path="task.rewards"):
    """The reward of each event, a whole number; by default, those of table 1 of the paper."""

    sentences: ClassVar[dict[str, str]] = {
        "": "The rewards are {empty} for a move onto E, {shaping} onto T or S, {pick_up} for "
        "picking up, {deliver} for giving, and {failed} for an action that fails.",
    }

    empty: Annotated[Reward, Setting("reward for a move onto a cell seen as empty (E)")] = 0
    failed: Annotated[Reward, Setting("reward for a failed move, pick-up or delivery")] = -1
    shaping: Annotated[Reward, Setting("reward for a move onto a cell seen as T or S")] = 1
    pick_up: Annotated[Reward, Setting("reward for picking up food")] = 3
    deliver: Annotated[Reward, Setting("reward for delivering food to the queen")] = 10

    def by_event(self) -> np.ndarray:
        """Return the rewards by `Event`, int32 (8,)."""
        import numpy as np

        rewards = np.zeros(len(Event), np.int32)
        rewards[[Event.ENTERED_EMPTY, Event.PUSHED]] = self.empty
        rewards[[Event.BLOCKED, Event.FAILED]] = self.failed
        rewards[Event.ENTERED_CUE] = self.shaping
        rewards[Event.PICKED_UP], rewards[Event.DELIVERED] = self.pick_up, self.deliver
        return rewards

    @property
    def largest(self) -> int:
        """The largest absolute reward, which limits the range of returns."""
        return max(map(abs, astuple(self)))


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
