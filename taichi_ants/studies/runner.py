"""Studies: points over seeds, computed in blocks that are saved as they finish.

A point is a world, a task, a learner, and the lengths of training and evaluation. A block is a
group of similar points and seeds. Each finished block is a file, so a stopped study can resume. The
outcome of a run depends only on its point and seed, so the order of blocks does not matter.
"""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, NamedTuple, TypeVar

import numpy as np

from taichi_ants import __version__, checks, files, learners
from taichi_ants.errors import AntsError, check_one_of, checked_whole
from taichi_ants.learners import policies
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.measures.series import Recorder, stops
from taichi_ants.protocol import Event, When, checked_protocol
from taichi_ants.settings import flat
from taichi_ants.studies import blocks
from taichi_ants.studies.blocks import Outcome, kept
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
_NUMBERS_OF_AN_ANT, _NUMBERS_OF_A_CELL = 13, 4  # upper bounds
_RUN_ARRAYS = ("returns", "steps", "deliveries")
_COLONY_ARRAYS = ("deliveries", "first_delivery", "moves", "blocked", "returns")

DURING = ("evaluation", "training", "both")
SERIES = "series_"  # begins the names of the series of measures in outcomes
# Settings that only the points that use them name, so that the blocks of others stay valid.
_LATER = ("policy", "measures", "measure_every")

Progress = Callable[[float], None]


@dataclass(frozen=True)
class RunPoint:
    """A lone ant that is trained and then follows its final policy greedily.

    Outcome: `returns`, `steps` and `deliveries` of training, integer (seeds, episodes);
    `greedy_returns`, `greedy_steps` and `greedy_deliveries` of the rollouts, integer (seeds,
    rollouts); `q_values`, float32 (seeds, n_states, 5); `seconds` of CPU time for training, float64
    (seeds,).

    Attributes:
        max_steps: The step limit of episodes and rollouts.

    Raises:
        AntsError: A value is not allowed.
    """

    world: World
    task: Task
    training: TrainingConfig
    episodes: int = EPISODES
    max_steps: int = EPISODE_STEPS
    rollouts: int = 50
    ants: ClassVar[int] = 1
    pool: ClassVar[None] = None
    after: ClassVar[None] = None

    def __post_init__(self) -> None:
        (config,) = checks.checked_configs(self.training)
        object.__setattr__(self, "training", config)
        checks.checked_runs_task(checks.checked_task(self.task))
        checked_whole("episodes", self.episodes)
        checks.checked_max_steps(self.max_steps, self.task)
        checked_whole("rollouts", self.rollouts)

    @property
    def alike(self) -> tuple:
        """The settings that all points of a block share."""
        which = self.training.learner, self.training.planning_steps
        return (self.world, self.task, which, self.episodes, self.max_steps, self.rollouts)

    @property
    def runs_of_a_block(self) -> int:
        """The number of runs of a block: many, for speed, but few enough to save often."""
        return min(max(1, _STEPS_OF_A_BLOCK // (self.episodes * self.max_steps)), _RUNS_OF_A_BLOCK)

    @property
    def weight(self) -> float:
        """The approximate work of a seed, for progress."""
        return self.episodes * self.max_steps

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
        trained = train(world, configs, seeds, *lengths, task, **where, progress=progress)
        q_values, steps = trained.q_values, trained.steps.sum(axis=2, dtype=float)
        greedy = evaluate(world, q_values, first.rollouts, seeds, first.max_steps, task, **where)
        return {
            **{name: files.smallest(getattr(trained, name)) for name in _RUN_ARRAYS},
            **{f"greedy_{name}": files.smallest(getattr(greedy, name)) for name in _RUN_ARRAYS},
            "q_values": q_values,
            "seconds": trained.seconds * steps / steps.sum(),
        }


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


@dataclass(frozen=True)
class ColonyPoint:
    """A colony that learns, and is then evaluated without learning, with its lowest epsilon.

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
        episodes: The number of training episodes; with 0, ants follow `policy` or the table of
            `after`.
        ticks: The length of each episode of training and evaluation.
        after: The point from whose shared table learning starts; None means the initial values.
        policy: The policy that ants follow if there is no training.
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
    measures: tuple[str, ...] = ()
    measure_every: int | None = None
    protocol: tuple[Event, ...] = ()
    during: str = "evaluation"

    def __post_init__(self) -> None:
        (config,) = checks.checked_configs(self.training)
        object.__setattr__(self, "training", config)
        checks.checked_task(self.task)
        checks.checked_capacity(self.task, self.ants, self.capacity, self.start, False)
        check_one_of("sharing", self.sharing, ("shared", "independent"))
        checks.check_sharing(learners.get(config.learner), self.sharing)
        if self.policy and (self.episodes or self.after):
            raise AntsError(
                f"policy is {self.policy.name!r}, but episodes is {self.episodes}; a fixed policy "
                "does not learn, so set episodes = 0."
            )
        without_training = self.after or self.policy
        more = "" if without_training else "; 0 requires a policy"
        checked_whole("episodes", self.episodes, 0 if without_training else 1, otherwise=more)
        Recorder(self.measures, self.measure_every)  # raises an error if it cannot read them
        checked_whole("ticks", self.ticks, most=MAX_STEPS)
        checked_whole("rollouts", self.rollouts)
        object.__setattr__(self, "protocol", checked_protocol(self.protocol))
        check_one_of("during", self.during, DURING)
        grid = (self.world[0] if isinstance(self.world, tuple) else self.world).grid
        for event in self.protocol:
            event.times(self.ticks)
            for one in event.interventions:
                one.check_in(grid, self.task)
        if self.after and (self.after.sharing != "shared" or not self.after.episodes):
            raise AntsError(
                "`after` has no shared table; it must be a point with sharing='shared' and at "
                "least one episode."
            )

    alike = property(lambda self: self)  # each point has its own blocks

    @property
    def runs_of_a_block(self) -> int:
        """The number of seeds of a block, whose colonies run together, as memory allows."""
        if any(isinstance(one, When) and one.in_all_worlds for one in self.protocol):
            return 1  # a condition of one world must not change what all share
        world = self.world[0] if isinstance(self.world, tuple) else self.world
        slots, states = self.capacity or self.ants, self.task.n_states
        memory = learners.get(self.training.learner).memory_for(self.training, states)
        table = (1 + memory.tables) * states * ROW + memory.floats + memory.integers
        owners = slots if self.sharing == "independent" else 1
        ants, cells = slots * _NUMBERS_OF_AN_ANT, world.grid.size * _NUMBERS_OF_A_CELL
        return max(1, _NUMBERS_OF_A_BLOCK // (ants + cells + owners * table))

    @property
    def weight(self) -> float:
        """The approximate work of a seed, for progress."""
        return self.ants * self.ticks * (self.episodes + self.rollouts)

    @property
    def bytes_of_a_run(self) -> int:
        """The approximate upper bound on the bytes of one seed's outcome on disk."""
        rows = len(self.measures) * len(list(stops(self.ticks, self.measure_every)))
        numbers = 8 * (len(_COLONY_ARRAYS) + rows) * self.rollouts
        return numbers + 4 * self.task.n_states * N_ACTIONS

    def events(self, learns: bool) -> tuple[Event, ...]:
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

        training = self.training
        if not learns:
            training = replace(training, epsilon=training.least_epsilon, epsilon_decay=1.0)
            seeds = [seed + EVALUATION_SEEDS for seed in seeds]
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
            part, protocol = _part(progress, 0.0, share), point.events(learns=True)
            learning.run(point.episodes, point.ticks, part, places, protocol=protocol)
            tables = learning.q_values
        colony = point.colony(point.world, seeds, tables, False, **where)
        part, protocol = _part(progress, share, 1 - share), point.events(learns=False)
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


@dataclass(frozen=True)
class Study(Generic[PointKind]):
    """Points that all run with the same seeds.

    Raises:
        AntsError: A world is too small for the ants, or worlds and seeds differ in number.
    """

    points: tuple[PointKind, ...]
    seeds: tuple[int, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "seeds", checks.checked_seeds(self.seeds))
        if not self.points:
            raise AntsError("`points` is empty; give at least one point.")
        places: Any = dict.fromkeys((one.world, one.pool, one.ants) for one in self.points)
        for world, pool, ants in places:
            several = world if isinstance(world, tuple) else (world,)
            if len(several) not in (1, len(self.seeds)):
                raise AntsError(
                    f"there are {len(several)} worlds for {len(self.seeds)} seeds; give one world, "
                    "or one for each seed."
                )
            starts = [*zip(several, self.seeds, strict=False), *((one, 0) for one in pool or ())]
            for one, seed in starts:
                of_colony = isinstance(self.points[0], ColonyPoint)
                checks.checked_world(one, learns=True, several=of_colony).start(seed, ants)

    @property
    def in_order(self) -> tuple[PointKind, ...]:
        """All points once; a point that is the `after` of another one comes first."""
        return _in_order(self.points)

    def blocks(self) -> Iterator[tuple[slice, slice]]:
        """Yield two slices for each block: that of `in_order`, and that of the seeds."""
        first = 0
        for _, group in itertools.groupby(self.in_order, lambda point: point.alike):
            points = list(group)
            size, end = points[0].runs_of_a_block, first + len(points)
            step, seeds = max(1, size // len(self.seeds)), len(self.seeds)
            for place, at in itertools.product(range(first, end, step), range(0, seeds, size)):
                yield slice(place, min(place + step, end)), slice(at, min(at + size, seeds))
            first = end

    def settings(self) -> dict[str, Any]:
        """Return everything that determines the results; equal settings give equal results."""
        return settings_of(self.points, self.seeds)

    def run(
        self, folder: Path, progress: Progress = lambda share: None, **where: Any
    ) -> dict[PointKind, Outcome]:
        """Return all outcomes; arguments and errors are those of `in_blocks`."""
        order, done = self.in_order, self.in_blocks(folder, progress, **where)
        return {order[place]: outcome for place, outcome in self._joined(done, range(len(order)))}

    def reduced(
        self,
        folder: Path,
        reduce: Callable[[Sequence[PointKind], Sequence[int], Outcome], Outcome],
        progress: Progress = lambda share: None,
        **where: Any,
    ) -> dict[str, np.ndarray]:
        """Return numbers of each run, arrays (points, seeds) by name, without keeping outcomes.

        `reduce` gets points, seeds and outcome of a block and returns these arrays for the block;
        the other arguments and errors are those of `in_blocks`.
        """
        order = self.in_order
        found: dict[str, np.ndarray] = {}
        for some, at, outcome in self.in_blocks(folder, progress, **where):
            for name, array in reduce(order[some], self.seeds[at], outcome).items():
                shape = len(order), len(self.seeds)
                found.setdefault(name, np.empty(shape, array.dtype))[some, at] = array
        if order == self.points:
            return found
        place = {point: number for number, point in enumerate(order)}  # points may repeat
        return {name: array[[place[one] for one in self.points]] for name, array in found.items()}

    def in_blocks(
        self, folder: Path, progress: Progress = lambda share: None, **where: Any
    ) -> Iterator[Block]:
        """Yield all blocks; compute and save those that the folder lacks.

        Args:
            folder: The folder of finished blocks of this study.
            progress: A function that is called with the finished share of the work.
            where: The arguments `threads` and `arch` of `train`.

        Raises:
            AntsError: The disk is too small for all blocks, or an argument is not allowed.
        """
        order, pieces = self.in_order, list(self.blocks())
        # The first point of a block can represent all of them.
        works = [(order[some.start], len(order[some]) * len(self.seeds[at])) for some, at in pieces]
        missing = [work for n, work in enumerate(works) if not _path(folder, n).exists()]
        files.check_room(folder, sum(one.bytes_of_a_run * runs for one, runs in missing))
        begun, total = 0.0, sum(one.weight * runs for one, runs in works)
        # The tables of points that are the `after` of others, a part for each of their blocks.
        befores = {point.after for point in order}
        tables: dict[Any, list[np.ndarray]] = {}
        progress(0.0)
        for number, ((some, at), (first, runs)) in enumerate(zip(pieces, works, strict=True)):
            points, seeds = order[some], self.seeds[at]
            if isinstance(first.world, tuple):  # a block of one point, with a world for each seed
                points = (replace(first, world=first.world[at]),)
            learned = np.concatenate(tables[first.after])[at] if first.after else None
            share = first.weight * runs / total
            part = _part(progress, begun, share)
            do: Any = partial(first.do, points, seeds, learned, part, where)
            outcome = kept(_path(folder, number), settings_of(points, seeds), do)
            if first in befores:
                tables.setdefault(first, []).append(outcome["q_values"][0])
            begun += share
            progress(begun)
            yield Block(some, at, outcome)

    def read(self, folder: Path, points: Iterable[int]) -> Iterator[tuple[int, Outcome]]:
        """Yield outcomes of points from finished blocks, by indices into `in_order`.

        Raises:
            AntsError: A block cannot be read.
        """
        wanted = set(points)
        pieces = (
            Block(some, at, blocks.read(_path(folder, number)))
            for number, (some, at) in enumerate(self.blocks())
            if not wanted.isdisjoint(range(some.start, some.stop))
        )
        return self._joined(pieces, wanted)

    def _joined(
        self, pieces: Iterable[Block], wanted: Container[int]
    ) -> Iterator[tuple[int, Outcome]]:
        """Yield the wanted points as `read` does, each after the block of its last seeds."""
        parts: dict[int, list[Outcome]] = {}
        for some, at, outcome in pieces:
            for place in filter(wanted.__contains__, range(some.start, some.stop)):
                of_point = {name: array[place - some.start] for name, array in outcome.items()}
                parts.setdefault(place, []).append(of_point)
                if at.stop == len(self.seeds):
                    several = parts.pop(place)
                    yield place, {n: np.concatenate([one[n] for one in several]) for n in of_point}


class Block(NamedTuple):
    """Slices of `in_order` and of the seeds, with their outcome (points, seeds, ...)."""

    points: slice
    seeds: slice
    outcome: Outcome


def settings_of(points: Sequence[Point], seeds: Sequence[int]) -> dict[str, Any]:
    """Return everything that determines the results of points and seeds, by name.

    Settings that all points share are single values; others are lists with an entry per point.
    """
    points = _in_order(points)
    places: list[Any] = [place for one in points for place in (one.world, one.pool) if place]
    worlds = list(dict.fromkeys(places))

    def facts(point: Point) -> dict[str, Any]:
        """Return the settings of a point by name, with worlds and other points as indices."""
        found = {one.name: getattr(point, one.name) for one in fields(point)}
        found |= {name: worlds.index(found[name]) for name in ("world", "pool") if found.get(name)}
        found |= {"after": points.index(point.after)} if point.after else {}
        protocol, during = found.pop("protocol", ()), found.pop("during", "")
        if protocol:
            found |= {"protocol": [event.facts() for event in protocol], "during": during}
        found = {name: value for name, value in found.items() if value or name not in _LATER}
        if policy := found.get("policy"):
            found["policy"] = {"name": policy.name, "sha256": policy.sha256}
        return flat({**found, "task": point.task.as_dict(), "training": point.training.as_dict()})

    rows = [facts(point) for point in points]
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


def _in_order(points: Sequence[PointKind]) -> tuple[PointKind, ...]:
    pairs: Any = ((point.after, point) for point in points)
    return tuple(dict.fromkeys(point for pair in pairs for point in pair if point))


def _part(progress: Progress, begin: float, share: float) -> Progress:
    return lambda done: progress(begin + share * done)


def _path(folder: Path, number: int) -> Path:
    return folder / f"{number:06d}.npz"
