"""Results of training and evaluation, with the state from which training resumes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass, field, fields
from typing import Any

import numpy as np

from taichi_ants import learners, measures
from taichi_ants.arguments import checked_max_steps, checked_seeds
from taichi_ants.engines.layout import OUTCOMES, padded
from taichi_ants.errors import as_array, expect
from taichi_ants.files import PathLike
from taichi_ants.files.archives import Kind
from taichi_ants.grid.constants import STREAM_ANT
from taichi_ants.grid.randomness import stream_state, words_of
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.learner import Memory
from taichi_ants.measures.finished import counts_of_lone_ant, of_lone_ants
from taichi_ants.measures.tidy import Measured, Tidy, seed_array
from taichi_ants.records import Record
from taichi_ants.task import Task
from taichi_ants.task.constants import N_ACTIONS, ROW
from taichi_ants.worlds.world import World

_KIND = Kind("training result", 7, "TrainingResult.save")


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
    def empty(
        cls,
        shape: tuple[int, ...],
        n_states: int,
        memory: Memory = Memory(),  # noqa: B008
    ) -> RunState:
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

    def part(self, configs: slice | list[int]) -> RunState:
        """Return the runs of some configurations, in arrays (runs, ...).

        The arrays are views if `configs` is a slice, else copies.
        """
        n, arrays = self.epsilon[configs].size, vars(self).items()
        return RunState(
            **{name: array[configs].reshape(n, *array.shape[2:]) for name, array in arrays}
        )

    def put(self, configs: slice | list[int], part: RunState) -> None:
        """Overwrite the runs of some configurations with a part that has copies, not views."""
        for name, array in vars(self).items():
            new = getattr(part, name)
            if not np.may_share_memory(array, new):
                array[configs] = new.reshape(array[configs].shape)


def memory_for(configs: Sequence[TrainingConfig], n_states: int) -> Memory:
    """Return a memory size that suffices for each of the learners, which must be registered."""
    memories = [
        astuple(learners.get(config.learner).memory_for(config, n_states)) for config in configs
    ]
    return padded(Memory(*np.max(memories, axis=0).tolist()))


@dataclass(frozen=True, eq=False, repr=False)
class TrainingResult(Record, Tidy):
    """The result of `train`: C configurations, S seeds, E episodes.

    Two results are equal if everything except `seconds` is equal.

    Attributes:
        returns, steps, deliveries: int32 (C, S, E), for each episode the undiscounted sum of
            rewards, the number of steps, and 1 if the ant delivered, else 0.
        seconds: The time of the last training without compilation: CPU seconds of all threads, or
            wall-clock seconds on a GPU.
        state: The state of the runs after the last episode, with leading axes (C, S).

    Raises:
        AntsError: The arrays do not fit the configurations and seeds.
    """

    world: World
    configs: tuple[TrainingConfig, ...]
    seeds: tuple[int, ...]
    max_steps: int
    task: Task
    returns: np.ndarray
    steps: np.ndarray
    deliveries: np.ndarray
    seconds: float = field(compare=False)
    state: RunState

    def __post_init__(self) -> None:
        """Check the shapes and types of arrays, because kernels rely on them."""
        expect("the state of a result", self.state, RunState)
        runs = len(self.configs), len(self.seeds)
        forms = {
            **dict.fromkeys(OUTCOMES, ("int32", (*runs, *np.shape(self.returns)[2:3]))),
            "q": ("float32", (*runs, None, self.task.n_states, ROW)),
            **{"floats": ("float32", (*runs, None)), "integers": ("int32", (*runs, None))},
            "random_states": ("uint64", runs),
            **dict.fromkeys(("epsilon", "learning_rate"), ("float64", runs)),
        }
        arrays = {**vars(self), **vars(self.state)}
        for name, (kind, shape) in forms.items():
            as_array(f"the array {name} of a result", arrays[name], kind, shape)

    def measured(self) -> Measured:
        """Return the values of the measures of each episode of each run."""
        arrays = {name: getattr(self, name) for name in OUTCOMES}
        return _measured(arrays, self.seeds, _labels(self.configs))

    @property
    def episodes(self) -> int:
        """The number of episodes of each run."""
        return self.returns.shape[2]

    @property
    def q_values(self) -> np.ndarray:
        """A copy of the action values after training, float32 (C, S, n_states, 5)."""
        return self.state.q[:, :, 0, :, :N_ACTIONS].copy()

    def save(self, path: PathLike) -> None:
        """Write the result to a file, from which `load` and `continue_training` resume exactly."""
        facts = {
            "world": self.world.as_dict(),
            "task": self.task.as_dict(),
            "configs": [config.as_dict() for config in self.configs],
            "seeds": self.seeds,
            "max_steps": self.max_steps,
            "seconds": self.seconds,
        }
        arrays = {name: getattr(self, name) for name in OUTCOMES}
        arrays |= {f"state_{name}": array for name, array in vars(self.state).items()}
        _KIND.write(path, facts, arrays)

    @classmethod
    def load(cls, path: PathLike) -> TrainingResult:
        """Return a result that `save` wrote; its learners need not be registered."""
        with _KIND.reading(path) as (arrays, facts):
            task = Task.from_dict(facts["task"])
            outcomes: dict[str, Any] = {name: arrays[name] for name in OUTCOMES}
            state = {one.name: arrays[f"state_{one.name}"] for one in fields(RunState)}
            return cls(
                world=World.from_dict(facts["world"]),
                configs=tuple(TrainingConfig(**config) for config in facts["configs"]),
                seeds=checked_seeds(facts["seeds"]),
                max_steps=checked_max_steps(facts["max_steps"], task),
                task=task,
                **outcomes,
                seconds=float(facts["seconds"]),
                state=RunState(**state),
            )


@dataclass(frozen=True, eq=False, repr=False)
class Rollouts(Record, Tidy):
    """The result of `evaluate`: int32 arrays of shape q_values.shape[:-2] + (rollouts,).

    `seeds` has the seed of each table, in the order of the last of its leading axes.
    """

    returns: np.ndarray
    steps: np.ndarray
    deliveries: np.ndarray
    seeds: tuple[int, ...] = field(default=(), compare=False, repr=False)

    def measured(self) -> Measured:
        """Return the values of the measures of each rollout; `configuration` numbers the tables.

        Tables are numbered along all leading axes except the last one, which is that of the seeds.
        """
        rollouts, leading = self.returns.shape[-1], self.returns.shape[:-1]
        shape = (-1, leading[-1] if leading else 1, rollouts)
        arrays = {name: getattr(self, name).reshape(shape) for name in OUTCOMES}
        n, several = arrays["returns"].shape[:2]
        names = ("",) if n == 1 else tuple(f"table {number}" for number in range(n))
        return _measured(arrays, self.seeds or tuple(range(several)), names)


def _measured(
    arrays: dict[str, np.ndarray], seeds: tuple[int, ...], groups: tuple[str, ...]
) -> Measured:
    """Return the measures of lone ants from arrays (configurations, seeds, episodes) by name."""
    configurations, places, episodes = (
        numbers.ravel().astype(np.int32) for numbers in np.indices(arrays["steps"].shape)
    )
    values = {name: array.ravel() for name, array in arrays.items()}
    read = of_lone_ants(counts_of_lone_ant(values))
    return Measured(
        index={
            "configuration": configurations,
            "seed": seed_array(seeds)[places],
            "episode": episodes,
            "tick": values["steps"],
        },
        values={**values, **read},
        of_seed=places,
        of_group=configurations,
        seeds=seeds,
        groups=groups,
        plotted=("returns", "deliveries", "steps"),
        units={"steps": "ticks", **{name: measures.get(name).unit for name in read}},
    )


def _labels(configs: Sequence[TrainingConfig]) -> tuple[str, ...]:
    """Return a short name of each configuration: the settings that differ."""
    rows = [{**vars(one), **dict(one.hyperparameters), "hyperparameters": ""} for one in configs]
    names = dict.fromkeys(name for row in rows for name in row)
    differ = [name for name in names if len({str(row.get(name)) for row in rows}) > 1]
    return tuple(
        ", ".join(
            str(row[name]) if name == "learner" else f"{name.replace('_', ' ')} {row[name]}"
            for name in differ
            if name in row
        )
        for row in rows
    )
