"""What training and evaluation return: NumPy arrays and what is needed to go on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichi_ants.config import TrainingConfig
from taichi_ants.constants import N_ACTIONS
from taichi_ants.worlds.world import World


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


@dataclass(frozen=True)
class RunState:
    """Where runs stopped; training goes on from it bit for bit.

    Attributes (leading axes: the runs, for example (configurations, seeds)):
        q: float32 (..., 128, 8), 5 action values and 3 unused.
        random_states: uint64 (...,), the ants' random streams.
        exploration: float64 (..., 3): epsilon of the next episode, its decay, its minimum.
        settings: int32 (..., 3): planning steps, whether delivery continues, visited pairs.
        entries: int32 (..., 640), the packed model; (..., 1) where nobody plans.
        slots: int32 (..., 640), where a pair stands in the model, from 1, 0 if it does not;
            (..., 1) where nobody plans.
    """

    q: np.ndarray
    random_states: np.ndarray
    exploration: np.ndarray
    settings: np.ndarray
    entries: np.ndarray
    slots: np.ndarray

    def take(self, index: object) -> RunState:
        """A copy of the runs at an index of the leading axes."""
        return RunState(**{name: array[index].copy() for name, array in vars(self).items()})

    def put(self, index: object, part: RunState) -> None:
        """Overwrite the runs at an index."""
        for name, array in vars(self).items():
            array[index] = getattr(part, name)


@dataclass(frozen=True)
class TrainingResult:
    """What `train` returns.

    C configurations, S seeds, E episodes.

    Attributes:
        world: The world trained in.
        configs: The configurations, in the order of the arrays' first axis.
        seeds: The seeds, in the order of the second axis.
        max_steps: The step limit of an episode.
        evaporation: Whether trails evaporated.
        returns: int32 (C, S, E), undiscounted sum of the rewards of each episode.
        steps: int32 (C, S, E), length of each episode.
        deliveries: int32 (C, S, E), 1 where the food was given to the queen.
        costs: What the learners took, one entry for each learner and number of planning steps.
        state: Where the runs stopped, leading axes (C, S).
    """

    world: World
    configs: tuple[TrainingConfig, ...]
    seeds: tuple[int, ...]
    max_steps: int
    evaporation: bool
    returns: np.ndarray
    steps: np.ndarray
    deliveries: np.ndarray
    costs: tuple[LearnerCost, ...]
    state: RunState

    @property
    def episodes(self) -> int:
        """The number of episodes of each run so far."""
        return self.returns.shape[2]

    @property
    def q_values(self) -> np.ndarray:
        """The action values at the end, float32 (C, S, 128, 5), a copy."""
        return self.state.q[..., :N_ACTIONS].copy()


@dataclass(frozen=True)
class Rollouts:
    """What `evaluate` returns: int32 arrays of shape q_values.shape[:-2] + (rollouts,)."""

    returns: np.ndarray
    steps: np.ndarray
    deliveries: np.ndarray
