"""A world laid out for the kernel of independent runs, and the loop over launches."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from taichi_ants import runtime
from taichi_ants.engines.packing import compass_of, pack_cells
from taichi_ants.engines.runs.launches import Launch, plan_launches
from taichi_ants.engines.runs.results import RunState
from taichi_ants.learners.registry import Learner
from taichi_ants.task import Task
from taichi_ants.worlds.world import World

Progress = Callable[[float], None]  # called with the share of the work that is done, 0 to 1

_PARALLEL_RUNS_ON_GPU = 4096


class RunEngine:
    """Does the episodes of many runs in one world.

    Attributes:
        seconds: What kernels have taken so far, without compilation: CPU seconds of all threads
            together, or wall-clock seconds on a GPU.
    """

    def __init__(
        self, world: World, task: Task, max_steps: int, evaporation: bool, settings: runtime.Runtime
    ) -> None:
        self.seconds = 0.0
        self._world = world
        self._max_steps = max_steps
        self._evaporation = evaporation
        self._settings = settings
        self._size = world.grid.size
        self._shared = (
            pack_cells(world),
            world.closer().copy(),
            compass_of(world.grid),
            task.rewards.by_event(),
        )

    def run(
        self,
        learner: Learner | None,
        seeds: np.ndarray,
        rates: np.ndarray,
        state: RunState,
        episodes: int,
        streams: np.ndarray | None = None,
        progress: Progress | None = None,
    ) -> np.ndarray:
        """Do the next episodes of n runs.

        Args:
            learner: The learner, None to follow the tables without learning.
            seeds: The seed of each run (n,), for worlds that do not list their ant.
            rates: float32 (n, 2), learning rate and discount.
            state: Where the runs stand, arrays (n, ...), contiguous; it is moved on.
            episodes: How many episodes.
            streams: uint64 (n, episodes), a random stream for each episode without learning.
            progress: Called after each launch.

        Returns:
            int32 (3, n, episodes): returns, steps, deliveries.
        """
        # Taichi is imported once it is configured, see `runtime`.
        from taichi_ants.engines.runs.kernels import EXTRA_CELLS, run_kernel

        kernel = run_kernel(learner)
        self._compile(kernel)
        per_run = self._size + EXTRA_CELLS
        on_cpu = self._settings.arch == "cpu"
        workers = self._settings.threads if on_cpu else _PARALLEL_RUNS_ON_GPU
        planning_steps = int(state.settings[:, 0].max(initial=0))
        plan = plan_launches(workers, episodes, self._max_steps, planning_steps, per_run)
        n = len(seeds)
        starts = self._starts(seeds)
        cells = np.empty(min(plan.runs, n) * per_run, dtype=np.int32)
        outcomes = np.empty((3, n, episodes), dtype=np.int32)
        for launch in plan.launches(n, episodes):
            rows = slice(launch.first, launch.first + launch.count)
            block = np.empty((3, launch.count, launch.end - launch.begin), dtype=np.int32)
            arguments = (
                *self._shared_arguments(launch.count, launch.end - launch.begin),
                *_run_arguments(state, starts, rates, rows, _drawn(streams, launch)),
                cells,
                *block,
                *_NO_TRACE,
            )
            began = self._clock()
            kernel(*arguments)
            self.seconds += self._clock() - began
            outcomes[:, rows, launch.begin : launch.end] = block
            if progress is not None:
                progress((launch.first + launch.count * launch.end / episodes) / n)
        return outcomes

    def trace(
        self,
        learner: Learner | None,
        seeds: np.ndarray,
        rates: np.ndarray,
        state: RunState,
        episodes: int,
        streams: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Do the episodes of runs in one launch and record each of their n steps, run by run.

        Args as in `run`; with learning, arrays of one run.

        Returns:
            The run of each step, int64 (n,); int32 (n, 10) in the columns `TRACE`; TD errors
            float32 (n,) and Q-tables float32 (n, 128, 8) after each step, both of no use without
            learning.
        """
        # Taichi is imported once it is configured, see `runtime`.
        from taichi_ants.engines.runs.kernels import EXTRA_CELLS, TRACE, run_kernel

        n_runs, capacity = len(seeds), episodes * self._max_steps
        integers = np.zeros((n_runs * capacity, len(TRACE)), dtype=np.int32)
        learned = capacity if learner is not None else 1
        errors = np.zeros(learned, dtype=np.float32)
        tables = np.empty((learned, *state.q.shape[1:]), dtype=np.float32)
        outcomes = np.zeros((3, n_runs, episodes), dtype=np.int32)
        drawn = np.zeros(1, dtype=np.uint64) if streams is None else streams
        kernel = run_kernel(learner, traced=True)
        self._compile(kernel)
        self._compile(kernel)
        kernel(
            *self._shared_arguments(n_runs, episodes),
            *_run_arguments(state, self._starts(seeds), rates, slice(0, n_runs), drawn),
            np.empty(n_runs * (self._size + EXTRA_CELLS), dtype=np.int32),
            *outcomes,
            integers,
            errors,
            tables.reshape(-1),
        )
        lengths = outcomes[1].sum(axis=1)
        runs = np.repeat(np.arange(n_runs), lengths)
        n = len(runs)
        rows = np.arange(n) + (np.arange(n_runs) * capacity - (lengths.cumsum() - lengths))[runs]
        return runs, integers[rows], errors[:n], tables[:n]

    def _shared_arguments(self, n_runs: int, n_episodes: int) -> tuple:
        """The kernel's arguments that all runs share."""
        sizes = (n_runs, n_episodes, self._max_steps, int(self._evaporation), self._size)
        return (*sizes, *self._shared)

    def _compile(self, kernel: Callable[..., None]) -> None:
        """Launch a kernel on nothing, so that its compilation is not counted as work."""
        nothing = [np.zeros(1, kind) for kind in _RUN_DTYPES]
        outcomes = np.zeros((3, 1, 1), dtype=np.int32)
        with runtime.quiet():
            kernel(*self._shared_arguments(0, 0), *nothing, *outcomes, *_NO_TRACE)

    def _clock(self) -> float:
        """Seconds of all threads of this process on the CPU, which other processes do not slow."""
        return time.process_time() if self._settings.arch == "cpu" else time.perf_counter()

    def _starts(self, seeds: np.ndarray) -> np.ndarray:
        """Start cell and heading of each run, int32 (n, 2)."""
        starts = np.empty((len(seeds), 2), dtype=np.int32)
        known: dict[int, tuple[int, int]] = {}
        for row, seed in enumerate(seeds.tolist()):
            if seed not in known:
                cells, headings = self._world.start(seed)
                known[seed] = (int(cells[0]), int(headings[0]))
            starts[row] = known[seed]
        return starts


def _run_arguments(
    state: RunState, starts: np.ndarray, rates: np.ndarray, rows: slice, streams: np.ndarray
) -> list[np.ndarray]:
    """The kernel's arguments that belong to runs, as flat views, so that it moves `state` on."""
    arrays = (
        starts[rows],
        rates[rows],
        state.exploration[rows],
        state.settings[rows],
        state.random_states[rows],
        streams,
        state.q[rows],
        state.entries[rows],
        state.slots[rows],
    )
    return [array.reshape(-1) for array in arrays]


def _drawn(streams: np.ndarray | None, launch: Launch) -> np.ndarray:
    if streams is None:
        return np.zeros(1, dtype=np.uint64)
    rows = slice(launch.first, launch.first + launch.count)
    return np.ascontiguousarray(streams[rows, launch.begin : launch.end])


# What an untraced kernel gets in place of the arrays of a trace.
_NO_TRACE = (np.zeros((1, 1), np.int32), np.zeros(1, np.float32), np.zeros(1, np.float32))

# The dtypes of the arguments between the shared ones and the outcomes.
_RUN_DTYPES = (
    *(np.int32, np.float32, np.float64, np.int32, np.uint64, np.uint64, np.float32),
    *(np.int32, np.int32, np.int32),
)
