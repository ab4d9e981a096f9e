"""Where runs stand, and what else the engine needs to know of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np

from taichi_ants import learners
from taichi_ants.engines.records import Record
from taichi_ants.grid.constants import STREAM_ANT, STREAM_ROLLOUT
from taichi_ants.grid.randomness import stream_state
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.registry import Learner, Memory
from taichi_ants.task.constants import N_ACTIONS, ROW


@dataclass(frozen=True, eq=False, repr=False)
class RunState(Record):
    """Where runs stopped; training goes on from it bit for bit.

    Attributes (leading axes: the runs, for example (configurations, seeds)):
        q: float32 (..., 1 + tables, n_states, 8), the table that the ant acts by and the further
            ones of its learner; 5 action values and 3 unused.
        floats: float32 (..., k), as many as any learner here needs, up to the next multiple of 8;
            see `taichi_ants.learners.Memory`.
        integers: int32 (..., k), likewise.
        random_states: uint64 (...,), the ants' random streams.
        epsilon: float64 (...,), of the next episode.
    """

    q: np.ndarray
    floats: np.ndarray
    integers: np.ndarray
    random_states: np.ndarray
    epsilon: np.ndarray

    def take(self, index: object) -> RunState:
        """A copy of the runs at an index of the leading axes."""
        return RunState(**{name: array[index].copy() for name, array in vars(self).items()})

    def put(self, index: object, part: RunState) -> None:
        """Overwrite the runs at an index."""
        for name, array in vars(self).items():
            array[index] = getattr(part, name).reshape(array[index].shape)

    def flat(self) -> RunState:
        """A view with one leading axis."""
        axes, n = self.epsilon.ndim, self.epsilon.size
        parts = vars(self).items()
        return RunState(**{name: array.reshape(n, *array.shape[axes:]) for name, array in parts})


@dataclass(frozen=True)
class Runs:
    """Runs of one learner.

    Attributes:
        learner: The learner; None to follow the tables without learning.
        seeds: The seed of each run, Python integers (n,), for worlds that do not list their ant.
        settings: float64 (n, columns), `layout.SETTINGS` and the hyperparameters of the learner.
        state: Where the runs stand, arrays (n, ...), contiguous; engines move it on.
        streams: uint64 (n, episodes), a random stream for each episode without learning.
        cost: What a step takes, 1 for one of Q-learning.
    """

    learner: Learner | None
    seeds: np.ndarray
    settings: np.ndarray
    state: RunState
    streams: np.ndarray | None = None
    cost: float = 1.0

    def __len__(self) -> int:
        return len(self.seeds)


def fresh_state(configs: Sequence[TrainingConfig], seeds: Sequence[int], n_states: int) -> RunState:
    """The state of runs that have not begun, leading axes (configurations, seeds)."""
    memories = [
        astuple(learners.get(config.learner).memory_for(config, n_states)) for config in configs
    ]
    state = _empty_state((len(configs), len(seeds)), n_states, Memory(*np.max(memories, axis=0)))
    words = _as_words(np.array(seeds, dtype=object))
    state.random_states[:] = stream_state(words, STREAM_ANT, 0)
    state.epsilon[:] = np.array([config.epsilon for config in configs])[:, None]
    return state


def learning_runs(configs: Sequence[TrainingConfig], seeds: Sequence[int], state: RunState) -> Runs:
    """Runs of configurations that differ in the settings of all learners alone, times seeds."""
    config = configs[0]
    learner = learners.get(config.learner)
    settings = [
        (
            *(one.learning_rate, one.discount, one.epsilon_decay, one.min_epsilon),
            *astuple(learner.settings(one)),
        )
        for one in configs
    ]
    return Runs(
        learner,
        np.tile(np.array(seeds, dtype=object), len(configs)),
        np.repeat(np.array(settings, dtype=np.float64), len(seeds), axis=0),
        state.flat(),
        cost=learner.cost(learner.settings(config)),
    )


def fixed_policy_runs(
    tables: np.ndarray, seeds: np.ndarray, numbers: np.ndarray, epsilon: float
) -> Runs:
    """Runs that follow tables (n, n_states, 5) with a constant epsilon.

    Args:
        tables: The action values.
        seeds: Python integers (n,).
        numbers: Which rollouts of a seed, (episodes,); each has a stream of its own.
        epsilon: Probability of a random action.
    """
    state = _empty_state((len(tables),), tables.shape[-2], Memory())
    state.q[:, 0, :, :N_ACTIONS] = tables
    state.epsilon[:] = epsilon
    streams = stream_state(_as_words(seeds)[:, None], STREAM_ROLLOUT, numbers[None, :])
    settings = np.tile([0.0, 0.0, 1.0, 0.0], (len(tables), 1))  # epsilon does not decay
    return Runs(None, seeds, settings, state, streams)


def _empty_state(shape: tuple[int, ...], n_states: int, memory: Memory) -> RunState:
    return RunState(
        q=np.zeros((*shape, 1 + memory.tables, n_states, ROW), dtype=np.float32),
        floats=np.zeros((*shape, -(-memory.floats // 8) * 8), dtype=np.float32),
        integers=np.zeros((*shape, -(-memory.integers // 8) * 8), dtype=np.int32),
        random_states=np.zeros(shape, dtype=np.uint64),
        epsilon=np.zeros(shape, dtype=np.float64),
    )


def _as_words(seeds: np.ndarray) -> np.ndarray:
    """Seeds of any sign as 64-bit words."""
    return np.array([seed % 2**64 for seed in seeds.tolist()], dtype=np.uint64)
