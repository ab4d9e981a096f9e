"""Dyna-Q (Sutton 1990): Q-learning, and updates from a model of what was seen last."""

from dataclasses import dataclass

from taichi_ants.learners.hyperparameters import MAX_PLANNING_STEPS, Hyperparameters, whole_number
from taichi_ants.learners.q_learning import td_error
from taichi_ants.learners.registry import Learner


@dataclass(frozen=True)
class Planning(Hyperparameters):
    """Attributes:
    planning_steps: Updates from the model after each step.
    """

    planning_steps: int = whole_number(5, 1, MAX_PLANNING_STEPS)


DYNA_Q = Learner(
    "dyna_q",
    td_error,
    plans=True,
    hyperparameters=Planning,
    summary="Q-learning that replays a model of the world",
)
