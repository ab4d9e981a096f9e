"""Launches of the kernels of a colony, and the choice of threads for a tick."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from taichi_ants import runtime
from taichi_ants.engines.colony.layout import GAVE_UP, Barrier, Order
from taichi_ants.engines.colony.state import ColonyState

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
        self._seconds_per_tick: dict[int, float] = {}  # by number of threads

    def plan(self, ticks: int, most: int) -> tuple[int, int]:
        """Return the number of ticks for the next launch, and of threads, up to `most`."""
        if most == 1:
            return ticks, 1
        self._launches += 1
        best, other = sorted((most, 1), key=lambda n: self._seconds_per_tick.get(n, math.inf))
        if self._launches % _LAUNCHES_BETWEEN_PROBES == 2:
            return max(1, ticks // _LAUNCHES_BETWEEN_PROBES), other
        return ticks, best

    def record(self, threads: int, seconds: float) -> None:
        """Record the seconds per tick on a number of threads."""
        self._seconds_per_tick[threads] = seconds


class Stepper:
    """The launches of the kernels of one colony."""

    def __init__(self) -> None:
        self._launches: dict[str, Any] = {}  # prepared kernels, by name
        self._piece = 1  # a number of ticks that takes less than _PIECE_SECONDS
        self.threads = ThreadChoice()

    def pieces(self, state: ColonyState, n: int) -> Iterator[None]:
        """Yield after each short launch until n ticks are done; launches cannot be interrupted."""
        end = state.ticks + n
        while state.ticks < end:
            piece = min(self._piece, end - state.ticks)
            began = time.perf_counter()
            self.advance(state, piece)
            if piece == self._piece:
                pace = (time.perf_counter() - began) / piece
                self._piece = max(1, min(2 * piece, int(_PIECE_SECONDS / pace)))
            yield

    def advance(self, state: ColonyState, n: int) -> None:
        """Advance the colony by n ticks."""
        end = state.ticks + n
        if state.schedule == "by_world":
            n_worlds = len(state.seeds)
            threads = threads_for(n_worlds)
            self._launch_ticks(state, n, parts=threads * -(-n_worlds // threads), threads=threads)
            return
        interval = _STEPS_BETWEEN_SORTS // (len(state.seeds) * state.capacity)
        interval = max(_FEWEST_TICKS, min(_MOST_TICKS, interval))
        while state.ticks < end:
            if state.ticks % interval == 0:
                state.sort_ants()
            self._share_ticks(state, min(end - state.ticks, interval - state.ticks % interval))

    def launch(self, state: ColonyState, name: str) -> None:
        """Launch a kernel by name: "ticks", or what ants do once, a function of `learning`."""
        # The caller may have reset Taichi, or forked the process.
        runtime.check_on_cpu(runtime.start(), "colonies run")
        if name not in self._launches:
            self._launches[name] = self._prepared(state, name)
        self._launches[name]({**kernel_numbers(state), **state.arrays})

    def _share_ticks(self, state: ColonyState, n: int) -> None:
        """Advance by up to n ticks, which threads share."""
        n_threads = min(runtime.start().threads, runtime.available_threads(), state.chunks)
        n, threads = self.threads.plan(n, n_threads)
        compiled, began = "ticks" in self._launches, time.perf_counter()
        self._launch_ticks(state, n, threads)
        if compiled:
            self.threads.record(threads, (time.perf_counter() - began) / n)

    def _launch_ticks(self, state: ColonyState, n: int, parts: int, threads: int = 1) -> None:
        """Advance by n ticks in one launch, and a second one if the first gave up at a barrier."""
        orders, barrier = state.arrays["orders"], state.arrays["barrier"]
        orders[: Order.PASSED], barrier[:] = (n, parts, threads, 0, _SPINS), 0
        try:
            self.launch(state, "ticks")
        finally:  # Ctrl-C during a launch raises an error after it
            if (opened := int(barrier[Barrier.OPENED])) < 0:
                orders[[Order.PARTS, Order.FIRST]] = 1, opened - GAVE_UP + 1
                barrier[:] = 0
                self.launch(state, "ticks")

    @staticmethod
    def _prepared(state: ColonyState, name: str) -> Any:
        """Return a kernel for repeated launches."""
        from taichi_ants.engines.colony import kernels, learning
        from taichi_ants.engines.launch import Launch

        variant = kernels.variant(state.model)
        if name == "ticks":
            return Launch(partial(kernels.ticks, variant, state.schedule == "by_chunk"))
        return Launch(partial(kernels.once, variant, getattr(learning, name)))


def threads_for(n_worlds: int) -> int:
    """Return the number of threads among which worlds are dealt, see `Order.THREADS`."""
    return min(runtime.start().threads, n_worlds)


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
