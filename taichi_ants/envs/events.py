"""Codes of what an action did, which environments return in their infos."""

from __future__ import annotations

from enum import IntEnum, auto


class Event(IntEnum):
    """The result of an ant's last action: `info["event"]`.

    `Event(code).name` is its name.
    """

    NONE = 0  # the ant has not acted in this episode
    MOVED = auto()
    PICKED_UP = auto()
    DELIVERED = auto()
    BLOCKED = auto()  # a move that only turned the ant
    FAILED = auto()  # a pick-up or a delivery that could not be done
    PUSHED = auto()  # another ant changed places with this one; in colonies only


class Reason(IntEnum):
    """The reason why an ant that is alone was blocked or failed: `info["reason"]`."""

    NONE = 0  # the action succeeded
    ROCK_OR_EDGE_AHEAD = auto()
    FOOD_AHEAD = auto()
    QUEEN_AHEAD = auto()
    CARRIES_FOOD_ALREADY = auto()
    NO_FOOD_IN_VIEW = auto()
    CARRIES_NO_FOOD = auto()
    NO_QUEEN_IN_VIEW = auto()
