"""The reward of each event."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from typing import TYPE_CHECKING, Annotated

from taichi_ants.settings import Is, Settings
from taichi_ants.task.constants import MOST_REWARD

if TYPE_CHECKING:
    import numpy as np

Reward = Annotated[int, Is(least=-MOST_REWARD, most=MOST_REWARD)]


@dataclass(frozen=True)
class Rewards(Settings, path="task.rewards"):
    """The reward of each event, whole numbers from -1000 to 1000; the paper's table 1 by default.

    The fields are in the order of the events, see `constants`.

    Attributes:
        empty: A move onto a cell that was seen as E.
        failed: A blocked move, or a pick-up or give that cannot be done.
        lure: A move onto a cell that was seen as T or S.
        pick_up: A food picked up.
        give: A food given to the queen.
    """

    empty: Annotated[Reward, Is("of a move onto a cell seen as empty (E)")] = 0
    failed: Annotated[Reward, Is("of a blocked move, or a pick-up or give that fails")] = -1
    lure: Annotated[
        Reward, Is("of a move onto a cell seen as T (trail) or S (nearer to the queen)")
    ] = 1
    pick_up: Annotated[Reward, Is("of picking up food")] = 3
    give: Annotated[Reward, Is("of giving food to the queen")] = 10

    def by_event(self) -> np.ndarray:
        """The rewards by event, int32 (5,)."""
        import numpy as np

        return np.array(astuple(self), dtype=np.int32)

    @property
    def largest(self) -> int:
        """The largest absolute value, on which the range of a return depends."""
        return max(map(abs, astuple(self)))
