"""Points: what a study computes for each seed, and the key that identifies it.

A point is a world, a task, a learner, and the lengths of training and evaluation. The outcome of a
run depends only on its point and seed.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np

from taichi_ants import PHYSICS, __version__, arguments, files, learners, worlds
from taichi_ants.errors import AntsError, check_one_of, checked_whole
from taichi_ants.features.support import COLONY
from taichi_ants.learners import policies
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.measures.series import SeriesRecorder
from taichi_ants.protocol import ProtocolEvent, When, checked_protocol
from taichi_ants.settings import Setting, flat
from taichi_ants.task import Task
from taichi_ants.task.constants import EPISODE_STEPS, EPISODES, MAX_STEPS, ROW
from taichi_ants.worlds.world import World

if TYPE_CHECKING:
    from taichi_ants.engines.colony.colony import Colony

# Added to the seeds of a colony for its evaluation, so that it shares no random numbers with the
# training.
EVALUATION_SEEDS = 1 << 32
_SECONDS_OF_A_BLOCK = 5.0  # of one processor, about
_STEPS_OF_A_SECOND, _TICKS_OF_A_SECOND = 5e7, 1e7  # of a lone ant, of an ant in a colony, about
_RUNS_OF_A_BLOCK = 5000  # at most; each needs about 20 KB during training
_NUMBERS_OF_A_BLOCK = 1 << 26  # of four bytes, for colonies, at most, unless one needs more
_WORK_OF_A_CELL, _WORK_OF_DIFFUSION = 0.02, 0.08  # of a dense field in a tick
_NUMBERS_OF_AN_ANT, _NUMBERS_OF_A_CELL = 13, 4  # upper bounds
_RUN_ARRAYS = ("returns", "steps", "deliveries")
_COLONY_ARRAYS = ("deliveries", "first_delivery", "moves", "blocked", "returns")

DURING = ("evaluation", "training", "both")
SERIES = "series_"  # begins the names of the series of measures in outcomes
# Settings that only the points that use them name, so that the blocks of others stay valid.
_LATER = ("policy", "measures", "measure_every", "evaluation_epsilon", "protocol")

_TRAINING = Setting("training, before the evaluation", unit="episodes")
_EVALUATION = Setting("evaluation", unit="episodes")
Progress = Callable[[float], None]
Where = Mapping[str, Any]  # the arguments `threads` and `arch` of `train`
Seeds = Sequence[int]
Tables = np.ndarray | None  # of the point `after`, float32 (seeds, n_states, 5)
Outcome = dict[str, np.ndarray]  # arrays by name


@dataclass(frozen=True)
class Drawn:
    """A world for each seed, as a recipe: JSON of a preset, a seed to add, settings and regions."""

    recipe: str

    @classmethod
    def by(
        cls, preset: str, first: int = 0, regions: Mapping[str, Any] | None = None, **settings: Any
    ) -> Drawn:
        """Return the worlds that `worlds.build(preset, first + seed, **settings)` draws."""
        for declared in worlds.registry.settings_of(preset) if preset in worlds.names() else ():
            if declared.name in settings:  # so that equal numbers of other types are equal
                settings[declared.name] = declared.checked(settings[declared.name])
        return cls(json.dumps([preset, first, settings, regions or {}], sort_keys=True))

    @lru_cache(1024)  # noqa: B019 - all points of a study can share worlds
    def of(self, seed: int) -> World:
        """Return the world of a seed; AntsError if a setting is not allowed."""
        preset, first, settings, regions = json.loads(self.recipe)
        return worlds.build(preset, first + seed, **settings).with_regions(regions)


@dataclass(frozen=True)
class RunPoint:
    """A lone ant that is trained and then follows its final policy, or another one, greedily.

    Outcome: `returns`, `steps` and `deliveries` of training, integer (seeds, episodes);
    `greedy_returns`, `greedy_steps` and `greedy_deliveries` of the rollouts, integer (seeds,
    rollouts). With training also `q_values`, float32 (seeds, n_states, 5). Raises AntsError if a
    value is not allowed.

    With a `policy`, which the ant then follows, there are no episodes of training.
    """

    world: World
    task: Task
    training: TrainingConfig
    episodes: Annotated[int, _TRAINING] = EPISODES
    max_steps: Annotated[int, Setting("longest time to a delivery", unit="ticks")] = EPISODE_STEPS
    rollouts: Annotated[int, _EVALUATION] = 50
    policy: FixedPolicy | None = None
    kind: ClassVar[str] = "runs"
    ants: ClassVar[int] = 1
    pool: ClassVar[None] = None
    after: ClassVar[None] = None

    def __post_init__(self) -> None:
        _check(self, bool(self.policy), *arguments.ALONE)
        arguments.checked_max_steps(self.max_steps, self.task)

    @property
    def alike(self) -> tuple:
        """The settings that all points of a block share."""
        learner = self.training.learner, self.training.planning_steps
        lengths = self.episodes, self.max_steps, self.rollouts
        return (self.world, self.task, learner, lengths, self.policy)

    @property
    def runs_of_a_block(self) -> int:
        """The number of runs of a block: many, for speed, but few enough to save often."""
        return min(max(1, round(_SECONDS_OF_A_BLOCK / self.seconds)), _RUNS_OF_A_BLOCK)

    @property
    def seconds(self) -> float:
        """The approximate time of a seed on one processor."""
        return (self.episodes or self.rollouts) * self.max_steps / _STEPS_OF_A_SECOND

    @staticmethod
    def compute(
        points: Sequence[RunPoint], seeds: Seeds, learned: Tables, progress: Progress, where: Where
    ) -> Outcome:
        """Return the outcomes of points of one block: arrays (points, seeds, ...)."""
        from taichi_ants.engines.runs.training import evaluate, train

        first, configs, shape = points[0], [p.training for p in points], (len(points), len(seeds))
        world, lengths, task = first.world, (first.episodes, first.max_steps), first.task
        if first.policy:
            table = first.policy.q_values
            q_values = np.broadcast_to(table, (*shape, *table.shape))
            outcome = {name: np.zeros((*shape, 0), np.int32) for name in _RUN_ARRAYS}
        else:
            trained = train(world, configs, seeds, *lengths, task, **where, progress=progress)
            outcome = {name: files.small(getattr(trained, name)) for name in _RUN_ARRAYS}
            outcome["q_values"] = q_values = trained.q_values
        greedy = evaluate(world, q_values, first.rollouts, seeds, first.max_steps, task, **where)
        for name in _RUN_ARRAYS:
            outcome[f"greedy_{name}"] = files.small(getattr(greedy, name))
        return outcome


@dataclass(frozen=True)
class FixedPolicy:
    """A policy that ants follow without learning: its name or file, and its action values."""

    name: str = field(compare=False)
    sha256: str
    q_values: np.ndarray = field(compare=False, repr=False)

    @classmethod
    def named(cls, name_or_path: str, task: Task) -> FixedPolicy:
        """Return the policy of a name or file (.npz); raises as `policies.frozen_policy` does."""
        q_values = policies.frozen_policy(name_or_path, task.observation)
        return cls(name_or_path, hashlib.sha256(q_values.tobytes()).hexdigest(), q_values)


def _check(point: Any, can_skip_training: bool, *supports: Any) -> None:
    """Check what both kinds of points have, and complete the configuration of the learner."""
    (config,) = arguments.checked_configs(point.training)
    object.__setattr__(point, "training", config)
    arguments.checked_task(point.task, *supports)
    if point.policy and point.episodes:
        raise AntsError(
            f"policy is {point.policy.name!r}, but episodes is {point.episodes}; a fixed policy "
            "does not learn, so set episodes = 0."
        )
    more = "" if can_skip_training else "; 0 requires a policy"
    checked_whole("episodes", point.episodes, int(not can_skip_training), otherwise=more)
    checked_whole("rollouts", point.rollouts)


@dataclass(frozen=True)
class ColonyPoint:
    """A colony that learns, and is then evaluated without learning.

    Outcome: `deliveries`, `first_delivery`, `moves`, `blocked` and `returns` of the evaluation,
    integer (seeds, rollouts), as in `ColonyEpisodes`; `q_values`, float32 (seeds, n_states, 5), if
    ants learned into a shared table. `series_NAME`, float64 (seeds, rollouts, rows), of each
    measure NAME. Raises AntsError if a value is not allowed.

    Attributes:
        world: The world, or the recipe of one for each seed, all of the same ranges.
        pool: Worlds of the same ranges for training; each seed draws one for each episode. None
            means training in `world`.
        sharing, start, capacity: The arguments of `Colony` during training.
        episodes: If 0, ants follow `policy`, the table of `after`, or a rule that needs no table.
        after: The point from whose shared table learning starts; None means the initial values.
        policy: The policy that ants follow if there is no training. A task whose ants choose
            without action values has neither.
        evaluation_epsilon: If None, the lowest rate of the training, or 0 with `policy`.
        measures, measure_every: The arguments `measures` and `every` of `Colony.run` for the
            evaluation, without `Measure` objects.
        protocol: Events, see `taichi_ants.protocol`, of each episode of what is in `during`.
    """

    world: World | Drawn
    task: Task
    training: TrainingConfig
    pool: tuple[World, ...] | None = None
    ants: Annotated[int, Setting("number at the start", unit="ants")] = 1
    sharing: Annotated[
        Literal["shared", "independent"], Setting("whether ants learn into one table or their own")
    ] = "shared"
    start: Annotated[
        Literal["nest", "spread"], Setting("start cells of ants that the world does not list")
    ] = "nest"
    capacity: Annotated[int | None, Setting("largest number of living ants", unit="ants")] = None
    episodes: Annotated[int, _TRAINING] = 50
    ticks: Annotated[int, Setting("length of an episode", unit="ticks")] = 1000
    rollouts: Annotated[int, _EVALUATION] = 4
    after: ColonyPoint | None = None
    policy: FixedPolicy | None = None
    evaluation_epsilon: Annotated[float | None, Setting("exploration rate in evaluation")] = None
    measures: tuple[str, ...] = ()
    measure_every: Annotated[int | None, Setting("time between measures", unit="ticks")] = None
    protocol: tuple[ProtocolEvent, ...] = ()
    during: Annotated[
        Literal["evaluation", "training", "both"], Setting("episodes in which the events happen")
    ] = "evaluation"
    kind: ClassVar[str] = "colony"

    def __post_init__(self) -> None:
        rule = self.task.choice
        can_skip_training = self.after or self.policy or not rule.needs_table
        _check(self, bool(can_skip_training), "a colony", COLONY)
        arguments.checked_capacity(self.task, self.ants, self.capacity, self.start, False)
        check_one_of("sharing", self.sharing, ("shared", "independent"))
        worlds = self.first_world, *(self.pool or ())
        arguments.check_features(self.task, worlds, self.sharing)
        arguments.check_learner(self.training, self.task, self.sharing)
        for name in ("episodes", "policy", "after", "evaluation_epsilon"):
            if not rule.needs_table and getattr(self, name) not in (None, 0):
                raise AntsError(
                    f"{name} has no effect if `task.choice.rule` is {rule.rule!r}, by which ants "
                    "choose without action values; set episodes = 0, and leave out the others."
                )
        if self.evaluation_epsilon is not None:
            arguments.checked_share("evaluation_epsilon", self.evaluation_epsilon)
        SeriesRecorder(self.measures, self.measure_every)  # raises an error if it cannot read them
        checked_whole("ticks", self.ticks, most=MAX_STEPS)
        object.__setattr__(self, "protocol", checked_protocol(self.protocol))
        check_one_of("during", self.during, DURING)
        self._check_protocol()
        if self.after and (self.after.sharing != "shared" or not self.after.episodes):
            raise AntsError("`after` has no shared table; set its sharing='shared' and episodes.")

    def _check_protocol(self) -> None:
        """Raise an AntsError, which names the event, if it can never happen as it should."""
        for learns in (True, False) if self.episodes else (False,):
            world = self.pool[0] if learns and self.pool else self.first_world
            for event in self.events(learns):
                number = [e for e in self.protocol if e.path == event.path].index(event) + 1
                try:
                    event.times(self.ticks)
                    for intervention in event.interventions:
                        intervention.check_in(world, self.task, learns)
                except AntsError as error:
                    raise AntsError(
                        f"in [[{event.path}]] number {number}, in the {DURING[learns]}, {error}"
                    ) from error

    @property
    def first_world(self) -> World:
        """The world of the evaluation; that of seed 0, if each seed draws its own."""
        return self.world.of(0) if isinstance(self.world, Drawn) else self.world

    alike = property(lambda self: self)  # each point has its own blocks

    @property
    def runs_of_a_block(self) -> int:
        """The number of seeds of a block, whose colonies run together, as memory allows."""
        conditions = [event for event in self.protocol if isinstance(event, When)]
        if any(one.in_all_worlds for event in conditions for one in event.interventions):
            return 1  # a condition of one world must not change what all share
        slots, states = self.capacity or self.ants, self.task.n_states
        memory = learners.get(self.training.learner).memory_for(self.training, states)
        table = (1 + memory.tables) * states * ROW + memory.floats + memory.integers
        owners = slots if self.sharing == "independent" else 1
        ants, cells = slots * _NUMBERS_OF_AN_ANT, self.first_world.grid.size * _NUMBERS_OF_A_CELL
        fits = _NUMBERS_OF_A_BLOCK // (ants + cells + owners * table)
        return max(1, min(fits, round(_SECONDS_OF_A_BLOCK / self.seconds)))

    @property
    def seconds(self) -> float:
        """The approximate time of a seed on one processor."""
        fields = [one for one in self.task.pheromones.values() if one.dense]
        work = sum(_WORK_OF_DIFFUSION if one.diffusion else _WORK_OF_A_CELL for one in fields)
        ants = self.ants + work * self.first_world.grid.size
        return ants * self.ticks * (self.episodes + self.rollouts) / _TICKS_OF_A_SECOND

    def events(self, learns: bool) -> tuple[ProtocolEvent, ...]:
        """Return the events of episodes of training or, if not `learns`, of the evaluation."""
        return self.protocol if self.during in ("both", DURING[learns]) else ()

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
            least = 0.0 if self.policy else self.training.least_epsilon
            epsilon = least if self.evaluation_epsilon is None else self.evaluation_epsilon
            training = TrainingConfig.frozen(epsilon)
        if not self.task.needs_table:
            training = None
        options |= {"ants": self.ants, "capacity": self.capacity, "start": self.start}
        options |= {"sharing": self.sharing if learns else "frozen", "q_values": q_values}
        return Colony(world, self.task, training, seeds, **options)

    @staticmethod
    def compute(
        points: Sequence[ColonyPoint],
        seeds: Seeds,
        learned: Tables,
        progress: Progress,
        where: Where,
    ) -> Outcome:
        """Return the outcome of the one point in `points`, arrays (1, seeds, ...)."""
        (point,) = points
        share = point.episodes / (point.episodes + point.rollouts)
        tables = point.tables(seeds, learned, lambda done: progress(share * done), where)
        colony = point.colony(point.worlds(seeds), seeds, tables, False, **where)
        how: dict[str, Any] = {"measures": point.measures, "every": point.measure_every}
        how["protocol"] = point.events(learns=False)
        episodes = colony.run(
            point.rollouts, point.ticks, lambda done: progress(share + (1 - share) * done), **how
        )
        outcome = {name: files.small(getattr(episodes, name).T) for name in _COLONY_ARRAYS}
        if (series := episodes.series) is not None:
            shape = point.rollouts, -1, len(seeds)  # all worlds run for all ticks
            for name, values in series.values.items():
                outcome[f"{SERIES}{name}"] = np.moveaxis(values.reshape(shape), -1, 0)
        if point.episodes and point.sharing == "shared":
            outcome["q_values"] = tables
        return {name: array[None] for name, array in outcome.items()}

    def tables(self, seeds: Seeds, learned: Tables, progress: Progress, where: Where) -> Any:
        """Return the action values that ants follow in the evaluation; train them if necessary."""
        if not self.episodes:
            return self.policy.q_values if self.policy else learned
        worlds, protocol = None, self.events(learns=True)
        if self.pool is not None:  # a world for each episode and seed
            streams = [np.random.default_rng(seed % 2**64) for seed in seeds]
            draws = [stream.integers(len(self.pool), size=self.episodes) for stream in streams]
            worlds = [[self.pool[n] for n in of_episode] for of_episode in np.transpose(draws)]
        first = worlds[0] if worlds else self.worlds(seeds)
        learning = self.colony(first, seeds, learned, True, **where)
        learning.run(self.episodes, self.ticks, progress, worlds, protocol=protocol)
        return learning.q_values

    def worlds(self, seeds: Sequence[int]) -> Any:
        """Return the world, or those of some seeds."""
        world = self.world
        return [world.of(seed) for seed in seeds] if isinstance(world, Drawn) else world


Point = RunPoint | ColonyPoint


def key_of(point: Point, *more: str) -> str:
    """Return the checksum of all that determines the outcome of a point, given its seed.

    Settings at their defaults do not count, so a new setting with a neutral default leaves all keys
    as they are. `more` are checksums of code of the user, and other facts.
    """
    facts = {"physics": PHYSICS, "kind": point.kind, "more": more, **_changed(point)}
    castes = {name: caste.policy for name, caste in point.task.castes.items() if caste.policy}
    if castes:  # whose policies are named by their files
        named = ((name, FixedPolicy.named(path, point.task)) for name, path in castes.items())
        facts["castes"] = {name: policy.sha256 for name, policy in named}
    text = json.dumps(facts, sort_keys=True, default=_identity)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def _identity(value: Any) -> Any:
    """Return what identifies an object that JSON does not have."""
    if isinstance(value, World):
        return _sum_of(value)
    if isinstance(value, Drawn):
        return json.loads(value.recipe)
    if isinstance(value, FixedPolicy):
        return value.sha256
    if isinstance(value, ProtocolEvent):
        return value.facts()
    return value.item() if isinstance(value, np.generic) else _changed(value)


def _changed(value: Any) -> dict[str, Any]:
    """Return the fields of a point or settings that do not have their defaults."""
    own = {}
    for each in fields(value):
        make, setting = each.default_factory, getattr(value, each.name)
        if setting != (each.default if make is MISSING else make()):
            # The order of named settings counts.
            own[each.name] = [*setting.items()] if isinstance(setting, Mapping) else setting
    if isinstance(value, TrainingConfig):
        defaults = learners.get(value.learner).hyperparameters()
        more = {n: v for n, v in value.hyperparameters if v != getattr(defaults, n, None)}
        own["hyperparameters"] = sorted(more.items())
    return own


@lru_cache(4096)
def _sum_of(world: World) -> str:
    regions = {name: cells.tolist() for name, cells in world.regions.items()}
    return files.checksum_of_json([world_facts(world), regions])[:32]


def settings_of(points: Sequence[Point], seeds: Sequence[int]) -> dict[str, Any]:
    """Return everything that determines the results of points and seeds, by name.

    Settings that all points share are single values; others are lists with an entry per point.
    """
    points = tuple(dict.fromkeys(earlier for point in points for earlier in chain(point)))
    each = (map(w.of, seeds) if isinstance(w, Drawn) else w for w in _worlds_of(points))
    facts = {"version": __version__, "seeds": list(seeds)}
    facts["worlds"] = [
        world_facts(worlds) if isinstance(worlds, World) else [*map(world_facts, worlds)]
        for worlds in each
    ]
    for name, values in columns_of(points).items():
        facts[name] = values[0] if all(value == values[0] for value in values) else values
    return facts


def _worlds_of(points: Sequence[Point]) -> list[Any]:
    """Return the worlds of points, recipes and pools, in order of appearance."""
    return list(dict.fromkeys(w for p in points for w in (p.world, p.pool) if w))


def columns_of(points: Sequence[Point]) -> dict[str, list[Any]]:
    """Return the settings of points by name, each a list with an entry per point.

    Numbers represent worlds, and other points. A point that lacks a setting has None.
    """
    index = {value: n for values in (points, _worlds_of(points)) for n, value in enumerate(values)}
    rows = []
    for point in points:
        row = {k: v for k, v in vars(point).items() if k not in _LATER or v not in (None, ())}
        row |= {k: index.get(row[k]) for k in ("world", "pool", "after") if row.get(k)}
        row |= {"task": point.task.as_dict(), "training": point.training.as_dict()}
        if policy := row.get("policy"):
            row["policy"] = {"name": policy.name, "sha256": policy.sha256}
        if protocol := row.get("protocol"):
            row["protocol"] = [event.facts() for event in protocol]
        else:
            row.pop("during", None)
        rows.append(flat(row))
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: [row.get(name) for row in rows] for name in names}


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


def chain(point: Any) -> list[Any]:
    """Return a point after the one that is its `after`, and so on."""
    return [*chain(point.after), point] if point.after is not None else [point]
