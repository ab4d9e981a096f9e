"""A world and a task laid out for the kernel of independent runs, and the loop over launches."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from taichi_ants import runtime
from taichi_ants.engines.layout import OUTCOMES, STEPS, TRACE
from taichi_ants.engines.packing import compass_of, pack_cells
from taichi_ants.engines.runs.launches import plan_launches
from taichi_ants.engines.runs.state import Runs
from taichi_ants.task import Task
from taichi_ants.task.constants import N_ACTIONS
from taichi_ants.worlds.world import World

if TYPE_CHECKING:
    from taichi_ants.engines.runs.arguments import Job

Progress = Callable[[float], None]  # called with the share of the work that is done, 0 to 1

_PARALLEL_RUNS_ON_GPU = 4096


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
        job, per_run = self._begin(runs)
        on_cpu = self._settings.arch == "cpu"
        workers = self._settings.threads if on_cpu else _PARALLEL_RUNS_ON_GPU
        widest = max(per_run, *(array[0].size for array in vars(runs.state).values()))
        plan = plan_launches(workers, episodes, self._max_steps, runs.cost, per_run, widest)
        outcomes = np.empty((len(OUTCOMES), len(runs), episodes), dtype=np.int32)
        job.put(cells=np.empty(min(plan.runs, len(runs)) * per_run, np.int32))
        for launch in plan.launches(len(runs), episodes):
            rows = slice(launch.first, launch.first + launch.count)
            block = np.empty((len(OUTCOMES), launch.count, launch.end - launch.begin), np.int32)
            self._put_runs(job, runs, rows, slice(launch.begin, launch.end))
            job.put(outcomes=block)
            began = self._clock()
            job.launch()
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
        job, per_run = self._begin(runs, traced=True)
        n_runs, capacity = len(runs), episodes * self._max_steps
        integers = np.zeros((n_runs * capacity, len(TRACE)), dtype=np.int32)
        learned = capacity if runs.learner is not None else 0
        errors = np.zeros(learned, dtype=np.float32)
        tables = np.empty((learned, *runs.state.q.shape[2:]), dtype=np.float32)
        outcomes = np.zeros((len(OUTCOMES), n_runs, episodes), dtype=np.int32)
        self._put_runs(job, runs, slice(0, n_runs), slice(0, episodes))
        job.put(
            cells=np.empty(n_runs * per_run, np.int32),
            outcomes=outcomes,
            trace=integers,
            trace_errors=errors,
            trace_tables=tables,
        )
        job.launch()
        lengths = outcomes[STEPS].sum(axis=1)
        number = np.repeat(np.arange(n_runs), lengths)
        n = len(number)
        rows = np.arange(n) + (np.arange(n_runs) * capacity - (lengths.cumsum() - lengths))[number]
        recorded = dict(zip(TRACE, integers[rows].T, strict=True)) | {"runs": number}
        if runs.learner is not None:
            recorded |= {"td_errors": errors[:n], "tables": tables[:n, :, :N_ACTIONS]}
        return recorded

    def _begin(self, runs: Runs, traced: bool = False) -> tuple[Job, int]:
        """The compiled kernel, with all set that does not belong to single runs.

        Also the number of packed cells that each run needs.
        """
        # Taichi is imported once it is configured, see `runtime`.
        from taichi_ants.engines.runs.arguments import Job
        from taichi_ants.engines.runs.kernels import run_kernel
        from taichi_ants.engines.runs.step import EXTRA_CELLS

        task, world = self._task, self._world
        pheromone = task.pheromone
        job = Job(run_kernel(runs.learner, task.sees, pheromone.deposit, traced))
        with runtime.quiet():
            job.launch()
        falls = task.evaporation_in_evaluation
        if runs.learner is not None:
            falls = task.evaporation_in_training
        job.put(
            max_steps=self._max_steps,
            size=world.grid.size,
            falls=int(falls and pheromone.evaporation == "linear"),
            level=pheromone.level,
            cap=pheromone.cap or 0,
            continuing=int(task.delivery == "continuing"),
            rewards=task.rewards.by_event(),
            world=pack_cells(world),
            trails=world.trail_levels().astype(np.int32),
            closer=world.closer().copy(),
            compass=compass_of(world.grid),
            tables=runs.state.q.shape[1],
            floats_by_8=runs.state.floats.shape[1] // 8,
            integers_by_8=runs.state.integers.shape[1] // 8,
        )
        return job, world.grid.size + EXTRA_CELLS

    def _put_runs(self, job: Job, runs: Runs, rows: slice, episodes: slice) -> None:
        """Set what belongs to the runs of one launch; the kernel moves their state on."""
        starts = [self._start(seed) for seed in runs.seeds[rows].tolist()]
        job.put(
            n_runs=len(starts),
            n_episodes=episodes.stop - episodes.start,
            start_cells=np.array([cells[0] for cells, _ in starts], dtype=np.int32),
            start_headings=np.array([headings[0] for _, headings in starts], dtype=np.int32),
            settings=runs.settings[rows],
            **{name: array[rows] for name, array in vars(runs.state).items()},
        )
        if runs.streams is not None:
            job.put(streams=np.ascontiguousarray(runs.streams[rows, episodes]))

    def _clock(self) -> float:
        """Seconds of all threads of this process on the CPU, which other processes do not slow."""
        return time.process_time() if self._settings.arch == "cpu" else time.perf_counter()
