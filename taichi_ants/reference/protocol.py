"""Protocols: interventions in a colony at given ticks, or when a measure crosses a bound."""

from __future__ import annotations

from collections.abc import Sequence

from taichi_ants.protocol import At, Every, ProtocolEvent, When
from taichi_ants.reference.colony import EpisodeRecord, ReferenceColony
from taichi_ants.reference.interventions import Interventions
from taichi_ants.reference.measures import measured


class Protocol:
    """Events in each episode of a colony.

    Each episode begins without the interventions of the one before. Call `before_tick` before each
    tick.
    """

    def __init__(self, colony: ReferenceColony, events: Sequence[ProtocolEvent]) -> None:
        self._colony, self._events = colony, events

    def run(self, episodes: int, ticks: int) -> list[EpisodeRecord]:
        """Return the records of whole episodes."""
        for _ in range(episodes):
            self.begin_episode()
            while self._colony.record.ticks < ticks and not self._colony.over:
                self.before_tick()
                self._colony.tick(last=self._colony.record.ticks == ticks - 1)
            self.end_episode()
        return self._colony.records[-episodes:]

    def begin_episode(self) -> None:
        """Begin an episode of the colony."""
        colony = self._colony
        colony.begin_episode()
        self._happened: set[int] = set()
        self._interventions = Interventions(colony)
        self._before = colony.task, colony.training, colony.epsilon, colony.learning_rate

    def end_episode(self) -> None:
        """Undo changes of numbers, and end the episode."""
        colony = self._colony
        colony.task, colony.training, colony.epsilon, colony.learning_rate = self._before
        colony.end_episode()

    def before_tick(self) -> None:
        """Let all events of the present tick happen."""
        for number, event in enumerate(self._events):
            if self._happens(number, event):
                self._happened.add(number)
                for intervention in event.interventions:
                    self._interventions.apply(intervention)

    def _happens(self, number: int, event: ProtocolEvent) -> bool:
        tick = self._colony.record.ticks
        if isinstance(event, At):
            return tick == event.tick
        if isinstance(event, Every):
            start = event.ticks if event.start is None else event.start
            stop = tick if event.stop is None else event.stop
            return start <= tick <= stop and (tick - start) % event.ticks == 0
        assert isinstance(event, When)
        if tick == 0 or tick % event.interval or (event.once and number in self._happened):
            return False
        value = measured(self._colony, event.measure)
        return value > event.above if event.above is not None else value < event.below  # type: ignore[operator]
