"""N-step SARSA (Sutton and Barto, chapter 7): targets of n rewards and the value after them.

The target of the pair of n steps ago is `r1 + discount * r2 + ... + discount^n * Q(s', a')`, where
n is `n_steps`, and a' is the next action, drawn before the update.
"""

from dataclasses import dataclass
from typing import Annotated

from taichi_ants.kernel_functions import ti
from taichi_ants.learners.config import Hyperparameters
from taichi_ants.learners.learner import Learner, Memory
from taichi_ants.learners.memory import discount_of
from taichi_ants.settings import Setting
from taichi_ants.task.constants import ROW


@dataclass(frozen=True)
class Steps(Hyperparameters):
    """The hyperparameter of n-step SARSA; targets near the end of an episode have fewer rewards."""

    n_steps: Annotated[
        int, Setting("number of rewards in the target of an update", least=1, most=64)
    ] = 4


def begin(memory, at):
    """Remove the pairs that wait for an update."""
    memory.integers[at.integers] = 0
    memory.integers[at.integers + 1] = 0


def learn(memory, at, step, rates, random_state):
    """Update the pair of n steps ago; at the end of an episode, update all pairs that wait.

    The integers are the number of pairs that wait and the index of the oldest, then a ring buffer
    of pairs. The floats are their rewards.
    """
    pair = step.state * ROW + step.action
    discount = discount_of(rates, step.terminated)
    after = at.table + step.next_state * ROW + ti.max(step.next_action, 0)
    error = step.reward + discount * memory.q[after] - memory.q[at.table + pair]
    waiting, oldest = memory.integers[at.integers] + 1, memory.integers[at.integers + 1]
    newest = (oldest + waiting - 1) % rates.n_steps
    memory.integers[at.integers + 2 + newest] = pair
    memory.floats[at.floats + newest] = step.reward
    ends = step.terminated | step.truncated
    while waiting == rates.n_steps or (ends == 1 and waiting > 0):
        worth = step.reward + discount * memory.q[after]
        for back in range(1, waiting):
            entry = (oldest + waiting - 1 - back) % rates.n_steps
            worth = memory.floats[at.floats + entry] + rates.discount * worth
        updated = at.table + memory.integers[at.integers + 2 + oldest]
        memory.q[updated] = memory.q[updated] + rates.learning_rate * (worth - memory.q[updated])
        oldest = (oldest + 1) % rates.n_steps
        waiting -= 1
    memory.integers[at.integers], memory.integers[at.integers + 1] = waiting, oldest
    return error, random_state


N_STEP_SARSA = Learner(
    "n_step_sarsa",
    learn,
    begin,
    draws_next_action=True,
    hyperparameters=Steps,
    memory=lambda settings, _: Memory(floats=settings.n_steps, integers=2 + settings.n_steps),
    cost=lambda settings: 1 + 0.25 * settings.n_steps,
    summary="SARSA with targets of several rewards and the value after them",
)
