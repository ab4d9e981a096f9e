"""What a learner is: functions that update a table of action values, and the memory they need."""

from __future__ import annotations

import dis
import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from taichi_ants.errors import AntsError, checked_whole, shown
from taichi_ants.learners.config import Hyperparameters, TrainingConfig


@dataclass(frozen=True)
class Memory:
    """Numbers that a learner keeps for each run, besides the table that the ant acts by.

    Further `tables` of action values start as copies of that one; f32 `floats` and i32 `integers`
    as 0.
    """

    tables: int = 0
    floats: int = 0
    integers: int = 0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            checked_whole(f"{name} of a memory", value, 0, 2**30)


@dataclass(frozen=True)
class Learner:
    """A tabular learner; `td_learner` makes one from a TD error alone.

    Attributes:
        name: The name by which configurations call it.
        learn: A `ti.func` (memory, at, step, rates, random_state) -> (TD error f32, random_state
            u64) that is called after each step; see `taichi_ants.learners.memory` for the
            arguments, the first of which is a `ti.template()`. It changes the memory of one run,
            which begins at `at`.
        begin: A `ti.func` (memory, at) that is called at the start of each episode, or None.
        td_error: The TD error, if all ants of a world can share a table, see `td_learner`.
        draws_next_action: The next action is drawn before the update and then taken (on-policy
            learners); only then has a step one.
        plans: The learner keeps `taichi_ants.learners.model` and has the hyperparameter
            `planning_steps`; ants that share a table share the model, and td_error may not look at
            the next action.
        hyperparameters: Its own, besides the settings of all learners, all with default values.
        memory: A function (hyperparameters, n_states) -> Memory.
        cost: A function (hyperparameters) -> float: the time of a step of one ant, in that of
            Q-learning. Launches of kernels are cut by it.
        summary: One line for listings.
    """

    name: str
    learn: Any
    begin: Any = None
    td_error: Any = None
    draws_next_action: bool = False
    plans: bool = False
    hyperparameters: type[Hyperparameters] = Hyperparameters
    memory: Callable[[Any, int], Memory] = lambda settings, n_states: Memory()
    cost: Callable[[Any], float] = lambda settings: 1.0
    summary: str = ""

    def settings(self, config: TrainingConfig) -> Hyperparameters:
        """The hyperparameters of a configuration."""
        return self.hyperparameters(**dict(config.hyperparameters))

    def memory_for(self, config: TrainingConfig, n_states: int) -> Memory:
        """The memory that it needs with a configuration and tables of n_states rows."""
        return self.memory(self.settings(config), n_states)


def td_learner(
    name: str, td_error: Any, draws_next_action: bool = False, summary: str = ""
) -> Learner:
    """A learner that adds learning_rate * TD error to the value of the pair; ants can share it.

    Args:
        name, draws_next_action, summary: See `Learner`.
        td_error: A `ti.func` (value, reward, discount, next_values, next_action, epsilon) -> float:
            the value of the state-action pair that is updated, the reward, the discount (0 where
            the step terminated), the vector of the five action values of the next state, the next
            action and the current epsilon; all f32 but next_action (i32), which is 0 where the step
            terminated, and may be looked at only if it is drawn. The result is checked when the
            learner is first used.
    """
    check_td_error(name, td_error, draws_next_action)
    from taichi_ants.learners.memory import learn_by  # Taichi starts to be imported

    return Learner(
        name,
        learn_by(td_error),
        td_error=td_error,
        draws_next_action=draws_next_action,
        summary=summary,
    )


def check_arguments(what: str, function: Any, wanted: list[str]) -> list[str]:
    """The names of the arguments of a `ti.func`, which are as many as are wanted."""
    # Taichi's own mark; a plain function would be taken apart without its branches and loops.
    if not getattr(function, "_is_taichi_function", False):
        raise AntsError(f"{what} is no Taichi function; mark it @ti.func.")
    arguments = list(inspect.signature(function.func.func).parameters)
    if len(arguments) != len(wanted):
        listed = f"{', '.join(wanted[:-1])} and {wanted[-1]}"
        raise AntsError(f"{what} has {len(arguments)} arguments; it needs {len(wanted)}: {listed}.")
    return arguments


def check_td_error(name: str, td_error: Any, draws_next_action: bool) -> None:
    wanted = ["value", "reward", "discount", "next_values", "next_action", "epsilon"]
    next_action = check_arguments(f"the TD error of {shown(name)}", td_error, wanted)[4]
    # Some instructions load two variables at once.
    instructions = dis.get_instructions(td_error.func.func)
    loaded = [one.argval for one in instructions if one.opname.startswith("LOAD")]
    looks = any(next_action in (one if isinstance(one, tuple) else (one,)) for one in loaded)
    if looks and not draws_next_action:
        raise AntsError(
            f"the TD error of {shown(name)} looks at {next_action}, but no next action is drawn; "
            "give draws_next_action=True (a learner that plans has none in its updates from the "
            "model)."
        )
