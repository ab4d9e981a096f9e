"""The reward of each event."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

from taichi_ants.features.foods import Reward
from taichi_ants.settings import Setting, Settings
from taichi_ants.task.constants import Event

if TYPE_CHECKING:
    import numpy as np


@dataclass(frozen=True)
class Rewards(Settings, path="task.rewards"):
    """The reward of each event, a whole number; by default, those of table 1 of the paper.

    >>> Task(rewards=Rewards(shaping=0)).rewards.deliver
    10
    """

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
