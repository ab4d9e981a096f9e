"""Arguments of the kernel of independent runs, and the loop over its launches.

A launch cannot be interrupted, so it should take about a second even if every episode uses all of
its steps. Within that bound, few large launches are best, because threads wait for the last run of
each launch.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple, dataclass, field
from functools import partial
from typing import Any

import numpy as np

from taichi_ants import learners, runtime
from taichi_ants.engines.layout import (
    EPSILON_DECAY,
    N_SETTINGS,
    OUTCOMES,
    SETTINGS,
    compass_of,
    pack_cells,
)
from taichi_ants.engines.runs.results import RunState
from taichi_ants.grid.constants import STREAM_ROLLOUT
from taichi_ants.grid.randomness import stream_state, words_of
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.learner import Learner
from taichi_ants.task import Task
from taichi_ants.task.constants import N_ACTIONS
from taichi_ants.worlds.world import World

Progress = Callable[[float], None]  # called with the share of the work that is done, 0 to 1

_SECONDS = 1.0
_STEP_NS = 25  # a step of Q-learning on one thread of a slow core
_WORKSPACE_BYTES = 256 * 2**20
_MOST_NUMBERS = 2**30  # in one array of a launch, because kernels use 32-bit indices
_PARALLEL_RUNS_ON_GPU = 4096


@dataclass(frozen=True)
class Runs:
    """n runs that learn by one learner, or follow tables without learning.

    Attributes:
        seeds: The seed of each run, Python integers (n,), for worlds that do not list their ant.
        settings: float64 (n, columns), `layout.SETTINGS` and the hyperparameters of the learner.
        state: The state of the runs, contiguous arrays (n, ...), which the kernel updates.
        streams: uint64 (n, episodes), a random stream for each episode; none for learners.
        cost: The time of a step, relative to a step of Q-learning.
    """

    learner: Learner | None
    seeds: np.ndarray
    settings: np.ndarray
    state: RunState
    streams: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), np.uint64))
    cost: float = 1.0

    @classmethod
    def learning(
        cls, configs: Sequence[TrainingConfig], seeds: Sequence[int], state: RunState
    ) -> Runs:
        """Return runs of all seeds and configurations, which share learner and hyperparameters."""
        learner = learners.get(configs[0].learner)
        more = learner.settings(configs[0])
        settings = [(*(getattr(one, name) for name in SETTINGS), *astuple(more)) for one in configs]
        return cls(
            learner,
            np.tile(np.array(seeds, dtype=object), len(configs)),
            np.repeat(np.array(settings, dtype=np.float64), len(seeds), axis=0),
            state,
            cost=learner.cost(more),
        )

    @classmethod
    def following(
        cls, tables: np.ndarray, seeds: np.ndarray, numbers: np.ndarray, epsilon: float
    ) -> Runs:
        """Return runs that follow tables (n, n_states, 5) in the rollouts of these `numbers`."""
        state = RunState.empty((len(tables),), tables.shape[-2])
        state.q[:, 0, :, :N_ACTIONS] = tables
        state.epsilon[:] = epsilon
        streams = stream_state(words_of(seeds)[:, None], STREAM_ROLLOUT, numbers[None, :])
        settings = np.zeros((len(tables), N_SETTINGS))
        settings[:, EPSILON_DECAY] = 1.0
        return cls(None, seeds, settings, state, streams)

    def __len__(self) -> int:
        return len(self.seeds)


def laid_out(worlds: Sequence[World], task: Task, falls: bool) -> dict[str, Any]:
    """Return kernel arguments for a task and worlds of one grid; trails evaporate if `falls`."""
    grid = worlds[0].grid
    return {
        "size": grid.size,
        **(task.pheromone if falls else task.pheromone.lasting).numbers,
        **task.numbers,
        "rewards": task.rewards.by_event(),
        "choice": task.choice.numbers(),
        # For each world: packed cells and all trails (also under food) at the start of an episode;
        # per cell a bit for each heading that leads nearer to the queen.
        "world": np.concatenate([pack_cells(world) for world in worlds]),
        "trails": np.concatenate([world.trail_levels() for world in worlds]),
        "closer": np.concatenate([world.closer() for world in worlds]),
        "compass": compass_of(grid),  # see `rules.actions`
    }


class Launcher:
    """The compiled kernel for runs in one world, and its arguments."""

    def __init__(
        self, world: World, task: Task, max_steps: int, runs: Runs, traced: bool = False
    ) -> None:
        # Imported here, because Taichi must be configured first; see `runtime`.
        from taichi_ants.engines.arguments import Launch
        from taichi_ants.engines.runs.kernels import run_kernel
        from taichi_ants.engines.runs.step import EXTRA_CELLS, Rules

        self._runs = runs
        self._cells, self._headings = world.first_starts(words_of(runs.seeds))
        self.cells_of_a_run = world.grid.size + EXTRA_CELLS
        rules, learner = Rules.of(task), runs.learner
        self._launch = Launch(partial(run_kernel, rules, learner, traced))
        falls = task.evaporation_in_training if learner else task.evaporation_in_evaluation
        self._common = {**laid_out([world], task, falls), "max_steps": max_steps}
        self.launch(slice(0, 0), slice(0, 0))  # compiles the kernel

    def launch(self, some: slice, episodes: slice, **arrays: Any) -> None:
        """Do some episodes of some runs, and write the results into the arrays.

        Arrays are flat, one run after another. The sizes of a memory are multiples of 8, see
        `layout.padded`.
        """
        runs, state, start_cells = self._runs, self._runs.state, self._cells[some]
        values = {
            "n_runs": len(start_cells),
            "n_episodes": episodes.stop - episodes.start,
            "regrows": 0,  # food that grows back at once has no effect, as a delivery is the end
            "start_cells": start_cells,
            "start_headings": self._headings[some],
            "settings": runs.settings[some],
            "epsilon": state.epsilon[some],
            "learning_rate": state.learning_rate[some],
            "random_states": state.random_states[some],
            "streams": np.ascontiguousarray(runs.streams[some, episodes]),
            "tables": state.q.shape[1],
            "floats_by_8": state.floats.shape[1] // 8,
            "integers_by_8": state.integers.shape[1] // 8,
            "q": state.q[some],
            "floats": state.floats[some],
            "integers": state.integers[some],
            "cells": np.empty(len(start_cells) * self.cells_of_a_run, np.int32),
            "keeps_tables": 0,  # 1 to write the table after each step
            "outcomes": np.zeros((0, 0, 0), np.int32),  # (3, n, n_episodes): `layout.OUTCOMES`
            "trace": np.zeros((0, 0), np.int32),  # (n * n_episodes * max_steps, `layout.TRACE`)
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
        self._launch({**values, **self._common})


def do_episodes(
    world: World,
    task: Task,
    max_steps: int,
    runs: Runs,
    outcomes: np.ndarray,
    progress: Progress | None = None,
) -> float:
    """Do the next episodes of n runs, update their state, and write `outcomes` (3, n, episodes).

    Returns:
        The time without compilation: CPU seconds of all threads, or wall-clock seconds on a GPU.
    """
    episodes = outcomes.shape[2]
    settings = runtime.start()
    # Other processes do not change the CPU time of this one.
    clock = time.process_time if settings.arch == "cpu" else time.perf_counter
    workers = settings.threads if settings.arch == "cpu" else _PARALLEL_RUNS_ON_GPU
    launcher = Launcher(world, task, max_steps, runs)
    widest = max(array[0].size for array in vars(runs.state).values())
    size = size_of_launch(workers, episodes, max_steps, runs.cost, launcher.cells_of_a_run, widest)
    seconds = 0.0
    for some, part in pieces(len(runs), episodes, *size, progress):
        block = np.empty((len(OUTCOMES), some.stop - some.start, part.stop - part.start), np.int32)
        began = clock()
        launcher.launch(some, part, outcomes=block)
        seconds += clock() - began
        outcomes[:, some, part] = block
    return seconds


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
