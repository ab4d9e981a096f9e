"""The one place where learners are registered.

A learner is a pure function that returns a TD error, and what it needs besides. To add one, write
a file beside this one and a line in `__init__.py`; or call `register` from a file of your own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from taichi_ants.errors import AntsError


@dataclass(frozen=True)
class Learner:
    """A tabular temporal-difference learner.

    Attributes:
        name: The name by which configurations call it.
        td_error: A `ti.func` (value, reward, discount, next_values, next_action, epsilon) -> f32:
            the value of the state-action pair that is updated, the reward, the discount (0 where
            the transition terminated), the five action values of the next state, the next action
            (-1 where none was drawn) and the current epsilon; all f32 but next_action (i32). The
            engine adds learning_rate times the error to the value.
        draws_next_action: The next action is drawn before the update and then taken (on-policy
            learners that look at it).
        plans: The learner keeps a model of the last seen outcome of each visited pair and updates
            from it `planning_steps` times after each step.
        summary: One line for listings.
    """

    name: str
    td_error: Callable[..., object]
    draws_next_action: bool = False
    plans: bool = False
    summary: str = ""


_LEARNERS: dict[str, Learner] = {}


def register(learner: Learner) -> Learner:
    """Make a learner known by its name.

    Raises:
        AntsError: The name is taken, or is not usable in files and on command lines; or the TD
            error is no `ti.func`.
    """
    if not isinstance(learner, Learner):
        raise AntsError(f"{learner!r} is not a Learner; wrap the TD error in Learner(name, ...).")
    if not isinstance(learner.name, str) or not learner.name.isidentifier():
        raise AntsError(
            f"{learner.name!r} cannot name a learner; use letters, digits and underscores."
        )
    # Taichi's own mark; a plain function would be taken apart without its branches and loops.
    if not getattr(learner.td_error, "_is_taichi_function", False):
        raise AntsError(
            f"the TD error of {learner.name!r} is no Taichi function; mark it @ti.func."
        )
    if learner.name in _LEARNERS:
        raise AntsError(f"a learner named {learner.name!r} exists already; choose another name.")
    _LEARNERS[learner.name] = learner
    return learner


def get(name: str) -> Learner:
    """The learner of that name.

    Raises:
        AntsError: There is none; the message lists those that exist.
    """
    if name not in _LEARNERS:
        raise AntsError(f"there is no learner {name!r}; choose one of {', '.join(names())}.")
    return _LEARNERS[name]


def names() -> tuple[str, ...]:
    """The names of all registered learners, in the order of registration."""
    return tuple(_LEARNERS)
