"""The colony: many ants in one world, in many worlds at once; the lockstep engine."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from importlib import import_module
from typing import Any, Literal, get_args

import numpy as np

from taichi_ants import checks, learners, runtime
from taichi_ants.engines.colony import files as colony_files
from taichi_ants.engines.colony import memory
from taichi_ants.engines.colony.layout import (
    FIRST_TRAIT,
    AntRow,
    Stage,
    WorldRow,
)
from taichi_ants.engines.colony.team import Team
from taichi_ants.engines.packing import padded
from taichi_ants.engines.records import Record
from taichi_ants.errors import (
    AntsError,
    array_of,
    check_one_of,
    checked_whole,
    entries_of,
    shown,
)
from taichi_ants.files import PathLike
from taichi_ants.grid.hexgrid import AxialGrid
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.registry import Memory
from taichi_ants.task import Task
from taichi_ants.task.constants import ACTION_NAMES, EMPTY, MAX_STEPS, N_ACTIONS, ROW
from taichi_ants.worlds.starts import Start
from taichi_ants.worlds.world import World

Progress = Callable[[float], None]
Sharing = Literal["shared", "own", "fixed"]
SHARINGS: tuple[str, ...] = get_args(Sharing)

# Slots from which ants, not worlds, are handed to threads: of a single world, and of each of many.
_LARGE_ALONE, _LARGE_COLONY = 2048, 16_384
_CHUNKS_PER_THREAD = 2
# Ants are sorted once they have taken so many steps together, but not too seldom nor too often.
_STEPS_BETWEEN_SORTS, _FEWEST_TICKS, _MOST_TICKS = 2_500_000, 16, 256
_PIECE_SECONDS = 0.4
_ANTS = ("ants", "traits")  # the arrays that kernels know row by row
# Kernels count moves in 32 bits, which 10 000 ants fill in 200 000 ticks; so these counters begin
# anew after so many, and what comes of a piece of ticks is far less.
_LARGE = (WorldRow.MOVES, WorldRow.BLOCKED)
_ROUND = 1 << 30

# Where actions are given, nobody chooses or learns, and none of these matters.
_NO_TRAINING = TrainingConfig("q_learning", 1.0, 1.0, 0.0, 1.0)


@dataclass(frozen=True, eq=False, repr=False)
class ColonyEpisodes(Record):
    """What episodes gave, arrays of shape (episodes, worlds).

    Attributes:
        returns: int64, rewards of all ants.
        ticks: int32, length.
        deliveries: int32, foods given to the queen.
        first_delivery: int32, ticks until the first delivery; -1 if there was none.
        moves: int64, moves that ants tried.
        blocked: int64, moves that failed.
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
        training: The learner and its settings. None, with sharing "fixed": ants do what `act` is
            given, and there are no action values.
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
            but if nobody learns they must be given, unless `training` is None. If tables are not
            shared, (W, slots, n_states, 5) too.
        threads: CPU threads; None keeps what runs, or takes all.
        arch: "cpu" or "cuda"; None keeps what runs, or takes the CPU.
        schedule: "by_world" hands worlds to threads, "by_chunk" groups of ants; None chooses by
            size. Both give the same numbers; by chunk, ants are stored in another order.

    Raises:
        AntsError: An argument is not allowed; the learner needs what a colony, or a shared table,
            does not have; or a world has too few free cells for the ants.
    """

    def __init__(
        self,
        world: World | Sequence[World],
        task: Task | None,
        training: TrainingConfig | None,
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
        self.capacity = checks.checked_capacity(self.task, ants, capacity, start, ends_at_delivery)
        self.ants, self.start = int(ants), start
        self.ends_at_delivery = bool(ends_at_delivery)
        check_one_of("sharing", sharing, SHARINGS)
        self.sharing, learns = sharing, sharing != "fixed"
        self.is_given_actions = training is None and not learns and q_values is None
        if self.is_given_actions:
            training = _NO_TRAINING
        if not isinstance(training, TrainingConfig):
            raise AntsError(
                f"training is {shown(training)}; it must be one TrainingConfig, or None with "
                'sharing="fixed" and without q_values.'
            )
        (self.training,) = checks.checked_configs(training)
        if not learns and q_values is None and not self.is_given_actions:
            raise AntsError(
                "sharing is 'fixed', but q_values is None; nobody learns, so give the action "
                "values that the ants follow."
            )
        table = None if q_values is None else checks.checked_q_values(q_values, self.task)
        self.one_a_slot = sharing == "own" or (
            sharing == "fixed" and table is not None and table.ndim == 4
        )
        self._learner = learners.get(training.learner) if learns else None
        self.draws_ahead = self._learner is not None and self._learner.draws_next_action
        self._plans_together = False
        self.memory = Memory()
        if self._learner is not None:
            checks.check_sharing(self._learner, sharing)
            self._plans_together = sharing == "shared" and self._learner.plans
            if sharing == "own" or self._plans_together:
                self.memory = padded(self._learner.memory_for(self.training, self.task.n_states))
        self.pheromone = self.task.pheromone_while(learns)
        self.seeds = checks.checked_seeds(seeds)
        self.seed_words = np.array([seed % 2**64 for seed in self.seeds], dtype=np.uint64)
        running = runtime.start(threads, arch)
        life = self.task.life
        self.ants_change = life.births or life.lifespan is not None
        self.food_changes = life.regrowth is not None or life.wander is not None
        large = self.capacity >= (_LARGE_ALONE if len(self.seeds) == 1 else _LARGE_COLONY)
        usual = "by_chunk" if large else "by_world"
        self.schedule = usual if schedule is None else schedule
        check_one_of("schedule", self.schedule, ("by_world", "by_chunk"))
        by_chunk = self.schedule == "by_chunk"
        self.chunks = _CHUNKS_PER_THREAD * running.threads if by_chunk else 1
        self.arrays: dict[str, np.ndarray] = {}
        self._lay_out(_checked_worlds(world, len(self.seeds), learns))
        self.arrays |= (lasting := memory.lasting(self, table))
        # The names of those that a file needs to hold.
        self.stored = (*self._changing, *lasting)
        self._launches: dict[str, Any] = {}  # of kernels, by their phases
        self._known_rows: dict[str, np.ndarray] = {}
        self._team = Team()
        self._piece = 1  # ticks that take less than _PIECE_SECONDS
        self.epsilon, self.learning_rate = self.training.epsilon, self.training.learning_rate
        self.length = 0  # of the episode in ticks, 0 if nobody has said
        self.ticks = 0  # since an episode began for all worlds
        # How often each counter of `_LARGE` has begun anew in this episode, in each world.
        self.rounds = np.zeros((len(_LARGE), len(self.seeds)), np.int64)
        # Foods that were delivered in the episodes before the present one, in each world.
        self.delivered = np.zeros(len(self.seeds), np.int64)

    @property
    def episode(self) -> int:
        """The number of the present episode, -1 before the first; of the world that had most."""
        return int(self.arrays["episodes"].max())

    def _lay_out(self, worlds: tuple[World, ...]) -> None:
        """Make the arrays that depend on the worlds."""
        self.worlds, self.grid = worlds, worlds[0].grid
        most = max(len(world.foods) for world in worlds)
        self.make_room_for_homes(most if self.food_changes else 0)
        self.arrays |= memory.constants(self)

    def make_room_for_homes(self, n: int) -> None:
        """Begin anew, with room for n homes of food in each world, at least as many as foods."""
        self.n_homes = n
        self.at_start = memory.start_of_episode(self)
        self.arrays |= (changing := memory.of_episode(self))
        self._changing = tuple(changing)

    def begin_episode(
        self, length: int | None = None, world: World | Sequence[World] | None = None
    ) -> None:
        """Set worlds and ants to their start; the ants look around.

        Args:
            length: How many ticks there will be. Learners that need to know which tick is the last
                are told then.
            world: As of the class: where the colonies live from now on, so that what they learn
                does not depend on one world. None: where they are.

        Raises:
            AntsError: A world is not allowed.
        """
        learns = self.sharing != "fixed"
        others = None if world is None else _checked_worlds(world, len(self.seeds), learns)
        self.delivered += self.arrays["worlds"][WorldRow.DELIVERIES]
        if others is not None:
            self._lay_out(others)
        self.length = 0 if length is None else checked_whole("length", length, most=MAX_STEPS)
        self.ticks = 0
        self.rounds[:] = 0
        memory.begin_episode(self)
        self._launch("begin_phases")

    def begin_some(self, which: np.ndarray, seeds: Sequence[int] | None = None) -> None:
        """Let some worlds begin their next episode, while the others go on with theirs.

        For these it is as `end_episode` and `begin_episode`; epsilon and the learning rate stay.

        Args:
            which: bool (W,).
            seeds: One for each of these worlds, which then begin a new life, as in a new `Colony`;
                tables and memories of learners go on. Seeds of a colony may repeat then, but
                `save` refuses them. None: their streams go on.

        Raises:
            AntsError: There are other numbers of worlds or seeds, or a seed is not allowed.
        """
        which = array_of("which", which)
        if which.dtype != bool or which.shape != (len(self.seeds),):
            raise AntsError(f"which is {shown(which)}; give a bool for each of the worlds.")
        if seeds is None:
            memory.keep_streams(self, which)
        else:
            listed = entries_of(seeds)
            if listed is None:
                raise AntsError(f"seeds is {shown(seeds)}; give a seed for each of these worlds.")
            self._reseed(which, [seed for one in listed for seed in checks.checked_seeds(one)])
        self.delivered += self.arrays["worlds"][WorldRow.DELIVERIES] * which
        self.rounds[:, which] = 0
        memory.begin_episode(self, which)
        self._launch("begin_phases")

    def look(self) -> None:
        """Let the ants see what was changed in the arrays since the last tick, see `hand`.

        Raises:
            AntsError: No episode has begun.
        """
        self._check_begun()
        self._launch("look_phases")

    def _reseed(self, which: np.ndarray, seeds: list[int]) -> None:
        """Take other seeds for some worlds, as if nothing had happened in them yet."""
        (places,) = np.nonzero(which)
        if len(seeds) != len(places):
            raise AntsError(f"there are {len(seeds)} seeds for {len(places)} worlds.")
        changed = list(self.seeds)
        for place, seed in zip(places, seeds, strict=True):
            changed[place] = seed
        self.seeds = tuple(changed)
        self.seed_words = np.array([seed % 2**64 for seed in self.seeds], dtype=np.uint64)
        self.arrays["seeds"][:] = self.seed_words
        self.at_start = memory.start_of_episode(self)
        memory.copy_worlds(self.arrays, memory.seeded(self), len(self.seeds), which)

    def tick(self, n: int = 1) -> None:
        """Let n ticks pass; worlds whose episode has ended stand still.

        Raises:
            AntsError: No episode has begun, or actions are given to this colony, see `act`.
        """
        self._check_begun()
        if self.is_given_actions:
            raise AntsError(
                "training is None, so nobody chooses; give the actions of each tick to act."
            )
        for _ in self._pass(checked_whole("n", n)):
            pass

    def act(self, actions: np.ndarray) -> None:
        """Let one tick pass in which each ant does what is given; for colonies without training.

        Args:
            actions: Whole numbers 0 to 4 (W, capacity): left, forward, right, pick up, give; those
                of vacant slots, and of worlds whose episode has ended, are ignored.

        Raises:
            AntsError: No episode has begun, the colony has a training, or an action is not allowed.
        """
        self._check_begun()
        if not self.is_given_actions:
            raise AntsError(
                "this colony has a training by which ants choose; call tick, or make it with "
                'training=None and sharing="fixed".'
            )
        given, shape = array_of("actions", actions), (len(self.seeds), self.capacity)
        if given.dtype.kind not in "iu" or given.shape != shape:
            raise AntsError(
                f"actions is {shown(given)}; give whole numbers of shape {shape}, one a slot."
            )
        if given.min() < 0 or given.max() >= N_ACTIONS:
            given = np.where(self.living, given, 0)
            wrong = given[(given < 0) | (given >= N_ACTIONS)]
            if len(wrong):
                raise AntsError(
                    f"an action is {wrong[0]}; it must lie between 0 and {N_ACTIONS - 1}: "
                    f"{', '.join(ACTION_NAMES)}."
                )
        self.of_ants(AntRow.ACTION)[:] = given.reshape(-1)
        self._advance(1)

    @property
    def living(self) -> np.ndarray:
        """In which slots ants live, bool (W, capacity)."""
        return self.ants_by_slot(AntRow.STAGE) == Stage.LIVING

    @property
    def states(self) -> np.ndarray:
        """The row of its table that each ant looks at, int32 (W, capacity), as it is now.

        In a slot whose ant has died it is what the ant saw last.
        """
        from taichi_ants.engines.looks import is_percept

        return self.ants_by_slot(AntRow.PERCEPT if is_percept(self.task.sees) else AntRow.STATE)

    def ants_by_slot(self, row: AntRow) -> np.ndarray:
        """What is stored of each ant, int32 or int8 (W, capacity); not a copy."""
        return self.of_ants(row).reshape(len(self.seeds), self.capacity)

    def of_ants(self, row: AntRow) -> np.ndarray:
        """The same of all worlds, one behind the other, (W * capacity,)."""
        if row < FIRST_TRAIT:
            return self.arrays["ants"][row]
        return self.arrays["traits"][row - FIRST_TRAIT]

    def ant_rows(self) -> np.ndarray:
        """A copy of all that is stored of the ants, int32 (len(AntRow), W * capacity).

        0 in rows that this colony does not keep, see `layout.AntRow`.
        """
        ants, traits = self.arrays["ants"], self.arrays["traits"]
        rows = np.zeros((len(AntRow), ants.shape[1]), np.int32)
        rows[: len(ants)], rows[FIRST_TRAIT : FIRST_TRAIT + len(traits)] = ants, traits
        return rows

    def _pass(self, n: int) -> Iterator[None]:
        """Let n ticks pass, in short pieces: a launch of a kernel cannot be interrupted."""
        end = self.ticks + n
        while self.ticks < end:
            piece = min(self._piece, end - self.ticks)
            began = time.perf_counter()
            self._advance(piece)
            if piece == self._piece:
                pace = (time.perf_counter() - began) / piece
                self._piece = max(1, min(2 * piece, int(_PIECE_SECONDS / pace)))
            yield

    def _advance(self, n: int) -> None:
        end = self.ticks + n
        if self.schedule == "by_world":
            self._pass_in_kernel("by_world", n)
        while self.ticks < end:
            self._share_ticks(min(end - self.ticks, self._sort_ants_at_times()))
        for rounds, row in zip(self.rounds, _LARGE, strict=True):
            counter = self.arrays["worlds"][row]
            if counter.max() >= _ROUND:
                more, counter[:] = np.divmod(counter, _ROUND)
                rounds += more

    def _share_ticks(self, n: int) -> None:
        """Let up to n ticks pass, each shared by all threads."""
        running = runtime.start()
        if not _can_wait(running):
            rounds = self.training.planning_steps if self._plans_together else 0
            for phases in ("tick_phases", *["planning_phases"] * rounds, "last_phases"):
                self._launch(phases)
            self.ticks += 1
            return
        most = min(running.threads, runtime.available_threads(), self.chunks)
        n, members = self._team.plan(n, most)
        compiled, began = "by_team" in self._launches, time.perf_counter()
        self._pass_in_kernel("by_team", n, members)
        if compiled:
            self._team.took(members, (time.perf_counter() - began) / n)

    def _pass_in_kernel(self, name: str, n: int, members: int = 1) -> None:
        """Let n ticks pass in a kernel of whole ticks."""
        self.arrays["orders"][:] = n, members
        self.arrays["come"][:] = 0
        self._launch(name)
        self.ticks += n

    def end_episode(self) -> None:
        """Keep the streams of the ants that start an episode; epsilon and learning rate decay.

        Raises:
            AntsError: The learner has made action values that are not finite.
        """
        self._check_finite()
        memory.keep_streams(self)
        self.epsilon = self.training.next_epsilon(self.epsilon)
        self.learning_rate = self.training.next_learning_rate(self.learning_rate)

    def run(
        self,
        episodes: int,
        ticks: int,
        progress: Progress | None = None,
        worlds: Sequence[World | Sequence[World]] | None = None,
    ) -> ColonyEpisodes:
        """Whole episodes of a fixed number of ticks.

        Args:
            episodes: How many.
            ticks: Ticks of each.
            progress: Called now and then with the share of the work that is done.
            worlds: Of each episode, see `begin_episode`; None: all take place where the colonies
                are.
        """
        episodes = checked_whole("episodes", episodes)
        ticks = checked_whole("ticks", ticks, most=MAX_STEPS)
        places = self._checked_places(worlds, episodes)
        checks.check_progress(progress)
        outcomes = []
        for episode in range(episodes):
            self.begin_episode(ticks, places[episode])
            for _ in self._pass(ticks):
                if progress is not None:
                    progress((episode + self.ticks / ticks) / episodes)
                if not self.arrays["worlds"][WorldRow.RUNNING].any():
                    break
            outcomes.append(self.outcome())
            self.end_episode()
        return ColonyEpisodes(
            **{name: np.stack([vars(one)[name][0] for one in outcomes])
               for name in vars(outcomes[0])}
        )  # fmt: skip

    def _checked_places(self, worlds: Any, episodes: int) -> Sequence[Any]:
        """The worlds of each episode, all of them allowed; None where the colonies stay."""
        if worlds is None:
            return [None] * episodes
        if not isinstance(worlds, (list, tuple)) or len(worlds) != episodes:
            raise AntsError(
                f"worlds is {shown(worlds)}; give a list with an entry for each of the {episodes} "
                "episodes."
            )
        for place in worlds:
            several = _checked_worlds(place, len(self.seeds), self.sharing != "fixed")
            for one, seed in dict.fromkeys(zip(several, self.seeds, strict=True)):
                one.start(seed, self.ants, self.start)  # whether there is room
        return worlds

    def outcome(self) -> ColonyEpisodes:
        """What the episode has given so far, arrays (1, W).

        Raises:
            AntsError: The learner has made action values that are not finite.
        """
        self._check_finite()
        counts = {
            field.name: self.arrays["worlds"][WorldRow[field.name.upper()]][None].copy()
            for field in fields(ColonyEpisodes)
            if field.name != "returns"
        }
        for rounds, row in zip(self.rounds, _LARGE, strict=True):
            counts[row.name.lower()] = counts[row.name.lower()] + rounds * _ROUND
        return ColonyEpisodes(returns=self.arrays["returns"][None].copy(), **counts)

    @property
    def q_values(self) -> np.ndarray:
        """The action values, float32 (W, n_states, 5), with own tables (W, slots, n_states, 5)."""
        n = self.capacity if self.one_a_slot else 1
        tables = self.arrays["q"].reshape(len(self.seeds), n, -1, self.task.n_states, ROW)
        tables = tables[:, :, 0, :, :N_ACTIONS]
        return (tables if self.one_a_slot else tables[:, 0]).copy()

    def snapshot(self, world: int = 0) -> ColonySnapshot:
        """World number `world` as it is now; arrays are copies.

        Raises:
            AntsError: There is no such world, or no episode has begun.
        """
        self._check_begun()
        world = checked_whole("world", world, most=len(self.seeds) - 1, least=0)
        cells = slice(world * self.grid.size, (world + 1) * self.grid.size)
        living = self.living[world]
        ant_cells = self.ants_by_slot(AntRow.CELL)[world, living]
        ground = self.arrays["ground"][cells].copy()
        ground[ant_cells] = EMPTY
        stored, clock = self.stored_trail(world)
        trail = np.maximum(stored - stored.dtype.type(clock), 0)
        return ColonySnapshot(
            self.grid,
            ground,
            trail,
            ant_cells,
            self.ants_by_slot(AntRow.HEADING)[world, living].astype(np.int32),
            self.ants_by_slot(AntRow.CARRIES)[world, living].astype(bool),
        )

    def stored_trail(self, world: int = 0) -> tuple[np.ndarray, int]:
        """The trail of world number `world` as kernels store it, and the clock.

        The level of a cell is what is stored less the clock, not below 0.

        Returns:
            A copy of the expiry clocks, int32 (grid.size,), and the clock as it is now; or of the
            levels, float32 (grid.size,), and 0, if the pheromone is dense.
        """
        cells = slice(world * self.grid.size, (world + 1) * self.grid.size)
        if self.pheromone.dense:
            return self.arrays["level"][cells].copy(), 0
        falls = self.pheromone.evaporation == "linear"
        clock = int(self.arrays["worlds"][WorldRow.TICKS, world]) * falls
        return self.arrays["trail"][cells].copy(), clock

    def save(self, path: PathLike) -> None:
        """Write the colony as it is now; `load` goes on from it, bit for bit.

        Raises:
            AntsError: The learner has made action values that are not finite, so that `load` would
                refuse the file; seeds repeat; or it cannot be written.
        """
        self._check_finite()
        checks.checked_seeds(self.seeds)
        colony_files.save_colony(self, path)

    @classmethod
    def load(cls, path: PathLike, threads: int | None = None, *, arch: str | None = None) -> Colony:
        """Read a colony that `save` wrote.

        Raises:
            AntsError: The file is missing, damaged, or holds no colony.
        """
        return colony_files.load_colony(cls, path, threads, arch)

    def __getstate__(self) -> dict[str, Any]:
        """All but what belongs to the Taichi that runs: copies and pickles go on alike."""
        return {**vars(self), "_launches": {}, "_known_rows": {}, "_learner": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        learns = self.sharing != "fixed"
        self._learner = learners.get(self.training.learner) if learns else None

    def __eq__(self, other: object) -> bool:
        """Whether both are at the same point of the same life, so that they go on alike."""
        if not isinstance(other, Colony):
            return NotImplemented
        return colony_files.same_colony(self, other)

    __hash__ = None  # type: ignore[assignment]  # it changes with each tick

    def __repr__(self) -> str:
        others = len(dict.fromkeys(self.worlds)) - 1
        more = f" and {others} more" if others else ""
        lines = [
            f"world: {self.worlds[0]}{more}",
            f"task: {self.task}",
            f"training: {None if self.is_given_actions else self.training}",
            f"seeds: {shown(self.seeds)}",
            f"ants: {self.ants}, capacity: {self.capacity}, start: {self.start!r}",
            f"sharing: {self.sharing!r}, epsilon: {self.epsilon:.4g}",
        ]
        if self.episode >= 0:
            now = self.arrays["worlds"].sum(axis=1)
            lines.append(
                f"episode: {self.episode}, ticks: {self.ticks}, living: {now[WorldRow.LIVING]}, "
                f"deliveries: {now[WorldRow.DELIVERIES]}"
            )
        return "\n    ".join(["Colony(", *lines]) + "\n)"

    def _repr_html_(self) -> str | None:
        """The first world as it is now, as notebooks show it: a page to look around in."""
        # The viewer stands above the engines; it is looked for only where it is needed.
        return import_module("taichi_ants.viewer").notebook(self) if self.episode >= 0 else None

    def _check_begun(self) -> None:
        if self.episode < 0:
            raise AntsError("no episode has begun; call begin_episode first.")

    def _check_finite(self) -> None:
        tables = self.arrays["q"].reshape(len(self.seeds), -1)
        checks.check_finite(tables, [self.training], self.seeds)

    def _sort_ants_at_times(self) -> int:
        """Sort the ants if it is time; the number of ticks until it is again."""
        ticks = _STEPS_BETWEEN_SORTS // (len(self.seeds) * self.capacity)
        ticks = max(_FEWEST_TICKS, min(_MOST_TICKS, ticks))
        if self.ticks % ticks == 0:
            self._sort_ants()
        return ticks - self.ticks % ticks

    def _sort_ants(self) -> None:
        """Store the ants of a world about in the order of their cells: neighbours share caches.

        Their order changes nothing but the speed: ants have numbers. Slots do matter where ants are
        born, have tables of their own or are given actions, and vacant ones stay behind the others;
        there the order stays.
        """
        slots_matter = self.ants_change or self.one_a_slot or self.is_given_actions
        if slots_matter or self.arrays["worlds"][WorldRow.LIVING].min() < self.capacity:
            return
        # Cells to 16 bits, by which NumPy sorts in a tenth of the time.
        near = self.ants_by_slot(AntRow.CELL) >> max(0, self.grid.size.bit_length() - 16)
        first = np.arange(len(self.seeds))[:, None] * self.capacity
        order = (np.argsort(near.astype(np.uint16), axis=1, kind="stable") + first).ravel()
        for row in (*self.arrays["ants"], *self.arrays["traits"]):
            row[:] = row[order]
        self.arrays["streams"][:] = self.arrays["streams"][order]

    def _launch(self, phases: str) -> None:
        """Do some phases of `kernels`, or whole ticks "by_world" or "by_team"."""
        runtime.start()  # the caller may have reset Taichi, or forked
        values = self._values()
        if phases not in self._launches:
            self._launches[phases] = self._prepared(phases, values)
        self._launches[phases](values)

    def _prepared(self, phases: str, values: dict[str, Any]) -> Any:
        """A kernel that can be launched again and again."""
        from taichi_ants.engines.arguments import Arguments, Launch
        from taichi_ants.engines.colony import kernels

        variant = kernels.variant(
            self._learner,
            self.one_a_slot,
            self.is_given_actions,
            self.task.sees,
            self.pheromone.dense,
            self.pheromone.view,
            self.task.traffic,
            self.ants_change,
            self.food_changes,
        )
        kind = Arguments.type_of(values)
        if phases in ("by_world", "by_team"):
            return Launch(getattr(kernels, phases)(variant, kind))
        return Launch(kernels.by_chunk(variant, getattr(kernels, phases), kind))

    def _values(self) -> dict[str, Any]:
        """All arrays and numbers of the kernels."""
        arrays = {name: one for name, one in self.arrays.items() if name not in _ANTS}
        return {**self._numbers(), **arrays, **self._rows()}

    def _rows(self) -> dict[str, np.ndarray]:
        """The rows of `AntRow` that there are, by the names that they have in kernels.

        The same views for each launch, which has to tell Taichi of others.
        """
        tables = [self.arrays[name] for name in _ANTS]
        if not self._known_rows or self._known_rows["cell"].base is not tables[0]:
            firsts = (AntRow.CELL, FIRST_TRAIT)
            self._known_rows = {
                AntRow(first + row).name.lower(): table[row]
                for table, first in zip(tables, firsts, strict=True)
                for row in range(len(table))
            }
        return self._known_rows

    def _numbers(self) -> dict[str, Any]:
        """What kernels know besides arrays; -1 stands for an option that is off."""
        life, memory, off = self.task.life, self.memory, -1
        return {
            "n_worlds": len(self.seeds),
            "n_ants": self.ants,  # that start an episode
            "n_slots": self.capacity,
            "n_chunks": self.chunks,
            "n_homes": self.n_homes,  # room for homes in each world
            "size": self.grid.size,
            "length": self.length,
            **self.pheromone.numbers,
            "turns_at_queen": int(self.task.turns_at_queen),
            "births": int(life.births),
            "lifespan": life.lifespan or off,
            "regrowth": off if life.regrowth is None else life.regrowth,
            "wander": life.wander or off,
            "ends_at_delivery": int(self.ends_at_delivery),
            "delivery_terminates": int(self.task.delivery != "continuing"),
            "initial_value": self.training.initial_value,
            "discount": self.training.discount,
            "epsilon": self.epsilon,
            "explore_below": np.uint64(self.epsilon * 4294967296.0),
            "planning_steps": self.training.planning_steps,
            # So that the sum of the errors of all ants is a fixed-point number, see `learning`.
            "largest_error": 2.0**31 / (self.capacity + 1),
            "tables": 1 + memory.tables,
            "floats_by_8": memory.floats // 8,  # see the runs' `engine`
            "integers_by_8": memory.integers // 8,
        }


def _can_wait(running: runtime.Runtime) -> bool:
    """Whether threads can wait for each other, as in `kernels.by_team`: not on a GPU."""
    return running.arch == "cpu"


def _checked_worlds(
    world: World | Sequence[World], n_seeds: int, learns: bool
) -> tuple[World, ...]:
    """A world for each seed, all of the same ranges."""
    given = entries_of(world) or [world] * n_seeds
    worlds = tuple(checks.checked_world(one, learns) for one in given)
    if len(worlds) != n_seeds:
        raise AntsError(f"there are {len(worlds)} worlds for {n_seeds} seeds.")
    ranges = {world.ranges for world in worlds}
    if len(ranges) > 1:
        raise AntsError(f"the worlds have the ranges {sorted(ranges)}; all must have the same.")
    return worlds
