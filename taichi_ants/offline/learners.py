"""Offline learners: tables of action values from a data set alone.

Tables are float32 (n_states, 5), or (runs, n_states, 5) with one table per run.

The value of a pair of state and action without data is a guess, and a greedy policy prefers pairs
whose guess is too high. This is the extrapolation error of Fujimoto, Meger and Precup (Off-policy
deep reinforcement learning without exploration, ICML 2019). Levine, Kumar, Tucker and Fu (Offline
reinforcement learning: tutorial, review, and perspectives on open problems, 2020) survey remedies.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from taichi_ants import runtime
from taichi_ants.errors import expect
from taichi_ants.learners.config import InitialValue
from taichi_ants.offline.dataset import Dataset
from taichi_ants.settings import Count, Flag, Setting, Share, checked_arguments
from taichi_ants.task.constants import N_ACTIONS, Event

_LATER = Setting("factor by which later rewards count less, per step")
# Below 1, so that values of endless episodes are finite; at 0.9999 Q iteration takes half a second.
Discount = Annotated[Share, _LATER, Setting(most=0.9999)]
ByRun = Annotated[Flag, Setting("return a table for each run of the data")]


@checked_arguments
def batch_q_learning(
    data: Dataset,
    discount: Annotated[Share, _LATER] = 0.9,
    learning_rate: Annotated[Share, Setting("share of the error by which a value changes")] = 0.1,
    sweeps: Annotated[Count, Setting("number of passes over the data")] = 100,
    initial_q: InitialValue = 0.0,
    by_run: ByRun = False,
) -> np.ndarray:
    """Return action values learned by Q-learning in repeated sweeps over the data, in their order.

    This is experience replay (Lin, Self-improving reactive agents, Machine Learning 8, 1992). The
    last transitions of a sweep count most, less so with a small learning rate. Pairs of state and
    action without data keep `initial_q`. The values are float32 (n_states, 5), or, with `by_run`,
    (runs, n_states, 5).

    Raises:
        AntsError: An argument is not allowed.

    >>> offline.batch_q_learning(data, sweeps=5).shape
    (128, 5)
    """
    expect("data", data, Dataset)
    runs = np.arange(len(data.seeds) + 1) if by_run else [0, len(data.seeds)]
    groups, rates = np.searchsorted(data.run, runs).astype(np.int32), (learning_rate, discount)
    q = np.full((len(groups) - 1, data.task.n_states, N_ACTIONS), initial_q, np.float32)
    runtime.start()
    from taichi_ants.engines.launch import call  # imports Taichi, as the next line does
    from taichi_ants.offline.kernels import replay

    rows = (data.state, data.action, data.reward, data.next_state, data.terminated.view(np.uint8))
    for _ in range(sweeps):  # one launch per sweep, because a launch cannot be interrupted
        call(replay, q.reshape(-1), groups, *rows, data.task.n_states, *rates)
    return q if by_run else q[0]


@checked_arguments
def fitted_q_iteration(
    data: Dataset, discount: Discount = 0.9, initial_q: InitialValue = 0.0, by_run: ByRun = False
) -> np.ndarray:
    """Return the optimal action values of the empirical model of the data, see `EmpiricalModel`.

    This is fitted Q iteration (Ernst, Geurts and Wehenkel, Tree-based batch mode reinforcement
    learning, JMLR 6, 2005) with a table as regression, which fits the mean target of each pair of
    state and action. The order of the data does not matter. Pairs without data keep `initial_q`.
    Shapes and errors are those of `batch_q_learning`.

    >>> offline.fitted_q_iteration(data).argmax(axis=-1).shape  # the best action in each state
    (128,)
    """
    model = _model(data, by_run)
    q = model.solve(discount, model.rewards, initial_q)
    return (q if by_run else q[0]).astype(np.float32)


@checked_arguments
def pessimistic_q_iteration(
    data: Dataset,
    discount: Discount = 0.9,
    penalty: Annotated[
        float, Setting("amount for a single transition", unit="units of reward", least=0, most=1e9)
    ] = 1.0,
    by_run: ByRun = False,
) -> np.ndarray:
    """Return pessimistic action values, which are lower the fewer data a pair has.

    This is value iteration with lower confidence bounds (Rashidinejad, Zhu, Ma, Jiao and Russell,
    Bridging offline reinforcement learning and imitation learning, NeurIPS 2021). It differs from
    `fitted_q_iteration` in that it subtracts penalty / sqrt(n) from the mean reward of a pair with
    n transitions. Pairs without data have the value of the worst reward forever, the lowest value.
    Shapes and errors are those of `batch_q_learning`.

    >>> cautious, hopeful = offline.pessimistic_q_iteration(data), offline.fitted_q_iteration(data)
    >>> (cautious <= hopeful + 1e-4).all().item()
    True
    """
    model = _model(data, by_run)
    worst = data.task.rewards.by_event()[Event.ENTERED_EMPTY :].min()
    lowest = worst / (1.0 - discount)
    rewards = model.rewards - penalty / np.sqrt(model.counts)
    q = model.solve(discount, rewards, lowest, lowest=lowest)
    return (q if by_run else q[0]).astype(np.float32)


@dataclass(frozen=True, eq=False)
class EmpiricalModel:
    """The maximum-likelihood Markov decision process of the data, for each group of rows.

    If states are not Markov, the model depends on the behaviour policy too.

    Attributes:
        n_states: The number of states.
        largest: The largest absolute reward of the task.
        groups: int32 (groups + 1,), the index of the first pair of each group, then of the end.
        pairs: int32 (pairs,), state * 5 + action, ascending in a group.
        counts: int64 (pairs,), numbers of transitions.
        rewards: float64 (pairs,), their mean rewards.
        begins: int32 (pairs + 1,), the index of the first successor of each pair, then of the end.
        successors: int32 (k,), states, ascending in a pair; none for transitions that terminated.
        probabilities: float64 (k,); for a pair that may terminate, their sum is less than 1.

    >>> every_episode = np.ones((1, len(data.begins) - 1), int)
    >>> model = offline.EmpiricalModel.of(data, every_episode)
    >>> model.solve(0.9, model.rewards, initial_q=0.0).shape
    (1, 128, 5)
    """

    n_states: int
    largest: float
    groups: np.ndarray
    pairs: np.ndarray
    counts: np.ndarray
    rewards: np.ndarray
    begins: np.ndarray
    successors: np.ndarray
    probabilities: np.ndarray

    @classmethod
    def of(cls, data: Dataset, times: np.ndarray) -> EmpiricalModel:
        """Return the model of each group of episodes of the data.

        `times`, integers (groups, episodes), says how often a group has an episode.
        """
        expect("data", data, Dataset)
        n_states, size = data.task.n_states, data.task.n_states * N_ACTIONS
        pair = data.state.astype(np.int64) * N_ACTIONS + data.action
        # A pair of state and action, and its next state; n_states means that the step terminated.
        key = pair * (n_states + 1) + np.where(data.terminated, n_states, data.next_state)
        keys, number = np.unique(key, return_inverse=True)
        groups = []
        for group, of_episode in enumerate(times):
            rows = of_episode[data.episode].astype(np.float64)  # sums of integers stay exact
            counts = np.bincount(number, rows, len(keys))
            sums, there = np.bincount(number, rows * data.reward, len(keys)), counts > 0
            pairs = keys // (n_states + 1) + group * size
            arrays = pairs, keys % (n_states + 1), counts, sums
            groups.append([array[there] for array in arrays])
        pair, successors, counts, sums = map(np.concatenate, zip(*groups, strict=True))
        pairs, first = np.unique(pair, return_index=True)
        total = np.add.reduceat(counts, first)
        goes_on = successors < n_states
        share = counts / np.repeat(total, np.diff(first, append=len(pair)))
        return cls(
            n_states=n_states,
            largest=float(np.abs(data.task.rewards.by_event()).max()),
            groups=np.searchsorted(pairs // size, np.arange(len(times) + 1)).astype(np.int32),
            pairs=(pairs % size).astype(np.int32),
            counts=total.astype(np.int64),
            rewards=np.add.reduceat(sums, first) / total,
            begins=np.append(0, np.cumsum(np.add.reduceat(goes_on, first))).astype(np.int32),
            successors=successors[goes_on].astype(np.int32),
            probabilities=share[goes_on],
        )

    def solve(
        self,
        discount: float,
        rewards: np.ndarray,
        initial_q: float,
        policy: np.ndarray | None = None,
        lowest: float = -np.inf,
    ) -> np.ndarray:
        """Return converged action values, float64 (groups, n_states, 5).

        Args:
            discount: The discount factor, below 1.
            rewards: float64 (pairs,), the expected rewards of the pairs.
            initial_q: The value that pairs without data keep.
            policy: float (n_states, 5), the probabilities of actions; None for the greedy policy.
            lowest: A lower bound of all values.
        """
        n_groups = len(self.groups) - 1
        q = np.full((n_groups, self.n_states, N_ACTIONS), initial_q, np.float64)
        values = np.empty((n_groups, self.n_states))
        greedy = np.zeros((self.n_states, N_ACTIONS)) if policy is None else policy
        runtime.start()
        from taichi_ants.engines.launch import call  # imports Taichi, as the next line does
        from taichi_ants.offline.kernels import iterate

        tables = q.reshape(-1), values.reshape(-1), np.ascontiguousarray(greedy).reshape(-1)
        # Taichi does not accept arrays of length 0.
        after = np.append(self.successors, np.int32(0)), np.append(self.probabilities, 0.0)
        numbers = self.n_states, discount, lowest, tolerance(self.largest, discount, initial_q)
        model = self.groups, self.pairs, rewards, self.begins, *after
        call(iterate, *tables, int(policy is None), *model, *numbers)
        return q


def tolerance(largest: float, discount: float, initial_q: float) -> float:
    """Return the tolerance of Q iteration, far above rounding errors.

    The iteration ends when no action value changes by more.
    """
    return 1e-12 * max(1.0, largest / (1.0 - discount), abs(initial_q))


def _model(data: Dataset, by_run: bool) -> EmpiricalModel:
    """Return the model of the data, with one group per run or a single group."""
    expect("data", data, Dataset)
    runs = data.run[data.begins[:-1]]
    own = np.arange(len(data.seeds))[:, None] == runs
    return EmpiricalModel.of(data, own if by_run else np.ones((1, len(runs)), bool))
