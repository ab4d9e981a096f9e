"""Time in a colony: launches of its kernels, and which threads share the work of a tick."""

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

# Ants are sorted once they have taken so many steps together, but not too seldom nor too often.
_STEPS_BETWEEN_SORTS, _FEWEST_TICKS, _MOST_TICKS = 2_500_000, 16, 256
_PIECE_SECONDS = 0.4
_SPINS = 2**26  # of a thread at a barrier: half a second or more
_LAUNCHES_BETWEEN_PROBES = 8  # and a probe has so many times fewer ticks


class ThreadChoice:
    """All threads share the ticks of a large world, or one does them alone, if that is faster.

    Threads that share a tick wait for each other several times in it, and wait long where other
    programs use the processors. So the slower choice is tried now and then.
    """

    def __init__(self) -> None:
        self._launches = 0
        self._paces: dict[int, float] = {}  # seconds a tick took, by threads

    def plan(self, ticks: int, most: int) -> tuple[int, int]:
        """Return how many of the ticks to launch next, and on how many threads, `most` at most."""
        if most == 1:
            return ticks, 1
        self._launches += 1
        best, other = sorted((most, 1), key=lambda n: self._paces.get(n, math.inf))
        if self._launches % _LAUNCHES_BETWEEN_PROBES == 2:
            return max(1, ticks // _LAUNCHES_BETWEEN_PROBES), other
        return ticks, best

    def took(self, threads: int, seconds: float) -> None:
        """Note how long so many threads took for a tick."""
        self._paces[threads] = seconds


class Stepper:
    """Launches the kernels of one colony."""

    def __init__(self) -> None:
        self._launches: dict[str, Any] = {}  # prepared kernels, by name
        self._piece = 1  # ticks that take less than _PIECE_SECONDS
        self.threads = ThreadChoice()

    def pieces(self, state: ColonyState, n: int) -> Iterator[None]:
        """Let n ticks pass, in short pieces: a launch of a kernel cannot be interrupted."""
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
        """Let n ticks pass."""
        end = state.ticks + n
        if state.schedule == "by_world":
            self._launch_ticks(state, n, parts=len(state.seeds))
        usual = _STEPS_BETWEEN_SORTS // (len(state.seeds) * state.capacity)
        interval = max(_FEWEST_TICKS, min(_MOST_TICKS, usual))
        while state.ticks < end:
            if state.ticks % interval == 0:
                state.sort_ants()
            self._share_ticks(state, min(end - state.ticks, interval - state.ticks % interval))

    def launch(self, state: ColonyState, name: str) -> None:
        """Do the phases of this name of `kernels`, or its `ticks`."""
        runtime.start()  # the caller may have reset Taichi, or forked
        if name not in self._launches:
            self._launches[name] = self._prepared(state, name)
        self._launches[name]({**kernel_numbers(state), **state.arrays})

    def _share_ticks(self, state: ColonyState, n: int) -> None:
        """Let up to n ticks pass, each shared by all threads."""
        running = runtime.start()
        if not _has_barrier(running):
            rounds = state.training.planning_steps if state.plans_together else 0
            for phases in ("tick_phases", *["planning_phases"] * rounds, "last_phases"):
                self.launch(state, phases)
            state.ticks += 1
            return
        most = min(running.threads, runtime.available_threads(), state.chunks)
        n, threads = self.threads.plan(n, most)
        compiled, began = "ticks" in self._launches, time.perf_counter()
        self._launch_ticks(state, n, threads)
        if compiled:
            self.threads.took(threads, (time.perf_counter() - began) / n)

    def _launch_ticks(self, state: ColonyState, n: int, parts: int) -> None:
        """Let n ticks pass in one launch; if it gives up at the barrier, another does the rest."""
        orders, barrier = state.arrays["orders"], state.arrays["barrier"]
        orders[:], barrier[:] = (n, parts, 0, _SPINS), 0
        self.launch(state, "ticks")
        if (opened := int(barrier[Barrier.OPENED])) < 0:
            orders[[Order.PARTS, Order.FIRST]] = 1, opened - GAVE_UP + 1
            barrier[:] = 0
            self.launch(state, "ticks")
        state.ticks += n

    @staticmethod
    def _prepared(state: ColonyState, name: str) -> Any:
        """Return a kernel that can be launched again and again."""
        from taichi_ants.engines.arguments import Launch
        from taichi_ants.engines.colony import kernels

        task, pheromone = state.task, state.pheromone
        variant = kernels.variant(
            *(state.learner, state.one_a_slot, state.is_given_actions, task.sees),
            *(pheromone.dense, pheromone.view, task.traffic),
            *(state.ants_change, state.food_changes),
        )
        if name == "ticks":
            return Launch(partial(kernels.ticks, variant, state.schedule == "by_chunk"))
        return Launch(partial(kernels.loops, variant, getattr(kernels, name)))


def _has_barrier(running: runtime.Runtime) -> bool:
    """Return whether threads can wait for each other: not on a GPU."""
    return running.arch == "cpu"


def kernel_numbers(state: ColonyState) -> dict[str, Any]:
    """Return the numbers that kernels read besides arrays."""
    memory = state.memory
    return {
        "n_worlds": len(state.seeds),
        "n_ants": state.ants,  # that start an episode
        "n_slots": state.capacity,
        "n_chunks": state.chunks,
        "n_food_sources": state.n_food_sources,  # room for food sources in each world
        "size": state.grid.size,
        "length": state.length,
        **state.pheromone.numbers,
        **state.task.numbers,
        "ends_at_delivery": int(state.ends_at_delivery),
        "initial_q": state.training.initial_q,
        "discount": state.training.discount,
        "epsilon": state.epsilon,
        "explore_below": np.uint64(state.epsilon * 4294967296.0),
        "planning_steps": state.training.planning_steps,
        # So that the sum of the errors of all ants is a fixed-point number, see `learning`.
        "largest_error": 2.0**31 / (state.capacity + 1),
        "tables": 1 + memory.tables,
        "floats_by_8": memory.floats // 8,  # see the runs' `engine`
        "integers_by_8": memory.integers // 8,
    }
