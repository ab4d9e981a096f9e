"""Results of training and evaluation, and step-by-step traces of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from taichi_ants import measures
from taichi_ants.arguments import checked_max_steps, checked_seeds
from taichi_ants.engines.layout import OUTCOMES
from taichi_ants.engines.runs.engine import RunState
from taichi_ants.errors import as_array, expect
from taichi_ants.files import PathLike
from taichi_ants.files.archives import Kind
from taichi_ants.files.tables import column
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.measures.finished import counts_of_lone_ant, of_lone_ants
from taichi_ants.measures.tidy import Measured, Tidy
from taichi_ants.records import Record
from taichi_ants.task import Task
from taichi_ants.task.constants import N_ACTIONS, ROW, Event
from taichi_ants.worlds.world import World

_KIND = Kind("training result", 7, "TrainingResult.save", sealed=True)


@dataclass(frozen=True, eq=False, repr=False)
class TrainingResult(Record, Tidy):
    """The result of `train`: C configurations, S seeds, E episodes.

    Two results are equal if everything except `seconds` is equal.

    Attributes:
        world, configs, seeds, max_steps, task: The arguments of `train`; `configs` is a tuple.
        returns: int32 (C, S, E), the undiscounted sum of the rewards of each episode.
        steps: int32 (C, S, E), its number of steps.
        deliveries: int32 (C, S, E), 1 if the ant delivered in it, else 0.
        seconds: The time of the last training without compilation: CPU seconds of all threads, or
            wall-clock seconds on a GPU.
        state: The state of the runs after the last episode, with leading axes (C, S).

    Raises:
        AntsError: The arrays do not fit the configurations and seeds.

    >>> result.q_values.shape  # configurations, seeds, states, actions
    (1, 3, 128, 5)
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
        """Return a result that `save` wrote; its learners need not be registered.

        >>> result.save("result.npz")
        >>> TrainingResult.load("result.npz") == result
        True
        """
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
    """The result of `evaluate`.

    Attributes:
        returns, steps, deliveries: As in `TrainingResult`, but int32 (..., rollouts), where ... are
            the leading axes of the tables.
        seeds: The seed of each table, in the order of the last of the leading axes.

    >>> evaluate(worlds.paper(), result.q_values, seeds=range(3), rollouts=5).steps.shape
    (1, 3, 5)
    """

    returns: np.ndarray
    steps: np.ndarray
    deliveries: np.ndarray
    seeds: tuple[int, ...] = field(compare=False, repr=False)

    def measured(self) -> Measured:
        """Return the values of the measures of each rollout; `configuration` numbers the tables.

        Tables are numbered along all leading axes except the last one, which is that of the seeds.
        """
        rollouts, leading = self.returns.shape[-1], self.returns.shape[:-1]
        shape = (-1, leading[-1] if leading else 1, rollouts)
        arrays = {name: getattr(self, name).reshape(shape) for name in OUTCOMES}
        n = len(arrays["returns"])
        names = ("",) if n == 1 else tuple(f"table {number}" for number in range(n))
        return _measured(arrays, self.seeds, names)


@dataclass(frozen=True, eq=False)
class RolloutArguments:
    """The arguments of `rollout` or `trace_training` that reproduce a trace.

    `q_values`, float (n_states, 5), is the table that the ant followed with `epsilon`; None if the
    ant learned. `config` configures its learner; None if the ant did not learn.
    """

    world: World
    task: Task
    seed: int
    max_steps: int
    number: int = 0
    q_values: np.ndarray | None = None
    epsilon: float = 0.0
    config: TrainingConfig | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Trace(Record):
    """The record of n steps; cell, heading and state are those before the action.

    Arrays are int32 (n,) unless noted.

    Attributes:
        episodes: Number of the episode, from 0, or of the policy if there are several.
        steps: Number of the step in its episode, from 0.
        cells: int32 (n, 3), cube coordinates in normal form.
        headings: Heading of the ant, 0 to 5.
        paper_states: The paper's state, see `taichi_ants.task.states`.
        states: The state index; with the paper's observation, that of the paper's state.
        actions: Action, 0 to 4.
        rewards: Its reward.
        events: Its result, an `Event`.
        executed: Action as executed, which differs from the chosen one only if actions slip.
        next_paper_states, next_states: As above, after the step.
        terminated: bool (n,), whether the learner treated the next state as terminal.
        q_values: float32 (n, 5), the action values of the state when the action was chosen.
        td_errors: float32 (n,), the TD error of the step; None without learning.
        tables: float32 (n, n_states, 5), the Q table after the step; None without learning.
        arguments: Those that reproduce it; None for several policies, or if you made it yourself.

    >>> trace = trace_training(worlds.paper(), config, max_steps=50)
    >>> trace.cells[0].tolist(), trace.actions.dtype
    ([0, 8, 8], dtype('int32'))
    """

    episodes: np.ndarray
    steps: np.ndarray
    cells: np.ndarray
    headings: np.ndarray
    paper_states: np.ndarray
    states: np.ndarray
    actions: np.ndarray
    rewards: np.ndarray
    next_paper_states: np.ndarray
    next_states: np.ndarray
    terminated: np.ndarray
    events: np.ndarray
    q_values: np.ndarray
    td_errors: np.ndarray | None = None
    tables: np.ndarray | None = None
    executed: np.ndarray | None = None
    arguments: RolloutArguments | None = field(default=None, compare=False, repr=False)

    def __len__(self) -> int:
        return len(self.steps)

    @property
    def delivered(self) -> np.ndarray:
        """Whether the ant delivered in each step, bool (n,)."""
        return self.events == Event.DELIVERED


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
            "seed": column(seeds)[places],
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
