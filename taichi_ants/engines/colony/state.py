"""The state of a colony: its worlds, ants and action values, views of them, and its files.

The state is in NumPy arrays, which kernels change in place. Only this package reads
`ColonyState.arrays`, see `layout`; other code uses the views.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, TypeVar, get_args

import numpy as np

from taichi_ants import arguments, files, learners, runtime
from taichi_ants.engines.colony import food_sources, layout
from taichi_ants.engines.colony.episodes import ColonyEpisodes
from taichi_ants.engines.colony.layout import BY_ANT, COLUMNS, NestRow, Order, Stage, WorldRow
from taichi_ants.engines.layout import compass_of, note_best_actions
from taichi_ants.errors import AntsError, as_array, check_one_of, checked_whole, enough_memory
from taichi_ants.features import FEATURES, arrays, numbers, used_by, without_files
from taichi_ants.features.cues import arrays_of
from taichi_ants.features.feature import ANT, CELL, NEST, Array
from taichi_ants.features.support import COLONY
from taichi_ants.files.archives import Kind
from taichi_ants.grid.constants import STREAM_ANT, STREAM_QUEEN
from taichi_ants.grid.randomness import stream_state, words_of
from taichi_ants.learners.config import TrainingConfig, update_weights
from taichi_ants.learners.learner import Memory
from taichi_ants.learners.policies import check_finite, checked_values, frozen_policy
from taichi_ants.records import Snapshot, same
from taichi_ants.task import Task
from taichi_ants.task.constants import EMPTY, FOOD, N_ACTIONS, OBSTACLE, ROW
from taichi_ants.task.model import Model
from taichi_ants.worlds.world import Start, World

State = TypeVar("State", bound="ColonyState")
SUPPORTS = COLONY
Sharing = Literal["shared", "independent", "frozen"]
SHARINGS: tuple[str, ...] = get_args(Sharing)
Arrays = dict[str, np.ndarray]
Which = slice | np.ndarray
# Views of arrays in snapshots: those of the core, and those of features.
_IN_SNAPSHOTS = ("cells", "headings", "numbers", "actions", "events", "nests")
OF_ANTS = tuple(array.view for _, array in arrays(ANT))
ALL = slice(None)  # selects all worlds; a bool (W,) selects some

_MOST_NUMBERS = 2**31 - 1  # kernels use 32-bit indices
# Unused settings for colonies with given actions, in which ants neither choose nor learn.
_NO_TRAINING = TrainingConfig("q_learning", 1.0, 1.0, 0.0, 1.0)

_KIND = Kind("colony", 14, "Colony.save", sealed=True)
# The contents of a file in addition to arrays: arguments of `Colony`, and progress.
_OPTIONS = ("seeds", "ants", "capacity", "start", "ends_at_delivery", "sharing", "schedule")
_PROGRESS = ("epsilon", "learning_rate", "length", "ticks")


def _view_of(array: Array) -> property:
    """Return a property of a colony: a view (W, n) of an array with n entries for each world."""

    def read(state: ColonyState) -> np.ndarray:
        shape = len(state.seeds), state.sizes[array.per]
        entries = state.arrays.get(array.name, state.arrays.get(array.instead))
        if entries is None or entries.size != math.prod(shape):
            entries = np.zeros(shape, array.dtype)
        entries = entries.reshape(shape)
        return entries.astype(array.shown_as) if array.shown_as else entries

    kind = np.dtype(array.shown_as or array.dtype)
    places = {ANT: "capacity", NEST: "nests", CELL: "grid.size"}.get(array.per, array.per)
    about = array.doc or f"{array.words.capitalize()}{f', in {array.unit}' if array.unit else ''}"
    return property(
        read, doc=f"{about}, {kind} (W, {places}){'' if array.shown_as else ', a view'}."
    )


class ColonyState:
    """The state of a colony of W worlds with `capacity` slots for ants each.

    Attributes, in addition to the arguments of `Colony`:
        learns: Whether the ants learn.
        has_training: Whether a `training` is given. Without it, ants take given actions, or choose
            by a rule that needs no action values.
        is_given_actions: Whether ants take the actions passed to `Colony.act`.
        one_a_slot: Whether each slot has its own table of action values, not each world.
        n_nests: The number of nests in each world.
        sizes: The numbers of slots, nests, cells, and what features count, in each world.
        pheromones: The trail, then the further fields, with or without evaporation, by number.
        memory: The size of the learner's memory for each table.
        stored: The names of the arrays in a file.
        length: Length of the episode in ticks; 0 if unknown.
        ready: bool (W,), whether an episode has begun, and each change of it was completed.
        delivered: int64 (W,), food items delivered in previous episodes.
        changed: bool (W,), whether interventions changed rock, food or the queen in this episode.
    """

    if TYPE_CHECKING:  # the views of arrays, see below

        def __getattr__(self, name: str) -> np.ndarray: ...

        _array: np.ndarray = np.zeros(0)
        actions = carried = carrying = cells = events = executed = headings = nests = _array
        next_actions = numbers = paper_states = states = _array  # so that editors know them

    @enough_memory("so many worlds, cells or ants")
    def __init__(
        self,
        world: World | Sequence[World],
        task: Task | None = None,
        training: TrainingConfig | None = None,
        seeds: int | Sequence[int] = 0,
        ants: int = 1,
        capacity: int | None = None,
        start: Start = "nest",
        ends_at_delivery: bool = False,
        sharing: Sharing = "shared",
        q_values: np.ndarray | None = None,
        threads: int | None = None,
        *,
        arch: str | None = None,
        schedule: Literal["by_world", "by_chunk", "by_ant"] | None = None,
    ) -> None:
        self.task = task = arguments.checked_task(task, "a colony", SUPPORTS)
        self.capacity = arguments.checked_capacity(task, ants, capacity, start, ends_at_delivery)
        self.ants, self.start, self.ends_at_delivery = int(ants), start, bool(ends_at_delivery)
        check_one_of("sharing", sharing, SHARINGS)
        self.sharing: str = sharing
        self.learns = sharing != "frozen"
        given = arguments.checked_training(training, task, sharing, q_values is not None)
        self.has_training, self.training = given is not None, given or _NO_TRAINING
        self.is_given_actions = task.needs_table and not self.has_training
        table = None if q_values is None else checked_values(q_values, task)
        self.seeds = arguments.checked_seeds(seeds)
        running = runtime.start(threads, arch)
        self.schedule = layout.schedule_of(schedule, len(self.seeds), self.capacity, running.arch)
        self.n_nests = 0
        worlds = self._checked_worlds(world)
        self.n_nests, shape = worlds[0].n_nests, () if table is None else table.shape
        # A table (W, n, ...) is by nest if n is the number of several nests, see `owners`.
        by_slot = len(shape) == 4 and (self.n_nests == 1 or shape[1] != self.n_nests)
        by_slot = by_slot and not self.learns and not any(f.tables_by for f in used_by(task))
        self.one_a_slot = by_slot or sharing == "independent"
        self.pheromones = task.pheromones_while(self.learns)
        self.memory, model = Memory(), self._model
        if model.learner is not None and (self.one_a_slot or model.plans_together):
            self.memory = model.learner.memory_for(self.training, task.n_states)
        # The states of all tables that ants of a world share, and the most chunks of a world.
        self._shared_rows = model.n_rows if sharing == "shared" else 0
        self.chunks = 1
        if self.schedule != "by_world":
            places = min(layout.PLACES, -(-self.capacity // layout.ANTS_OF_PLACE))
            places = places if self.schedule == BY_ANT else running.threads
            sizes = len(self.seeds), self.capacity, self._shared_rows * ROW, places
            self.chunks = layout.most_chunks(*sizes)
        self.arrays: Any = {}
        if self.schedule == BY_ANT:
            from taichi_ants.engines.colony.device import DeviceArrays  # imports Taichi

            self.arrays = DeviceArrays()
        self._lay_out(worlds)
        self.arrays |= (lasting := self._lasting(table))
        self.stored = (*self._changing, *lasting)
        self.epsilon, self.learning_rate = self.training.epsilon, self.training.learning_rate
        self.length, self.ready = 0, np.zeros(len(self.seeds), bool)
        self.delivered = np.zeros(len(self.seeds), np.int64)

    @cached_property
    def _model(self) -> Model:
        """The properties of the colony for which kernels are compiled."""
        learner = learners.get(self.training.learner) if self.learns else None
        own_tables, is_given = self.one_a_slot, self.is_given_actions
        return Model(self.task, self.learns, learner, own_tables, is_given, self.n_nests)

    # Views

    @property
    def episode(self) -> int:
        """The number of the current episode (the largest of all worlds), from 0; -1 before it."""
        return int(self.arrays["episodes"].max())

    @property
    def ticks(self) -> int:
        """The number of ticks since an episode started in all worlds."""
        return int(self.arrays["orders"][Order.PASSED])

    @ticks.setter
    def ticks(self, ticks: int) -> None:
        self.arrays["orders"][Order.PASSED] = ticks

    running = property(
        lambda colony: colony.arrays["worlds"][WorldRow.RUNNING] == 1,
        doc="Whether the episode of each world is still running, bool (W,).",
    )
    episode_ticks = property(
        lambda colony: colony.arrays["worlds"][WorldRow.TICKS],
        doc="Ticks since the episode of each world began, int32 (W,), a view.",
    )
    deliveries = property(
        lambda colony: colony.arrays["worlds"][WorldRow.DELIVERIES],
        doc="Deliveries of the present episode, int32 (W,), a view.",
    )
    living = property(
        lambda colony: colony._stages == Stage.LIVING,
        doc="Whether an ant lives in each slot, bool (W, capacity).",
    )
    queen_cells = property(
        lambda colony: colony._of_nests(NestRow.QUEEN_CELL),
        doc="Flat indices of the cells of queens, int32 (W, nests), a view.",
    )
    streams = _view_of(Array("streams", ANT, "u8", doc="State of the random stream"))

    def _part(self, name: str, world: int) -> np.ndarray:
        """Return a view of a world's part of an array that has only parts of worlds."""
        return self.arrays[name].reshape(len(self.seeds), -1)[world]

    def _of_nests(self, row: int) -> np.ndarray:
        """Return a view (W, nests) of a row of the numbers of nests."""
        return self.arrays["nests"][row].reshape(len(self.seeds), -1)

    @property
    def occupied(self) -> np.ndarray:
        """Whether an ant is on each cell, bool (W, grid.size)."""
        return self.arrays["ground"].reshape(len(self.seeds), -1) >> 4 != 0

    @property
    def nbytes(self) -> int:
        """The number of bytes of all arrays."""
        kept = self.arrays, self.at_start, self.first
        return sum(array.nbytes for arrays in kept for array in arrays.values())

    @property
    def q_values(self) -> np.ndarray:
        """The action values, float32 (W, n_states, 5); a copy.

        With a table for each slot (W, slots, n_states, 5). If several nests or castes share tables,
        they have axes after W: (W, nests, castes, n_states, 5).
        """
        shape = len(self.seeds), *self._axes.values(), -1, self.task.n_states, ROW
        return self.arrays["q"].reshape(shape)[..., 0, :, :N_ACTIONS].copy()

    @property
    def _axes(self) -> dict[str, int]:
        """The numbers of slots that own tables, or else of nests and castes if several do."""
        if self.one_a_slot:
            return {"slot": self.capacity}
        return {per: n for per, n in self._groups.items() if n > 1}

    @property
    def _groups(self) -> dict[str, int]:
        """The numbers of nests, and of groups in a nest, whose ants share a table."""
        by = (feature.tables_by for feature in self._model.features if feature.tables_by)
        return {NEST: self.n_nests, **{per: self.sizes[per] for per in by}}

    @property
    def _owners(self) -> int:
        """The number of tables in each world: one for each slot, or for each nest and caste."""
        return math.prod(self._axes.values())

    @property
    def tables_of_ants(self) -> np.ndarray:
        """The number of the table by which the last ant in each slot acts, int32 (W, capacity)."""
        if self.one_a_slot:
            return np.tile(np.arange(self.capacity, dtype=np.int32), (len(self.seeds), 1))
        tables = np.zeros_like(self.nests)
        for per, n in self._groups.items():
            tables = tables * np.int32(n) + getattr(self, COLUMNS[per].view)
        return tables

    @property
    def rewards(self) -> np.ndarray:
        """The reward of the last action of the ant in each slot, int32 (W, capacity)."""
        if "reward" in self.arrays:
            return self.arrays["reward"].reshape(self.events.shape).copy()
        rewards = self.task.rewards.by_event()[self.events]
        for feature in self._model.features:
            rewards = feature.paid(self, rewards)
        return rewards

    def outcome(self) -> ColonyEpisodes:
        """Return the results of the episode so far, arrays (1, W).

        Raises:
            AntsError: An episode has not begun, or was interrupted, or a value is NaN.

        >>> colony.tick(100)
        >>> colony.outcome().ticks.item()
        100
        """
        self._check_begun()
        self._check_finite()
        return self._results()

    def _results(self) -> ColonyEpisodes:
        rows, totals = self.arrays["worlds"], self.arrays["totals"]
        counts: Arrays = {
            **{row.name.lower(): totals[row] for row in layout.TOTALS},
            "waiting_births": self._of_nests(NestRow.STORE).sum(axis=1, dtype=np.int32),
            **{row.name.lower(): rows[row] for row in WorldRow if row >= WorldRow.TICKS},
        }
        for feature in FEATURES:
            counts |= feature.counts(self)
        copies: Any = {name: array[None].copy() for name, array in counts.items()}
        return ColonyEpisodes(**copies, seeds=self.seeds)

    def snapshot(self, world: int = 0) -> Snapshot:
        """Return the present state of world number `world`; arrays are copies.

        >>> colony.snapshot().ant_cells.shape
        (16,)
        """
        self._check_begun()
        w = checked_whole("world", world, most=len(self.seeds) - 1, least=0)
        slots, levels = self.living[w], {}
        further: dict[str, Any] = {}
        shown = {name: getattr(self, name)[w, slots] for name in (*_IN_SNAPSHOTS, *OF_ANTS)}
        ants = {f"ant_{name}": shown[name].astype(np.int32) for name in _IN_SNAPSHOTS}
        carries = self.carrying[w, slots]
        ground = self._part("ground", w).copy()
        ground[ants["ant_cells"]] = EMPTY
        for number, name in enumerate(self.task.pheromones):
            stored, clock = self._stored_pheromone(w, number)
            levels[name] = np.maximum(stored - stored.dtype.type(clock), 0)
        for feature in self._model.features:
            further |= feature.shown(self, w, slots, ground == FOOD)
        return Snapshot(
            self.grid,
            ground,
            next(iter(levels.values())),
            **ants,
            ant_carries=carries,
            ant_carried=np.where(carries, self.carried[w, slots], np.int32(0)),
            queens=self.queen_cells[w].copy(),
            of_ants={name: shown[name] for name in OF_ANTS},
            fields=levels,
            counts=self._results().of_world(w),
            names={f.group: tuple(of) for f in FEATURES if isinstance(of := f.of(self.task), dict)},
            world=self.worlds[w],
            **further,
        )

    def _stored_pheromone(self, world: int, number: int) -> tuple[np.ndarray, int]:
        """Return a view of a pheromone as kernels store it, and its clock; 0 is the trail.

        A pheromone in whole numbers has expiry clocks, int32 (grid.size,). A dense one has levels,
        float32, and its clock is 0. The level of a cell is max(stored - clock, 0).
        """
        pheromone = self.pheromones[number]
        falls = pheromone.evaporation == "linear" and not pheromone.dense
        stored = self._part(layout.array_of(number, pheromone.dense), world)
        return stored, int(self.episode_ticks[world]) * falls

    def _check_begun(self) -> None:
        """Raise an AntsError unless all worlds are in an episode, whose changes are complete."""
        if not self.ready.all():
            why = "no episode has begun"
            if self.episode >= 0:
                why = "not all worlds have begun an episode, or a change of one was interrupted"
            raise AntsError(f"{why}; call begin_episode first.")

    def _check_finite(self) -> None:
        """Raise an AntsError if an action value is not finite."""
        tables = self.arrays["q"].reshape(len(self.seeds), -1)
        check_finite(tables, [self.training], self.seeds)

    # Changes

    def _checked_worlds(self, world: World | Sequence[World]) -> tuple[World, ...]:
        """Return one world per seed; AntsError if their number is wrong or one does not fit."""
        return arguments.checked_worlds(world, len(self.seeds), self.learns, self.n_nests)

    def _lay_out(self, worlds: tuple[World, ...]) -> None:
        """Make the arrays that depend on the worlds; AntsError if they have too few free cells."""
        self.worlds, self.grid = worlds, worlds[0].grid
        self.sizes = {ANT: self.capacity, NEST: self.n_nests, CELL: self.grid.size}
        for feature in FEATURES:
            self.sizes |= {per: of(self) for per, of in feature.spaces.items()}
        arguments.check_features(self.task, worlds, self.sharing)
        self.changed = np.zeros(len(worlds), bool)
        most = max(len(world.foods) for world in worlds)
        self._make_room_for_food(most if self._model.food_changes else 0)
        self.arrays |= self._constants()

    def _make_room_for_food(self, n: int) -> None:
        """Reset all arrays of episodes, with room for n food sources in each world."""
        self._read_start(n)
        made = {name: array.copy() for name, array in self.at_start.items()}
        made |= self._pheromone_arrays(len(self.worlds) * self.grid.size)
        dense = self._model.dense_by_number[0]  # of the trail; the other array is not in use
        made[layout.array_of(0, not dense)] = np.zeros(1, np.int32 if dense else np.float32)
        for dtype in ("i4", "i1", "f4"):
            used = [array.name for array in layout.columns_of(self._model) if array.dtype == dtype]
            # One allocation, because columns at equal offsets in pages slow each other down.
            columns = np.zeros((len(used), len(self.worlds) * self.capacity), dtype)
            made |= zip(used, columns, strict=True)
        self._changing = tuple(made)
        self.arrays |= made
        self._set_to_start()

    def _count_deliveries(self, which: Which = ALL) -> None:
        """Add the deliveries of the episode to those of the previous ones."""
        deliveries = self.deliveries
        # No call is between the two statements, so Ctrl-C does not separate them.
        self.delivered[which] += deliveries[which]
        deliveries[which] = 0

    def _stop(self, which: np.ndarray) -> None:
        """End the episode of some worlds, bool (W,), which then wait for their next episode."""
        self.arrays["worlds"][WorldRow.RUNNING, which] = 0

    def _keep_streams(self, which: Which = ALL) -> None:
        """Save the random streams of the ants that started the episode of these worlds."""
        ours = np.zeros((len(self.seeds), 1), bool)
        ours[which] = True
        there = (self._stages != Stage.VACANT) & ours
        worlds, slots = np.nonzero(there & (self.numbers >= 0) & (self.numbers < self.ants))
        first_streams = self.arrays["first_streams"].reshape(self.numbers.shape)
        first_streams[worlds, self.numbers[worlds, slots]] = self.streams[worlds, slots]

    def _set_learning_rate(self, learning_rate: float) -> None:
        self.learning_rate = learning_rate
        weights, kept = self._update_weights(learning_rate), self.arrays["weights"]
        if len(weights) > len(kept):  # rare, because Taichi leaks some bytes for each new array
            room = min(2 * len(weights), self.capacity + 1)
            kept = self.arrays["weights"] = np.empty(room, np.float32)
        kept[: len(weights)], kept[len(weights) :] = weights, weights[-1]

    def _update_weights(self, learning_rate: float) -> np.ndarray:
        """Return the weight of the mean of n TD errors in an update, by n."""
        return update_weights(learning_rate, self.capacity if self.sharing == "shared" else 1)

    @property
    def _can_sort(self) -> bool:
        """Whether ants may change slots: not if slots matter, or some are vacant.

        Ants have numbers, so their order does not change results. Vacant slots are the last ones.
        """
        living = self.arrays["worlds"][WorldRow.LIVING]
        return not self._model.slots_matter and int(living.min()) == self.capacity

    @property
    def _near_bits(self) -> int:
        """The number of the lowest bits of a cell's number that do not matter to the order."""
        return max(0, self.grid.size.bit_length() - layout.SORTED_BITS)

    def _sort_ants(self) -> None:
        """Sort the ants of a world roughly by cell, so that neighbours share caches."""
        # NumPy sorts keys of 16 bits in a tenth of the time.
        self._sort_slots((self.cells >> self._near_bits).astype(np.uint16))

    def _close_gaps(self) -> None:
        """Move vacant slots behind those with ants, unless slots matter."""
        if not self._model.slots_matter:
            self._sort_slots(self._stages == Stage.VACANT)

    def _sort_slots(self, keys: np.ndarray) -> None:
        """Sort the slots of each world by keys (W, capacity), equal ones in their present order."""
        first = np.arange(len(self.seeds))[:, None] * self.capacity
        order = (np.argsort(keys, axis=1, kind="stable") + first).ravel()
        for name in self._columns():
            self.arrays[name][:] = self.arrays[name][order]

    def _columns(self) -> tuple[str, ...]:
        """Return the names of the arrays with one entry for each slot."""
        return (*(name for name in COLUMNS if name in self.arrays), "streams")

    # Arrays

    def _read_start(self, n_food_sources: int) -> None:
        """Set the arrays with which worlds and ants begin each episode, see `set_to_start`."""
        self.n_food_sources = n_food_sources
        worlds, n, model = self.worlds, self.ants, self._model
        starts = [w.start(seed, n, self.start) for w, seed in zip(worlds, self.seeds, strict=True)]
        cells = np.stack([cells for cells, _ in starts])
        self.nests_at_start = nests = self._of_each(lambda world: world.nests_of(n))
        # Columns of the ants by world and number.
        headings = np.array([headings for _, headings in starts], np.int8)
        self.first = {"cell": cells, "heading": headings}
        if self.n_nests > 1:
            self.first["nest"] = nests.astype(np.int8)
        for feature in model.features:
            self.first |= feature.columns(self)
        ground, of_cells = self._of_each(World.ground), self._of_each(World.kinds_by_cell)
        is_food = ground == FOOD
        marks = (layout.ANT_GROUND - (nests << 4)).astype(np.uint8)
        np.put_along_axis(ground, cells.astype(np.int64), marks, axis=1)
        levels = self._of_each(World.trail_levels)
        levels = levels if levels.any() else levels[:, :1].copy()  # all cells are equal
        rows = np.zeros((len(WorldRow), len(worlds)), np.int32)
        rows[[WorldRow.TOP, WorldRow.FIRST_VACANT, WorldRow.LIVING, WorldRow.NEXT_NUMBER]] = n
        rows[WorldRow.RUNNING], rows[WorldRow.FIRST_DELIVERY] = 1, -1
        of_nests = np.zeros((len(NestRow), len(worlds) * self.n_nests), np.int32)
        queens = self._of_each(lambda world: world.grid.index(world.queens))
        of_nests[NestRow.QUEEN_CELL] = queens.reshape(-1)
        foods = [food_sources.at_start(world) for world in worlds] if n_food_sources else []
        self.at_start = {
            # The ground of each cell, and the mark of the ant on it, see `layout`.
            "ground": ground.reshape(-1),
            # The clock at which a cell's trail has evaporated; if dense, its level. The same for
            # each further field, which is empty at the start.
            **self._pheromone_arrays(len(worlds)),
            layout.array_of(0, model.dense_by_number[0]): levels.reshape(-1),
            "worlds": rows,
            "nests": of_nests,
            **{
                array.name: np.zeros(
                    len(worlds) * self.sizes[array.per] if feature in model.features else 1,
                    array.dtype,
                )
                for feature, array in arrays()
                if array.per != ANT and (feature in model.features or array.always)
            },
            # Sums over all ants in this episode, see `Tally`.
            "totals": np.zeros((len(layout.TOTALS), len(worlds)), np.int64),
            **food_sources.arrays(foods, rows, n_food_sources, self.grid.size),
        }
        for feature in model.features:
            for name, values in feature.filled(self, of_cells).items():
                self.at_start[name][:] = np.where(is_food, values, 0).reshape(-1)

    def _pheromone_arrays(self, n: int) -> Arrays:
        return {
            layout.array_of(number, dense): np.zeros(n, np.float32 if dense else np.int32)
            for number, dense in enumerate(self._model.dense_by_number)
        }

    def _set_to_start(self, which: Which = ALL) -> None:
        """Reset the arrays that change in an episode, for these worlds."""
        self._copy_worlds(self.at_start, which)
        shape, n = (len(self.worlds), self.capacity), self.first["cell"].shape[1]
        starts: Arrays = {**self.first, "number": np.arange(n), "stage": np.array(Stage.LIVING)}
        for name in COLUMNS.keys() & self.arrays.keys():
            slots = self.arrays[name].reshape(shape)
            slots[which] = COLUMNS[name].start
            if name in starts:
                slots[which, :n] = np.broadcast_to(starts[name], (shape[0], n))[which]

    def _lasting(self, q_values: np.ndarray | None) -> Arrays:
        slots, memory, n_worlds = self.capacity, self.memory, len(self.seeds)
        owners = n_worlds * self._owners
        sizes = ((1 + memory.tables) * self.task.n_states * ROW, memory.floats, memory.integers)
        if owners * max(sizes) > _MOST_NUMBERS:
            raise AntsError(
                f"{owners} tables, with the memory of learner {self.training.learner!r} for each, "
                f"need more than {_MOST_NUMBERS} numbers; choose fewer ants, worlds or states, or "
                'sharing="shared".'
            )
        return {
            "streams": np.zeros(n_worlds * slots, np.uint64),
            **self._seeded(),
            # By world or slot: the table, then further tables of the learner; its memory.
            "q": self._tables(q_values),
            "floats": np.zeros(max(1, owners * memory.floats), np.float32),
            "integers": np.zeros(max(1, owners * memory.integers), np.int32),
        }

    def _seeded(self) -> Arrays:
        """Return the arrays that depend on seeds and last through all episodes."""
        seeds = words_of(self.seeds)
        ants = np.arange(self.capacity, dtype=np.uint64)  # more ants may start later episodes
        first_streams = stream_state(seeds[:, None], STREAM_ANT, ants[None, :])
        return {
            # By world and ant number: the last states of the streams of ants that start episodes.
            "first_streams": first_streams.reshape(-1),
            "queen_streams": np.atleast_1d(stream_state(seeds, STREAM_QUEEN, 0)).astype(np.uint64),
            "episodes": np.full(len(seeds), -1, np.int32),  # the number of the present episode
        }

    def _tables(self, q_values: np.ndarray | None) -> np.ndarray:
        """Return the tables of all worlds or slots, with `q_values` or the initial value."""
        n_worlds, slots, n_states = len(self.seeds), self._owners, self.task.n_states
        q = np.zeros((n_worlds, slots, 1 + self.memory.tables, n_states, ROW), np.float32)
        q[..., :N_ACTIONS] = self.training.initial_q
        if q_values is not None:
            tables = arguments.checked_tables(q_values, n_worlds, self._axes)
            q[..., :N_ACTIONS] = tables[..., None, :, :]
        for feature in self._model.features:
            for number, (policy, name) in feature.policies(self.task).items():
                table = frozen_policy(policy, self.task.observation, name)
                of_groups = q.reshape(n_worlds, self.n_nests, -1, *q.shape[2:])
                of_groups[:, :, number, 0, :, :N_ACTIONS] = table
        note_best_actions(q)
        return q.reshape(-1)

    def _constants(self) -> Arrays:
        """Return constants of worlds and settings, and scratch arrays of a tick."""
        n_worlds, rows, touched = len(self.seeds), self._shared_rows, self._shared_rows * ROW + 1
        chunks = sums = n_worlds * self.chunks
        if self.schedule != "by_world":
            sums, touched = n_worlds + chunks, layout.TOUCHED_LINE * -(-rows // layout.TOUCHED_LINE)
        pairs, cells = max(1, sums * rows * ROW), n_worlds * self.grid.size
        by_ant, plans = self.schedule == BY_ANT, self._model.plans_together
        return {
            **self._ground_constants(),
            "compass": compass_of(self.grid),  # see `rules.actions`
            "seeds": words_of(self.seeds),
            **self._settings(),
            "hyperparameters": np.array([*dict(self.training.hyperparameters).values(), 0.0]),
            # By n: the weight of the mean of n errors in an update; see `set_learning_rate`.
            "weights": np.zeros(2, np.float32),
            # By cell: the mark of what its ant wants, see `rules.conflicts`.
            "wants": np.zeros(cells, np.uint8),
            "spare": np.zeros_like(self.arrays["level"]),  # the next levels, with diffusion
            **{
                f"spare_{number}": np.zeros(cells, np.float32)
                for number, dense in enumerate(self._model.dense_by_number)
                if number and dense
            },
            "orders": np.array([self.chunks * (one == Order.CHUNKS) for one in Order], np.int32),
            "barrier": np.zeros(layout.BARRIER_SIZE, np.int64),  # see `barrier`
            "tallies": np.zeros(chunks * layout.TALLY_WIDTH, np.int64),
            "delivered": np.zeros(chunks * layout.NESTS_BY_KINDS, np.int32),  # by nest and kind
            # See `learning`: fixed-point sums of TD errors, the last error, and `SumRow`; by world
            # if there are chunks, and by chunk.
            "sums": np.zeros(pairs, np.int64),
            "errors": np.zeros(pairs, np.float32),
            "sums_of": np.zeros((len(layout.SumRow), pairs), np.int32),
            "touched": np.zeros(max(1, sums * touched), np.int32),
            **dict.fromkeys(["latest"] * by_ant, np.zeros(pairs if plans else 1, np.int64)),
        }

    def _settings(self) -> Arrays:
        """Return the settings of the task as kernels read them."""
        task = self.task
        settings = {"rewards": task.rewards.by_event(), **numbers(task)}
        for feature in self._model.features:
            settings |= feature.constants(self)
        if task.rules:  # the parameters of your own rules
            rules = [value for rule in task.rules.values() for value in vars(rule).values()]
            settings["rule_numbers"] = np.array([*rules, 0.0], np.float64)
        return settings

    def _ground_constants(self) -> Arrays:
        return {
            # 1 for rocks and outside.
            "walls": (self._of_each(World.ground) == OBSTACLE).astype(np.uint8).reshape(-1),
            **{name: self._maps(make) for name, make in arrays_of(self._model.senses).items()},
        }

    def _maps(self, make: Callable[[World, int], Any]) -> np.ndarray:
        """Return an array of a cue that is not a pheromone, by world, nest and cell."""
        maps = self._of_each(lambda world: [make(world, nest) for nest in range(world.n_nests)])
        return maps.reshape(-1)

    def _of_each(self, make: Callable[[World], Any]) -> np.ndarray:
        """Return an array for each world, made once for equal worlds."""
        made = {world: make(world) for world in dict.fromkeys(self.worlds)}
        return np.stack([made[world] for world in self.worlds])

    def _copy_worlds(self, source: Arrays, which: Which) -> None:
        """Copy some worlds from other arrays; worlds are consecutive in the last axis."""
        n_worlds = len(self.seeds)
        for name, array in source.items():
            if array.shape[-1] % n_worlds == 0:  # others are not in use
                shape = (*array.shape[:-1], n_worlds, -1)
                kept = self.arrays[name].reshape(shape)
                kept[..., which, :] = array.reshape(shape)[..., which, :]

    # Files

    def _contents(self) -> tuple[dict[str, Any], Arrays]:
        arrays = {f"array_{name}": self.arrays[name] for name in self.stored}
        places = {world: place for place, world in enumerate(dict.fromkeys(self.worlds))}
        facts = {
            "task": self.task.as_dict(),
            "training": self.training.as_dict() if self.has_training else None,
            "worlds": [world.as_dict() for world in places],
            "world_of": [places[world] for world in self.worlds],
            "one_a_slot": self.one_a_slot,
            # Interventions can add food sources.
            "food_sources": self.n_food_sources,
            **{name: getattr(self, name) for name in (*_OPTIONS, *_PROGRESS)},
        }
        return facts, arrays

    def save(self, path: files.PathLike) -> None:
        """Write the present state to a file, from which `load` resumes the colony bit for bit.

        AntsError if an action value is not finite, seeds repeat, or the file cannot be written.
        """
        self._check_finite()
        arguments.checked_seeds(self.seeds)
        if self.episode >= 0:
            self._check_begun()
        facts, arrays = self._contents()
        _KIND.write(path, facts, arrays, compress=False)

    @classmethod
    def load(
        cls: type[State],
        path: files.PathLike,
        threads: int | None = None,
        *,
        arch: str | None = None,
    ) -> State:
        """Return a colony that `save` wrote; `threads` and `arch` are those of `train`.

        AntsError if the file cannot be used, or its learner or observation is not registered.

        >>> colony.save("colony.npz")
        >>> Colony.load("colony.npz") == colony
        True
        """
        running = runtime.start(threads, arch)  # first: its errors are not about the file
        with _KIND.reading(path) as (arrays, facts):
            training = facts["training"] and TrainingConfig(**facts["training"])
            worlds = [World.from_dict(world) for world in facts["worlds"]]
            task, options = Task.from_dict(facts["task"]), {name: facts[name] for name in _OPTIONS}
            if (options["schedule"] == BY_ANT) != (running.arch == "cuda"):
                options["schedule"] = None  # of another processor
            if options["sharing"] == "frozen" and training is not None:
                # Tables of the right shape, which the arrays of the file replace.
                leading = (len(facts["seeds"]), facts["capacity"]) if facts["one_a_slot"] else ()
                options["q_values"] = np.zeros((*leading, task.n_states, N_ACTIONS), np.float32)
            known = without_files(task)  # tables are in the arrays; other files may be gone
            colony = cls([worlds[w] for w in facts["world_of"]], known, training, **options)
            colony.task, colony.length, colony.ticks = task, facts["length"], facts["ticks"]
            colony.epsilon = arguments.checked_share("epsilon", facts["epsilon"])
            colony._set_learning_rate(facts["learning_rate"])
            if facts["food_sources"] != colony.n_food_sources:
                colony._make_room_for_food(facts["food_sources"])
            for name in colony.stored:
                array = colony.arrays[name]
                array[:] = as_array(name, arrays[f"array_{name}"], array.dtype, array.shape)
            colony.ready = colony.arrays["episodes"] >= 0
        return colony

    def __eq__(self, other: object) -> bool:
        """Return whether both would be saved as equal files, and so behave identically."""
        if not isinstance(other, ColonyState):
            return NotImplemented
        (facts, arrays), (other_facts, other_arrays) = self._contents(), other._contents()
        return facts == other_facts and same(arrays, other_arrays)

    __hash__ = None  # type: ignore[assignment]  # it changes with each tick


for array in (*COLUMNS.values(), *(array for _, array in arrays() if array.per != ANT)):
    if array.view:
        setattr(ColonyState, array.view, _view_of(array))
