"""The colony: many ants in one world, in many worlds at once; the lockstep engine."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from taichi_ants import checks, learners, runtime
from taichi_ants.engines.colony import files as colony_files
from taichi_ants.engines.colony import memory as colony_memory
from taichi_ants.engines.colony.layout import AntRow, Stage, WorldRow
from taichi_ants.engines.colony.population import SHARINGS, Population, Start
from taichi_ants.engines.records import Record
from taichi_ants.errors import AntsError, check_one_of, shown
from taichi_ants.files import PathLike
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.registry import Learner, Memory
from taichi_ants.task import Task
from taichi_ants.task.constants import EMPTY, MAX_STEPS, N_ACTIONS, ROW
from taichi_ants.worlds.world import World

Progress = Callable[[float], None]

_LARGE_COLONY = 16_384  # slots from which ants, not worlds, are handed to threads
_ANTS_PER_CHUNK = 2048
_MOST_CHUNKS = 256
_TICKS_BETWEEN_SORTS = 32
_TICK_NS = 150  # of an ant, on a slow core, by Q-learning
_LAUNCH_SECONDS = 0.4


@dataclass(frozen=True, eq=False, repr=False)
class ColonyEpisodes(Record):
    """What episodes gave, arrays of shape (episodes, worlds).

    Attributes:
        returns: int64, rewards of all ants.
        ticks: int32, length.
        deliveries: int32, foods given to the queen.
        first_delivery: int32, ticks until the first delivery; -1 if there was none.
        moves: int32, moves that ants tried.
        blocked: int32, moves that failed.
        births, deaths: int32, ants.
        regrown: int32, foods that grew back.
        living: int32, ants at the end.
    """

    returns: np.ndarray
    ticks: np.ndarray
    deliveries: np.ndarray
    first_delivery: np.ndarray
    moves: np.ndarray
    blocked: np.ndarray
    births: np.ndarray
    deaths: np.ndarray
    regrown: np.ndarray
    living: np.ndarray


@dataclass(frozen=True, eq=False, repr=False)
class ColonySnapshot(Record):
    """One world of a colony at one moment, as `taichi_ants.rendering` draws it.

    Attributes:
        grid: Where the cells lie in the arrays.
        ground: uint8 (grid.size,), EMPTY, OBSTACLE, FOOD or QUEEN; EMPTY under ants.
        trail: int32 or float32 (grid.size,), trail levels.
        ant_cells: int32 (n,), flat indices of the living ants.
        ant_headings: int32 (n,), 0 to 5.
        ant_carries: bool (n,).
    """

    grid: AxialGrid
    ground: np.ndarray
    trail: np.ndarray
    ant_cells: np.ndarray
    ant_headings: np.ndarray
    ant_carries: np.ndarray


class Colony:
    """Colonies of ants, one in each of W worlds, that act and learn in lockstep.

    A colony depends on its world, its configurations and its seed alone: not on the other worlds,
    the number of threads or the schedule.

    Args:
        world: One world for all seeds, or one for each, of the same ranges.
        task: The rules of the game; None is the paper's. Colonies that learn have its evaporation
            in training, others that in evaluation.
        training: The learner and its settings.
        seeds: One seed for each of the W worlds.
        ants: How many start each episode, 1 to 2**24: the listed ants of the World first, then
            others on free cells, see `start`.
        capacity: How many ants can live at once, at least `ants`; more than these changes nothing
            where none are born. None: `ants` if none are born, else 2 * `ants` + 64.
        start: Where ants start that the World does not list: "nest", on the free cells nearest to
            the queen; "spread", on free cells anywhere. The seed decides which, and the headings.
        ends_at_delivery: Whether an episode ends at its first delivery, as when an ant trains
            alone. Only for one ant, without births.
        sharing: "shared": one table for all ants of a world, for learners with a TD error. "own":
            one, and a memory of the learner, for each slot. "fixed": nobody learns.
        q_values: Action values to start from, float (n_states, 5) or (W, n_states, 5); None: zeros,
            but if nobody learns they must be given. If tables are not shared, (W, slots, n_states,
            5) too.
        threads: CPU threads; None keeps what runs, or takes all.
        arch: "cpu" or "cuda"; None keeps what runs, or takes the CPU.
        schedule: "by_world" hands worlds to threads, "by_chunk" groups of ants; None chooses by
            size. Both give the same numbers.

    Raises:
        AntsError: An argument is not allowed; the learner needs what a colony, or a shared table,
            does not have; or a world has too few free cells for the ants.
    """

    def __init__(
        self,
        world: World | Sequence[World],
        task: Task | None,
        training: TrainingConfig,
        seeds: int | Sequence[int] = 0,
        ants: int = 1,
        capacity: int | None = None,
        start: Start = "nest",
        ends_at_delivery: bool = False,
        sharing: str = "shared",
        q_values: np.ndarray | None = None,
        threads: int | None = None,
        *,
        arch: str | None = None,
        schedule: str | None = None,
    ) -> None:
        self.task = checks.checked_task(Task() if task is None else task)
        self.population = Population.of(self.task, ants, capacity, start, ends_at_delivery)
        if not isinstance(training, TrainingConfig):
            raise AntsError(f"training is {shown(training)}; it must be one TrainingConfig.")
        (self.training,) = checks.checked_configs(training)
        check_one_of("sharing", sharing, SHARINGS)
        self.sharing, learns = sharing, sharing != "fixed"
        if not learns and q_values is None:
            raise AntsError(
                "sharing is 'fixed', but q_values is None; nobody learns, so give the action "
                "values that the ants follow."
            )
        table = None if q_values is None else checks.checked_q_values(q_values, self.task)
        self.one_a_slot = sharing == "own" or (
            sharing == "fixed" and table is not None and table.ndim == 4
        )
        self._learner = learners.get(training.learner) if learns else None
        self.memory = Memory()
        self._cost = 1.0  # of a tick of an ant, in that of Q-learning
        self._plans_together = False
        if self._learner is not None:
            _check_sharing(self._learner, sharing)
            settings = self._learner.settings(self.training)
            self._cost = self._learner.cost(settings)
            self._plans_together = sharing == "shared" and self._learner.plans
            if sharing == "own" or self._plans_together:
                self.memory = self._learner.memory(settings, self.task.n_states)
        falls = self.task.evaporation_in_training if learns else self.task.evaporation_in_evaluation
        self.pheromone = self.task.pheromone if falls else self.task.pheromone.lasting
        self.seeds = checks.checked_seeds(seeds)
        self.seed_words = np.array([seed % 2**64 for seed in self.seeds], dtype=np.uint64)
        self._settings = runtime.start(threads, arch)
        one = isinstance(world, (str, World)) or not isinstance(world, Iterable)
        given: Any = (world,) * len(self.seeds) if one else world
        several = tuple(given)
        if len(several) != len(self.seeds):
            raise AntsError(f"there are {len(several)} worlds for {len(self.seeds)} seeds.")
        check_world = checks.checked_food if learns else checks.checked_world
        self.layout = colony_memory.Layout(
            [check_world(one) for one in several], self.task.life, self.population, self.seeds
        )
        slots = self.population.slots
        usual = "by_chunk" if slots >= _LARGE_COLONY else "by_world"
        self.schedule = usual if schedule is None else schedule
        check_one_of("schedule", self.schedule, ("by_world", "by_chunk"))
        by_chunk = self.schedule == "by_chunk"
        self.chunks = min(_MOST_CHUNKS, -(-slots // _ANTS_PER_CHUNK)) if by_chunk else 1
        self.arrays = colony_memory.allocate(self, table)
        self.stored = tuple(self.arrays)  # the names of those that a file needs to hold
        self.arrays |= colony_memory.constants(self)
        self._arguments: Any = None
        self.epsilon = float(self.training.epsilon)
        self.episode = -1
        self.ticks = 0

    def begin_episode(self) -> None:
        """Set worlds and ants to their start; the ants look around."""
        self.episode += 1
        self.ticks = 0
        colony_memory.fill_episode(self)
        self._launch("begin", 1)

    def tick(self, n: int = 1) -> None:
        """Let n ticks pass; worlds whose episode has ended stand still."""
        self._check_begun()
        n = checks.checked_count("n", n)
        if self.schedule == "by_world":
            self._launch("by_world", n)
            self.ticks += n
            return
        for _ in range(n):
            if self.ticks % _TICKS_BETWEEN_SORTS == 0:
                self._sort_ants()
            self._launch("by_chunk", 1)
            if self._plans_together:
                for _ in range(self.training.planning_steps):
                    self._launch("plan", 1)
            if self.task.life.changes or self.population.ends_at_delivery:
                self._launch("end", 1)
            self.ticks += 1

    def end_episode(self) -> None:
        """Keep the streams of the ants that start an episode, and let epsilon decay.

        Raises:
            AntsError: The learner has made action values that are not finite.
        """
        ants, slots = self.arrays["ants"], self.population.slots
        number = ants[AntRow.NUMBER]
        there = ants[AntRow.STAGE] != Stage.VACANT
        (columns,) = np.nonzero(there & (number >= 0) & (number < self.population.ants))
        places = columns // slots * slots + number[columns]
        self.arrays["first_streams"][places] = self.arrays["streams"][columns]
        self._check_finite()
        decayed = self.epsilon * float(self.training.epsilon_decay)
        self.epsilon = max(float(self.training.min_epsilon), decayed)

    def run(self, episodes: int, ticks: int, progress: Progress | None = None) -> ColonyEpisodes:
        """Whole episodes of a fixed number of ticks.

        Args:
            episodes: How many.
            ticks: Ticks of each.
            progress: Called now and then with the share of the work that is done.
        """
        episodes = checks.checked_count("episodes", episodes)
        ticks = checks.checked_count("ticks", ticks, MAX_STEPS)
        progress = checks.checked_progress(progress)
        outcomes = []
        for episode in range(episodes):
            self.begin_episode()
            while self.ticks < ticks and self.arrays["worlds"][WorldRow.RUNNING].any():
                self.tick(min(self._ticks_per_launch(), ticks - self.ticks))
                if progress is not None:
                    progress((episode + self.ticks / ticks) / episodes)
            outcomes.append(self.outcome())
            self.end_episode()
        return ColonyEpisodes(
            **{name: np.stack([vars(one)[name][0] for one in outcomes])
               for name in vars(outcomes[0])}
        )  # fmt: skip

    def outcome(self) -> ColonyEpisodes:
        """What the episode has given so far, arrays (1, W).

        Raises:
            AntsError: The learner has made action values that are not finite.
        """
        self._check_finite()
        return self._counted()

    def _counted(self) -> ColonyEpisodes:
        counts = {
            field.name: self.arrays["worlds"][WorldRow[field.name.upper()]][None].copy()
            for field in fields(ColonyEpisodes)
            if field.name != "returns"
        }
        return ColonyEpisodes(returns=self.arrays["returns"][None].copy(), **counts)

    @property
    def q_values(self) -> np.ndarray:
        """The action values, float32 (W, n_states, 5), with own tables (W, slots, n_states, 5)."""
        n = self.population.slots if self.one_a_slot else 1
        tables = self.arrays["q"].reshape(len(self.seeds), n, -1, self.task.n_states, ROW)
        tables = tables[:, :, 0, :, :N_ACTIONS]
        return (tables if self.one_a_slot else tables[:, 0]).copy()

    @property
    def waiting_foods(self) -> int:
        """Foods that the queens have been given, but could not turn into ants yet."""
        return int(self.arrays["worlds"][WorldRow.STORE].sum())

    @property
    def worlds(self) -> tuple[World, ...]:
        """The worlds as they are at the start of an episode."""
        return self.layout.worlds

    def snapshot(self, world: int = 0) -> ColonySnapshot:
        """World number `world` as it is now; arrays are copies.

        Raises:
            AntsError: There is no such world, or no episode has begun.
        """
        self._check_begun()
        world = checks.checked_count("world", world, len(self.seeds) - 1, least=0)
        cells = slice(world * self.layout.size, (world + 1) * self.layout.size)
        slots = slice(world * self.population.slots, (world + 1) * self.population.slots)
        ants = self.arrays["ants"][:, slots]
        ants = ants[:, ants[AntRow.STAGE] == Stage.LIVING]
        ground = self.arrays["ground"][cells].copy()
        ground[ants[AntRow.CELL]] = EMPTY
        if self.pheromone.dense:
            trail = self.arrays["level"][cells].copy()
        else:
            clock = self.ticks if self.pheromone.evaporation == "linear" else 0
            trail = np.maximum(self.arrays["trail"][cells] - clock, 0)
        return ColonySnapshot(
            self.layout.grid,
            ground,
            trail,
            ants[AntRow.CELL].copy(),
            ants[AntRow.HEADING].copy(),
            ants[AntRow.CARRIES].astype(bool),
        )

    def save(self, path: PathLike) -> None:
        """Write the colony as it is now; `load` goes on from it, bit for bit.

        Raises:
            AntsError: The learner has made action values that are not finite, so that `load` would
                refuse the file; or it cannot be written.
        """
        self._check_finite()
        colony_files.save_colony(self, path)

    @classmethod
    def load(cls, path: PathLike, threads: int | None = None, *, arch: str | None = None) -> Colony:
        """Read a colony that `save` wrote.

        Raises:
            AntsError: The file is missing, damaged, or holds no colony.
        """
        return colony_files.load_colony(cls, path, threads, arch)

    def __eq__(self, other: object) -> bool:
        """Whether both are at the same point of the same life, so that they go on alike."""
        if not isinstance(other, Colony):
            return NotImplemented
        return colony_files.same_colony(self, other)

    __hash__ = None  # type: ignore[assignment]  # it changes with each tick

    def __repr__(self) -> str:
        others = len(dict.fromkeys(self.worlds)) - 1
        more = f" and {others} more" if others else ""
        lines = [f"world: {self.worlds[0]}{more}", f"task: {self.task}"]
        lines += [f"population: {self.population}"]
        lines += [f"training: {self.training}", f"seeds: {shown(self.seeds)}"]
        lines += [f"sharing: {self.sharing!r}, epsilon: {self.epsilon:.4g}"]
        if self.episode >= 0:
            now = self._counted()
            lines += [
                f"episode: {self.episode}, ticks: {self.ticks}, living: {now.living.sum()}, "
                f"deliveries: {now.deliveries.sum()}"
            ]
        return "\n    ".join(["Colony(", *lines]) + "\n)"

    def _check_begun(self) -> None:
        if self.episode < 0:
            raise AntsError("no episode has begun; call begin_episode first.")

    def _check_finite(self) -> None:
        tables = self.arrays["q"].reshape(len(self.seeds), -1)
        checks.check_finite(tables, [self.training], self.seeds)

    def _ticks_per_launch(self) -> int:
        if self.schedule == "by_chunk":
            return 1
        rounds = -(-len(self.seeds) // self._settings.threads)
        cost = _TICK_NS * max(self._cost, 1 + self.training.planning_steps)
        if self.pheromone.dense:
            cost += 2 * self.layout.size / self.population.slots
        return max(1, int(_LAUNCH_SECONDS * 1e9 / (rounds * self.population.slots * cost)))

    def _sort_ants(self) -> None:
        """Store the ants of a world in the order of their cells, so that neighbours share caches.

        Their order changes nothing but the speed: ants have numbers. Slots do matter where ants are
        born or have tables of their own, and vacant ones stay behind the others; there the order
        stays.
        """
        life, population = self.task.life, self.population
        spare = population.slots > population.ants
        if life.births or life.lifespan or self.one_a_slot or spare:
            return
        ants = self.arrays["ants"]
        cells = ants[AntRow.CELL].reshape(len(self.seeds), -1)
        first = np.arange(len(self.seeds))[:, None] * population.slots
        order = (np.argsort(cells, axis=1) + first).ravel()
        for row in ants:
            row[:] = row[order]
        self.arrays["streams"][:] = self.arrays["streams"][order]

    def _launch(self, what: str, n_ticks: int) -> None:
        from taichi_ants.engines.arguments import Arguments
        from taichi_ants.engines.colony import kernels

        self._settings = runtime.start()  # the caller may have reset Taichi, or forked
        if self._arguments is None:
            self._arguments = Arguments()
        variant = kernels.Variant(
            self._learner,
            self.one_a_slot,
            self.memory.tables,
            self.task.sees,
            self.pheromone.dense,
            self.pheromone.view,
            self.task.traffic,
            self.task.life.changes,
        )
        with runtime.quiet():
            values = {**self._numbers(), **self.arrays}
            kind = self._arguments.type_of(values)
            kernel = kernels.colony_kernel(getattr(kernels, what), variant, kind)
            kernel(self._arguments.pack(values), self.ticks, n_ticks)

    def _numbers(self) -> dict[str, Any]:
        """What kernels know besides arrays; -1 stands for an option that is off."""
        life, population, pheromone = self.task.life, self.population, self.pheromone
        off = -1
        return {
            "n_worlds": len(self.seeds),
            "n_ants": population.ants,  # that start an episode
            "n_slots": population.slots,
            "n_chunks": self.chunks,
            "n_homes": self.layout.homes,  # room for places of food in each world
            "size": self.layout.size,
            "episode": self.episode,
            "evaporates": int(pheromone.evaporation == "linear"),  # of integer trails: the clock
            "adds": {"fading": 2, "add": 1, "set": 0, "none": off}[pheromone.deposit],
            "deposit_level": int(pheromone.level),
            "cap": int(pheromone.cap or 0),
            "slope": int(pheromone.slope or 0),
            "fades_after": pheromone.fades_after,
            "turns_at_queen": int(self.task.turns_at_queen),
            # The factor of exponential evaporation, 1 for none, -1 for linear.
            "decay": -1.0 if pheromone.evaporation == "linear" else float(pheromone.decay),
            "share": float(pheromone.share),  # what a cell gives to each neighbour
            "births": int(life.births),
            "lifespan": life.lifespan or off,
            "regrowth": off if life.regrowth is None else life.regrowth,
            "wander": life.wander or off,
            "ends_at_delivery": int(population.ends_at_delivery),
            "continuing": int(self.task.delivery == "continuing"),
            "learning_rate": self.training.learning_rate,
            "discount": self.training.discount,
            "epsilon": self.epsilon,
            "explore_below": np.uint64(self.epsilon * 4294967296.0),
            "planning_steps": self.training.planning_steps,
            # So that the sum of the errors of all ants is a fixed-point number, see `learning`.
            "largest_error": 2.0**31 / (population.slots + 1),
            "floats_size": self.memory.floats,
            "integers_size": self.memory.integers,
        }


def _check_sharing(learner: Learner, sharing: str) -> None:
    """Refuse a learner that cannot learn in a colony, or not into a table that others share."""
    if learner.needs_episode_end:
        raise AntsError(
            f"learner {learner.name!r} needs to know the last step of an episode, which the ants "
            "of a colony do not; take another one, or train one ant by train(...)."
        )
    if sharing == "shared" and learner.td_error is None:
        raise AntsError(
            f"learner {learner.name!r} keeps a memory of its own, so ants cannot share its table; "
            'take sharing="own".'
        )
