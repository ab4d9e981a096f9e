"""The progress of a colony over its episodes: the few numbers that curves show."""

from __future__ import annotations

from taichi_ants.engines.colony.colony import Colony

# Of a point, in this order. The ticks and what was delivered are of all episodes so far, returns of
# this one; ended is 1 at the end of an episode.
POINT = ("episode", "ticks", "delivered", "returns", "epsilon", "ended")
_MOST = 1000  # points of each kind

Point = tuple[float, ...]


class Progress:
    """Points of one world of a colony: at the end of each episode, and within the first one."""

    def __init__(self, colony: Colony, world: int) -> None:
        self._colony, self._world, self._first = colony, world, colony.episode
        self._before = 0  # ticks of episodes that have ended
        self._within, self._ends = _Thinned(), _Thinned()
        self._new: list[Point] = []

    @property
    def ticks(self) -> int:
        """How many have passed in all episodes."""
        return self._before + self._colony.ticks

    def note(self, ended: bool = False) -> None:
        """Remember how the colony is now; tell it each time before another episode begins."""
        colony = self._colony
        if not ended and colony.episode != self._first:
            return
        outcome = colony.outcome()
        delivered = colony.delivered[self._world] + outcome.deliveries[0, self._world]
        returns = outcome.returns[0, self._world]
        numbers = (colony.episode, self.ticks, delivered, returns, colony.epsilon, ended)
        point = tuple(map(float, numbers))
        if (self._ends if ended else self._within).add(point):
            self._new.append(point)
        if ended:
            self._before = self.ticks

    def news(self) -> list[Point]:
        """The points since this was asked last."""
        new, self._new = self._new, []
        return new

    def points(self) -> list[Point]:
        """All points that are kept, those at the ends of episodes last."""
        return self._within.points + self._ends.points


class _Thinned:
    """The first of each so many points, more of them the more there are."""

    def __init__(self) -> None:
        self.points: list[Point] = []
        self._every, self._seen = 1, 0

    def add(self, point: Point) -> bool:
        """Whether it is kept."""
        keeps = self._seen % self._every == 0
        self._seen += 1
        if keeps:
            self.points.append(point)
        if len(self.points) > _MOST:
            self.points = self.points[::2]
            self._every *= 2
        return keeps
