"""The state of independent runs, the arguments of their kernel, and the loop over its launches.

A launch cannot be interrupted, so it should take about a second even if every episode uses all of
its steps. Within that bound, few large launches are best, because threads wait for the last run of
each launch.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple, dataclass, field
from functools import lru_cache, partial
from typing import Any

import numpy as np

from taichi_ants import learners, runtime
from taichi_ants.engines import layout
from taichi_ants.engines.layout import EXTRA_CELLS, OUTCOMES, TRACE
from taichi_ants.features import numbers
from taichi_ants.grid.constants import STREAM_ANT, STREAM_ROLLOUT
from taichi_ants.grid.randomness import stream_state, words_of
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.learner import Learner, Memory
from taichi_ants.records import Record
from taichi_ants.task import Task
from taichi_ants.task.constants import N_ACTIONS, ROW
from taichi_ants.worlds.world import World

Progress = Callable[[float], None]  # called with the share of the work that is done, 0 to 1

_SECONDS = 1.0
_FEW_STEPS = 500_000  # of a run
_TOGETHER = set[Any]()  # rules and learners of which several runs were done together
# Lanes need vectors that gather numbers from memory, which compiled kernels have for Intel's
# processors. Taichi's LLVM 15 does not know AMD's Zen 5, and makes vectors of four numbers for it.
GATHERS = "Intel" in runtime.processor()
_STEP_NS = 25  # a step of Q-learning on one thread of a slow core
_WORKSPACE_BYTES = 256 * 2**20
_MOST_NUMBERS = 2**30  # in one array of a launch, because kernels use 32-bit indices
_RUNS_ON_GPU = 2**16  # in parallel, each of which takes a step in about
_STEP_NS_ON_GPU = 32_000
TRACED = {"trace", "trace_chances", "trace_errors", "trace_tables"}  # arrays of `Runs.record`
MAX_ROLLOUT_STEPS = 1_000_000  # that a launch records


@dataclass(frozen=True, eq=False, repr=False)
class RunState(Record):
    """The state of runs after their last episode, from which training resumes, bit for bit.

    Attributes (leading axes: the runs, for example (configurations, seeds)):
        q: float32 (..., 1 + tables, n_states, 8), the table by which the ant acts, then further
            tables of the learner; a row has 5 action values and 3 unused numbers.
        floats, integers: float32 and int32 (..., k), the memory of the learner, as large as any
            learner here needs, in multiples of 8; see `taichi_ants.learners.Memory`.
        random_states: uint64 (...,), the ants' random streams.
        epsilon, learning_rate: float64 (...,), values for the next episode.
    """

    q: np.ndarray
    floats: np.ndarray
    integers: np.ndarray
    random_states: np.ndarray
    epsilon: np.ndarray
    learning_rate: np.ndarray

    @classmethod
    def empty(cls, shape: tuple[int, ...], n_states: int, memory: Memory) -> RunState:
        """Return a state of zeros for runs of this shape."""
        return cls(
            q=np.zeros((*shape, 1 + memory.tables, n_states, ROW), dtype=np.float32),
            floats=np.zeros((*shape, memory.floats), dtype=np.float32),
            integers=np.zeros((*shape, memory.integers), dtype=np.int32),
            random_states=np.zeros(shape, dtype=np.uint64),
            epsilon=np.zeros(shape, dtype=np.float64),
            learning_rate=np.zeros(shape, dtype=np.float64),
        )

    @classmethod
    def initial(
        cls, configs: Sequence[TrainingConfig], seeds: Sequence[int], n_states: int
    ) -> RunState:
        """Return the state of new runs, with leading axes (configurations, seeds)."""
        state = cls.empty((len(configs), len(seeds)), n_states, memory_for(configs, n_states))
        state.random_states[:] = stream_state(words_of(seeds), STREAM_ANT, 0)
        for config, q, epsilon, rate in zip(
            configs, state.q, state.epsilon, state.learning_rate, strict=True
        ):
            q[..., :N_ACTIONS] = config.initial_q
            epsilon[:], rate[:] = config.epsilon, config.learning_rate
        return state

    def part(self, configs: slice) -> RunState:
        """Return the runs of some configurations, as views (runs, ...)."""
        n, arrays = self.epsilon[configs].size, vars(self).items()
        return RunState(
            **{name: array[configs].reshape(n, *array.shape[2:]) for name, array in arrays}
        )


def memory_for(configs: Sequence[TrainingConfig], n_states: int) -> Memory:
    """Return a memory size that suffices for each of the learners, which must be registered."""
    memories = [
        astuple(learners.get(config.learner).memory_for(config, n_states)) for config in configs
    ]
    return Memory(*np.max(memories, axis=0).tolist())


def laid_out(worlds: Sequence[World], task: Task, falls: bool) -> dict[str, Any]:
    """Return kernel arguments for a task and worlds of one grid; trails evaporate if `falls`."""
    grid = worlds[0].grid
    return {
        "size": grid.size,
        **(task.pheromone if falls else task.pheromone.lasting).numbers,
        **task.numbers,
        "rewards": task.rewards.by_event(),
        **numbers(task),
        # For each world: packed cells and all trails (also under food) at the start of an episode;
        # per cell a bit for each heading that leads nearer to the queen.
        "world": np.concatenate([layout.pack_cells(world) for world in worlds]),
        "trails": np.concatenate([world.trail_levels() for world in worlds]),
        "closer": np.concatenate([world.closer() for world in worlds]),
        "compass": layout.compass_of(grid),  # see `rules.actions`
    }


@dataclass(frozen=True, eq=False)
class Runs:
    """n runs in one world that learn by one learner, or follow tables without learning.

    Attributes:
        seeds: The seed of each run, Python integers (n,), for worlds that do not list their ant.
        settings: float64 (n, columns), `layout.SETTINGS` and the hyperparameters of the learner.
        state: The state of the runs, contiguous arrays (n, ...), which the kernel updates.
        streams: uint64 (n, episodes), a random stream for each episode; none for learners.
        cost: The time of a step, relative to a step of Q-learning.
    """

    world: World
    task: Task
    max_steps: int
    learner: Learner | None
    seeds: np.ndarray
    settings: np.ndarray
    state: RunState
    streams: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), np.uint64))
    cost: float = 1.0

    @classmethod
    def learning(
        cls,
        world: World,
        task: Task,
        max_steps: int,
        configs: Sequence[TrainingConfig],
        seeds: Sequence[int],
        state: RunState | None = None,
    ) -> Runs:
        """Return runs of all seeds and configurations, which share learner and hyperparameters.

        Without a `state`, they are new.
        """
        learner = learners.get(configs[0].learner)
        more = learner.settings(configs[0])
        settings = [
            (*(getattr(config, name) for name in layout.SETTINGS), *astuple(more))
            for config in configs
        ]
        if state is None:
            state = RunState.initial(configs, seeds, task.n_states).part(slice(None))
        return cls(
            *(world, task, max_steps, learner),
            np.tile(np.array(seeds, dtype=object), len(configs)),
            np.repeat(np.array(settings, dtype=np.float64), len(seeds), axis=0),
            state,
            cost=learner.cost(more),
        )

    @classmethod
    def following(
        cls,
        world: World,
        task: Task,
        max_steps: int,
        tables: np.ndarray,
        seeds: Sequence[int] | np.ndarray,
        numbers: Sequence[int],
        epsilon: float,
    ) -> Runs:
        """Return runs that follow tables (n, n_states, 5) in the rollouts of these `numbers`."""
        state = RunState.empty((len(tables),), task.n_states, Memory())
        state.q[:, 0, :, :N_ACTIONS] = tables
        state.epsilon[:] = epsilon
        words = np.array(seeds, dtype=object)
        streams = stream_state(words_of(words)[:, None], STREAM_ROLLOUT, np.array(numbers)[None, :])
        settings = np.zeros((len(tables), layout.N_SETTINGS))
        settings[:, layout.EPSILON_DECAY] = 1.0
        return cls(world, task, max_steps, None, words, settings, state, streams)

    def __len__(self) -> int:
        return len(self.seeds)

    def compiled(self, episodes: int, traced: bool = False) -> Callable[..., None]:
        """Return a function (runs, episodes, **arrays), after compiling its kernel.

        It does some of these episodes of some runs, both slices, and writes the results into the
        arrays. All arrays of a launch are flat, one run after another. The sizes of a memory are
        multiples of 8, see `Learner.memory_for`.
        """
        # Imported here, because Taichi must be configured first; see `runtime`.
        from taichi_ants.engines.device_memory import room_for
        from taichi_ants.engines.launch import Launch
        from taichi_ants.engines.runs.kernels import LANES, learns_at_once, run_kernel
        from taichi_ants.engines.runs.step import Rules

        task, state = self.task, self.state
        start_cells, headings = self.world.first_starts(words_of(self.seeds))
        settings, form = runtime.start(), (Rules.of(task), self.learner)
        # A few runs are faster one by one, and so are those of learners with much memory or much
        # to plan. But to load another kernel takes longer than a few short runs.
        several = not traced and 2 * len(self) >= LANES * settings.threads
        if several:
            _TOGETHER.add(form)
        several |= not traced and form in _TOGETHER and episodes * self.max_steps <= _FEW_STEPS
        several &= self.learner is None or learns_at_once(self.learner)
        lanes = LANES if several and GATHERS and not runtime.compiles_for_gpu() else 1
        kernel = partial(run_kernel, *form, traced, lanes)
        launch = Launch(kernel, vars(state).keys() | TRACED, ["outcomes"])
        falls = task.evaporation_in_training if self.learner else task.evaporation_in_evaluation
        common = {**laid_out([self.world], task, falls), "max_steps": self.max_steps}

        @lru_cache(maxsize=1)
        def cells_of(n: int) -> Any:
            """Return room for the cells of n runs; a GPU need not copy it."""
            cells = np.empty(n * (common["size"] + EXTRA_CELLS), np.int32)
            return room_for(cells) if n > 0 and runtime.compiles_for_gpu() else cells

        def launch_part(runs: slice, episodes: slice, **arrays: Any) -> None:
            n = runs.stop - runs.start
            n_tasks = n if lanes == 1 else min(settings.threads, n)
            values = {
                "n_runs": n,
                "n_tasks": n_tasks,
                "begun": np.full(1, n_tasks * lanes, np.int32),  # the next run that a lane takes
                "n_episodes": episodes.stop - episodes.start,
                "regrows": 0,  # food that grows back at once has no effect after a delivery
                "start_cells": start_cells[runs],
                "start_headings": headings[runs],
                "settings": self.settings[runs],
                "epsilon": state.epsilon[runs],
                "learning_rate": state.learning_rate[runs],
                "random_states": state.random_states[runs],
                "streams": np.ascontiguousarray(self.streams[runs, episodes]),
                "tables": state.q.shape[1],
                "floats_by_8": state.floats.shape[1] // 8,
                "integers_by_8": state.integers.shape[1] // 8,
                "q": state.q[runs],
                "floats": state.floats[runs],
                "integers": state.integers[runs],
                "cells": cells_of(n_tasks * lanes),
                "keeps_tables": 0,  # 1 to write the table after each step
                "outcomes": np.zeros((0, 0, 0), np.int32),  # (3, n, n_episodes): `OUTCOMES`
                "trace": np.zeros((0, 0), np.int32),  # (n * n_episodes * max_steps, `TRACE`)
                "trace_chances": np.zeros(0),  # the probability with which the action was chosen
                "trace_errors": np.zeros(0, np.float32),  # the TD error of each step
                "trace_tables": np.zeros(0, np.float32),  # the table after each step
                **arrays,
            }
            for name, value in values.items():
                if isinstance(value, np.ndarray):
                    flat = value if name in ("outcomes", "trace") else value.reshape(-1)
                    # Taichi allows no arrays of length 0.
                    values[name] = flat if flat.size else np.zeros((1,) * flat.ndim, flat.dtype)
            launch({**values, **common})

        launch_part(slice(0, 0), slice(0, 0))
        return launch_part

    def do_episodes(self, outcomes: np.ndarray, progress: Progress | None = None) -> float:
        """Do the next episodes, update the state, and write `outcomes` (3, n, episodes).

        Returns:
            The time without compilation: CPU seconds of all threads, or wall-clock seconds on a
            GPU.
        """
        episodes = outcomes.shape[2]
        settings = runtime.start()
        # Other processes do not change the CPU time of this one.
        clock = time.process_time if settings.arch == "cpu" else time.perf_counter
        workers, cost = settings.threads, self.cost
        if settings.arch != "cpu":
            workers, cost = _RUNS_ON_GPU, self.cost * _STEP_NS_ON_GPU / _STEP_NS
        launch = self.compiled(episodes)
        cells = self.world.grid.size + EXTRA_CELLS
        widest = max(array[0].size for array in vars(self.state).values())
        size = size_of_launch(workers, episodes, self.max_steps, cost, cells, widest)
        seconds = 0.0
        for runs, part in pieces(len(self), episodes, *size, progress):
            block = np.empty_like(outcomes[:, runs, part], order="C")
            began = clock()
            launch(runs, part, outcomes=block)
            seconds += clock() - began
            outcomes[:, runs, part] = block
        return seconds

    def record(
        self, episodes: int, tables: np.ndarray | None = None
    ) -> Iterator[dict[str, np.ndarray]]:
        """Yield the steps of the next episodes, in pieces, and update the state.

        A piece has the columns `TRACE`, with episodes numbered from 0 in each run. Further arrays
        (n,) are "runs", int64, the number of the run; "chances", float64, the probability of each
        action; and "td_errors", float32. Pieces of a run are in order. If `tables` is given, the
        kernel writes the table after each step of the piece into it.
        """
        runtime.start()
        launch, max_steps = self.compiled(episodes, traced=True), self.max_steps
        keeps = {} if tables is None else {"keeps_tables": 1, "trace_tables": tables}
        # A step needs ten times as much memory as a cell of the world.
        most_runs = MAX_ROLLOUT_STEPS // max(max_steps, self.world.grid.size // 10)
        runs_each = max(1, min(len(self), most_runs))
        episodes_each = max(1, MAX_ROLLOUT_STEPS // (runs_each * max_steps))
        for runs, part in pieces(len(self), episodes, runs_each, episodes_each):
            n_runs, n_episodes = runs.stop - runs.start, part.stop - part.start
            capacity = n_episodes * max_steps  # the most steps of a run
            trace = np.empty((n_runs * capacity, len(TRACE)), np.int32)
            chances, errors = np.empty(n_runs * capacity), np.empty(n_runs * capacity, np.float32)
            outcomes = np.zeros((len(OUTCOMES), n_runs, n_episodes), np.int32)
            arrays = {"trace": trace, "trace_errors": errors, "trace_chances": chances}
            launch(runs, part, outcomes=outcomes, **arrays, **keeps)
            steps_of_run = outcomes[layout.STEPS].sum(axis=1)
            taken = (np.arange(capacity) < steps_of_run[:, None]).reshape(-1)
            columns = dict(zip(TRACE, trace[taken].T, strict=True))
            columns["episodes"] += part.start
            columns["runs"] = np.repeat(np.arange(runs.start, runs.stop), steps_of_run)
            yield {**columns, "chances": chances[taken], "td_errors": errors[taken]}


def size_of_launch(
    workers: int, episodes: int, max_steps: int, cost: float, cells: int, widest: int
) -> tuple[int, int]:
    """Return the number of runs in a launch, and of episodes of each, for `workers` parallel runs.

    `cost` is the time of a step, relative to a step of Q-learning. `cells` is the number of cells
    of a run, and `widest` the size of the largest array in its state.
    """
    steps_each = _SECONDS * 1e9 / (_STEP_NS * cost)
    rounds = int(steps_each // (episodes * max_steps))
    numbers = max(widest, cells, episodes)
    most_runs = max(1, min(_WORKSPACE_BYTES // (4 * cells), _MOST_NUMBERS // numbers))
    if rounds >= 1:
        return min(workers * rounds, most_runs), episodes
    return min(workers, most_runs), max(1, int(steps_each // max_steps))


def pieces(
    n_runs: int,
    n_episodes: int,
    runs_each: int,
    episodes_each: int,
    progress: Progress | None = None,
) -> Iterator[tuple[slice, slice]]:
    """Yield the runs and episodes of each launch, with the episodes of a run in order."""
    for first in range(0, n_runs, runs_each):
        end = min(first + runs_each, n_runs)
        for begin in range(0, n_episodes, episodes_each):
            stop = min(begin + episodes_each, n_episodes)
            yield slice(first, end), slice(begin, stop)
            if progress is not None:
                progress((first + (end - first) * stop / n_episodes) / n_runs)
