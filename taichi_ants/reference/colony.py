"""The colony: many ants in one world, tick by tick."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.errors import AntsError
from taichi_ants.grid.constants import STREAM_ANT, STREAM_BORN, STREAM_QUEEN
from taichi_ants.reference.ant import Event, observe
from taichi_ants.reference.colony_actions import carry_out, intend
from taichi_ants.reference.colony_homes import Homes
from taichi_ants.reference.colony_learning import SHARING
from taichi_ants.reference.colony_life import Queen, grow_old
from taichi_ants.reference.colony_records import (
    AntSnapshot,
    ColonyAnt,
    EpisodeRecord,
    Snapshot,
    Transition,
)
from taichi_ants.reference.colony_world import ColonyWorld
from taichi_ants.reference.learning import decayed_epsilon
from taichi_ants.reference.policy import choose_action
from taichi_ants.reference.random_stream import RandomStream, stream_state
from taichi_ants.reference.start import start as start_of
from taichi_ants.task import Task
from taichi_ants.task.constants import PICK_UP

if TYPE_CHECKING:
    from taichi_ants.learners.config import TrainingConfig
    from taichi_ants.worlds.world import World


class ReferenceColony:
    """Many ants in one world: `begin_episode`, any number of `tick`s, `end_episode`, and again.

    Attributes:
        world: The present state of the world.
        ants: The living ants by slot.
        homes: The places of the foods of the start.
        queen: Her store and her stream.
        minds: The tables; see `colony_learning`.
        epsilon: Of the present episode, float64.
        episode: Its number in the run, from 0; -1 before the first.
        record: What happened in the present episode, or in the last one between two.
        records: Of each finished episode.
        transitions: Of each ant that acted in the last tick, by ascending slot.
        td_errors: Of each of these transitions; empty where none learns.
        over: Whether the episode has ended at a delivery; it then takes no further tick.
    """

    def __init__(
        self,
        world: World,
        task: Task | None,
        training: TrainingConfig,
        seed: int,
        ants: int = 1,
        capacity: int | None = None,
        start: str = "nest",
        ends_at_delivery: bool = False,
        sharing: str = "shared",
        q_values: np.ndarray | None = None,
    ) -> None:
        """Set up a run, before its first episode.

        Args:
            world: Every episode starts from it.
            task: The rules of the game; the paper's if None.
            training: The learner and its settings.
            seed: Any integer.
            ants, capacity, start, ends_at_delivery: As in `Colony`.
            sharing: "shared", "own" or "fixed".
            q_values: The table to begin with, (128, 5); with "own" also (slots, 128, 5). Zeros if
                not given. A born ant that has a table of its own begins with zeros all the same.

        Raises:
            AntsError: The learner or the sharing is unknown, `planning_steps` does not fit the
                learner, or the world has too few cells for the ants.
        """
        if sharing not in SHARING:
            raise AntsError(f"sharing is {sharing!r}; it must be one of {', '.join(SHARING)}.")
        self._task = task or Task()
        self._start_world, self._life, self._training = world, self._task.life, training
        self._n_ants, self._ends_at_delivery = ants, ends_at_delivery
        self._slots = capacity or (2 * ants + 64 if self._life.births else ants)
        learns = sharing != "fixed"
        falls = (
            self._task.evaporation_in_training if learns else self._task.evaporation_in_evaluation
        )
        self._pheromone = self._task.pheromone if falls else self._task.pheromone.lasting
        self._seed, self._sharing = seed, sharing
        self._starts = start_of(world, seed, ants, start)
        self._initial_streams = [
            RandomStream(stream_state(seed, STREAM_ANT, number)) for number in range(ants)
        ]
        self.queen = Queen(RandomStream(stream_state(seed, STREAM_QUEEN, 0)))
        self.minds = SHARING[sharing](training, self._slots, q_values)
        self.epsilon = float(training.epsilon)
        self.episode = -1
        self.records: list[EpisodeRecord] = []
        self._set_up()

    def _set_up(self) -> None:
        """Put everything that does not outlive an episode where it starts."""
        world = self._start_world
        self.world = ColonyWorld(world, self._pheromone, self._task.rewards)
        self.homes = Homes([(x, y, z) for x, y, z in world.foods.tolist()])
        self.queen.store = 0
        self.record = EpisodeRecord()
        self.over = False
        self.transitions: list[Transition] = []
        self.td_errors: list[np.float32] = []
        self.ants: dict[int, ColonyAnt] = {}
        for number, (cell, heading) in enumerate(self._starts):
            # The stream goes on where this ant's last episode left it.
            stream = self._initial_streams[number]
            self._add(ColonyAnt(cell, heading, slot=number, number=number, stream=stream))
        for ant in self.ants.values():
            ant.state = observe(self.world, ant)

    def _add(self, ant: ColonyAnt) -> None:
        self.ants[ant.slot] = ant
        self.world.occupied.add(ant.cell)

    def begin_episode(self) -> None:
        """Start an episode from the world; tables, models, streams and epsilon go on."""
        self.episode += 1
        self._set_up()

    def end_episode(self) -> EpisodeRecord:
        """End the episode: epsilon decays. Returns its record."""
        self.epsilon = decayed_epsilon(self.epsilon, self._training)
        self.records.append(self.record)
        return self.record

    def run(self, episodes: int, ticks: int) -> list[EpisodeRecord]:
        """Run episodes of so many ticks each, fewer where one ends at a delivery.

        Returns:
            The records of these episodes.
        """
        for _ in range(episodes):
            self.begin_episode()
            while self.record.ticks < ticks and not self.over:
                self.tick()
            self.end_episode()
        return self.records[len(self.records) - episodes :]

    def tick(self) -> None:
        """Let one tick pass for all."""
        if self.episode < 0 or self.over:
            raise AssertionError("there is no episode to go on with; begin one")
        tick = self.record.ticks
        acting = [self.ants[slot] for slot in sorted(self.ants)]
        states = [ant.state for ant in acting]
        intents = [intend(ant, self._choose(ant)) for ant in acting]
        events, taken = carry_out(self.world, intents, tick)
        for cell in taken:
            self.homes.taken(cell, tick)
        self.world.trail.tick()
        self._count(acting, events)
        self._births(events.count(Event.DELIVERED))
        dying = self._deaths(acting)
        self._food(tick)
        for ant in [*self.ants.values(), *dying]:
            ant.state = observe(self.world, ant)
        self._learn(acting, states, events, {ant.slot for ant in dying})
        self.record.living_per_tick.append(len(self.ants))
        self.record.ticks += 1
        self.over = self._ends_at_delivery and self.record.deliveries > 0

    def _choose(self, ant: ColonyAnt) -> int:
        action, ant.chosen = ant.chosen, None
        if action is None:
            action = self._draw_action(ant)
        return action

    def _draw_action(self, ant: ColonyAnt) -> int:
        return choose_action(self.minds.values(ant.slot, ant.state), self.epsilon, ant.stream)

    def _count(self, acting: list[ColonyAnt], events: list[Event]) -> None:
        record = self.record
        gives = events.count(Event.DELIVERED)
        record.episode_return += sum(ant.reward for ant in acting)
        record.moves += sum(ant.action < PICK_UP for ant in acting)
        record.blocked += events.count(Event.BLOCKED)
        record.deliveries += gives
        record.deliveries_per_tick.append(gives)
        if gives and record.first_delivery < 0:
            record.first_delivery = record.ticks + 1

    def _births(self, gives: int) -> None:
        if not self._life.births:
            return
        self.queen.store += gives
        free_slots = [slot for slot in range(self._slots) if slot not in self.ants]
        # The slots first: where they end, no further place is asked for, and so none is drawn.
        for slot, (cell, heading) in zip(free_slots, self.queen.places(self.world), strict=False):
            number = self._n_ants + self.record.births
            state = stream_state(self._seed, STREAM_BORN, (self.episode << 32) + number)
            stream = RandomStream(state)
            self._add(ColonyAnt(cell, heading, slot=slot, number=number, stream=stream))
            self.minds.born(slot)
            self.record.births += 1

    def _deaths(self, ants: list[ColonyAnt]) -> list[ColonyAnt]:
        if self._life.lifespan is None:
            return []
        dying = grow_old(self.world, ants, self._life.lifespan)
        for ant in dying:
            del self.ants[ant.slot]
        self.record.deaths += len(dying)
        return dying

    def _food(self, tick: int) -> None:
        life = self._life
        if life.regrowth is not None:
            self.record.regrown += self.homes.regrow(self.world, life.regrowth, tick)
        if life.wander is not None and (tick + 1) % life.wander == 0:
            self.homes.wander(self.world, self.queen.stream)

    def _learn(
        self, acting: list[ColonyAnt], states: list[int], events: list[Event], dying: set[int]
    ) -> None:
        """Draw a' where the learner wants it, by the tables as they stand; then learn."""
        absorbing = self._task.delivery == "absorbing"
        self.transitions = []
        for ant, state, event in zip(acting, states, events, strict=True):
            terminated = event is Event.DELIVERED and absorbing
            # After an absorbing delivery the ant goes on with a choice of its own.
            if self.minds.draws_next_action and not terminated:
                ant.chosen = self._draw_action(ant)
            self.transitions.append(
                Transition(
                    slot=ant.slot,
                    number=ant.number,
                    state=state,
                    action=ant.action,
                    reward=ant.reward,
                    next_state=ant.state,
                    terminated=terminated,
                    next_action=ant.chosen,
                    died=ant.slot in dying,
                )
            )
        streams = [ant.stream for ant in acting]
        self.td_errors = self.minds.learn(self.transitions, streams, self.epsilon)

    def snapshot(self) -> Snapshot:
        """Return a copy of all that the colony is between two ticks."""
        tables = np.array([knowledge.table() for knowledge in self.minds.tables])
        return Snapshot(
            ants={slot: _ant_snapshot(self.ants[slot]) for slot in sorted(self.ants)},
            ground=dict(self.world.ground),
            levels=self.world.levels(),
            homes=[(home.cell, home.waiting_since) for home in self.homes.homes],
            store=self.queen.store,
            queen_rng_state=self.queen.stream.state,
            q_values=tables if self._sharing == "own" else tables[0],
            models=[
                [(*pair, *outcome) for pair, outcome in knowledge.model.items()]
                for knowledge in self.minds.tables
            ],
            epsilon=self.epsilon,
            record=replace(
                self.record,
                deliveries_per_tick=list(self.record.deliveries_per_tick),
                living_per_tick=list(self.record.living_per_tick),
            ),
        )


def _ant_snapshot(ant: ColonyAnt) -> AntSnapshot:
    own = {field.name for field in fields(AntSnapshot)} - {"rng_state"}
    return AntSnapshot(**{name: getattr(ant, name) for name in own}, rng_state=ant.stream.state)
