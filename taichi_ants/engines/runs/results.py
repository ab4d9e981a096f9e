"""What training and evaluation return: NumPy arrays and what is needed to go on."""

from __future__ import annotations

import operator
from dataclasses import asdict, astuple, dataclass, field, fields
from typing import Any

import numpy as np

from taichi_ants import files, learners
from taichi_ants.checks import checked_count, checked_max_steps, checked_seeds
from taichi_ants.engines.layout import OUTCOMES
from taichi_ants.engines.records import Record
from taichi_ants.engines.runs.state import RunState
from taichi_ants.engines.stored import FileKind, world_arrays, world_facts, world_from
from taichi_ants.errors import AntsError, shown
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.task import Task
from taichi_ants.task.constants import N_ACTIONS, ROW
from taichi_ants.worlds.world import World

# What the arrays of a result come from.
_MAKERS = ("world", "task", "configs", "seeds", "max_steps")
_KIND = FileKind("taichi-ants training 3", "training result", "TrainingResult.save")
_SUMMED_UP, _LISTED = 50, 6  # episodes and configurations that a result shows


@dataclass(frozen=True)
class LearnerCost:
    """What the runs of one learner took.

    Attributes:
        learner: Its name.
        planning_steps: Model updates after each step.
        steps: Environment steps that were taken, learning included.
        seconds: CPU seconds of all threads together, without compilation; wall-clock seconds on a
            GPU.
    """

    learner: str
    planning_steps: int
    steps: int
    seconds: float

    @property
    def nanoseconds_per_step(self) -> float:
        """CPU time of one environment step with its learning, in nanoseconds."""
        return self.seconds * 1e9 / self.steps if self.steps else float("nan")

    def as_row(self) -> dict[str, object]:
        """For tables and manifests."""
        return {**vars(self), "nanoseconds_per_step": self.nanoseconds_per_step}


@dataclass(frozen=True, eq=False, repr=False)
class TrainingResult(Record):
    """What `train` returns.

    C configurations, S seeds, E episodes. Two results are equal if all but their costs are.

    Attributes:
        world: The world trained in.
        configs: The configurations, in the order of the arrays' first axis.
        seeds: The seeds, in the order of the second axis.
        max_steps: The step limit of an episode.
        task: The rules of the game.
        returns: int32 (C, S, E), undiscounted sum of the rewards of each episode.
        steps: int32 (C, S, E), length of each episode.
        deliveries: int32 (C, S, E), 1 where the food was given to the queen.
        costs: What the learners took, one entry for each learner and number of planning steps.
        state: Where the runs stopped, leading axes (C, S).

    Raises:
        AntsError: The arrays do not belong to the configurations and seeds; or a copy by
            `dataclasses.replace` claims to be of another training.
    """

    world: World
    configs: tuple[TrainingConfig, ...]
    seeds: tuple[int, ...]
    max_steps: int
    task: Task
    returns: np.ndarray
    steps: np.ndarray
    deliveries: np.ndarray
    costs: tuple[LearnerCost, ...] = field(compare=False)
    state: RunState
    # What the arrays come from; a copy keeps it, so that it cannot claim to be something else.
    _made_by: tuple = field(default=(), compare=False, repr=False)

    def __post_init__(self) -> None:
        for name, was in zip(_MAKERS, self._made_by, strict=False):
            if getattr(self, name) != was:
                raise AntsError(
                    f"{name} cannot be replaced in a result, whose arrays come from others; train "
                    "anew with the ones that you want."
                )
        object.__setattr__(self, "_made_by", tuple(getattr(self, name) for name in _MAKERS))
        if not isinstance(self.state, RunState):
            raise AntsError(f"state of a result is {shown(self.state)}; it must be a RunState.")
        self.check()

    @property
    def episodes(self) -> int:
        """The number of episodes of each run so far."""
        return self.returns.shape[2]

    @property
    def q_values(self) -> np.ndarray:
        """The action values at the end, float32 (C, S, n_states, 5), a copy."""
        return self.state.q[:, :, 0, :, :N_ACTIONS].copy()

    def save(self, path: files.PathLike) -> None:
        """Write the result; training goes on from what `load` reads, bit for bit.

        Raises:
            AntsError: The file cannot be written.
        """
        facts = {
            "world": world_facts(self.world),
            "task": self.task.as_dict(),
            "configs": [config.as_dict() for config in self.configs],
            "seeds": self.seeds,
            "max_steps": self.max_steps,
            "costs": [asdict(cost) for cost in self.costs],
        }
        arrays = {name: getattr(self, name) for name in OUTCOMES}
        arrays |= {f"state_{name}": array for name, array in vars(self.state).items()}
        _KIND.write(path, facts, {**arrays, **world_arrays(self.world, "world")}, compress=True)

    @classmethod
    def load(cls, path: files.PathLike) -> TrainingResult:
        """Read a result that `save` wrote; its learners need not be registered.

        Raises:
            AntsError: The file is missing, damaged, or holds no training result.
        """
        stored, facts = _KIND.read(path)
        with _KIND.rebuilding(path):
            task = Task.from_dict(facts["task"])
            costs = tuple(LearnerCost(**cost) for cost in facts["costs"])
            for cost in costs:
                checked_count("steps", cost.steps, most=2**63 - 1, least=0)
            arrays: dict[str, Any] = {name: np.ascontiguousarray(stored[name]) for name in OUTCOMES}
            state = {
                one.name: np.ascontiguousarray(stored[f"state_{one.name}"])
                for one in fields(RunState)
            }
            return cls(
                world=world_from(stored, "world", facts["world"]),
                configs=tuple(TrainingConfig(**config) for config in facts["configs"]),
                seeds=checked_seeds(facts["seeds"]),
                max_steps=checked_max_steps(facts["max_steps"], task),
                task=task,
                **arrays,
                costs=costs,
                state=RunState(**state),
            )

    def __repr__(self) -> str:
        last = slice(-_SUMMED_UP, None)
        lines = [
            f"world: {self.world}",
            f"seeds: {len(self.seeds)}, from {min(self.seeds)} to {max(self.seeds)}",
            f"episodes: {self.episodes}, of at most {self.max_steps} steps each",
            f"task: {self.task}",
            f"means over seeds and the last {min(_SUMMED_UP, self.episodes)} episodes:",
        ]
        for c, config in enumerate(self.configs[:_LISTED]):
            means = (array[c, :, last].mean() for array in self._outcomes)
            line = "    {}\n        return {:.4g}, steps {:.4g}, deliveries {:.3g}"
            lines.append(line.format(config, *means))
        if len(self.configs) > _LISTED:
            lines.append(f"    and {len(self.configs) - _LISTED} more configurations")
        return "\n    ".join(["TrainingResult(", *lines]) + "\n)"

    @property
    def _outcomes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.returns, self.steps, self.deliveries

    def check(self) -> None:
        """Make sure that training can go on from the arrays, which kernels believe.

        Raises:
            AntsError: It cannot.
        """
        runs = (len(self.configs), len(self.seeds))
        episodes = np.shape(self.returns)[2] if np.ndim(self.returns) == 3 else 0
        forms = {
            **dict.fromkeys(OUTCOMES, ("int32", (*runs, episodes))),
            "q": ("float32", (*runs, *np.shape(self.state.q)[2:3], self.task.n_states, ROW)),
            "floats": ("float32", (*runs, _by_8(self.state.floats))),
            "integers": ("int32", (*runs, _by_8(self.state.integers))),
            "random_states": ("uint64", runs),
            "epsilon": ("float64", runs),
        }
        arrays = {**vars(self), **vars(self.state)}
        for name, (kind, shape) in forms.items():
            array = arrays[name]
            if not isinstance(array, np.ndarray) or (array.dtype, array.shape) != (kind, shape):
                raise AntsError(
                    f"{name} of a result is {shown(array)}; for {runs[0]} configurations and "
                    f"{runs[1]} seeds it must be an array of shape {shape} and type {kind}."
                )
        if not ((self.state.epsilon >= 0) & (self.state.epsilon <= 1)).all():
            raise AntsError(
                "epsilon of a result lies outside of 0 to 1; leave its arrays as they are."
            )

    def check_memory(self) -> None:
        """Make sure that there is room for the memory of the learners, which must be registered.

        Raises:
            AntsError: There is not: a learner of this name needed less when it began.
        """
        state, n_states = self.state, self.task.n_states
        given = (state.q.shape[2] - 1, state.floats.shape[2], state.integers.shape[2])
        for config in self.configs:
            needed = astuple(learners.get(config.learner).memory_for(config, n_states))
            if not all(map(operator.ge, given, needed)):
                raise AntsError(
                    f"learner {config.learner!r} has come to need more memory than when this "
                    "training began; train anew."
                )


def _by_8(array: np.ndarray) -> int:
    """The length of the last of three axes, down to a multiple of 8; kernels count by it."""
    return np.shape(array)[2] // 8 * 8 if np.ndim(array) == 3 else 0


@dataclass(frozen=True, eq=False, repr=False)
class Rollouts(Record):
    """What `evaluate` returns: int32 arrays of shape q_values.shape[:-2] + (rollouts,)."""

    returns: np.ndarray
    steps: np.ndarray
    deliveries: np.ndarray
