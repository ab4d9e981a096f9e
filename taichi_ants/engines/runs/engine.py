"""A world and a task laid out for the kernel of independent runs, and the loop over launches."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from taichi_ants import runtime
from taichi_ants.engines.layout import OUTCOMES, STEPS, TRACE
from taichi_ants.engines.packing import compass_of, pack_cells
from taichi_ants.engines.runs.launches import plan_launches
from taichi_ants.engines.runs.state import Runs
from taichi_ants.task import Task
from taichi_ants.task.constants import N_ACTIONS
from taichi_ants.worlds.world import World

Progress = Callable[[float], None]  # called with the share of the work that is done, 0 to 1

_PARALLEL_RUNS_ON_GPU = 4096

# The arguments of the kernel, n runs of one learner with tables of n_states rows. Arrays of runs
# are flat, one run behind the other. Each has so many tables, and so many times 8 floats and
# integers: then compilers know that neighbouring addresses differ in their last bits alone, which
# saves Dyna-Q a tenth of its time.
_NO_WORK: dict[str, Any] = {
    "n_runs": 0,
    "n_episodes": 0,
    "max_steps": 0,
    "size": 0,  # cells of the world
    # The task.
    "falls": 0,  # by how much a trail falls per tick: 1, or 0 without evaporation
    "level": 0,  # of a deposit
    "slope": 0,
    "fades_after": 0,
    "turns_at_queen": 0,
    "cap": 0,  # of deposits that add
    "continuing": 0,  # 1 if a delivery is no terminal state
    "rewards": np.zeros(1, np.int32),  # (5,) by event
    # The world.
    "world": np.zeros(1, np.int32),  # (size,) packed cells at the start of an episode
    "trails": np.zeros(1, np.int32),  # (size,) trails at the start, under food too
    "closer": np.zeros(1, np.uint8),  # (size,) a bit for each heading that leads nearer the queen
    "compass": np.zeros(1, np.int32),  # see `rules.actions`
    # The runs.
    "start_cells": np.zeros(1, np.int32),  # (n,)
    "start_headings": np.zeros(1, np.int32),  # (n,)
    "settings": np.zeros(1, np.float64),  # `layout.SETTINGS`, then the hyperparameters
    "epsilon": np.zeros(1, np.float64),  # (n,) of the next episode
    "random_states": np.zeros(1, np.uint64),  # (n,)
    "streams": np.zeros(1, np.uint64),  # (n * n_episodes,): of each episode without learning
    "tables": 0,
    "floats_by_8": 0,
    "integers_by_8": 0,
    "q": np.zeros(1, np.float32),
    "floats": np.zeros(1, np.float32),
    "integers": np.zeros(1, np.int32),
    "cells": np.zeros(1, np.int32),  # the packed cells of each run, see `step`
    # What comes out.
    "outcomes": np.zeros((1, 1, 1), np.int32),  # (3, n, n_episodes): `layout.OUTCOMES`
    "trace": np.zeros((1, 1), np.int32),  # (n * n_episodes * max_steps, columns): `layout.TRACE`
    "trace_errors": np.zeros(1, np.float32),  # the TD error of each step
    "trace_tables": np.zeros(1, np.float32),  # the table after each step
}


class RunEngine:
    """Does the episodes of many runs in one world.

    Attributes:
        seconds: What kernels have taken so far, without compilation: CPU seconds of all threads
            together, or wall-clock seconds on a GPU.
    """

    def __init__(self, world: World, task: Task, max_steps: int, settings: runtime.Runtime) -> None:
        self.seconds = 0.0
        self._world = world
        self._start = cache(world.start)
        self._task = task
        self._max_steps = max_steps
        self._settings = settings

    def run(self, runs: Runs, episodes: int, progress: Progress | None = None) -> np.ndarray:
        """Do the next episodes of n runs.

        Args:
            runs: The runs; their state is moved on.
            episodes: How many episodes.
            progress: Called after each launch.

        Returns:
            int32 (3, n, episodes): returns, steps, deliveries.
        """
        launch_on, per_run = self._prepare(runs)
        on_cpu = self._settings.arch == "cpu"
        workers = self._settings.threads if on_cpu else _PARALLEL_RUNS_ON_GPU
        widest = max(per_run, *(array[0].size for array in vars(runs.state).values()))
        plan = plan_launches(workers, episodes, self._max_steps, runs.cost, per_run, widest)
        cells = np.empty(min(plan.runs, len(runs)) * per_run, np.int32)
        outcomes = np.empty((len(OUTCOMES), len(runs), episodes), dtype=np.int32)
        for launch in plan.launches(len(runs), episodes):
            rows = slice(launch.first, launch.first + launch.count)
            block = np.empty((len(OUTCOMES), launch.count, launch.end - launch.begin), np.int32)
            some = self._of_runs(runs, rows, slice(launch.begin, launch.end))
            began = self._clock()
            launch_on(**some, cells=cells, outcomes=block)
            self.seconds += self._clock() - began
            outcomes[:, rows, launch.begin : launch.end] = block
            if progress is not None:
                progress((launch.first + launch.count * launch.end / episodes) / len(runs))
        return outcomes

    def trace(self, runs: Runs, episodes: int) -> dict[str, np.ndarray]:
        """Do the episodes of runs in one launch and record each of their n steps, run by run.

        Args:
            runs: The runs, one run if it learns; the state is moved on.
            episodes: How many episodes.

        Returns:
            `TRACE` by name, int32 (n,), with cells as in `AxialGrid`; "runs", the run of each
            step, int64 (n,); with learning also "td_errors", float32 (n,), and "tables", float32
            (n, n_states, 5), after each step.
        """
        launch_on, per_run = self._prepare(runs, traced=True)
        n_runs, capacity = len(runs), episodes * self._max_steps
        integers = np.zeros((n_runs * capacity, len(TRACE)), dtype=np.int32)
        learned = capacity if runs.learner is not None else 0
        errors = np.zeros(learned, dtype=np.float32)
        tables = np.empty((learned, *runs.state.q.shape[2:]), dtype=np.float32)
        outcomes = np.zeros((len(OUTCOMES), n_runs, episodes), dtype=np.int32)
        launch_on(
            **self._of_runs(runs, slice(0, n_runs), slice(0, episodes)),
            cells=np.empty(n_runs * per_run, np.int32),
            outcomes=outcomes,
            trace=integers,
            trace_errors=errors,
            trace_tables=tables.reshape(-1),
        )
        lengths = outcomes[STEPS].sum(axis=1)
        number = np.repeat(np.arange(n_runs), lengths)
        n = len(number)
        rows = np.arange(n) + (np.arange(n_runs) * capacity - (lengths.cumsum() - lengths))[number]
        recorded = dict(zip(TRACE, integers[rows].T, strict=True)) | {"runs": number}
        if runs.learner is not None:
            recorded |= {"td_errors": errors[:n], "tables": tables[:n, :, :N_ACTIONS]}
        return recorded

    def _prepare(self, runs: Runs, traced: bool = False) -> tuple[Callable[..., None], int]:
        """A function that launches the compiled kernel on arguments that are given by name.

        Also the number of packed cells that each run needs.
        """
        # Taichi is imported once it is configured, see `runtime`.
        from taichi_ants.engines.arguments import Arguments, compile_once
        from taichi_ants.engines.runs.kernels import run_kernel
        from taichi_ants.engines.runs.step import EXTRA_CELLS

        arguments = Arguments()
        kernel = run_kernel(
            runs.learner,
            self._task.sees,
            self._task.pheromone.deposit,
            self._task.pheromone.view == "half",
            traced,
            arguments.type_of(_NO_WORK),
        )
        compile_once(kernel, lambda: Arguments().pack(_NO_WORK))
        values = _NO_WORK | self._of_task(runs.learner is not None)

        def launch_on(**others: Any) -> None:
            # An array of length 0 cannot be an argument; the single 0 stays.
            values.update({name: one for name, one in others.items() if getattr(one, "size", 1)})
            kernel(arguments.pack(values))

        return launch_on, self._world.grid.size + EXTRA_CELLS

    def _of_task(self, learns: bool) -> dict[str, Any]:
        """The arguments of the kernel that belong to the task and the world."""
        task, world = self._task, self._world
        falls = task.evaporation_in_training if learns else task.evaporation_in_evaluation
        return {
            "max_steps": self._max_steps,
            "size": world.grid.size,
            "falls": int(falls and task.pheromone.evaporation == "linear"),
            "level": task.pheromone.level,
            "cap": task.pheromone.cap or 0,
            "slope": task.pheromone.slope or 0,
            "fades_after": task.pheromone.fades_after,
            "turns_at_queen": int(task.turns_at_queen),
            "continuing": int(task.delivery == "continuing"),
            "rewards": task.rewards.by_event(),
            "world": pack_cells(world),
            "trails": world.trail_levels(),
            "closer": world.closer().copy(),
            "compass": compass_of(world.grid),
        }

    def _of_runs(self, runs: Runs, rows: slice, episodes: slice) -> dict[str, Any]:
        """The arguments that belong to some runs; the kernel moves their state on."""
        starts = np.array([self._start(seed) for seed in runs.seeds[rows].tolist()])
        state = runs.state
        of_runs = {
            "n_runs": len(starts),
            "n_episodes": episodes.stop - episodes.start,
            "start_cells": starts[:, 0, 0].astype(np.int32),
            "start_headings": starts[:, 1, 0].astype(np.int32),
            "settings": runs.settings[rows].reshape(-1),
            "tables": state.q.shape[1],
            "floats_by_8": state.floats.shape[1] // 8,
            "integers_by_8": state.integers.shape[1] // 8,
            **{name: array[rows].reshape(-1) for name, array in vars(state).items()},
        }
        if runs.streams is not None:
            of_runs["streams"] = np.ascontiguousarray(runs.streams[rows, episodes]).reshape(-1)
        return of_runs

    def _clock(self) -> float:
        """Seconds of all threads of this process on the CPU, which other processes do not slow."""
        return time.process_time() if self._settings.arch == "cpu" else time.perf_counter()
