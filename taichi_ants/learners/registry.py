"""The one place where learners are registered.

A learner is a pure function that returns a TD error, and what it needs besides. To add one, write
a file beside this one and add its name to `BUILT_IN`; or call `register` from a file of your own.
"""

from __future__ import annotations

import dis
import inspect
from dataclasses import asdict, dataclass, fields, replace
from importlib import import_module
from types import FunctionType
from typing import Any

from taichi_ants.errors import AntsError, shown
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.learners.hyperparameters import Hyperparameters


@dataclass(frozen=True)
class Learner:
    """A tabular temporal-difference learner.

    Attributes:
        name: The name by which configurations call it.
        td_error: A `ti.func` (value, reward, discount, next_values, next_action, epsilon) -> float:
            the value of the state-action pair that is updated, the reward, the discount (0 where
            the transition terminated), the five action values of the next state, the next action
            and the current epsilon; all f32 but next_action (i32). The engine adds learning_rate
            times the error to the value. Python's max, min, sum and len work on next_values, and
            next_values[a] takes any action a; all else is what Taichi allows in a `ti.func`.
        draws_next_action: The next action is drawn before the update and then taken (on-policy
            learners); only then may td_error look at next_action, which is 0 to 4, and 0 where the
            transition terminated.
        plans: The learner keeps a model of the last seen outcome of each visited pair and updates
            from it `planning_steps` times after each step. These updates have no next action, so
            td_error may not look at it.
        hyperparameters: What it has besides the settings of all learners: a dataclass whose fields
            `whole_number` and `number` of `taichi_ants.learners` make, all with usual values.
        summary: One line for listings.
    """

    name: str
    td_error: Any
    draws_next_action: bool = False
    plans: bool = False
    hyperparameters: type[Hyperparameters] = Hyperparameters
    summary: str = ""


# The package's own: NAME in the file `name.py`, imported when it is asked for, since that starts
# to import Taichi.
BUILT_IN = ("q_learning", "sarsa", "expected_sarsa", "dyna_q")
_LEARNERS: dict[str, Learner] = {}


def register(learner: Learner) -> Learner:
    """Make a learner known by its name.

    Raises:
        AntsError: The name is taken, or is not usable in files and on command lines; or the TD
            error is no `ti.func`, does not take six arguments, or looks at a next action that is
            not drawn. What it computes is tried when it is first used.
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
    if learner.name in names():
        raise AntsError(f"a learner named {learner.name!r} exists already; choose another name.")
    _check_arguments(learner, learner.td_error.func.func)
    _LEARNERS[learner.name] = learner
    return learner


def _check_arguments(learner: Learner, td_error: FunctionType) -> None:
    arguments = list(inspect.signature(td_error).parameters)
    if len(arguments) != 6:
        raise AntsError(
            f"the TD error of {learner.name!r} has {len(arguments)} arguments; it needs 6: value, "
            "reward, discount, next_values, next_action and epsilon."
        )
    # Some instructions load two variables at once.
    loaded = [i.argval for i in dis.get_instructions(td_error) if i.opname.startswith("LOAD")]
    looks = any(arguments[4] in (one if isinstance(one, tuple) else (one,)) for one in loaded)
    if looks and (learner.plans or not learner.draws_next_action):
        advice = "register it with draws_next_action=True"
        if learner.plans:
            advice = "a learner that plans has none in its updates from the model"
        raise AntsError(
            f"the TD error of {learner.name!r} looks at {arguments[4]}, but no next action is "
            f"drawn; {advice}."
        )


def get(name: str) -> Learner:
    """The learner of that name.

    Raises:
        AntsError: There is none; the message lists those that exist.
    """
    if name in BUILT_IN:
        return getattr(import_module(f"taichi_ants.learners.{name}"), name.upper())
    if name not in _LEARNERS:
        raise AntsError(f"there is no learner {name!r}; choose one of {', '.join(names())}.")
    return _LEARNERS[name]


def settle(config: TrainingConfig) -> TrainingConfig:
    """The configuration with all hyperparameters of its learner.

    Raises:
        AntsError: There is no such learner, it has no such hyperparameter, or a value is outside
            its range.
    """
    kind = get(config.learner).hyperparameters
    given, known = dict(config.hyperparameters), [field.name for field in fields(kind)]
    for name in given:
        if name not in known:
            allowed = f"it has {', '.join(known)}" if known else "it has none"
            raise AntsError(
                f"{shown(name)} is no hyperparameter of learner {config.learner!r}; {allowed}."
            )
    return replace(config, hyperparameters=asdict(kind(**given)))


def names() -> tuple[str, ...]:
    """The names of all registered learners, in the order of registration."""
    return (*BUILT_IN, *_LEARNERS)
