"""What a training run needs to know besides its world and its seed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

from taichi_ants.errors import AntsError

Delivery = Literal["absorbing", "continuing"]
DELIVERIES: tuple[str, ...] = get_args(Delivery)
MAX_PLANNING_STEPS = 1000


@dataclass(frozen=True)
class TrainingConfig:
    """The settings of one learner.

    Attributes:
        learner: Name of a registered learner, for example "q_learning".
        learning_rate: Step size alpha of the tabular update, in (0, 1].
        discount: Discount factor gamma, in [0, 1].
        epsilon: Probability of a random action in the first episode, in [0, 1].
        epsilon_decay: Factor on epsilon after each episode, in (0, 1].
        min_epsilon: Epsilon does not decay below this, in [0, 1].
        planning_steps: Updates from the model after each step, at least 1 for learners that plan,
            0 for all others.
        delivery: "absorbing": the delivery is a terminal state, its target is the reward alone.
            "continuing": the update at delivery bootstraps from what the ant then sees. The
            episode ends in both.

    Raises:
        AntsError: A value is outside its range. Whether the learner exists, and whether it plans,
            is checked when training starts, so that configurations can be written down before a
            learner is registered.
    """

    learner: str
    learning_rate: float
    discount: float
    epsilon: float
    epsilon_decay: float
    min_epsilon: float = 0.01
    planning_steps: int = 0
    delivery: Delivery = "absorbing"

    def __post_init__(self) -> None:
        if not isinstance(self.learner, str):
            raise AntsError(f"learner is {self.learner!r}; it must be the name of a learner.")
        _check_number("learning_rate", self.learning_rate, "above 0 and at most 1", open_below=True)
        _check_number("discount", self.discount, "between 0 and 1")
        _check_number("epsilon", self.epsilon, "between 0 and 1")
        _check_number("epsilon_decay", self.epsilon_decay, "above 0 and at most 1", open_below=True)
        _check_number("min_epsilon", self.min_epsilon, "between 0 and 1")
        steps = self.planning_steps
        if isinstance(steps, bool) or not hasattr(steps, "__index__"):
            raise AntsError(f"planning_steps is {steps!r}; it must be a whole number.")
        if not 0 <= steps <= MAX_PLANNING_STEPS:
            raise AntsError(
                f"planning_steps is {steps}; it must lie between 0 and {MAX_PLANNING_STEPS}."
            )
        if self.delivery not in DELIVERIES:
            raise AntsError(
                f"delivery is {self.delivery!r}; it must be one of {', '.join(DELIVERIES)}."
            )


def _check_number(name: str, value: object, allowed: str, open_below: bool = False) -> None:
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        number = math.nan
    inside = (0 < number <= 1) if open_below else (0 <= number <= 1)
    if isinstance(value, (bool, str)) or not inside:
        raise AntsError(f"{name} is {value!r}; it must be a number {allowed}.")
