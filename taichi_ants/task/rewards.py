"""What the outcome of an action pays."""

from __future__ import annotations

from dataclasses import astuple, dataclass, fields

import numpy as np

from taichi_ants.errors import checked_whole
from taichi_ants.task.events import Event

MOST = 1000


@dataclass(frozen=True)
class Rewards:
    """The reward of each event, whole numbers from -1000 to 1000; the paper's table 1 by default.

    Attributes:
        empty: A move onto a cell that was seen as E.
        failed: A blocked move, or a pick-up or give that cannot be done.
        lure: A move onto a cell that was seen as T or S.
        pick_up: A food picked up.
        give: A food given to the queen.
    """

    empty: int = 0
    failed: int = -1
    lure: int = 1
    pick_up: int = 3
    give: int = 10

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            value = checked_whole(f"the reward {field.name}", value, -MOST, MOST)
            object.__setattr__(self, field.name, value)

    def by_event(self) -> np.ndarray:
        """The rewards by `Event`, int32 (8,)."""
        rewards = np.zeros(len(Event), np.int32)
        rewards[[Event.ENTERED_EMPTY, Event.PUSHED]] = self.empty
        rewards[[Event.BLOCKED, Event.FAILED]] = self.failed
        rewards[Event.ENTERED_LURE] = self.lure
        rewards[Event.PICKED_UP], rewards[Event.DELIVERED] = self.pick_up, self.give
        return rewards

    @property
    def largest(self) -> int:
        """The largest absolute value, on which the range of a return depends."""
        return max(map(abs, astuple(self)))
