"""Studies: points over seeds, computed in blocks that are saved as they finish.

A point is a world, a task, a learner, and the lengths of training and evaluation. A block is a
group of similar points and seeds. Each finished block is a file, so a stopped study can resume. The
outcome of a run depends only on its point and seed, so the order of blocks does not matter.
"""

from __future__ import annotations

import copy
import hashlib
import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, NamedTuple, TypeVar

import numpy as np

from taichi_ants import __version__, checks, files, learners
from taichi_ants.errors import AntsError, check_one_of, checked_whole, count, shown
from taichi_ants.learners import policies
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.measures.series import Recorder, stops
from taichi_ants.protocol import Event, When, checked_protocol
from taichi_ants.settings import flat
from taichi_ants.studies.blocks import Blocks, Outcome
from taichi_ants.studies.executors import Executor, Plugin, Reduce, Work, completed
from taichi_ants.studies.interruption import stop_if_noted
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
_HOPELESS = 3  # blocks that fail, and none that succeeds: a study stops
_NAMED = 3  # failed blocks, at most, in a message
_RUN_ARRAYS = ("returns", "steps", "deliveries")
_COLONY_ARRAYS = ("deliveries", "first_delivery", "moves", "blocked", "returns")

DURING = ("evaluation", "training", "both")
SERIES = "series_"  # begins the names of the series of measures in outcomes
VALUE = "value_"  # begins the names of numbers of runs in outcomes, which functions `Reduce` make
# Settings that only the points that use them name, so that the blocks of others stay valid.
_LATER = ("policy", "measures", "measure_every")

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
        (config,) = checks.checked_configs(self.training)
        object.__setattr__(self, "training", config)
        checks.checked_runs_task(checks.checked_task(self.task))
        _check_policy(self.policy, self.episodes)
        more = "" if self.policy else "; 0 requires a policy"
        checked_whole("episodes", self.episodes, 0 if self.policy else 1, otherwise=more)
        checks.checked_max_steps(self.max_steps, self.task)
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
        episodes: The number of training episodes; with 0, ants follow `policy`, the table of
            `after`, or a rule that needs no table.
        ticks: The length of each episode of training and evaluation.
        after: The point from whose shared table learning starts; None means the initial values.
        policy: The policy that ants follow if there is no training. A task whose ants choose
            without action values has neither.
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
        _check_policy(self.policy, self.episodes)
        rule = self.task.choice
        if not rule.needs_table and (self.episodes or self.policy or self.after):
            given = "a policy is given" if self.policy else f"episodes is {self.episodes}"
            raise AntsError(
                f"`task.choice.rule` is {rule.rule!r}, which needs no action values, but {given}; "
                "set episodes = 0 and leave out policy."
            )
        without_training = self.after or self.policy or not rule.needs_table
        more = "" if without_training else "; 0 requires a policy"
        checked_whole("episodes", self.episodes, 0 if without_training else 1, otherwise=more)
        Recorder(self.measures, self.measure_every)  # raises an error if it cannot read them
        checked_whole("ticks", self.ticks, most=MAX_STEPS)
        checked_whole("rollouts", self.rollouts)
        object.__setattr__(self, "protocol", checked_protocol(self.protocol))
        check_one_of("during", self.during, DURING)
        world = self.world[0] if isinstance(self.world, tuple) else self.world
        for event in self.protocol:
            event.times(self.ticks)
            for one in event.interventions:
                one.check_in(world, self.task)
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
        fits = _NUMBERS_OF_A_BLOCK // (ants + cells + owners * table)
        return max(1, min(fits, int(_WORK_OF_A_BLOCK / self.weight)))

    @property
    def weight(self) -> float:
        """The approximate work of a seed: that of a tick of an ant is 1."""
        world = self.world[0] if isinstance(self.world, tuple) else self.world
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

        training: TrainingConfig | None = self.training
        if not self.task.choice.needs_table:
            training = None
        elif not learns:
            training = replace(
                self.training, epsilon=self.training.least_epsilon, epsilon_decay=1.0
            )
        if not learns:
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

    @cached_property
    def in_order(self) -> tuple[PointKind, ...]:
        """All points once; a point that is the `after` of another one comes first."""
        return _in_order(self.points)

    def blocks(self, missing: np.ndarray | None = None) -> Iterator[Piece]:
        """Yield the blocks of the runs that are True in `missing`, bool (points, seeds), or of all.

        The points are those of `in_order`.
        """
        order = self.in_order
        runs = np.ones((len(order), len(self.seeds)), bool) if missing is None else missing
        places = np.flatnonzero(runs.any(axis=1)).tolist()
        for _, group in itertools.groupby(
            places, lambda place: (order[place].alike, runs[place].tobytes())
        ):
            some = list(group)
            at, size = np.flatnonzero(runs[some[0]]).tolist(), order[some[0]].runs_of_a_block
            step = max(1, size // len(at))
            for p, s in itertools.product(range(0, len(some), step), range(0, len(at), size)):
                yield Piece(tuple(some[p : p + step]), tuple(at[s : s + size]))

    def settings(self) -> dict[str, Any]:
        """Return everything that determines the results; equal settings give equal results."""
        return settings_of(self.points, self.seeds)

    @cached_property
    def keys(self) -> tuple[str, ...]:
        """For each point of `in_order`, a checksum of all that determines its outcomes.

        If there is a world for each seed, the names of seeds contain its checksum instead.
        """
        known: dict[Any, Any] = {}  # by worlds and points

        def number_of(name: str, value: Any) -> Any:
            if value not in known:
                several = value if isinstance(value, tuple) else (value,)
                known[value] = [world_facts(one) for one in several]
            return None if name == "world" and isinstance(value, tuple) else known[value]

        for point in self.in_order:
            facts = {"version": __version__, **_facts_of(point, number_of)}
            known[point] = hashlib.sha256(files.to_json(facts).encode()).hexdigest()[:32]
        return tuple(known[point] for point in self.in_order)

    @cached_property
    def names(self) -> tuple[tuple[str, ...], ...]:
        """For each point of `in_order`, the names of the seeds, with the worlds of each seed."""
        known: dict[Any, tuple[str, ...]] = {}
        for point in self.in_order:
            worlds = tuple(one.world for one in _chain(point) if isinstance(one.world, tuple))
            if worlds not in known:
                sums = [[world_facts(one)["sha256"] for one in several] for several in worlds]
                parts = zip(map(str, self.seeds), *sums, strict=True)
                known[worlds] = tuple("@".join(one) for one in parts)
            known[point] = known[worlds]
        return tuple(known[point] for point in self.in_order)

    def runs(self, shard: tuple[int, int] = (1, 1)) -> dict[str, Any]:
        """Return what identifies the runs of a shard, for manifests.

        Returns:
            `points`: the `keys`. `seeds`: lists of names of seeds. `seeds_of`: for each point, the
            index of its list. `weights`: for each point, the work of a seed. `rows`: for each of
            `Study.points`, its index. `shard`: for each point, the range of its seeds.
        """
        place = {point: n for n, point in enumerate(self.in_order)}
        lists = {names: n for n, names in enumerate(dict.fromkeys(self.names))}
        share = [np.flatnonzero(row) for row in self.share(*shard)]
        return {
            "points": self.keys,
            "seeds": list(lists),
            "seeds_of": [lists[names] for names in self.names],
            "weights": self.weights[:, 0],
            "rows": [place[point] for point in self.points],
            "shard": [[int(at[0]), int(at[-1]) + 1] if len(at) else [0, 0] for at in share],
        }

    @cached_property
    def weights(self) -> np.ndarray:
        """The approximate work of each run, float64 (points of `in_order`, seeds)."""
        several = np.array([[float(one.weight)] for one in self.in_order])
        return np.broadcast_to(several, (len(several), len(self.seeds)))

    def share(self, number: int, shards: int) -> np.ndarray:
        """Return the runs of one of several shards with equal work, bool as `weights`.

        `number` is from 1 to `shards`. Points that start from the table of another one are in the
        same shard as that one.
        """
        if shards == 1:
            return np.ones(self.weights.shape, bool)
        roots = [_chain(one)[0] for one in self.in_order]
        families = {root: n for n, root in enumerate(dict.fromkeys(roots))}
        of_point = np.array([families[root] for root in roots])
        weights = np.zeros((len(families), len(self.seeds)))
        np.add.at(weights, of_point, self.weights)
        middle = weights.cumsum().reshape(weights.shape) - weights / 2
        return (np.floor(middle / weights.sum() * shards) == number - 1)[of_point]

    def run(
        self, folder: Path, progress: Progress = lambda share: None, **how: Any
    ) -> dict[PointKind, Outcome]:
        """Return all outcomes, or none of a shard; arguments and errors as of `in_blocks`."""
        for _ in self.in_blocks(folder, progress, **how):
            pass
        order, is_whole = self.in_order, how.get("shard", (1, 1))[1] == 1
        places = range(len(order)) if is_whole else ()
        return {order[place]: outcome for place, outcome in self.read(folder, places)}

    def reduced(
        self,
        folder: Path,
        reduce: Reduce,
        progress: Progress = lambda share: None,
        each: Callable[[Block], None] = lambda block: None,
        **how: Any,
    ) -> dict[str, np.ndarray]:
        """Return the `VALUE` arrays of all runs (points, seeds), by their names without `VALUE`.

        `each` is called with each block; the other arguments and errors are those of `in_blocks`.
        """
        order = self.in_order
        found: dict[str, np.ndarray] = {}
        for block in self.in_blocks(folder, progress, reduce=reduce, **how):
            for name, array in values_in(block.outcome).items():
                shape = len(order), len(self.seeds)
                of_all = found.setdefault(name, np.empty(shape, array.dtype))
                of_all[np.ix_(block.points, block.seeds)] = array
            each(block)
        if order == self.points:
            return found
        place = {point: number for number, point in enumerate(order)}  # points may repeat
        return {name: array[[place[one] for one in self.points]] for name, array in found.items()}

    def in_blocks(
        self,
        folder: Path,
        progress: Progress = lambda share: None,
        shard: tuple[int, int] = (1, 1),
        **how: Any,
    ) -> Iterator[Block]:
        """Yield all blocks in any order; compute and save those that the folder lacks.

        Args:
            folder: The folder of finished blocks of this study.
            progress: A function that is called with the finished share of the work.
            shard: The arguments of `share`; only this part of the study is computed.
            how: See `_computed`, whose errors are raised.
        """
        saved, wanted = Blocks(folder), self.share(*shard)
        missing, total = wanted.copy(), self.weights[wanted].sum()
        progress(0.0)
        for block in self._saved(saved):
            at = np.ix_(block.points, block.seeds)
            if missing[at].any():
                missing[at] = False
                progress(1.0 - self.weights[missing].sum() / total)
                yield block
        yield from self._computed(saved, missing, total, progress, **how)

    def complete(
        self,
        folder: Path,
        runs: np.ndarray,
        array: str,
        progress: Progress = lambda share: None,
        shard: tuple[int, int] = (1, 1),
        **how: Any,
    ) -> None:
        """Compute and save the runs, bool as `weights`, for which the folder lacks an array.

        The other arguments are those of `in_blocks`.
        """
        saved = Blocks(folder)
        missing = runs & self.share(*shard) & ~self._has(saved, array)
        total = max(self.weights[missing].sum(), 1.0)
        for _ in self._computed(saved, missing, total, progress, **how):
            pass

    def _has(self, saved: Blocks, array: str) -> np.ndarray:
        """Return whether there is a block with an array for each run, bool as `weights`."""
        rows = zip(self.keys, self.names, strict=True)
        return np.array([[saved.has(key, name, array) for name in names] for key, names in rows])

    def _computed(
        self,
        saved: Blocks,
        missing: np.ndarray,
        total: float,
        progress: Progress,
        *,
        reduce: Reduce | None = None,
        bytes_of_a_run: Callable[[Any], int] = lambda point: point.bytes_of_a_run,
        executor: Executor | None = None,
        in_flight: int | None = None,
        plugins: Sequence[Plugin] = (),
        **where: Any,
    ) -> Iterator[Block]:
        """Yield blocks of the missing runs, after they were computed and saved.

        Args:
            saved: The finished blocks.
            missing: The runs to compute, bool as `weights`.
            total: The work from which `progress` counts.
            progress: See `in_blocks`.
            reduce: What is saved of an outcome, see `Work`; None means all of it.
            bytes_of_a_run: The upper bound on the bytes of a run of a point on disk.
            executor: The executor that computes blocks, see `studies.executors`; None computes them
                in this process.
            in_flight: The number of blocks that the executor has at the same time; None means
                twice the number of its workers.
            plugins: The plugins that the workers of the executor need.
            where: The arguments `threads` and `arch` of `train`.

        Raises:
            AntsError: The disk is too small for all blocks, or an argument is not allowed.
            FailedBlocksError: Some blocks cannot be computed; the others are finished.
        """
        order, weights = self.in_order, self.weights
        place_of: dict[Any, int] = {point: place for place, point in enumerate(order)}
        after = [place_of.get(point.after, -1) for point in order]
        for place in reversed(range(len(order))):  # those that need the tables of another point
            if (a := after[place]) >= 0 and missing[place].any():
                lacks = [not saved.has(self.keys[a], n, "q_values") for n in self.names[a]]
                missing[a] |= missing[place] & lacks
        needed = zip(map(bytes_of_a_run, order), missing.sum(axis=1).tolist(), strict=True)
        files.check_room(saved.folder, sum(size * runs for size, runs in needed))
        failed: dict[Piece, Exception] = {}
        succeeded = not missing.all()

        left = weights[missing].sum()

        def show(more: float = 0.0) -> None:
            progress(1.0 - (left - more) / total)

        def here(pieces: Iterable[Piece]) -> Iterator[tuple[Piece, Outcome | Exception]]:
            for piece in pieces:
                work = self._work(piece, saved, reduce, where)
                try:
                    yield piece, work.do(_part(show, 0.0, weights[np.ix_(*piece)].sum()))
                except Exception as error:
                    stop_if_noted()
                    yield piece, error

        depths = np.array([[len(_chain(one))] for one in order])
        for depth in range(1, depths.max() + 1):
            ready = missing & (depths == depth)
            for place, a in enumerate(after):
                ready[place] &= (a < 0) | ~missing[a]
            if executor is None:
                found = here(self.blocks(ready))
            else:
                work_of = partial(self._work, saved=saved, reduce=reduce, where=where)
                found = completed(self.blocks(ready), work_of, executor, in_flight, plugins)
            for piece, outcome in found:
                if isinstance(outcome, Exception):
                    failed[piece] = outcome
                    if not succeeded and len(failed) == _HOPELESS:
                        break
                    continue
                keys = [self.keys[place] for place in piece.points]
                names = self.names[piece.points[0]]
                saved.add(keys, [names[s] for s in piece.seeds], outcome)
                missing[np.ix_(*piece)], succeeded = False, True
                left -= weights[np.ix_(*piece)].sum()
                show()
                yield Block(*piece, outcome)
            if failed and not succeeded:
                raise next(iter(failed.values()))
        if failed:
            raise self._failure(failed)

    def _saved(self, saved: Blocks) -> Iterator[Block]:
        """Yield the finished blocks of this study."""
        place_of = {key: place for place, key in enumerate(self.keys)}
        for keys, names, outcome in saved:
            rows = [row for row, key in enumerate(keys) if key in place_of]
            if not rows:
                continue
            places = tuple(place_of[keys[row]] for row in rows)
            own = {name: s for s, name in enumerate(self.names[places[0]])}
            columns = [column for column, name in enumerate(names) if name in own]
            at = tuple(own[names[column]] for column in columns)
            if len(rows) < len(keys) or len(columns) < len(names):
                outcome = {n: array[np.ix_(rows, columns)] for n, array in outcome.items()}
            if at:
                yield Block(places, at, outcome)

    def _work(
        self, piece: Piece, saved: Blocks, reduce: Reduce | None, where: Mapping[str, Any]
    ) -> Work:
        """Return the work of a block; AntsError if the tables of `after` cannot be read."""
        points: list[Any] = [self.in_order[place] for place in piece.points]
        seeds, learned = tuple(self.seeds[s] for s in piece.seeds), None
        if isinstance(points[0].world, tuple):  # a block of one point, with a world for each seed
            own = points[0].world
            points = [replace(points[0], world=tuple(own[s] for s in piece.seeds))]
        if points[0].after is not None:
            place = self.in_order.index(points[0].after)
            names = [self.names[place][s] for s in piece.seeds]
            learned = saved.read(self.keys[place], names, "q_values")["q_values"]
            points = [copy.copy(points[0])]
            object.__setattr__(points[0], "after", None)  # workers get its tables instead
        return Work(tuple(points), seeds, learned, reduce, where)

    def read(
        self, folder: Path, points: Iterable[int], array: str | None = None
    ) -> Iterator[tuple[int, Outcome]]:
        """Yield outcomes of points from finished blocks, by indices into `in_order`.

        With `array`, the blocks are those that have this array.

        Raises:
            AntsError: A block cannot be read.
        """
        saved = Blocks(folder)
        for place in sorted(set(points)):
            yield place, saved.read(self.keys[place], self.names[place], array)

    def _failure(self, failed: Mapping[Piece, Exception]) -> FailedBlocksError:
        return FailedBlocksError(
            [f"{self.named(piece)} ({_said(error)})" for piece, error in failed.items()]
        )

    def named(self, piece: Piece) -> str:
        """Return the settings of a block that are not those of all points, and its seeds."""
        worlds: dict[Any, int] = {}
        rows = [
            _facts_of(point, lambda name, value: worlds.setdefault(value, len(worlds)))
            for point in self.in_order
        ]
        own = [rows[place] for place in piece.points]
        parts = []
        for name in dict.fromkeys(name for row in rows for name in row):
            if any(row.get(name) != rows[0].get(name) for row in rows):
                values = dict.fromkeys(shown(row.get(name)) for row in own)
                parts.append(f"{name} {' or '.join(values)}")
        seeds = [self.seeds[s] for s in piece.seeds]
        of_seeds = f"seed {seeds[0]}" if len(seeds) == 1 else f"seeds {seeds[0]} to {seeds[-1]}"
        return ", ".join([*parts, of_seeds])


def values_in(outcome: Outcome) -> Outcome:
    """Return the `VALUE` arrays of an outcome by their names without `VALUE`."""
    return {n.removeprefix(VALUE): array for n, array in outcome.items() if n.startswith(VALUE)}


class FailedBlocksError(AntsError):
    """Blocks that cannot be computed, while others are finished; `several` names them all."""

    exit_status = 1

    def __init__(self, several: Sequence[str]) -> None:
        more = f" and {len(several) - _NAMED} more" if len(several) > _NAMED else ""
        super().__init__(
            f"{count(len(several), 'block')} failed: {'; '.join(several[:_NAMED])}{more}; all "
            "others are saved, so correct the cause and run the same command again."
        )
        self.several = list(several)


class Piece(NamedTuple):
    """A block that is not computed yet: indices into `in_order` and into the seeds."""

    points: tuple[int, ...]
    seeds: tuple[int, ...]


class Block(NamedTuple):
    """Indices into `in_order` and into the seeds, with their outcome (points, seeds, ...)."""

    points: tuple[int, ...]
    seeds: tuple[int, ...]
    outcome: Outcome


def settings_of(points: Sequence[Point], seeds: Sequence[int]) -> dict[str, Any]:
    """Return everything that determines the results of points and seeds, by name.

    Settings that all points share are single values; others are lists with an entry per point.
    """
    points = _in_order(points)
    places: list[Any] = [place for one in points for place in (one.world, one.pool) if place]
    worlds = list(dict.fromkeys(places))
    numbers = {one: number for several in (points, worlds) for number, one in enumerate(several)}
    rows = [_facts_of(point, lambda name, value: numbers[value]) for point in points]
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


def _facts_of(point: Point, number_of: Callable[[str, Any], Any]) -> dict[str, Any]:
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
    found = {name: value for name, value in found.items() if value or name not in _LATER}
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


def _in_order(points: Sequence[PointKind]) -> tuple[PointKind, ...]:
    return tuple(dict.fromkeys(one for point in points for one in _chain(point)))


def _chain(point: Any) -> list[Any]:
    """Return a point after the one that is its `after`, and so on."""
    return [*_chain(point.after), point] if point.after is not None else [point]


def _part(progress: Progress, begin: float, share: float) -> Progress:
    return lambda done: progress(begin + share * done)


def _said(error: Exception) -> str:
    """Return an error as messages show it."""
    text = " ".join(str(error).split()).rstrip(".")
    return text if isinstance(error, AntsError) else f"{type(error).__name__}: {text}"
