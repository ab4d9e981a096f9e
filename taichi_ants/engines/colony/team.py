"""How many threads share the ticks of a large world."""

from __future__ import annotations

import math

_LAUNCHES_BETWEEN_TRIALS = 8  # and a trial has so many times fewer ticks


class Team:
    """Threads that share each tick, or one alone.

    Those that share a tick wait for each other several times in it, and wait long where other
    programs use the processors; one alone may be faster then. What comes of the ticks is the same,
    so the colony takes what was faster, and tries the other now and then.
    """

    def __init__(self) -> None:
        self._launches = 0
        self._paces: dict[int, float] = {}  # seconds a tick took, by members

    def plan(self, ticks: int, most: int) -> tuple[int, int]:
        """What to launch next.

        Args:
            ticks: How many are to pass.
            most: How many members there may be.

        Returns:
            How many of the ticks to let pass now, and how many members share them.
        """
        if most == 1:
            return ticks, 1
        self._launches += 1
        best, other = sorted((most, 1), key=lambda n: self._paces.get(n, math.inf))
        if self._launches % _LAUNCHES_BETWEEN_TRIALS == 2:
            return max(1, ticks // _LAUNCHES_BETWEEN_TRIALS), other
        return ticks, best

    def took(self, members: int, seconds: float) -> None:
        """Note how long so many members took for a tick."""
        self._paces[members] = seconds
