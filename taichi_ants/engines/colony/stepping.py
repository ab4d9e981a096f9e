"""The colony tick by tick: launches of its kernels, and the choice of threads for a tick."""

from __future__ import annotations

import copy
import math
import time
from collections.abc import Iterator, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np

from taichi_ants import arguments, runtime
from taichi_ants.engines.colony.layout import GAVE_UP, Barrier, Order, WorldRow
from taichi_ants.engines.colony.state import ALL, ColonyState, Which
from taichi_ants.errors import AntsError, as_array, checked_whole, count, entries_of, shown
from taichi_ants.grid.randomness import words_of
from taichi_ants.task.constants import MAX_STEPS, N_ACTIONS
from taichi_ants.worlds.world import World

# Ants are sorted after this many steps of all ants, within limits in ticks.
_STEPS_BETWEEN_SORTS, _FEWEST_TICKS, _MOST_TICKS = 2_500_000, 16, 256
_PIECE_SECONDS = 0.4
_SPINS = 2**26  # checks of a thread at a barrier, which take at least half a second
_LAUNCHES_BETWEEN_PROBES = 8  # also the factor by which a probe has fewer ticks


class ThreadChoice:
    """The choice whether all threads share the ticks of a large world, or one does them alone.

    Threads that share a tick wait for each other several times, and they wait long if other
    programs use the processors. So the slower choice is measured again from time to time.
    """

    def __init__(self) -> None:
        self._launches = 0
        self.seconds_per_tick: dict[int, float] = {}  # by number of threads

    def plan(self, ticks: int, most: int) -> tuple[int, int]:
        """Return the number of ticks for the next launch, and of threads, up to `most`."""
        if most == 1:
            return ticks, 1
        self._launches += 1
        best, other = sorted((most, 1), key=lambda n: self.seconds_per_tick.get(n, math.inf))
        if self._launches % _LAUNCHES_BETWEEN_PROBES == 2:
            return max(1, ticks // _LAUNCHES_BETWEEN_PROBES), other
        return ticks, best


class TickingColony(ColonyState):
    """A colony whose ants observe, act and learn; `Colony` adds runs of whole episodes."""

    _piece = 1  # a number of ticks that takes less than _PIECE_SECONDS
    _launches = cached_property[dict[str, Any]](lambda colony: {})  # prepared kernels, by name
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
        """
        fresh = copy.copy(self)
        fresh.length = 0 if length is None else checked_whole("length", length, most=MAX_STEPS)
        if world is not None:  # which may have too little room
            fresh.arrays = {**self.arrays}
            fresh.lay_out(self.checked_worlds(world))
        self.ready[:] = False  # also after Ctrl-C before the end
        self.count_deliveries()
        vars(self).update(vars(fresh))
        self.ticks = 0
        self._start()

    def _start(self, which: Which = ALL) -> None:
        """Reset worlds to the start of an episode, and let their ants observe.

        Tables, memories and random streams stay.
        """
        self.ready[which] = False
        self.count_deliveries(which)
        self.set_learning_rate(self.learning_rate)
        self.set_to_start(which)
        stale = np.zeros_like(self.changed)
        stale[which] = self.changed[which]
        if stale.any():
            self.copy_worlds(self.ground_constants(), stale)
            self.changed[stale] = False
        self.copy_worlds({"streams": self.arrays["first_streams"]}, which)
        self.arrays["episodes"][which] += 1
        self._launch("begin")
        self.ready[which] = True

    def reset_worlds(self, which: np.ndarray, seeds: Sequence[int] | None = None) -> None:
        """Start the next episode of some worlds, bool (W,), while the others continue.

        For these worlds it does the same as `end_episode` and `begin_episode`, but does not change
        epsilon and the learning rate. With `seeds`, one for each of these worlds, they restart as
        in a new `Colony`, except that tables and memories of learners are kept. Seeds may repeat,
        but then `save` raises an error.

        Raises:
            AntsError: The number of worlds or seeds is wrong, or a seed is not allowed.
        """
        which = as_array("which", which, "b", (len(self.seeds),))
        if seeds is None:
            self.keep_streams(which)
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
            self.read_start(self.n_food_sources)
            self.copy_worlds(self.seeded(), which)
        self._start(which)

    def observe(self, worlds: Sequence[int]) -> None:
        """Let the ants of some worlds observe again, after interventions in these worlds."""
        row = self.arrays["worlds"][WorldRow.RUNNING]
        running = row.copy()
        row[np.setdiff1d(np.arange(len(row)), worlds)] = 0  # ants that misread draw numbers
        try:
            self._launch("see_interventions")
        finally:
            row[:] = running

    def tick(self, n: int = 1) -> None:
        """Advance by n ticks, except worlds whose episode has ended."""
        self.check_begun()
        if self.is_given_actions:
            raise AntsError(
                "training is None, so ants do not choose actions; call act with the actions of "
                "each tick instead."
            )
        for _ in self.pieces(checked_whole("n", n)):
            pass

    def act(self, actions: np.ndarray) -> None:
        """Advance by one tick in which ants take given actions; for colonies without a training.

        Actions are whole numbers 0 to 4 (W, capacity): left, forward, right, pick up, give. Those
        of vacant slots and of worlds whose episode has ended are ignored. AntsError if no episode
        has started, the colony has a training, or an action is not allowed.
        """
        self.check_begun()
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
        """End the episode: save random streams for the next one, and decay epsilon and the rate."""
        self.check_finite()
        self.keep_streams()
        epsilon = self.training.next_epsilon(self.epsilon)
        learning_rate = self.training.next_learning_rate(self.learning_rate)
        self.epsilon, self.learning_rate = epsilon, learning_rate

    # Launches

    def pieces(self, n: int) -> Iterator[None]:
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
        """Advance the colony by n ticks."""
        end = self.ticks + n
        n_worlds, running = len(self.seeds), runtime.start().threads
        if self.schedule == "by_world":
            threads = min(running, n_worlds)
            self._launch_ticks(n, parts=threads * -(-n_worlds // threads), threads=threads)
            return
        interval = _STEPS_BETWEEN_SORTS // (n_worlds * self.capacity)
        interval = max(_FEWEST_TICKS, min(_MOST_TICKS, interval))
        most = min(running, runtime.available_threads(), self.chunks)
        while self.ticks < end:
            if self.ticks % interval == 0:
                self.sort_ants()
            piece = min(end - self.ticks, interval - self.ticks % interval)
            piece, threads = self._choice.plan(piece, most)
            compiled, began = "ticks" in self._launches, time.perf_counter()
            self._launch_ticks(piece, threads)
            if compiled:
                seconds = time.perf_counter() - began
                self._choice.seconds_per_tick[threads] = seconds / piece

    def _launch(self, name: str) -> None:
        """Launch a kernel by name: "ticks", or what ants do once, a function of `learning`."""
        # The caller may have reset Taichi, or forked the process.
        runtime.check_on_cpu(runtime.start(), "colonies run")
        if name not in self._launches:
            from taichi_ants.engines.colony import kernels, learning
            from taichi_ants.engines.launch import Launch

            variant = kernels.variant(self.model)
            kernel_of = partial(kernels.ticks, variant, self.schedule == "by_chunk")
            if name != "ticks":
                kernel_of = partial(kernels.once, variant, getattr(learning, name))
            self._launches[name] = Launch(kernel_of)
        self._launches[name]({**kernel_numbers(self), **self.arrays})

    def _launch_ticks(self, n: int, parts: int, threads: int = 1) -> None:
        """Advance by n ticks in one launch, and a second one if the first gave up at a barrier."""
        orders, barrier = self.arrays["orders"], self.arrays["barrier"]
        orders[: Order.PASSED], barrier[:] = (n, parts, threads, 0, _SPINS), 0
        try:
            self._launch("ticks")
        finally:  # Ctrl-C during a launch raises an error after it
            if (opened := int(barrier[Barrier.OPENED])) < 0:
                orders[[Order.PARTS, Order.FIRST]] = 1, opened - GAVE_UP + 1
                barrier[:] = 0
                self._launch("ticks")

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without Taichi's objects, so that copies and pickles work."""
        made = "_piece", "_launches", "_choice", "model"
        return {name: value for name, value in vars(self).items() if name not in made}


def kernel_numbers(state: ColonyState) -> dict[str, Any]:
    """Return the numbers that kernels read in addition to arrays."""
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
        "n_chunks": state.chunks,
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
