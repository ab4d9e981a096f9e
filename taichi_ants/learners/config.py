"""What a training run needs to know besides its world and its seed."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real
from typing import Any, Literal, get_args

from taichi_ants.errors import AntsError, check_one_of, shown
from taichi_ants.grid.randomness import whole

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
            raise AntsError(f"learner is {shown(self.learner)}; it must be the name of a learner.")
        self._check_number("learning_rate", "above 0 and at most 1", open_below=True)
        self._check_number("discount", "between 0 and 1")
        self._check_number("epsilon", "between 0 and 1")
        self._check_number("epsilon_decay", "above 0 and at most 1", open_below=True)
        self._check_number("min_epsilon", "between 0 and 1")
        steps = whole("planning_steps", self.planning_steps)
        if not 0 <= steps <= MAX_PLANNING_STEPS:
            raise AntsError(
                f"planning_steps is {shown(steps)}; it must lie between 0 and {MAX_PLANNING_STEPS}."
            )
        object.__setattr__(self, "planning_steps", steps)
        check_one_of("delivery", self.delivery, DELIVERIES)

    def _check_number(self, name: str, allowed: str, open_below: bool = False) -> None:
        """Check a field and store it as a Python float, so that equal settings are equal."""
        value = getattr(self, name)
        if not share_of_one(value) or (open_below and value == 0):
            raise AntsError(f"{name} is {shown(value)}; it must be a number {allowed}.")
        object.__setattr__(self, name, float(value))


def share_of_one(value: Any) -> bool:
    """Whether a value is a number from 0 to 1; booleans, text and arrays are none."""
    number = isinstance(value, Real) and not isinstance(value, bool)
    return number and bool(0 <= value <= 1)
