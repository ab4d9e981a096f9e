"""Many configurations over many seeds, trained and evaluated, kept on disk as they finish.

The work is cut into blocks (some configurations of a learner, some seeds). Each finished block is a
file, so that a sweep that was stopped goes on where it was. Since a run depends only on its world,
configuration and seed, blocks can be done in any order without changing anything.
"""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from taichi_ants import checks, files
from taichi_ants.engines.records import Record
from taichi_ants.engines.runs.results import LearnerCost
from taichi_ants.errors import AntsError
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.task import Task
from taichi_ants.task.constants import N_ACTIONS
from taichi_ants.worlds.world import World

_STEPS_OF_A_BLOCK = 100_000_000  # at most, if every episode used all its steps
_RUNS_OF_A_BLOCK = 5000  # at most, each needs about 20 KB while it is trained
_COPIES = 3  # of the results in memory while they are analysed
_ARRAYS = ("returns", "steps", "deliveries")
_GREEDY = tuple(f"greedy_{name}" for name in _ARRAYS)


@dataclass(frozen=True)
class Sweep:
    """What to do.

    Attributes:
        world: The world of all runs.
        tasks: C tasks, that of each configuration.
        configs: C configurations.
        seeds: S seeds.
        episodes: Training episodes of each run.
        max_steps: Step limit of episodes and rollouts.
        rollouts: Greedy rollouts of each final policy.

    Raises:
        AntsError: A value is not allowed, the world has no room for the ant, or the results would
            not fit into the memory of this machine.
    """

    world: World
    tasks: tuple[Task, ...]
    configs: tuple[TrainingConfig, ...]
    seeds: tuple[int, ...]
    episodes: int = 500
    max_steps: int = 600
    rollouts: int = 50

    def __post_init__(self) -> None:
        checks.checked_world(self.world).start(checks.checked_seeds(self.seeds)[0])
        configs = checks.checked_configs(self.configs)
        object.__setattr__(self, "configs", configs)
        for task in self.tasks:
            checks.checked_runs_task(task)
        if len(self.tasks) != len(configs):
            raise AntsError(f"there are {len(self.tasks)} tasks for {len(configs)} configurations.")
        checks.checked_count("episodes", self.episodes)
        for task in dict.fromkeys(self.tasks):
            checks.checked_max_steps(self.max_steps, task)
        checks.checked_count("rollouts", self.rollouts)
        runs = len(self.configs) * len(self.seeds)
        figures = len(_ARRAYS) * (self.episodes + self.rollouts)
        needed = runs * (4 * figures + 4 * self.n_states * N_ACTIONS) * _COPIES
        if needed > available_memory():
            raise AntsError(
                f"{runs} runs of {self.episodes} episodes need about {needed / 1e9:.0f} GB of "
                f"memory, this machine has {available_memory() / 1e9:.0f} GB; take fewer seeds, "
                "configurations or episodes at once."
            )

    def blocks(self) -> Iterator[tuple[slice, slice]]:
        """The range of configurations, all with one learner and depth, and of seeds of each block.

        Large enough for the cost of a launch not to count, small enough for a stop to come soon.
        """
        longest = self.episodes * self.max_steps
        size = min(max(1, _STEPS_OF_A_BLOCK // longest), _RUNS_OF_A_BLOCK)
        kind = lambda c: (self.tasks[c], self.cost_of(c))  # noqa: E731
        for _, alike in itertools.groupby(range(len(self.configs)), kind):
            first, *others = alike
            configs = slice(first, first + 1 + len(others))
            for some in _pieces(configs, max(1, size // len(self.seeds))):
                for seeds in _pieces(slice(0, len(self.seeds)), size):
                    yield some, seeds

    @property
    def n_states(self) -> int:
        """The rows of each table."""
        return self.tasks[0].n_states

    def cost_of(self, c: int) -> tuple[str, int]:
        """What the cost of a configuration depends on: its learner and its planning steps."""
        return self.configs[c].learner, self.configs[c].planning_steps


@dataclass(frozen=True, eq=False, repr=False)
class SweepResult(Record):
    """What came of it.

    Attributes:
        returns, steps, deliveries: integer (C, S, episodes), of training.
        greedy_returns, greedy_steps, greedy_deliveries: integer (C, S, rollouts).
        q_values: float32 (C, S, 128, 5), the final policies; None where they were not kept.
        costs: What each learner's training took, over all its blocks.
    """

    returns: np.ndarray
    steps: np.ndarray
    deliveries: np.ndarray
    greedy_returns: np.ndarray
    greedy_steps: np.ndarray
    greedy_deliveries: np.ndarray
    q_values: np.ndarray | None
    costs: tuple[LearnerCost, ...]


def _pieces(whole: slice, size: int) -> Iterator[slice]:
    for first in range(whole.start, whole.stop, size):
        yield slice(first, min(first + size, whole.stop))


def available_memory() -> float:
    """Bytes of memory that this machine has; infinite where the system does not tell."""
    with suppress(AttributeError, ValueError, OSError):
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return math.inf


def run_sweep(
    sweep: Sweep,
    folder: Path,
    threads: int | None = None,
    arch: str | None = None,
    progress: Callable[[float], None] = lambda share: None,
    notice: Callable[[str], None] = lambda text: None,
) -> SweepResult:
    """Do the blocks that the folder does not hold yet, and join all.

    Args:
        sweep: What to do.
        folder: Where finished blocks are kept; it must belong to this sweep alone.
        threads, arch: As in `train`.
        progress: Called at first and after each block with the share of the work that is done.
        notice: Called with what a person should know, as that a block is damaged.

    Raises:
        AntsError: A block cannot be written, or an argument is not allowed.
    """
    blocks = list(sweep.blocks())
    weights = [_weight(sweep, configs, seeds) for configs, seeds in blocks]
    total, done = sum(weights), 0.0
    joined = _empty_result(sweep)
    costs: dict[tuple[str, int], LearnerCost] = {}
    progress(0.0)
    for (configs, seeds), weight in zip(blocks, weights, strict=True):
        path = folder / f"block-{configs.start:04d}-{seeds.start:06d}.npz"
        block = read_block(path, notice)
        if block is None:
            block = _do_block(sweep, configs, seeds, threads, arch)
            files.write_sealed_npz(path, block)
        for name, array in joined.items():
            array[configs, seeds] = block[name]
        _add_cost(costs, sweep.cost_of(configs.start), block)
        done += weight
        progress(done / total)
    return SweepResult(**joined, costs=tuple(costs.values()))


def _do_block(
    sweep: Sweep, configs: slice, seeds: slice, threads: int | None, arch: str | None
) -> dict[str, np.ndarray]:
    from taichi_ants.engines.runs.training import evaluate, train

    chosen = sweep.seeds[seeds]
    trained = train(
        sweep.world,
        sweep.configs[configs],
        chosen,
        sweep.episodes,
        sweep.max_steps,
        sweep.tasks[configs.start],
        threads=threads,
        arch=arch,
    )
    tables = trained.q_values
    greedy = evaluate(
        sweep.world,
        tables,
        sweep.rollouts,
        chosen,
        sweep.max_steps,
        sweep.tasks[configs.start],
        threads=threads,
        arch=arch,
    )
    block = {name: files.smallest(getattr(trained, name)) for name in _ARRAYS}
    block |= {f"greedy_{name}": files.smallest(getattr(greedy, name)) for name in _ARRAYS}
    (cost,) = trained.costs
    return block | {"q_values": tables, "cost": np.array([cost.steps, cost.seconds])}


def read_block(path: Path, notice: Callable[[str], None]) -> dict[str, np.ndarray] | None:
    """A finished block; None if there is none, or, with a word on it, if it is damaged."""
    if not path.exists():
        return None
    try:
        return files.read_sealed_npz(path)
    except AntsError:
        notice(f"{str(path)!r} is damaged, so this part is done again.")
        return None


def _empty_result(sweep: Sweep) -> dict[str, np.ndarray]:
    runs = (len(sweep.configs), len(sweep.seeds))
    arrays = {name: np.zeros((*runs, sweep.episodes), dtype=np.int32) for name in _ARRAYS}
    arrays |= {name: np.zeros((*runs, sweep.rollouts), dtype=np.int32) for name in _GREEDY}
    return arrays | {"q_values": np.zeros((*runs, sweep.n_states, N_ACTIONS), dtype=np.float32)}


def _add_cost(
    costs: dict[tuple[str, int], LearnerCost],
    key: tuple[str, int],
    block: dict[str, np.ndarray],
) -> None:
    known = costs.get(key, LearnerCost(*key, steps=0, seconds=0.0))
    steps, seconds = block["cost"].tolist()
    costs[key] = LearnerCost(*key, known.steps + int(steps), known.seconds + seconds)


def _weight(sweep: Sweep, configs: slice, seeds: slice) -> float:
    runs = (configs.stop - configs.start) * (seeds.stop - seeds.start)
    return (4 + sweep.configs[configs.start].planning_steps) * runs
