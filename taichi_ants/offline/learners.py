"""Offline learners: tables of action values from a data set alone.

Tables are float32 (n_states, 5), or (runs, n_states, 5) with a table from the data of each run.

Where data lack a pair of state and action, its value is a guess, and a policy that maximises goes
where guesses are too high: the extrapolation error of Fujimoto, Meger and Precup (Off-policy deep
reinforcement learning without exploration, ICML 2019); Levine, Kumar, Tucker and Fu (Offline
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
from taichi_ants.settings import Count, Flag, Is, Share, checked_arguments
from taichi_ants.task.constants import N_ACTIONS
from taichi_ants.task.events import Event

# Values of endless episodes stay finite; with the largest one Q iteration takes half a second.
Discount = Annotated[Share, Is(most=0.9999)]


@checked_arguments
def batch_q_learning(
    data: Dataset,
    discount: Share = 0.9,
    learning_rate: Share = 0.1,
    sweeps: Count = 100,
    initial_q: InitialValue = 0.0,
    by_run: Flag = False,
    threads: int | None = None,
) -> np.ndarray:
    """Q-learning that goes over the data again and again, in the order in which they stand.

    Lin (Self-improving reactive agents, Machine Learning 8, 1992) calls it experience replay. The
    last transitions of a sweep count most; the smaller the learning rate, the less. Pairs that the
    data lack keep `initial_q`. With `by_run`, a table is learned from the data of each run.

    Raises:
        AntsError: An argument is not allowed.
    """
    groups, rates = _groups(data, by_run), (learning_rate, discount)
    q = np.full((len(groups) - 1, data.task.n_states, N_ACTIONS), initial_q, np.float32)
    runtime.start(threads)
    from taichi_ants.offline.kernels import replay  # imports Taichi

    rows = (data.state, data.action, data.reward, data.next_state, data.terminated.view(np.uint8))
    for _ in range(sweeps):  # a launch cannot be interrupted
        replay(q.reshape(-1), groups, *rows, data.task.n_states, *rates)
    return q if by_run else q[0]


@checked_arguments
def fitted_q_iteration(
    data: Dataset,
    discount: Discount = 0.9,
    initial_q: InitialValue = 0.0,
    by_run: Flag = False,
    threads: int | None = None,
) -> np.ndarray:
    """The best action values of the empirical model of the data, see `EmpiricalModel`.

    Fitted Q iteration (Ernst, Geurts and Wehenkel, Tree-based batch mode reinforcement learning,
    JMLR 6, 2005) with a table for regression: its fit to all targets is their mean over the
    transitions of a pair, so that it iterates Q on that model. The order of the data is irrelevant.
    Pairs that the data lack keep `initial_q`. Arguments and errors are those of
    `batch_q_learning`, but the discount must be at most 0.9999.
    """
    model = EmpiricalModel.of(data, by_run)
    q = model.solve(discount, model.rewards, initial_q, threads=threads)
    return (q if by_run else q[0]).astype(np.float32)


@checked_arguments
def pessimistic_q_iteration(
    data: Dataset,
    discount: Discount = 0.9,
    penalty: Annotated[float, Is(least=0, most=1e9)] = 1.0,
    by_run: Flag = False,
    threads: int | None = None,
) -> np.ndarray:
    """Action values from below: the fewer data a pair has, the less it is worth.

    Value iteration with lower confidence bounds (Rashidinejad, Zhu, Ma, Jiao and Russell, Bridging
    offline reinforcement learning and imitation learning, NeurIPS 2021): as `fitted_q_iteration`,
    but from the mean reward of a pair with n transitions penalty / sqrt(n) is taken away. No value
    falls below that of the worst reward for ever, which is what pairs have that the data lack.

    Args:
        penalty: From 0 to 1e9, in rewards; the others, and errors, as of `fitted_q_iteration`.
    """
    model = EmpiricalModel.of(data, by_run)
    worst = data.task.rewards.by_event()[Event.ENTERED_EMPTY :].min()
    lowest = worst / (1.0 - discount)
    rewards = model.rewards - penalty / np.sqrt(model.counts)
    q = model.solve(discount, rewards, lowest, lowest=lowest, threads=threads)
    return (q if by_run else q[0]).astype(np.float32)


@dataclass(frozen=True, eq=False)
class EmpiricalModel:
    """The Markov decision process of maximum likelihood: which pair led where how often.

    Where the states that ants see are not Markov, it depends on the behaviour policy too.

    Attributes:
        largest: The largest absolute reward of the task.
        groups: int32 (groups + 1,), where the pairs of a group of rows begin.
        pairs: int32 (pairs,), state * 5 + action, ascending in a group.
        counts, rewards: int64, float64 (pairs,), transitions and their mean rewards.
        begins: int32 (pairs + 1,), where the successors of a pair begin.
        successors: int32 (k,), states, ascending in a pair; none for transitions that terminated.
        probabilities: float64 (k,), which may add up to less than 1 for a pair.
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
    def of(cls, data: Dataset, by_run: bool) -> EmpiricalModel:
        """Of each run a group, or of all of them one."""
        groups = _groups(data, by_run)
        group = np.repeat(np.arange(len(groups) - 1), np.diff(groups))
        pair = (group * data.task.n_states + data.state) * N_ACTIONS + data.action
        return cls._counted(data, len(groups) - 1, *_tally(data, pair)[:4])

    @classmethod
    def resampled(cls, data: Dataset, times: np.ndarray) -> EmpiricalModel:
        """Of resamples of the episodes, a group each; (resamples, episodes) how often one is in."""
        n_states = data.task.n_states
        pair = data.state.astype(np.int64) * N_ACTIONS + data.action
        pairs, successors, _, _, triple = _tally(data, pair)
        several = []
        for number, of_episode in enumerate(times):
            rows = of_episode[data.episode].astype(np.float64)  # sums of integers stay exact
            counts = np.bincount(triple, rows, len(pairs))
            rewards, there = np.bincount(triple, rows * data.reward, len(pairs)), counts > 0
            moved = pairs + number * n_states * N_ACTIONS
            several.append([one[there] for one in (moved, successors, counts, rewards)])
        return cls._counted(data, len(times), *map(np.concatenate, zip(*several, strict=True)))

    @classmethod
    def _counted(
        cls,
        data: Dataset,
        n_groups: int,
        pair: np.ndarray,
        successor: np.ndarray,
        counts: np.ndarray,
        rewards: np.ndarray,
    ) -> EmpiricalModel:
        """From counts and sums of rewards by pair, that of group g moved by g tables, and state."""
        n_states, size = data.task.n_states, data.task.n_states * N_ACTIONS
        pairs, first = np.unique(pair, return_index=True)
        total = np.add.reduceat(counts, first)
        goes_on = successor < n_states
        share = counts / np.repeat(total, np.diff(first, append=len(pair)))
        return cls(
            n_states=n_states,
            largest=float(np.abs(data.task.rewards.by_event()).max()),
            groups=np.searchsorted(pairs // size, np.arange(n_groups + 1)).astype(np.int32),
            pairs=(pairs % size).astype(np.int32),
            counts=total.astype(np.int64),
            rewards=np.add.reduceat(rewards, first) / total,
            begins=np.append(0, np.cumsum(np.add.reduceat(goes_on, first))).astype(np.int32),
            successors=successor[goes_on].astype(np.int32),
            probabilities=share[goes_on],
        )

    def solve(
        self,
        discount: float,
        rewards: np.ndarray,
        initial_q: float,
        policy: np.ndarray | None = None,
        lowest: float = -np.inf,
        threads: int | None = None,
    ) -> np.ndarray:
        """Iterate Q until it stays, each group for itself: float64 (groups, n_states, 5).

        `rewards` are those expected of the pairs; `initial_q` is the value of all pairs before, and
        of those that the data lack after; the values are those of the `policy` with these
        probabilities of actions (n_states, 5), None: the greedy one. No value falls below `lowest`.
        """
        n_groups = len(self.groups) - 1
        q = np.full((n_groups, self.n_states, N_ACTIONS), initial_q, np.float64)
        values = np.empty((n_groups, self.n_states))
        greedy = np.zeros((self.n_states, N_ACTIONS)) if policy is None else policy
        runtime.start(threads)
        from taichi_ants.offline.kernels import iterate  # imports Taichi

        tables = q.reshape(-1), values.reshape(-1), np.ascontiguousarray(greedy).reshape(-1)
        # An array of length 0 cannot be an argument.
        after = np.append(self.successors, np.int32(0)), np.append(self.probabilities, 0.0)
        numbers = self.n_states, discount, lowest, tolerance(self.largest, discount, initial_q)
        model = self.groups, self.pairs, rewards, self.begins, *after
        iterate(*tables, int(policy is None), *model, *numbers)
        return q


def _tally(data: Dataset, pair: np.ndarray) -> tuple[np.ndarray, ...]:
    """Count the states to which each pair led, ascending; n_states stands for termination.

    Returns:
        Pairs, next states, counts, sums of rewards, and for each row which of these it is.
    """
    ends = data.task.n_states
    key = pair * (ends + 1) + np.where(data.terminated, ends, data.next_state)
    keys, which = np.unique(key, return_inverse=True)
    counts, rewards = np.bincount(which), np.bincount(which, data.reward)
    return keys // (ends + 1), keys % (ends + 1), counts, rewards, which


def tolerance(largest: float, discount: float, initial_q: float) -> float:
    """Q iteration ends when no action value changes by more: far above rounding errors."""
    return 1e-12 * max(1.0, largest / (1.0 - discount), abs(initial_q))


def _groups(data: Dataset, by_run: bool) -> np.ndarray:
    """Where the rows of each run begin, and end; of all runs together without `by_run`."""
    expect("data", data, Dataset)
    n = len(data.seeds)
    runs = np.arange(n + 1) if by_run else np.array([0, n])
    return np.searchsorted(data.run, runs).astype(np.int32)
