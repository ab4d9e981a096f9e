"""The timetable of a protocol: the ticks at which a run of a colony is cut, and what happens."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from taichi_ants import measures
from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.engines.colony.stepping import TickingColony
from taichi_ants.errors import AntsError
from taichi_ants.protocol import ProtocolEvent, When, checked_protocol


class Timetable:
    """The events of a protocol in the episodes of a `Colony`, which imports this module.

    A context manager for an episode that has begun. At its end, the numbers of the colony are
    again those of its beginning; `ColonyState._lay_out` resets the worlds.

    Raises:
        AntsError: An event cannot happen in an episode of `length` ticks, or in this colony.
    """

    def __init__(self, colony: TickingColony, protocol: Any, length: int) -> None:
        self._colony = colony
        self._at: dict[int, list[tuple[int, ProtocolEvent]]] = {}  # by tick: numbers and events
        for number, event in enumerate(checked_protocol(protocol)):
            for tick in event.times(length):
                self._at.setdefault(tick, []).append((number, event))
            for intervention in event.interventions:
                everywhere = isinstance(event, When) and intervention.in_all_worlds
                if everywhere and len(colony.worlds) > 1:
                    raise AntsError(
                        f"`when.{intervention.path}` would change all {len(colony.worlds)} worlds "
                        "of the colony, which share it; make a colony with a single seed."
                    )
                intervention.check_in(colony.worlds[0], colony.task, colony.learns)

    def __enter__(self) -> None:
        colony = self._colony
        self._interventions = Interventions(colony, lasting=False)
        self._done: dict[int, np.ndarray] = {}  # by event: the worlds in which it has happened
        self._before = colony.task, colony.training, colony.epsilon, colony.learning_rate

    def __exit__(self, *_: object) -> None:
        colony, (task, training, epsilon, learning_rate) = self._colony, self._before
        if colony.task != task:
            self._interventions.set_task(task)
        colony.training, colony.epsilon = training, epsilon
        if colony.learning_rate != learning_rate:
            colony._set_learning_rate(learning_rate)

    def pieces(self, advance: Callable[[Any, int], Iterator[None]], n: int) -> Iterator[None]:
        """Yield when `advance` does, until n ticks are done, with all events on the way."""
        colony, end = self._colony, self._colony.ticks + n
        while colony.ticks < end:
            for number, event in self._at.get(colony.ticks, ()):
                self._happen(number, event)
            stop = min((tick for tick in self._at if colony.ticks < tick < end), default=end)
            yield from advance(colony, stop - colony.ticks)

    def _happen(self, number: int, event: ProtocolEvent) -> None:
        """Let an event happen in the worlds that are running, if its condition holds there."""
        colony, worlds = self._colony, self._colony.running
        if isinstance(event, When):
            done = self._done.setdefault(number, np.zeros_like(worlds))
            worlds &= ~(done & event.once)
            for w in np.flatnonzero(worlds):
                worlds[w] = event.holds(measures.get(event.measure)(colony.snapshot(int(w))))
            done |= worlds
        if not worlds.any():
            return
        self._interventions.worlds = tuple(np.flatnonzero(worlds).tolist())
        try:
            for intervention in event.interventions:
                self._interventions.apply(intervention)
        except AntsError as error:
            raise AntsError(f"after {colony.ticks} ticks, {error}") from error
