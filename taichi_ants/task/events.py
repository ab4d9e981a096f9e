"""The results of actions, and the reasons for failure."""

from __future__ import annotations

from enum import IntEnum, auto

from taichi_ants.task.constants import SEES_CUE, SEES_EMPTY


class Event(IntEnum):
    """The result of an ant's last action; for a move, the code of the cell plus 1."""

    NONE = 0  # the ant has not acted in this episode
    ENTERED_EMPTY = SEES_EMPTY + 1
    BLOCKED = auto()  # a move that only turned the ant
    ENTERED_CUE = SEES_CUE + 1  # a cell seen as T or S
    PICKED_UP = auto()
    DELIVERED = auto()
    FAILED = auto()  # a pick-up or a delivery that was not possible
    PUSHED = auto()  # a carrier changed places with this ant; in colonies only


class Reason(IntEnum):
    """The reason why the action of a lone ant failed: `info["reason"]`."""

    NONE = 0  # the action succeeded
    ROCK_OR_EDGE_AHEAD = auto()
    FOOD_AHEAD = auto()
    QUEEN_AHEAD = auto()
    CARRIES_FOOD_ALREADY = auto()
    NO_FOOD_IN_VIEW = auto()
    CARRIES_NO_FOOD = auto()
    NO_QUEEN_IN_VIEW = auto()
