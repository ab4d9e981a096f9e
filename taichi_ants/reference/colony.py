"""The simulator of the reference: ants in one world, tick by tick."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.errors import AntsError
from taichi_ants.grid.constants import STREAM_ANT, STREAM_BORN, STREAM_QUEEN
from taichi_ants.reference.actions import carry_out, intend
from taichi_ants.reference.homes import Homes
from taichi_ants.reference.learners import LEARNERS
from taichi_ants.reference.life import Queen, grow_old
from taichi_ants.reference.observations import OBSERVATIONS
from taichi_ants.reference.policy import choose_action
from taichi_ants.reference.random_stream import RandomStream, stream_state
from taichi_ants.reference.records import Ant, EpisodeRecord, Event, Snapshot, Transition
from taichi_ants.reference.sharing import SHARING
from taichi_ants.reference.start import start as start_of
from taichi_ants.reference.vision import observe
from taichi_ants.reference.world_state import WorldState
from taichi_ants.task import Task
from taichi_ants.task.constants import PICK_UP

if TYPE_CHECKING:
    from taichi_ants.learners.config import TrainingConfig
    from taichi_ants.worlds.world import World


class ReferenceColony:
    """Ants in one world: `begin_episode`, any number of `tick`s, `end_episode`, and again.

    Attributes:
        world: The present state of the world.
        ants: The living ants by slot.
        streams: Of the initial ants; they run on through all episodes.
        homes: The places of the foods of the start.
        queen: Her store and her stream.
        minds: The tables; see `sharing`.
        epsilon: Of the present episode, float64.
        episode: Its number in the run, from 0; -1 before the first.
        record: What happened in the present episode, or in the last one between two.
        records: Of each finished episode.
        transitions: Of each ant that acted in the last tick, by ascending slot.
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
            q_values: The table to begin with, (n_states, 5); with "own" also (slots, n_states, 5).
                Zeros if not given. A born ant that has a table of its own begins with zeros all the
                same.

        Raises:
            AntsError: The learner, one of its hyperparameters, the sharing or the observation is
                unknown, the learner cannot share a table, or the world has too few cells for the
                ants.
        """
        if sharing not in SHARING:
            raise AntsError(f"sharing is {sharing!r}; it must be one of {', '.join(SHARING)}.")
        self._task = task = task or Task()
        falls = (
            task.evaporation_in_evaluation if sharing == "fixed" else task.evaporation_in_training
        )
        self._pheromone = task.pheromone if falls else task.pheromone.lasting
        self._observation = OBSERVATIONS[task.observation]
        self._start_world, self._training = world, training
        self._n_ants, self._ends_at_delivery = ants, ends_at_delivery
        self._slots = capacity or (2 * ants + 64 if task.life.births else ants)
        self._seed, self._sharing = seed, sharing
        self._starts = start_of(world, seed, ants, start)
        self.streams = [RandomStream(stream_state(seed, STREAM_ANT, n)) for n in range(ants)]
        self.queen = Queen(RandomStream(stream_state(seed, STREAM_QUEEN, 0)))
        make = partial(LEARNERS[training.learner], training, self._observation.n_states)
        self.minds = SHARING[sharing](make, self._slots, q_values)
        self.epsilon = float(training.epsilon)
        self.episode = -1
        self.records: list[EpisodeRecord] = []
        self._set_up()

    def _set_up(self) -> None:
        """Put everything that does not outlive an episode where it starts."""
        self.world = WorldState(self._start_world, self._pheromone)
        self.homes = Homes(self._start_world)
        self.queen.store = 0
        self.record = EpisodeRecord()
        self.over = False
        self.transitions: list[Transition] = []
        self.ants: dict[int, Ant] = {}
        for number, (cell, heading) in enumerate(self._starts):
            self._add(Ant(cell, heading, slot=number, number=number, stream=self.streams[number]))
        for ant in self.ants.values():
            self.look(ant)

    def _add(self, ant: Ant) -> None:
        self.ants[ant.slot] = ant
        self.world.ants[ant.cell] = ant

    def look(self, ant: Ant) -> None:
        """Let an ant see what is around it now."""
        ant.percept = observe(self.world, ant)
        ant.state = self._observation.row(self.world, ant)

    def begin_episode(self) -> None:
        """Start an episode from the world; tables, models, streams and epsilon go on."""
        self.episode += 1
        self._set_up()
        for learner in self.minds.tables:
            learner.begin()

    def end_episode(self) -> EpisodeRecord:
        """End the episode: epsilon decays. Returns its record."""
        decayed = self.epsilon * float(self._training.epsilon_decay)
        self.epsilon = max(float(self._training.min_epsilon), decayed)
        self.records.append(self.record)
        return self.record

    def run_episode(self, ticks: int) -> Iterator[list[Transition]]:
        """Run an episode of so many ticks, fewer where it ends at a delivery.

        Yields:
            The transitions of each tick.
        """
        self.begin_episode()
        while self.record.ticks < ticks and not self.over:
            self.tick(last=self.record.ticks == ticks - 1)
            yield self.transitions
        self.end_episode()

    def run(self, episodes: int, ticks: int) -> list[EpisodeRecord]:
        """Run episodes; see `run_episode`. Returns the records of these episodes."""
        for _ in range(episodes):
            for _ in self.run_episode(ticks):
                pass
        return self.records[len(self.records) - episodes :]

    def tick(self, last: bool = False) -> None:
        """Let one tick pass for all.

        Args:
            last: Whether the episode ends with it.
        """
        if self.episode < 0 or self.over:
            raise AssertionError("there is no episode to go on with; begin one")
        tick = self.record.ticks
        acting = [self.ants[slot] for slot in sorted(self.ants)]
        before = [copy.copy(ant) for ant in acting]
        intents = [intend(self.world, ant, self._choose(ant), self._task.traffic) for ant in acting]
        events = carry_out(self.world, intents, tick, self._task)
        for intent, event in zip(intents, events, strict=True):
            if event is Event.PICKED_UP and intent.target is not None:
                self.homes.taken(intent.target, tick)
        self.world.trail.tick()
        self._count(acting, events)
        self._births(events.count(Event.DELIVERED))
        dying = self._deaths(acting)
        self._food(tick)
        for ant in [*self.ants.values(), *dying]:
            self.look(ant)
        self.over = self._ends_at_delivery and self.record.deliveries > 0
        self._learn(before, acting, events, last or self.over)
        self.record.living_per_tick.append(len(self.ants))
        self.record.ticks += 1

    def _choose(self, ant: Ant) -> int:
        action, ant.chosen = ant.chosen, None
        return self._draw_action(ant) if action is None else action

    def _draw_action(self, ant: Ant) -> int:
        values = self.minds.of(ant.slot).rows[ant.state]
        return choose_action(values, self.epsilon, ant.stream)

    def _count(self, acting: Sequence[Ant], events: Sequence[Event]) -> None:
        record = self.record
        gives = events.count(Event.DELIVERED)
        record.episode_return += sum(ant.reward for ant in acting)
        record.moves += sum(ant.action < PICK_UP for ant in acting)
        record.blocked += sum(
            ant.action < PICK_UP and event in (Event.BLOCKED, Event.PUSHED)
            for ant, event in zip(acting, events, strict=True)
        )
        record.deliveries += gives
        record.deliveries_per_tick.append(gives)
        if gives and record.first_delivery < 0:
            record.first_delivery = record.ticks + 1

    def _births(self, gives: int) -> None:
        if not self._task.life.births:
            return
        self.queen.store += gives
        free_slots = [slot for slot in range(self._slots) if slot not in self.ants]
        # The slots first: where they end, no further place is asked for, and so none is drawn.
        for slot, (cell, heading) in zip(free_slots, self.queen.places(self.world), strict=False):
            number = self._n_ants + self.record.births
            state = stream_state(self._seed, STREAM_BORN, (self.episode << 32) + number)
            self._add(Ant(cell, heading, slot=slot, number=number, stream=RandomStream(state)))
            self.minds.born(slot)
            self.record.births += 1

    def _deaths(self, ants: Sequence[Ant]) -> list[Ant]:
        if self._task.life.lifespan is None:
            return []
        dying = grow_old(self.world, ants, self._task.life.lifespan)
        for ant in dying:
            del self.ants[ant.slot]
        self.record.deaths += len(dying)
        return dying

    def _food(self, tick: int) -> None:
        life = self._task.life
        if life.regrowth is not None:
            self.record.regrown += self.homes.regrow(self.world, life.regrowth, tick)
        if life.wander is not None and (tick + 1) % life.wander == 0:
            self.homes.wander(self.world, self.queen.stream)

    def _learn(
        self, before: Sequence[Ant], after: Sequence[Ant], events: Sequence[Event], last: bool
    ) -> None:
        """Draw a' where the learner wants it, by the tables as they stand; then learn."""
        self.transitions = []
        for was, ant, event in zip(before, after, events, strict=True):
            terminated = event is Event.DELIVERED and self._task.delivery == "absorbing"
            # After an absorbing delivery the ant goes on with a choice of its own.
            if self.minds.draws_next_action and not terminated:
                ant.chosen = self._draw_action(ant)
            self.transitions.append(
                Transition(
                    slot=ant.slot,
                    number=ant.number,
                    episode=self.episode,
                    step=self.record.ticks,
                    cell=was.cell,
                    heading=was.heading,
                    state=was.state,
                    action=ant.action,
                    reward=ant.reward,
                    event=event,
                    next_cell=ant.cell,
                    next_heading=ant.heading,
                    next_state=ant.state,
                    next_action=ant.chosen,
                    terminated=terminated,
                    truncated=(last or ant.slot not in self.ants) and not terminated,
                )
            )
        self.minds.learn(self.transitions, [ant.stream for ant in after], self.epsilon)
        for step, ant in zip(self.transitions, after, strict=True):
            step.rng_state = ant.stream.state

    def snapshot(self) -> Snapshot:
        """Return a copy of all that the colony is between two ticks."""
        tables = np.array([learner.table() for learner in self.minds.tables])
        return Snapshot(
            ants={slot: copy.deepcopy(self.ants[slot]) for slot in sorted(self.ants)},
            ground=dict(self.world.ground),
            levels=self.world.levels(),
            homes=[(home.cell, home.waiting_since) for home in self.homes.homes],
            store=self.queen.store,
            queen_rng_state=self.queen.stream.state,
            q_values=tables if self._sharing == "own" else tables[0],
            models=[
                [(*pair, *seen.outcome) for pair, seen in learner.model.items()]
                for learner in self.minds.tables
            ],
            epsilon=self.epsilon,
            record=copy.deepcopy(self.record),
        )
