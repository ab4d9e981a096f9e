"""A world and a task laid out for the kernel of independent runs, and the loop over launches.

A launch cannot be interrupted, so it should take about a second even if every episode uses all of
its steps. Within that bound few large launches are best: threads wait for the last run of each.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple, dataclass
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
_STEP_NS = 25  # of Q-learning in one thread, on a slow core
_WORKSPACE_BYTES = 256 * 2**20
_MOST_NUMBERS = 2**30  # of one array in a launch, which kernels index by 32 bits
_PARALLEL_RUNS_ON_GPU = 4096

# The arguments of the kernel besides those of world and task: of n runs of one learner with tables
# of n_states rows. Arrays of runs are flat, one run behind the other. Each has so many tables, and
# so many times 8 floats and integers, see `layout.padded`.
_NO_WORK: dict[str, Any] = {
    "n_runs": 0,
    "n_episodes": 0,
    "regrows": 0,  # 1 if food grows back at once; not while an episode ends at a delivery
    "start_cells": np.zeros(1, np.int32),  # (n,)
    "start_headings": np.zeros(1, np.int32),  # (n,)
    "settings": np.zeros(1, np.float64),  # `layout.SETTINGS`, then the hyperparameters
    "epsilon": np.zeros(1, np.float64),  # (n,) of the next episode
    "learning_rate": np.zeros(1, np.float64),  # (n,) of the next episode
    "random_states": np.zeros(1, np.uint64),  # (n,)
    "streams": np.zeros(1, np.uint64),  # (n * n_episodes,): of each episode without learning
    "tables": 0,
    "floats_by_8": 0,
    "integers_by_8": 0,
    "q": np.zeros(1, np.float32),
    "floats": np.zeros(1, np.float32),
    "integers": np.zeros(1, np.int32),
    "cells": np.zeros(1, np.int32),  # the packed cells of each run, see `step`
    "keeps_tables": 0,  # 1 to write the table after each step
    "outcomes": np.zeros((1, 1, 1), np.int32),  # (3, n, n_episodes): `layout.OUTCOMES`
    "trace": np.zeros((1, 1), np.int32),  # (n * n_episodes * max_steps, columns): `layout.TRACE`
    "trace_chances": np.zeros(1, np.float64),  # the probability with which the action was chosen
    "trace_errors": np.zeros(1, np.float32),  # the TD error of each step
    "trace_tables": np.zeros(1, np.float32),  # the table after each step
}


@dataclass(frozen=True)
class Runs:
    """Runs of one learner, or that follow tables without learning.

    Attributes:
        seeds: The seed of each run, Python integers (n,), for worlds that do not list their ant.
        settings: float64 (n, columns), `layout.SETTINGS` and the hyperparameters of the learner.
        state: Where the runs stand, arrays (n, ...), contiguous; the kernel moves it on.
        streams: uint64 (n, episodes), a random stream for each episode without learning.
        cost: What a step takes, 1 for one of Q-learning.
    """

    learner: Learner | None
    seeds: np.ndarray
    settings: np.ndarray
    state: RunState
    streams: np.ndarray | None = None
    cost: float = 1.0

    @classmethod
    def learning(
        cls, configs: Sequence[TrainingConfig], seeds: Sequence[int], state: RunState
    ) -> Runs:
        """Configurations that differ in the settings of all learners alone, times seeds."""
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
        """Runs that follow tables (n, n_states, 5), in the rollouts of these `numbers`."""
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
    """Arrays and numbers of a task and of worlds of one grid; trails evaporate if `falls`."""
    grid = worlds[0].grid
    return {
        "size": grid.size,
        **(task.pheromone if falls else task.pheromone.lasting).numbers,
        **task.numbers,
        "rewards": task.rewards.by_event(),
        # Of the cells of each world: packed at the start of an episode; trails then, under food
        # too; a bit for each heading that leads nearer to the queen.
        "world": np.concatenate([pack_cells(world) for world in worlds]),
        "trails": np.concatenate([world.trail_levels() for world in worlds]),
        "closer": np.concatenate([world.closer() for world in worlds]),
        "compass": compass_of(grid),  # see `rules.actions`
    }


class Launcher:
    """The compiled kernel of some runs in one world, and its arguments."""

    def __init__(
        self, world: World, task: Task, max_steps: int, runs: Runs, traced: bool = False
    ) -> None:
        # Taichi is imported once it is configured, see `runtime`.
        from taichi_ants.engines.arguments import Launch
        from taichi_ants.engines.runs.kernels import run_kernel
        from taichi_ants.engines.runs.step import EXTRA_CELLS

        self._runs = runs
        self._cells, self._headings = world.first_starts(words_of(runs.seeds))
        self.cells_of_a_run = world.grid.size + EXTRA_CELLS
        learns, pheromone = runs.learner is not None, task.pheromone
        deposits, half = pheromone.numbers["deposits"], pheromone.view == "half"
        self._launch = Launch(partial(run_kernel, runs.learner, task.sees, deposits, half, traced))
        falls = task.evaporation_in_training if learns else task.evaporation_in_evaluation
        self._values = {**_NO_WORK, **laid_out([world], task, falls), "max_steps": max_steps}
        self._launch(self._values)  # which compiles it

    def launch(self, some: slice, episodes: slice, **arrays: Any) -> None:
        """Do some episodes of some runs; what comes out is written into the arrays."""
        runs, state = self._runs, self._runs.state
        start_cells = self._cells[some]
        values = {
            "n_runs": len(start_cells),
            "n_episodes": episodes.stop - episodes.start,
            "start_cells": start_cells,
            "start_headings": self._headings[some],
            "settings": runs.settings[some].reshape(-1),
            "tables": state.q.shape[1],
            "floats_by_8": state.floats.shape[1] // 8,
            "integers_by_8": state.integers.shape[1] // 8,
            "cells": np.empty(len(start_cells) * self.cells_of_a_run, np.int32),
            **{name: array[some].reshape(-1) for name, array in vars(state).items()},
            **arrays,
        }
        if runs.streams is not None:
            values["streams"] = np.ascontiguousarray(runs.streams[some, episodes]).reshape(-1)
        # An array of length 0 cannot be an argument; the single 0 stays.
        self._values.update({name: one for name, one in values.items() if getattr(one, "size", 1)})
        self._launch(self._values)


def do_episodes(
    world: World,
    task: Task,
    max_steps: int,
    runs: Runs,
    outcomes: np.ndarray,
    progress: Progress | None = None,
) -> float:
    """Do the next episodes of n runs, move their state on, and write `outcomes` (3, n, episodes).

    Returns:
        What it took without compilation, in CPU seconds of all threads together, or wall-clock
        seconds on a GPU.
    """
    episodes = outcomes.shape[2]
    settings = runtime.start()
    # Seconds of all threads of this process on the CPU, which other processes do not slow.
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
    """Runs, and episodes of each, in one launch, if `workers` runs progress at the same time.

    A step costs `cost`, 1 for one of Q-learning; a run needs so many `cells`, and `widest` is the
    most numbers that its state has in one array.
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
    """Yield the runs and the episodes of all launches, the episodes of a run in order."""
    for first in range(0, n_runs, runs_each):
        end = min(first + runs_each, n_runs)
        for begin in range(0, n_episodes, episodes_each):
            stop = min(begin + episodes_each, n_episodes)
            yield slice(first, end), slice(begin, stop)
            if progress is not None:
                progress((first + (end - first) * stop / n_episodes) / n_runs)
