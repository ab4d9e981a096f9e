"""The simulator of the reference: a colony of ants in one world, tick by tick."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from taichi_ants.features.support import COLONY, refuse_unsupported
from taichi_ants.grid.constants import N_HEADINGS, STREAM_ANT, STREAM_BORN, STREAM_QUEEN
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.policies import frozen_policy
from taichi_ants.reference.actions import Intent, carry_out, intend
from taichi_ants.reference.ants import Ant, Transition, nest_of, starts
from taichi_ants.reference.features import castes, hooks
from taichi_ants.reference.features.choice import choose
from taichi_ants.reference.food_sources import FoodSources
from taichi_ants.reference.geometry import Cell, kinds_of_food, neighbour, queens_of
from taichi_ants.reference.learners import LEARNERS, learn_together
from taichi_ants.reference.observations import OBSERVATIONS, codes_in_view, observe, yours
from taichi_ants.reference.own_rules import choose_by_rule, pay
from taichi_ants.reference.random_stream import RandomStream, pick, stream_state
from taichi_ants.reference.world_state import WorldState
from taichi_ants.task import Caste, Task
from taichi_ants.task.constants import EMPTY, FOOD, GIVE, PICK_UP, Event
from taichi_ants.worlds.world import World


@dataclass
class EpisodeRecord:
    """Sums over all ants of an episode so far."""

    episode_return: int = 0
    ticks: int = 0
    deliveries: int = 0
    moves: int = 0  # attempted
    blocked: int = 0  # moves that failed
    carried: int = 0  # ticks from the pick-up to the delivery, of all delivered loads
    first_delivery: int = -1  # number of ticks up to the first delivery; -1 if there is none
    births: int = 0
    deaths: int = 0
    regrown: int = 0
    delivered: Counter[tuple[int, int]] = field(default_factory=Counter)  # by nest, kind of food
    by_caste: Counter[int] = field(default_factory=Counter)


class ReferenceColony:
    """A colony in one world. An episode is `begin_episode`, calls of `tick`, and `end_episode`.

    The arguments are those of `Colony`, which checks them. If ants have independent tables, a
    newborn ant starts with the initial value, not with `q_values`.

    >>> plain = reference.ReferenceColony(worlds.paper(), Task(), config, seed=0)
    >>> plain.begin_episode()
    >>> plain.tick()
    >>> plain.end_episode()
    >>> plain.q_values.shape
    (128, 5)
    """

    def __init__(
        self,
        world: World,
        task: Task | None,
        training: TrainingConfig | None,
        seed: int,
        ants: int = 1,
        capacity: int | None = None,
        start: str = "nest",
        ends_at_delivery: bool = False,
        sharing: str = "shared",
        q_values: np.ndarray | None = None,
    ) -> None:
        self.task = task = task or Task()
        refuse_unsupported("the reference", task.uses(), COLONY)
        if training is None:  # ants choose without action values
            training = TrainingConfig("q_learning", 1.0, 1.0, 0.0, 1.0)
        self._row = OBSERVATIONS.get(task.observation) or partial(yours, task.sees)
        self._turns = task.sees.cells  # in the order in which ants may misread them
        self.start_world, self.training = world, training
        self._ends_at_delivery = ends_at_delivery
        self.n_ants = ants  # at the start of an episode
        self.slots = capacity or (2 * ants + 64 if task.life.births else ants)
        self.seed, self.start = seed, start
        self.sharing, self.learns = sharing, sharing != "frozen"
        # Both continue through all episodes; wandering food uses the queen's stream, too.
        self.streams = [RandomStream(stream_state(seed, STREAM_ANT, n)) for n in range(ants)]
        self.queen_stream = RandomStream(stream_state(seed, STREAM_QUEEN, 0))
        self._make = partial(LEARNERS[training.learner], training, task.n_states)
        n = self.slots if sharing == "independent" else len(queens_of(world)) * len(self.castes)
        tables = [q_values] * n
        if q_values is not None and q_values.ndim > 2:
            tables = list(q_values.reshape(n, *q_values.shape[-2:]))
        for number in range(n if sharing != "independent" else 0):
            if (policy := self.castes[number % len(self.castes)].policy) is not None:
                tables[number] = frozen_policy(policy, task.observation)
        # One for each slot if they are independent, else for each nest and caste.
        self.learners = [self._make(table) for table in tables]
        self.epsilon, self.learning_rate = training.epsilon, training.learning_rate  # now
        self.episode = -1  # before the first
        self.records: list[EpisodeRecord] = []  # of the finished episodes
        self._set_up()

    @property
    def castes(self) -> list[Caste]:
        """The castes of the task, or one without settings."""
        return list(self.task.castes.values()) or [castes.ONE]

    def table_of(self, ant: Ant | Transition) -> int:
        if self.sharing == "independent":
            return ant.slot
        return ant.nest * len(self.castes) + ant.caste

    def _set_up(self) -> None:
        """Reset everything that lasts for one episode."""
        self.world = WorldState(self.start_world, self.task, self.learns)
        for cell, kind in kinds_of_food(self.start_world).items():
            self.fill(cell, kind)
        self.food_sources = FoodSources(self.start_world)
        self.stores = [0] * len(self.world.queens)  # food that each queen will turn into ants
        self.next_number = self.n_ants  # of the next ant that is added
        self.record = EpisodeRecord()
        self.over = False  # whether a delivery has ended the episode, so that no tick follows
        self.transitions: list[Transition] = []  # of the ants that acted in the last tick, by slot
        self.ants: dict[int, Ant] = {}  # the living ants by slot
        begin = starts(self.start_world, self.seed, self.n_ants, self.start)
        nests = [nest_of(self.start_world, number) for number in range(self.n_ants)]
        self.starting = Counter(nests)  # ants at the start by nest
        left = [
            castes.castes_at_start(self.castes, nest, self.starting[nest])
            for nest in range(len(self.world.queens))
        ]
        for number, (cell, heading) in enumerate(begin):
            nest, stream = nests[number], self.streams[number]
            caste = left[nest].pop(0)
            self.add(Ant(cell, heading, False, number, number, stream, nest=nest, caste=caste))
        for ant in self.ants.values():
            self.observe(ant)

    def fill(self, cell: Cell, kind: int) -> int:
        """Fill a cell with food of a kind; return the number of loads."""
        self.world.ground[cell], n = FOOD, 1
        for filled in hooks(self.task, "filled"):
            n = filled(self, cell, kind, n)
        return n

    def add(self, ant: Ant) -> None:
        """Put an ant into its slot and onto its cell."""
        ant.trait = castes.draw_trait(self.seed, ant.number)
        for born in hooks(self.task, "born"):
            born(self, ant)
        self.ants[ant.slot] = ant
        self.world.ants[ant.cell] = ant

    @property
    def q_values(self) -> np.ndarray:
        """A copy of the table, float32 (n_states, 5), or of all tables, (slots, n_states, 5)."""
        tables = np.array([learner.rows for learner in self.learners], np.float32)
        if self.sharing == "independent":
            return tables
        axes = [n for n in (len(self.world.queens), len(self.castes)) if n > 1]
        return tables.reshape(*axes, *tables.shape[1:])

    def observe(self, ant: Ant) -> None:
        """Update the paper's state and the state index of an ant, which may misread cells."""
        ant.paper_state, ant.misread = observe(self.world, ant), {}
        sees = hooks(self.task, "see") if self.episode >= 0 else []  # not before the first episode
        codes = codes_in_view(self.world, ant, self._turns)
        for turn, code in zip(self._turns, codes, strict=True):
            seen = code
            for see in sees:
                seen = see(self, ant, seen)
            if seen != code:
                ant.misread[turn] = seen
        ant.state = self._row(self.world, ant)

    def begin_episode(self, world: World | None = None) -> None:
        """Start an episode, in another world if one is given; the ants keep what they learned."""
        self.start_world = world or self.start_world
        self.episode += 1
        self._set_up()
        for learner in self.learners:
            learner.begin()

    def end_episode(self) -> None:
        """End the episode: epsilon and the learning rate decay."""
        training = self.training
        least = min(training.min_epsilon, training.epsilon)  # the bound never raises epsilon
        self.epsilon = max(least, self.epsilon * training.epsilon_decay)
        least = min(training.min_learning_rate, training.learning_rate)
        self.learning_rate = max(least, self.learning_rate * training.learning_rate_decay)
        self.records.append(self.record)

    def tick(self, last: bool = False) -> None:
        """Advance the colony by one tick, after which the episode ends if `last`."""
        assert self.episode >= 0
        assert not self.over
        tick = self.record.ticks
        acting = [self.ants[slot] for slot in sorted(self.ants)]
        before = [replace(ant) for ant in acting]
        intents = []
        for ant in acting:
            if self._any("choose", ant):
                ant.action, ant.chosen = -1, None
                intents.append(Intent(ant, GIVE, rests=True))
                continue
            ant.action = self._draw_action(ant, tick) if ant.chosen is None else ant.chosen
            ant.chosen = None
            action = ant.action
            for execute in hooks(self.task, "execute"):
                action = execute(self, ant, action)
            intents.append(intend(self.world, ant, action, self.task.traffic))
        carry_out(self, intents, tick)
        for intent in intents:
            picked = intent.target if intent.ant.event is Event.PICKED_UP else None
            if picked is not None and self.world.ground[picked] == EMPTY:  # its last load
                self.food_sources.taken(picked, tick)
        for trail in self.world.pheromones.values():
            trail.tick(tick)
        self._count(before, acting)
        for nest in range(len(self.stores)):
            self._births(nest)
        dying = self._deaths(acting)
        life = self.task.life
        self.record.regrown += self.food_sources.regrow(self, tick)
        if life.pile_move_interval is not None and (tick + 1) % life.pile_move_interval == 0:
            self.food_sources.move_piles(self.world, self.queen_stream)
        pairs = zip(before, acting, intents, strict=True)
        foragers = [(was, ant) for was, ant, intent in pairs if not intent.rests]
        stopping = {ant.slot for _, ant in foragers if self._any("acted", ant)}
        for ant in [*self.ants.values(), *dying]:
            self.observe(ant)
        if self.task.own_reward is not None:
            for was, ant in foragers:
                paid = pay(self.world, was, ant, self.task.own_reward, self.task, tick)
                self.record.episode_return += paid - ant.reward
                ant.reward = paid
        self.over = self._ends_at_delivery and self.record.deliveries > 0
        self._learn(foragers, stopping, last or self.over)
        for _, ant in foragers:
            if ant.slot in stopping:
                ant.chosen = None
                for stopped in hooks(self.task, "stopped"):
                    stopped(self, ant)
                if self.sharing == "independent":
                    self.learners[ant.slot].begin()
        for nest in range(len(self.stores)):
            for tick_ended in hooks(self.task, "tick_ended"):
                tick_ended(self, nest)
        self.record.ticks += 1

    def _any(self, point: str, ant: Ant) -> bool:
        """Return whether a hook of a point returns true for an ant; all hooks run."""
        results = [hook(self, ant) for hook in hooks(self.task, point)]
        return any(results)

    def _draw_action(self, ant: Ant, tick: int) -> int:
        choice = self.task.choice
        values = self.learners[self.table_of(ant)].rows[ant.state] if choice.needs_table else []
        epsilon = castes.epsilon_of(self.castes[ant.caste], ant, self.epsilon)
        if choice.own_rule is not None:
            return choose_by_rule(self.world, ant, self.task, values, epsilon, tick)
        return choose(self.world, ant, self.task, values, epsilon)

    def _count(self, before: Sequence[Ant], acting: Sequence[Ant]) -> None:
        """Record what happened in the tick, and store and use what each nest got."""
        record, task = self.record, self.task
        record.episode_return += sum(ant.reward for ant in acting)
        moving = [ant for ant in acting if 0 <= ant.executed < PICK_UP]
        record.moves += len(moving)
        record.blocked += sum(ant.event in (Event.BLOCKED, Event.PUSHED) for ant in moving)
        fed = [0] * len(self.stores)
        for was, ant in zip(before, acting, strict=True):
            if ant.event is Event.DELIVERED:
                record.deliveries += 1
                record.carried += was.carried
                record.delivered[ant.nest, ant.own["kind"]] += 1
                record.by_caste[ant.caste] += 1
                fed[ant.nest] += 1
                for gave in hooks(task, "gave"):
                    gave(self, ant)
        if record.deliveries and record.first_delivery < 0:
            record.first_delivery = record.ticks + 1
        for nest, n in enumerate(fed):
            for delivered in hooks(task, "delivered"):
                delivered(self, nest, n)
            self.stores[nest] += n * task.life.births

    def _births(self, nest: int) -> None:
        """Turn stored food into ants that face away from their queen, while there is room."""
        queen = self.world.queens[nest]
        free_slots = (slot for slot in range(self.slots) if slot not in self.ants)
        while self.stores[nest] > 0:
            around = [neighbour(queen, heading) for heading in range(N_HEADINGS)]
            free = [h for h in range(N_HEADINGS) if self.world.content(around[h]) == EMPTY]
            slot = next(free_slots, None)
            if slot is None or not free:
                return
            heading = free[pick(self.queen_stream.draw()[0], len(free))]
            caste = castes.draw_caste(self.castes, nest, self.starting[nest], self.queen_stream)
            self.new_ant(around[heading], heading, slot, nest, caste)
            self.stores[nest] -= 1
            self.record.births += 1

    def new_ant(self, cell: Cell, heading: int, slot: int, nest: int = 0, caste: int = 0) -> None:
        number = self.next_number
        stream = RandomStream(stream_state(self.seed, STREAM_BORN, (self.episode << 32) + number))
        ant = Ant(cell, heading, slot=slot, number=number, stream=stream, nest=nest, caste=caste)
        self.add(ant)
        if self.sharing == "independent":
            self.learners[slot] = self._make(None)  # the initial value, and no memory
        self.next_number += 1

    def _deaths(self, acting: Sequence[Ant]) -> list[Ant]:
        """Remove and return the ants that die, which still observe and learn in this tick.

        A dying ant leaves its food on its cell.
        """
        dying = [ant for ant in acting if self._any("aged", ant)]
        for ant in dying:
            del self.world.ants[ant.cell]
            if ant.carries:
                self.world.ground[ant.cell] = FOOD
                for dropped in hooks(self.task, "dropped"):
                    dropped(self, ant, ant.cell)
            del self.ants[ant.slot]
        self.record.deaths += len(dying)
        return dying

    def _learn(self, pairs: Sequence[tuple[Ant, Ant]], stopping: set[int], last: bool) -> None:
        """Draw the next actions if the learner needs them, by the present tables; then learn.

        `pairs` has each forager before and after the tick.
        """
        self.transitions = []
        members: dict[int, list[tuple[Ant, Transition]]] = defaultdict(list)
        same = ("slot", "number", "action", "executed", "reward", "event", "nest", "caste")
        for was, ant in pairs:
            terminated = ant.event is Event.DELIVERED and self.task.delivery == "terminates"
            number, follows = self.table_of(ant), self.castes[ant.caste].policy is not None
            learns = self.learns and not (follows and self.sharing == "shared")
            # After a delivery that terminates, the ant chooses at the start of its next tick.
            if learns and self.learners[number].draws_next_action and not terminated:
                ant.chosen = self._draw_action(ant, self.record.ticks + 1)
            stops = last or ant.slot not in self.ants or ant.slot in stopping
            step = Transition(
                **{name: getattr(ant, name) for name in same},
                **{name: getattr(was, name) for name in ("cell", "heading", "state")},
                episode=self.episode,
                step=self.record.ticks,
                next_state=ant.state,
                next_action=ant.chosen,
                terminated=terminated,
                truncated=stops and not terminated,
            )
            self.transitions.append(step)
            if learns:
                members[number].append((ant, step))
        for number, of_table in members.items():
            learner, caste = self.learners[number], self.castes[of_table[0][0].caste]
            rate, discount = caste.learning_rate, caste.discount
            learner.learning_rate = np.float32(self.learning_rate if rate is None else rate)
            learner.discount = np.float32(self.training.discount if discount is None else discount)
            epsilon = self.epsilon if caste.epsilon is None else caste.epsilon
            steps, streams = [step for _, step in of_table], [ant.stream for ant, _ in of_table]
            if self.sharing == "independent":
                steps[0].td_error = learner.learn(steps[0], epsilon, streams[0])
            else:
                learn_together(learner, steps, streams, epsilon, self.slots)
