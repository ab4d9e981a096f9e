"""The colony tick by tick: launches of its kernels, and the choice of threads for a tick."""

from __future__ import annotations

import copy
import math
import statistics
import time
from collections.abc import Iterator, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np

from taichi_ants import arguments, runtime
from taichi_ants.engines.colony.layout import BY_ANT, GAVE_UP, Barrier, Order, WorldRow, chunks_for
from taichi_ants.engines.colony.state import ALL, ColonyState, Which
from taichi_ants.errors import AntsError, as_array, checked_whole, count, entries_of, shown
from taichi_ants.grid.randomness import words_of
from taichi_ants.task.constants import MAX_STEPS, N_ACTIONS
from taichi_ants.worlds.world import World

# Ants are sorted after this many steps of all ants, within limits in ticks.
_STEPS_BETWEEN_SORTS, _FEWEST_TICKS, _MOST_TICKS = 2_500_000, 16, 256
_SORT_SECONDS = 0.25  # about the time in which Taichi loads the kernel that sorts
_MOST_IN_ONE_LOOP = 65_536  # entries, such as ants, for which a GPU is faster with one loop
_PIECE_SECONDS = 0.4
_SPINS = 2**26  # checks of a thread at a barrier, which take at least half a second
# Trials of another number of threads: seconds in a launch, launches, the share of all time, and the
# log of the gain in speed for which the number changes.
_TRIAL_SECONDS, _TRIAL_LAUNCHES, _TRIAL_SHARE, _LEAST_GAIN = 0.01, 3, 0.03, 0.03


class ThreadChoice:
    """The choice of the number of threads that share the ticks of a large world: 1, 2, 4, ..., all.

    Threads that share a tick wait for each other several times, and they wait long if other
    programs use the processors. So the choice starts with all threads, and tries the next lower and
    the next higher number in turn. A trial is three short launches with the other number. The first
    does not count, because threads that have rested wake up late, and of the others only the faster
    one, because all threads wait if one is interrupted. Trials take at most `_TRIAL_SHARE` of all
    time, and much less with a number that was slower, because threads that have rested also delay
    the next launches. Only the first launch with each number is extra: on processors that other
    programs use, fewer threads can be many times faster.
    """

    def __init__(self, most: int = 1) -> None:
        self.numbers = (*(2**i for i in range((most - 1).bit_length())), most)
        self.at = len(self.numbers) - 1  # the place of the present number
        self.gains: dict[int, float] = {}  # by place: log of the speed relative to the present one
        self.tried: dict[int, float] = {}  # by place: seconds per tick in the last trial
        self.recent: list[float] = []  # seconds per tick of the last launches of no trial
        self.allowance = 0.0  # seconds that trials may take by now
        self._step = 1  # to the neighbour that was tried last, then the other one
        self._left = 0  # launches of a trial that are left
        self._ticks = 1  # in each of them

    def plan(self, ticks: int, most: int) -> tuple[int, int]:
        """Return the number of ticks for the next launch, and of threads, up to `most`."""
        if most != self.numbers[-1]:
            vars(self).update(vars(ThreadChoice(most)))
        if not self._left and self.recent:
            pace = statistics.median(self.recent)
            self._ticks = max(1, round(_TRIAL_SECONDS / pace))
            for step in (-self._step, self._step):
                slower = self.tried.get(self.at + step, pace / 3) / pace
                # More threads are often slow for a short time only, for example two on a processor.
                weight = slower**2 if step < 0 else min(slower, 2)
                cost = _TRIAL_LAUNCHES * min(ticks, self._ticks) * pace * weight
                if 0 <= self.at + step < len(self.numbers) and cost <= self.allowance:
                    self._left, self._step = _TRIAL_LAUNCHES, step
                    break
        if self._left:
            return min(ticks, self._ticks), self.numbers[self.at + self._step]
        return ticks, self.numbers[self.at]

    def note(self, ticks: int, seconds: float) -> None:
        """Take notice of the time of a launch that followed the last plan."""
        pace, other = seconds / ticks, self.at + self._step
        self.allowance += _TRIAL_SHARE * seconds
        if not self._left:
            self.recent = [*self.recent[-8:], pace]
            return
        self.allowance -= seconds if other in self.tried else 0.0
        counts = self._left < _TRIAL_LAUNCHES - 1  # the first two give a pace to compare with
        self.tried[other] = min(pace, self.tried[other]) if counts else pace
        self._left -= 1
        if not self._left:
            gain = math.log(statistics.median(self.recent) / self.tried[other])
            self.gains[other] = gain + self.gains.get(other, 0.0) / 2
            if self.gains[other] > _LEAST_GAIN:
                self.at, self.gains, self.recent = other, {}, [self.tried[other]]
                self.allowance = 0.0  # a trial that paid off has cost nothing


class TickingColony(ColonyState):
    """A colony whose ants observe, act and learn; `Colony` adds runs of whole episodes."""

    _piece = 1  # a number of ticks that takes less than _PIECE_SECONDS
    _sort_seconds = 0.0  # spent on sorting by NumPy
    _launches = cached_property[dict[Any, Any]](lambda colony: {})  # prepared kernels, by name
    _choice = cached_property(lambda colony: ThreadChoice())

    def begin_episode(
        self, length: int | None = None, world: World | Sequence[World] | None = None
    ) -> None:
        """Reset worlds and ants to the start of an episode, and let the ants observe.

        Args:
            length: Number of ticks, for learners that update at the last tick; None if unknown.
            world: The new world or worlds, as for `Colony`; None keeps the present ones.

        Raises:
            AntsError: A world is not allowed.

        >>> colony.begin_episode()
        >>> colony.ticks
        0
        """
        fresh = copy.copy(self)
        fresh.length = 0 if length is None else checked_whole("length", length, most=MAX_STEPS)
        if world is not None:  # which may have too little room
            fresh.arrays = copy.copy(self.arrays)
            fresh._lay_out(self._checked_worlds(world))
        self.ready[:] = False  # also after Ctrl-C before the end
        self._count_deliveries()
        vars(self).update(vars(fresh))
        self.ticks = 0
        self._start()

    def _start(self, which: Which = ALL) -> None:
        """Reset worlds to the start of an episode, and let their ants observe.

        Tables, memories and random streams stay.
        """
        self.ready[which] = False
        self._count_deliveries(which)
        self._set_learning_rate(self.learning_rate)
        self._set_to_start(which)
        stale = np.zeros_like(self.changed)
        stale[which] = self.changed[which]
        if stale.any():
            self._copy_worlds(self._ground_constants(), stale)
            self.changed[stale] = False
        self._copy_worlds({"streams": self.arrays["first_streams"]}, which)
        self.arrays["episodes"][which] += 1
        self._launch("begin")
        self.ready[which] = True

    def reset_worlds(self, which: np.ndarray, seeds: Sequence[int] | None = None) -> None:
        """Start the next episode of the worlds `which`, bool (W,), while the others continue.

        For these worlds it does the same as `end_episode` and `begin_episode`, but does not change
        epsilon and the learning rate. With `seeds`, one for each of these worlds, they restart as
        in a new `Colony`, except that tables and memories of learners are kept. Seeds may repeat,
        but then `save` raises an error.

        Raises:
            AntsError: The number of worlds or seeds is wrong, or a seed is not allowed.

        >>> colony.reset_worlds(np.array([True]))
        >>> colony.episode, colony.ticks
        (1, 0)
        """
        which = as_array("which", which, "b", (len(self.seeds),))
        if seeds is None:
            self._keep_streams(which)
        else:
            listed, (places,) = entries_of(seeds) or [], np.nonzero(which)
            checked = [seed for one in listed for seed in arguments.checked_seeds(one)]
            if len(checked) != len(places):
                wanted = count(len(places), "seed")
                raise AntsError(f"seeds is {shown(seeds)}; give a list of {wanted}.")
            self.ready[which] = False
            changed = dict(zip(places.tolist(), checked, strict=True))
            self.seeds = tuple(changed.get(w, seed) for w, seed in enumerate(self.seeds))
            self.arrays["seeds"][:] = words_of(self.seeds)
            self._read_start(self.n_food_sources)
            self._copy_worlds(self._seeded(), which)
        self._start(which)

    def _observe(self, worlds: Sequence[int]) -> None:
        """Let the ants of some worlds observe again, after interventions in these worlds."""
        running = self.arrays["worlds"][WorldRow.RUNNING].copy()
        others = np.setdiff1d(np.arange(len(running)), worlds)
        self.arrays["worlds"][WorldRow.RUNNING, others] = 0  # ants that misread draw numbers
        try:
            self._launch("see_interventions")
        finally:
            self.arrays["worlds"][WorldRow.RUNNING] = running

    def tick(self, n: int = 1) -> None:
        """Advance by n ticks, except worlds whose episode has ended."""
        self._check_begun()
        if self.is_given_actions:
            raise AntsError(
                "training is None, so ants do not choose actions; call act with the actions of "
                "each tick instead."
            )
        for _ in self._pieces(checked_whole("n", n)):
            pass

    def act(self, actions: np.ndarray) -> None:
        """Advance by one tick in which ants take given actions; for colonies without a training.

        Actions are whole numbers 0 to 4 (W, capacity): left, forward, right, pick up, give. Those
        of vacant slots and of worlds whose episode has ended are ignored. AntsError if no episode
        has started, the colony has a training, or an action is not allowed.

        >>> given = Colony(worlds.paper(), ants=4, sharing="frozen")
        >>> given.begin_episode()
        >>> given.act(np.ones((1, 4), int))  # forward
        >>> given.rewards.tolist()
        [[1, -1, -1, 0]]
        """
        self._check_begun()
        if not self.is_given_actions:
            raise AntsError(
                "the ants of this colony choose their own actions; call tick instead, or make a "
                'colony with training=None and sharing="frozen".'
            )
        shape, most = (len(self.seeds), self.capacity), N_ACTIONS - 1
        given = as_array("actions", actions, "iu", shape)
        if given.min() < 0 or given.max() > most:
            given = as_array("actions", np.where(self.living, given, 0), "iu", shape, 0, most)
        self.actions[:] = given
        self._advance(1)

    def end_episode(self) -> None:
        """End the episode: save random streams for the next one, and decay epsilon and the rate.

        >>> colony.end_episode()
        >>> colony.epsilon
        0.099
        """
        self._check_finite()
        self._keep_streams()
        epsilon = self.training.next_epsilon(self.epsilon)
        learning_rate = self.training.next_learning_rate(self.learning_rate)
        self.epsilon, self.learning_rate = epsilon, learning_rate

    # Launches

    def _pieces(self, n: int) -> Iterator[None]:
        """Yield after each short launch until n ticks are done; launches cannot be interrupted."""
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
        if self.schedule == BY_ANT:
            self._advance_by_ant(n)
            return
        end = self.ticks + n
        n_worlds, running = len(self.seeds), runtime.start().threads
        if self.schedule == "by_world":
            threads = min(running, n_worlds)
            self._launch_parts("ticks", n, threads * -(-n_worlds // threads), threads)
            return
        interval = _STEPS_BETWEEN_SORTS // (n_worlds * self.capacity)
        interval = max(_FEWEST_TICKS, min(_MOST_TICKS, interval))
        most = min(running, runtime.available_threads(), n_worlds * self.chunks)
        while self.ticks < end:
            piece = min(end - self.ticks, interval - self.ticks % interval)
            piece, threads = self._choice.plan(piece, most)
            if self.ticks % interval == 0 and self._can_sort:
                self._sort(threads)
            compiled, began = "ticks" in self._launches, time.perf_counter()
            self._launch_parts("ticks", piece, threads)
            if compiled:
                self._choice.note(piece, time.perf_counter() - began)

    def _advance_by_ant(self, n: int) -> None:
        """Advance by n ticks: all in one launch if the colony is small, else by their loops."""
        names = ["tick"] * n
        if self._entries <= _MOST_IN_ONE_LOOP:
            self.arrays["orders"][Order.TICKS], self.arrays["barrier"][:] = n, 0
            names = ["ticks"]
        elif self._model.plans_together:
            names = ["first", *["planning"] * self.training.planning_steps, "last"] * n
        ready, self.ready = self.ready, np.zeros_like(self.ready)  # in case of Ctrl-C
        self._launch_by_ant(names)
        self.ticks += n
        self.ready = ready

    def _launch_by_ant(self, names: Sequence[str]) -> None:
        """Launch kernels by name, with a thread for each ant, and wait for the device."""
        import taichi as ti

        from taichi_ants.engines.colony import kernels
        from taichi_ants.engines.device_memory import multiprocessors
        from taichi_ants.engines.launch import Launch

        contents, memories = self.arrays.on_device(kernel_numbers(self) | {"places": self.chunks})
        for name in names:
            if (name, contents) not in self._launches:
                kernel_of = partial(kernels.by_ant, self._variant, name, contents)
                if name == "ticks":
                    blocks = multiprocessors()
                    kernel_of = partial(kernels.in_one_loop, self._variant, blocks, contents)
                self._launches[name, contents] = Launch(kernel_of)
            self._launches[name, contents](memories)
        ti.sync()

    def _sort(self, parts: int) -> None:
        """Sort the ants: in a kernel, once NumPy has taken the time that the kernel costs."""
        if self._sort_seconds >= _SORT_SECONDS:
            self._launch_parts("sort", 0, parts)
        else:
            began = time.perf_counter()
            self._sort_ants()
            self._sort_seconds += time.perf_counter() - began

    def _launch(self, name: str) -> None:
        """Launch a kernel by name: "ticks", "sort", or what ants do once, see `learning`."""
        if self.schedule == BY_ANT:
            self._launch_by_ant([name])
            return
        running = runtime.start()  # the caller may have reset Taichi, or forked the process
        if running.arch != "cpu":  # on a GPU, threads cannot wait for each other
            raise AntsError(
                f"arch is {running.arch!r}, but the schedule {self.schedule!r} runs only on the "
                "CPU; use arch='cpu'."
            )
        if name not in self._launches:
            from taichi_ants.engines.colony import kernels, sorting
            from taichi_ants.engines.launch import Launch

            kernel_of = partial(kernels.once, self._variant, name)
            if name == "sort":
                kernel_of = partial(sorting.sort, self._columns())
            elif name == "ticks":
                kernel_of = partial(kernels.ticks, self._variant)
            self._launches[name] = Launch(kernel_of)
        values = {**kernel_numbers(self), **self.arrays}
        if name == "sort":
            read = "n_worlds", "n_slots", "orders", "barrier", *self._columns()
            values = {name: values[name] for name in read}
            values |= {"near_bits": self._near_bits, **self._scratch}
        self._launches[name](values)

    @property
    def _entries(self) -> int:
        """The length of the longest loop of a tick in which each entry has a thread."""
        cells = self.grid.size * any(self._model.dense_by_number)
        return len(self.seeds) * max(self.capacity, cells, self._shared_rows * self.chunks)

    @property
    def _variant(self) -> Any:
        from taichi_ants.engines.colony import kernels

        return kernels.variant(self._model, self.schedule)

    @cached_property
    def _scratch(self) -> dict[str, np.ndarray]:
        from taichi_ants.engines.colony import sorting

        n_worlds = len(self.seeds)
        return sorting.scratch(n_worlds * self.capacity, n_worlds * self.chunks)

    def _launch_parts(self, name: str, n: int, parts: int, threads: int = 1) -> None:
        """Launch a kernel with several parts, and again if the first one gave up at a barrier."""
        orders, barrier = self.arrays["orders"], self.arrays["barrier"]
        chunks = chunks_for(parts, len(self.seeds), self.chunks)
        orders[: Order.PASSED], barrier[:] = (n, parts, chunks, threads, 0, _SPINS), 0
        try:
            self._launch(name)
        finally:  # Ctrl-C during a launch raises an error after it
            if (opened := int(barrier[Barrier.OPENED])) < 0:
                orders[[Order.PARTS, Order.FIRST]] = 1, opened - GAVE_UP + 1
                barrier[:] = 0
                self._launch(name)

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without Taichi's objects, so that copies and pickles work."""
        made = "_piece", "_sort_seconds", "_launches", "_choice", "_scratch", "_model"
        return {name: value for name, value in vars(self).items() if name not in made}


def kernel_numbers(state: ColonyState) -> dict[str, Any]:
    memory, fields = state.memory, state.task.fields.values()
    of_fields: dict[str, float] = {}
    if fields:
        of_fields["counts_without_food"] = int(any(field.counts_without_food for field in fields))
    for number, pheromone in enumerate(state.pheromones[1:], start=1):
        of_fields |= {f"{name}_{number}": value for name, value in pheromone.numbers.items()}
    return {
        "n_worlds": len(state.seeds),
        "n_ants": state.ants,  # at the start of an episode
        "n_slots": state.capacity,
        "n_food_sources": state.n_food_sources,  # room for food sources in each world
        "size": state.grid.size,
        "length": state.length,
        **state.pheromones[0].numbers,
        **of_fields,
        **state.task.numbers,
        "ends_at_delivery": int(state.ends_at_delivery),
        "initial_q": state.training.initial_q,
        "discount": state.training.discount,
        "epsilon": state.epsilon,
        "explore_below": np.uint64(state.epsilon * 4294967296.0),
        "planning_steps": state.training.planning_steps,
        # A bound with which the sum of the errors of all ants fits 64 bits, see `learning`.
        "largest_error": 2.0**31 / (state.capacity + 1),
        "tables": 1 + memory.tables,
        "floats_by_8": memory.floats // 8,  # see the runs' `engine`
        "integers_by_8": memory.integers // 8,
    }
