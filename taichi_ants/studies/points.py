"""Points: what a study computes for each seed, and the settings that identify it.

A point is a world, a task, a learner, and the lengths of training and evaluation. The outcome of a
run depends only on its point and seed.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from itertools import product
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np

from taichi_ants import __version__, arguments, files, learners, measures
from taichi_ants.errors import AntsError, check_one_of, checked_whole
from taichi_ants.features import COLONY
from taichi_ants.learners import policies
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.measures.series import Recorder, stops
from taichi_ants.protocol import ProtocolEvent, When, check_queen, check_room, checked_protocol
from taichi_ants.settings import flat
from taichi_ants.studies.blocks import Outcome
from taichi_ants.task import Task
from taichi_ants.task.constants import EPISODE_STEPS, EPISODES, MAX_STEPS, N_ACTIONS, ROW
from taichi_ants.worlds.world import World

if TYPE_CHECKING:
    from taichi_ants.engines.colony.colony import Colony, ColonyEpisodes

# Added to the seeds of a colony for its evaluation, so that it shares no random numbers with the
# training.
EVALUATION_SEEDS = 1 << 32
_STEPS_OF_A_BLOCK = 250_000_000  # at most, if every episode of every run uses all its steps
_RUNS_OF_A_BLOCK = 5000  # at most; each needs about 20 KB during training
_NUMBERS_OF_A_BLOCK = 1 << 26  # of four bytes, for colonies, at most, unless one needs more
_WORK_OF_A_BLOCK = 1e8  # ticks of ants, about ten seconds on one thread
_WORK_OF_A_CELL, _WORK_OF_DIFFUSION = 0.02, 0.08  # of a dense field in a tick
_NUMBERS_OF_AN_ANT, _NUMBERS_OF_A_CELL = 13, 4  # upper bounds
_RUN_ARRAYS = ("returns", "steps", "deliveries")
_COLONY_ARRAYS = ("deliveries", "first_delivery", "moves", "blocked", "returns")

DURING = ("evaluation", "training", "both")
SERIES = "series_"  # begins the names of the series of measures in outcomes
# Settings that only the points that use them name, so that the blocks of others stay valid.
_LATER = ("policy", "measures", "measure_every", "evaluation_epsilon")

Progress = Callable[[float], None]


@dataclass(frozen=True)
class RunPoint:
    """A lone ant that is trained and then follows its final policy, or another one, greedily.

    Outcome: `returns`, `steps` and `deliveries` of training, integer (seeds, episodes);
    `greedy_returns`, `greedy_steps` and `greedy_deliveries` of the rollouts, integer (seeds,
    rollouts). With training also `q_values`, float32 (seeds, n_states, 5), and `seconds` of CPU
    time for it, float64 (seeds,).

    Attributes:
        episodes: The number of training episodes; 0 with a policy.
        max_steps: The step limit of episodes and rollouts.
        policy: The policy that the ant follows if there is no training.

    Raises:
        AntsError: A value is not allowed.
    """

    world: World
    task: Task
    training: TrainingConfig
    episodes: int = EPISODES
    max_steps: int = EPISODE_STEPS
    rollouts: int = 50
    policy: FixedPolicy | None = None
    ants: ClassVar[int] = 1
    pool: ClassVar[None] = None
    after: ClassVar[None] = None

    def __post_init__(self) -> None:
        (config,) = arguments.checked_configs(self.training)
        object.__setattr__(self, "training", config)
        arguments.checked_lone_task(self.task)
        _check_policy(self.policy, self.episodes)
        more = "" if self.policy else "; 0 requires a policy"
        checked_whole("episodes", self.episodes, 0 if self.policy else 1, otherwise=more)
        arguments.checked_max_steps(self.max_steps, self.task)
        checked_whole("rollouts", self.rollouts)

    @property
    def alike(self) -> tuple:
        """The settings that all points of a block share."""
        which = self.training.learner, self.training.planning_steps
        lengths = self.episodes, self.max_steps, self.rollouts
        return (self.world, self.task, which, *lengths, self.policy)

    @property
    def runs_of_a_block(self) -> int:
        """The number of runs of a block: many, for speed, but few enough to save often."""
        return min(max(1, _STEPS_OF_A_BLOCK // self.weight), _RUNS_OF_A_BLOCK)

    @property
    def weight(self) -> int:
        """The approximate work of a seed, for progress."""
        return (self.episodes or self.rollouts) * self.max_steps

    @property
    def bytes_of_a_run(self) -> int:
        """The approximate upper bound on the bytes of one seed's outcome on disk."""
        most = self.max_steps * self.task.rewards.largest
        ends = (-most, most), (0, self.max_steps), (0, 1)
        of_an_episode = sum(files.smallest(np.array(one)).itemsize for one in ends)
        numbers = (self.episodes + self.rollouts) * of_an_episode
        return numbers + 4 * self.task.n_states * N_ACTIONS + 8

    @staticmethod
    def do(
        points: Sequence[RunPoint],
        seeds: Sequence[int],
        learned: np.ndarray | None,
        progress: Progress,
        where: Mapping[str, Any],
    ) -> Outcome:
        """Return the outcomes of points of one block: arrays (points, seeds, ...)."""
        from taichi_ants.engines.runs.training import evaluate, train

        first, configs = points[0], [point.training for point in points]
        world, lengths, task = first.world, (first.episodes, first.max_steps), first.task
        shape = len(points), len(seeds)
        if first.policy:
            q_values = np.broadcast_to(
                first.policy.q_values, (*shape, *first.policy.q_values.shape)
            )
            outcome = {name: np.zeros((*shape, 0), np.int32) for name in _RUN_ARRAYS}
        else:
            trained = train(world, configs, seeds, *lengths, task, **where, progress=progress)
            q_values, steps = trained.q_values, trained.steps.sum(axis=2, dtype=float)
            outcome = {name: files.smallest(getattr(trained, name)) for name in _RUN_ARRAYS}
            seconds = trained.seconds * steps / steps.sum()
            outcome |= {"q_values": q_values, "seconds": seconds}
        greedy = evaluate(world, q_values, first.rollouts, seeds, first.max_steps, task, **where)
        of_rollouts = {f"greedy_{name}": getattr(greedy, name) for name in _RUN_ARRAYS}
        return outcome | {name: files.smallest(array) for name, array in of_rollouts.items()}


@dataclass(frozen=True)
class FixedPolicy:
    """A policy that ants follow without learning: its name or file, and its action values."""

    name: str
    sha256: str
    q_values: np.ndarray = field(compare=False, repr=False)

    @classmethod
    def named(cls, name_or_path: str, task: Task) -> FixedPolicy:
        """Return the policy of a name or file (.npz); raises as `policies.frozen_policy` does."""
        q_values = policies.frozen_policy(name_or_path, task.observation)
        return cls(name_or_path, hashlib.sha256(q_values.tobytes()).hexdigest(), q_values)


def _check_policy(policy: FixedPolicy | None, episodes: int) -> None:
    """Raise AntsError if there is a policy, but also training."""
    if policy and episodes:
        raise AntsError(
            f"policy is {policy.name!r}, but episodes is {episodes}; a fixed policy does not "
            "learn, so set episodes = 0."
        )


@dataclass(frozen=True)
class ColonyPoint:
    """A colony that learns, and is then evaluated without learning.

    Outcome: `deliveries`, `first_delivery`, `moves`, `blocked` and `returns` of the evaluation,
    integer (seeds, rollouts), as in `ColonyEpisodes`; `q_values`, float32 (seeds, n_states, 5), if
    ants learned into a shared table. `series_NAME`, float64 (seeds, rollouts, rows), of each
    measure NAME.

    Attributes:
        world: The world, or one for each seed, all of the same ranges.
        pool: Worlds of the same ranges for training; each seed draws one for each episode. None
            means training in `world`.
        sharing: "shared" or "independent" tables during training.
        start, capacity: The arguments of `Colony`.
        episodes: The number of training episodes; with 0, ants follow `policy`, the table of
            `after`, or a rule that needs no table.
        ticks: The length of each episode of training and evaluation.
        after: The point from whose shared table learning starts; None means the initial values.
        policy: The policy that ants follow if there is no training. A task whose ants choose
            without action values has neither.
        evaluation_epsilon: The exploration rate of the evaluation. None: the lowest one of the
            training, or 0 with `policy`.
        measures, measure_every: The arguments `measures` and `every` of `Colony.run` for the
            evaluation, without `Measure` objects.
        protocol: Events with interventions, see `taichi_ants.protocol`.
        during: When they happen: in each episode of the "evaluation", the "training", or "both".

    Raises:
        AntsError: A value is not allowed.
    """

    world: World | tuple[World, ...]
    task: Task
    training: TrainingConfig
    pool: tuple[World, ...] | None = None
    ants: int = 1
    sharing: str = "shared"
    start: str = "nest"
    capacity: int | None = None
    episodes: int = 50
    ticks: int = 1000
    rollouts: int = 4
    after: ColonyPoint | None = None
    policy: FixedPolicy | None = None
    evaluation_epsilon: float | None = None
    measures: tuple[str, ...] = ()
    measure_every: int | None = None
    protocol: tuple[ProtocolEvent, ...] = ()
    during: str = "evaluation"

    def __post_init__(self) -> None:
        (config,) = arguments.checked_configs(self.training)
        object.__setattr__(self, "training", config)
        arguments.checked_task(self.task, "a colony", COLONY)
        arguments.checked_capacity(self.task, self.ants, self.capacity, self.start, False)
        check_one_of("sharing", self.sharing, ("shared", "independent"))
        arguments.check_learner(config, self.task, self.sharing)
        _check_policy(self.policy, self.episodes)
        rule = self.task.choice
        if not rule.needs_table and (self.episodes or self.policy or self.after):
            given = "a policy is given" if self.policy else f"episodes is {self.episodes}"
            raise AntsError(
                f"`task.choice.rule` is {rule.rule!r}, which needs no action values, but {given}; "
                "set episodes = 0 and leave out policy."
            )
        if self.evaluation_epsilon is not None:
            arguments.checked_share("evaluation_epsilon", self.evaluation_epsilon)
            if not rule.needs_table:
                raise AntsError(
                    f"evaluation_epsilon is {self.evaluation_epsilon}, but `task.choice.rule` is "
                    f"{rule.rule!r}, with which ants do not explore; leave it out."
                )
        without_training = self.after or self.policy or not rule.needs_table
        more = "" if without_training else "; 0 requires a policy"
        checked_whole("episodes", self.episodes, 0 if without_training else 1, otherwise=more)
        Recorder(self.measures, self.measure_every)  # raises an error if it cannot read them
        checked_whole("ticks", self.ticks, most=MAX_STEPS)
        checked_whole("rollouts", self.rollouts)
        object.__setattr__(self, "protocol", checked_protocol(self.protocol))
        check_one_of("during", self.during, DURING)
        self._check_protocol()
        if self.after and (self.after.sharing != "shared" or not self.after.episodes):
            raise AntsError(
                "`after` has no shared table; it must be a point with sharing='shared' and at "
                "least one episode."
            )

    def _check_protocol(self) -> None:
        """Raise an AntsError, which names the event, if it can never happen as it should."""
        for learns in (True, False) if self.episodes else (False,):
            events = self.events(learns)
            for check, event in product((self._check_times, self._check_event), events):
                number = [one for one in self.protocol if one.path == event.path].index(event) + 1
                try:
                    check(event, learns)
                except AntsError as error:
                    raise AntsError(
                        f"in [[{event.path}]] number {number}, in the {DURING[learns]}, {error}"
                    ) from error

    def _check_times(self, event: ProtocolEvent, learns: bool) -> None:
        event.times(self.ticks)

    def _check_event(self, event: ProtocolEvent, learns: bool) -> None:
        places = self.pool if learns and self.pool else self.places_of_evaluation
        of, start = self.events(learns), (self.ants, self.capacity, self.start, False)
        capacity = arguments.checked_capacity(self.task, *start)
        check_room(event, of, self.task, self.ants, capacity, self.ticks)
        for one in event.interventions:
            one.check_in(places[0], self.task, learns)
        if isinstance(event, When):
            measures.check_part(event.measure, places[0], self.task, single=True)
        for world in () if places is self.pool else places:  # a pool's worlds are drawn
            check_queen(event, of, world, self.ticks)

    @property
    def places_of_evaluation(self) -> tuple[World, ...]:
        """The worlds of the evaluation: one, or one for each seed."""
        return self.world if isinstance(self.world, tuple) else (self.world,)

    alike = property(lambda self: self)  # each point has its own blocks

    @property
    def runs_of_a_block(self) -> int:
        """The number of seeds of a block, whose colonies run together, as memory allows."""
        if any(isinstance(one, When) and one.in_all_worlds for one in self.protocol):
            return 1  # a condition of one world must not change what all share
        world = self.places_of_evaluation[0]
        slots, states = self.capacity or self.ants, self.task.n_states
        memory = learners.get(self.training.learner).memory_for(self.training, states)
        table = (1 + memory.tables) * states * ROW + memory.floats + memory.integers
        owners = slots if self.sharing == "independent" else 1
        ants, cells = slots * _NUMBERS_OF_AN_ANT, world.grid.size * _NUMBERS_OF_A_CELL
        fits = _NUMBERS_OF_A_BLOCK // (ants + cells + owners * table)
        return max(1, min(fits, int(_WORK_OF_A_BLOCK / self.weight)))

    @property
    def weight(self) -> float:
        """The approximate work of a seed: that of a tick of an ant is 1."""
        world = self.places_of_evaluation[0]
        cells = sum(
            world.grid.size * (_WORK_OF_DIFFUSION if one.diffusion else _WORK_OF_A_CELL)
            for one in (self.task.pheromone, *self.task.fields.values())
            if one.dense
        )
        return (self.ants + cells) * self.ticks * (self.episodes + self.rollouts)

    @property
    def bytes_of_a_run(self) -> int:
        """The approximate upper bound on the bytes of one seed's outcome on disk."""
        rows = len(self.measures) * len(list(stops(self.ticks, self.measure_every)))
        numbers = 8 * (len(_COLONY_ARRAYS) + rows) * self.rollouts
        return numbers + 4 * self.task.n_states * N_ACTIONS

    @property
    def exploration(self) -> float:
        """The exploration rate of the evaluation."""
        if self.evaluation_epsilon is not None:
            return self.evaluation_epsilon
        return 0.0 if self.policy else self.training.least_epsilon

    def events(self, learns: bool) -> tuple[ProtocolEvent, ...]:
        """Return the events of episodes of training or, if not `learns`, of the evaluation."""
        return self.protocol if self.during in ("both", DURING[learns]) else ()

    def places(self, seeds: Sequence[int]) -> list[list[World]] | None:
        """Return the world of each training episode and seed; None without a pool."""
        if self.pool is None:
            return None
        streams = [np.random.default_rng(seed % 2**64) for seed in seeds]
        draws = [stream.integers(len(self.pool), size=self.episodes) for stream in streams]
        return [[self.pool[n] for n in of_episode] for of_episode in np.transpose(draws)]

    def colony(
        self, world: Any, seeds: Sequence[int], q_values: Any, learns: bool, **options: Any
    ) -> Colony:
        """Return the colony of some seeds, for training or (`learns=False`) for evaluation.

        `world`, `q_values` and `options` are arguments of `Colony`.
        """
        from taichi_ants.engines.colony.colony import Colony

        training: TrainingConfig | None = self.training
        if not learns:
            seeds = [seed + EVALUATION_SEEDS for seed in seeds]
            training = TrainingConfig.frozen(self.exploration)
        if not self.task.choice.needs_table:
            training = None
        sharing = self.sharing if learns else "frozen"
        options |= {"ants": self.ants, "capacity": self.capacity, "start": self.start}
        options |= {"sharing": sharing, "q_values": q_values}
        return Colony(world, self.task, training, seeds, **options)

    @staticmethod
    def do(
        points: Sequence[ColonyPoint],
        seeds: Sequence[int],
        learned: np.ndarray | None,
        progress: Progress,
        where: Mapping[str, Any],
    ) -> Outcome:
        """Return the outcome of the one point in `points`, arrays (1, seeds, ...).

        `learned` has the tables of the point `after`, from which learning starts.
        """
        (point,) = points
        share = point.episodes / (point.episodes + point.rollouts)
        tables: Any = point.policy.q_values if point.policy else learned
        if point.episodes:
            places = point.places(seeds)
            learning = point.colony(
                places[0] if places else point.world, seeds, learned, True, **where
            )
            part, protocol = part_of(progress, 0.0, share), point.events(learns=True)
            learning.run(point.episodes, point.ticks, part, places, protocol=protocol)
            tables = learning.q_values
        colony = point.colony(point.world, seeds, tables, False, **where)
        part, protocol = part_of(progress, share, 1 - share), point.events(learns=False)
        episodes = colony.run(
            *(point.rollouts, point.ticks, part),
            measures=point.measures,
            every=point.measure_every,
            protocol=protocol,
        )
        outcome = {name: files.smallest(getattr(episodes, name).T) for name in _COLONY_ARRAYS}
        outcome |= _series_of(episodes, point)
        if point.episodes and point.sharing == "shared":
            outcome["q_values"] = tables
        return {name: array[None] for name, array in outcome.items()}


def _series_of(episodes: ColonyEpisodes, point: ColonyPoint) -> Outcome:
    """Return the series of measures, float64 (seeds, rollouts, rows) by "series_NAME"."""
    series = episodes.series
    if series is None:
        return {}
    for name in series.maps:
        raise AntsError(f"the measure {name!r} is an array; choose measures that give numbers.")
    shape = point.rollouts, -1, len(episodes.seeds)  # all worlds run for all ticks
    return {
        f"{SERIES}{name}": np.moveaxis(values.reshape(shape), -1, 0)
        for name, values in series.values.items()
    }


Point = RunPoint | ColonyPoint
PointKind = TypeVar("PointKind", bound=Point)


def settings_of(points: Sequence[Point], seeds: Sequence[int]) -> dict[str, Any]:
    """Return everything that determines the results of points and seeds, by name.

    Settings that all points share are single values; others are lists with an entry per point.
    """
    points = in_order(points)
    places: list[Any] = [place for one in points for place in (one.world, one.pool) if place]
    worlds = list(dict.fromkeys(places))
    numbers = {one: number for several in (points, worlds) for number, one in enumerate(several)}
    rows = [facts_of(point, lambda name, value: numbers[value]) for point in points]
    names = dict.fromkeys(name for row in rows for name in row)
    columns = {name: [row.get(name) for row in rows] for name in names}
    return {
        "version": __version__,
        "seeds": list(seeds),
        "worlds": [
            [world_facts(one) for one in world] if isinstance(world, tuple) else world_facts(world)
            for world in worlds
        ],
        **{
            name: values[0] if all(one == values[0] for one in values) else values
            for name, values in columns.items()
        },
    }


def facts_of(point: Point, number_of: Callable[[str, Any], Any]) -> dict[str, Any]:
    """Return the settings of a point by name.

    `number_of` gets the name and the value of a world, several worlds or another point, and returns
    what represents it.
    """
    found = {one.name: getattr(point, one.name) for one in fields(point)}
    for name in ("world", "pool", "after"):
        found |= {name: number_of(name, found[name])} if found.get(name) else {}
    protocol, during = found.pop("protocol", ()), found.pop("during", "")
    if protocol:
        found |= {"protocol": [event.facts() for event in protocol], "during": during}
    found = {k: v for k, v in found.items() if k not in _LATER or v not in (None, ())}
    if policy := found.get("policy"):
        found["policy"] = {"name": policy.name, "sha256": policy.sha256}
    return flat({**found, "task": point.task.as_dict(), "training": point.training.as_dict()})


def world_facts(world: World) -> dict[str, Any]:
    """Return the sizes of a world, and a checksum of all of its cells."""
    digest, numbers = hashlib.sha256(), {}
    for name in ("foods", "obstacles", "trails", "ants"):
        array = getattr(world, name)
        numbers[name] = len(array)
        digest.update(repr(array.shape).encode())
        digest.update(array.tobytes())
    for more in (world.other_queens, world.food_kinds):  # empty in most worlds
        digest.update(more.tobytes())
    where = {"ranges": list(world.ranges), "queen": list(world.queen)}
    if world.n_nests > 1:
        where["queens"] = world.queens.tolist()
    return {**where, **numbers, "sha256": digest.hexdigest()}


def in_order(points: Sequence[PointKind]) -> tuple[PointKind, ...]:
    return tuple(dict.fromkeys(one for point in points for one in chain(point)))


def chain(point: Any) -> list[Any]:
    """Return a point after the one that is its `after`, and so on."""
    return [*chain(point.after), point] if point.after is not None else [point]


def part_of(progress: Progress, begin: float, share: float) -> Progress:
    return lambda done: progress(begin + share * done)
