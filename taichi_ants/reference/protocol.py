"""Protocols: interventions in a colony at given ticks, or when a measure crosses a bound."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

import taichi_ants.interventions as language
from taichi_ants.learners.policies import random_policy, trail_follower
from taichi_ants.protocol import At, Every, ProtocolEvent, When
from taichi_ants.reference.colony import EpisodeRecord, ReferenceColony
from taichi_ants.reference.geometry import Cell, listed_cells, normal_form
from taichi_ants.reference.interventions import Interventions
from taichi_ants.reference.measures import measured
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE

_CONTENTS = {"rock": OBSTACLE, "food": FOOD}


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
        tables = copy.deepcopy([learner.rows for learner in colony.learners.tables])
        self._before = colony.task, colony.epsilon, colony.learning_rate, tables
        self._pheromones = colony.pheromone, colony.fields

    def end_episode(self) -> None:
        """Undo changes of numbers and of policies, and end the episode."""
        colony = self._colony
        colony.task, colony.epsilon, learning_rate, tables = self._before
        colony.pheromone, colony.fields = self._pheromones
        colony.take_castes()
        colony.learners.set_learning_rate(learning_rate)
        colony.learning_rate = learning_rate
        if colony.sharing == "frozen":
            for learner, rows in zip(colony.learners.tables, tables, strict=True):
                learner.rows = rows
        colony.end_episode()

    def before_tick(self) -> None:
        """Let all events of the present tick happen."""
        for number, event in enumerate(self._events):
            if self._happens(number, event):
                self._happened.add(number)
                for name in vars(event):
                    if isinstance(getattr(event, name), language.Intervention):
                        self.apply(getattr(event, name))

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

    def apply(self, intervention: Any) -> None:
        """Apply an intervention."""
        to = self._interventions
        match intervention:
            case language.RemoveAnts(cells=None):
                to.remove_some(self._amount(intervention), intervention.nest)
            case language.RemoveAnts():
                to.remove_ants(self._cells(intervention), intervention.nest)
            case language.AddAnts(cells=None):
                to.add_some(self._amount(intervention), intervention.heading, intervention.nest)
            case language.AddAnts():
                to.add_ants(self._cells(intervention), intervention.heading, intervention.nest)
            case language.SetAnts():
                to.set_ants(intervention.number)
            case language.Place(what="queen"):
                to.move_queen(self._cells(intervention)[0], intervention.nest or 0)
            case language.Place():
                names = list(self._colony.task.foods)
                kind = names.index(intervention.kind) if intervention.kind else 0
                to.put(self._cells(intervention), _CONTENTS[intervention.what], kind)
            case language.Move():
                to.move(*self._cells(intervention))
            case language.Clear():
                to.put(self._cells(intervention), EMPTY)
            case language.SetTrail(cells=None):
                to.lay_trail(
                    list(self._colony.world.ground), intervention.level, intervention.field
                )
            case language.SetTrail():
                to.lay_trail(self._cells(intervention), intervention.level, intervention.field)
            case language.SetEpsilon():
                self._colony.epsilon = intervention.value
            case language.SetLearningRate():
                to.set_learning_rate(intervention.value)
            case language.SetPolicy():
                make = {"random": random_policy, "trail_follower": trail_follower}
                to.set_policy(
                    make[intervention.source](self._colony.task.observation)
                    if intervention.table is None
                    else intervention.table
                )
            case language.SetTask():
                to.set_task(intervention.changed(self._colony.task))

    def _amount(self, intervention: Any) -> int:
        """Return a number of ants; a share is rounded, halves up."""
        if intervention.number is not None:
            return intervention.number
        ants = [ant for ant in self._colony.ants.values() if intervention.nest in (None, ant.nest)]
        return int(intervention.share * len(ants) + 0.5)

    def _cells(self, intervention: Any) -> list[Cell]:
        """Return the cells of an intervention, without duplicates."""
        if isinstance(intervention.cells, str):
            return listed_cells(self._colony.start_world.regions[intervention.cells])
        return list(dict.fromkeys(normal_form(*cell) for cell in intervention.cells))
