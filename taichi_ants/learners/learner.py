"""The class of learners: functions that update a table of action values, and their memory."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from taichi_ants.errors import refuse, shown
from taichi_ants.kernel_functions import kernel_function
from taichi_ants.learners.config import Hyperparameters, TrainingConfig


@dataclass(frozen=True)
class Memory:
    """The size of a learner's memory for each run, in addition to the table that the ant acts by.

    Additional `tables` of action values start as copies of that table. The f32 `floats` and the i32
    `integers` start as 0.

    >>> learners.get("double_q").memory(None, 128)
    Memory(tables=2, floats=0, integers=0)
    """

    tables: int = 0
    floats: int = 0
    integers: int = 0


@dataclass(frozen=True)
class Learner:
    """A tabular learner; `td_learner` builds one from a TD error alone.

    Attributes:
        name: The name that configurations use.
        learn: A function (memory, at, step, rates, random_state) -> (TD error f32, random_state
            u64), called after each step; see `taichi_ants.learners.memory` for the arguments. It
            changes the memory of one run, at `at`. Kernels compile it, and those below.
        begin: A function (memory, at), called at the start of each episode, or None.
        td_error: The TD error if ants can share a table, else None; see `td_learner`.
        draws_next_action: Whether the next action is drawn before the update and then taken
            (on-policy learners). Otherwise a step has no next action.
        plans: Whether the learner has a model, `taichi_ants.learners.model`, and the hyperparameter
            `planning_steps`. Ants that share a table share the model, and td_error must not use the
            next action.
        hyperparameters: The class of its hyperparameters, all with default values.
        memory: A function (hyperparameters, n_states) -> Memory.
        cost: A function (hyperparameters) -> float: the time of one step, relative to Q-learning.
            It determines the length of kernel launches.
        summary: A line for listings.

    >>> from taichi_ants.learners.memory import discount_of, values_of
    >>> def learn(memory, at, step, rates, random_state):  # Q-learning
    ...     entry = at.table + step.state * 8 + step.action
    ...     best = values_of(memory.q, at.table, step.next_state).max()
    ...     target = step.reward + discount_of(rates, step.terminated) * best
    ...     error = target - memory.q[entry]
    ...     memory.q[entry] = memory.q[entry] + rates.learning_rate * error
    ...     return error, random_state
    >>> learners.register(learners.Learner("mine", learn)).name
    'mine'
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

    def __post_init__(self) -> None:
        for part in ("learn", "begin", "td_error"):
            if (function := getattr(self, part)) is not None:
                if not callable(function):
                    refuse(f"{part} of {shown(self.name)}", function, "a function")
                object.__setattr__(self, part, kernel_function(function))

    def settings(self, config: TrainingConfig) -> Hyperparameters:
        """Return the hyperparameters of a configuration."""
        return self.hyperparameters(**dict(config.hyperparameters))

    def memory_for(self, config: TrainingConfig, n_states: int) -> Memory:
        """Return the memory for a configuration and tables of n_states rows.

        Sizes are rounded up to multiples of 8: compilers of kernels with an array of memories then
        know that neighbouring addresses differ only in their last bits.
        """
        memory = self.memory(self.settings(config), n_states)
        floats, integers = (-(-size // 8) * 8 for size in (memory.floats, memory.integers))
        return replace(memory, floats=floats, integers=integers)


def td_learner(
    name: str, td_error: Any, draws_next_action: bool = False, summary: str = ""
) -> Learner:
    """Return a learner that adds learning_rate * TD error to the value of each pair.

    Ants can share its table.

    Args:
        name, draws_next_action, summary: See `Learner`.
        td_error: A function (value, reward, discount, next_values, next_action, epsilon) -> float.
            `value` is that of the state-action pair to update; `discount` is 0 if the step
            terminated; `next_values` is the vector of the five action values of the next state.
            `next_action` is i32, all others are f32; it is 0 if the step terminated, and allowed
            only with `draws_next_action`. To try your learner, run `taichi-ants check FILE`.

    >>> def td_error(value, reward, discount, next_values, next_action, epsilon):
    ...     return reward + discount * next_values.max() - value
    >>> learners.td_learner("my_q_learning", td_error).draws_next_action
    False
    """
    from taichi_ants.learners.memory import learn_by  # here, because it imports Taichi

    error = kernel_function(td_error)
    return Learner(name, learn_by(error), None, error, draws_next_action, summary=summary)
