"""Off-policy evaluation: what a policy will bring, judged from data of another one.

The *target policy* is the one in question, the *behaviour policy* the one that made the data. The
value of a policy is its expected discounted return from where the episodes of the data begin.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from taichi_ants import runtime
from taichi_ants.analysis.statistics import resampling_counts
from taichi_ants.checks import checked_q_values
from taichi_ants.engines.records import Record
from taichi_ants.errors import AntsError, expect
from taichi_ants.learners.config import InitialValue
from taichi_ants.learners.policies import action_probabilities
from taichi_ants.offline.dataset import Dataset
from taichi_ants.offline.learners import Discount, EmpiricalModel
from taichi_ants.settings import Flag, Is, Share, checked_arguments

Resamples = Annotated[int, Is(least=0, most=100_000)]


@dataclass(frozen=True, eq=False, repr=False)
class PolicyValues(Record):
    """Estimated values of policies, float64 arrays of their shape.

    Attributes:
        value: The discounted return that is to be expected.
        low, high: The ends of its bootstrap interval over episodes (percentiles); nan without
            resamples. It covers the choice of episodes, not the error of the method.
        effective_sample_size: (sum of weights)^2 / sum of squared weights of whole episodes: how
            many episodes of the target policy tell as much (Kong, A note on importance sampling
            using standardized weights, 1992). nan where none is weighted. 0: the target policy
            would have done no whole episode of the data; do not believe the value.
    """

    value: np.ndarray
    low: np.ndarray
    high: np.ndarray
    effective_sample_size: np.ndarray


@checked_arguments
def importance_sampling(
    data: Dataset,
    q_values: np.ndarray,
    discount: Share = 0.9,
    epsilon: Share = 0.0,
    weighted: Flag = True,
    resamples: Resamples = 200,
    level: Share = 0.95,
    threads: int | None = None,
) -> PolicyValues:
    """Per-decision importance sampling (Precup, Sutton and Singh, ICML 2000).

    Each reward counts as much more often as the target policy would have come to it than the
    behaviour policy did: the product, over the actions up to it, of the ratios of their
    probabilities. It needs no Markov states, but the variance grows exponentially with the length
    of episodes.

    Args:
        q_values: float (..., n_states, 5), the target policies, with `epsilon`.
        weighted: Divide by the sum of the weights, not by the number of episodes: for each step of
            an episode (Thomas, Safe reinforcement learning, 2015, section 3.8; an episode that has
            ended keeps its weight). It is biased, but its variance is far smaller.
        resamples: Bootstrap resamples of the episodes, 0 for no intervals. Ants of one colony are
            not independent of each other: take their intervals as too short.
        level: Confidence level of the intervals.
        threads: CPU threads; None keeps what runs, or takes all.

    Raises:
        AntsError: An argument is not allowed, or the data do not know their probabilities.
    """
    policies, shape = _policies(data, q_values, epsilon)
    if np.isnan(data.behaviour_probability).any():
        raise AntsError(
            "the data do not tell with which probability their actions were taken; record them "
            "with record, or use model_based."
        )
    runtime.start(threads)
    from taichi_ants.offline.kernels import add_up, weigh  # imports Taichi

    times, begins = _times(data, resamples), data.begins.astype(np.int32)
    longest = int(np.diff(begins).max())
    weights, estimates = np.empty(len(data)), np.empty(len(times))
    sums = np.empty((3, len(times), longest + 1))

    def estimated(policy: np.ndarray) -> tuple[np.ndarray, float]:
        weigh(weights, begins, policy[data.state, data.action] / data.behaviour_probability)
        sums[:] = 0.0
        add_up(*sums, estimates, begins, data.reward, weights, times, int(weighted), discount)
        whole = weights[begins[1:] - 1]
        squares = np.square(whole).sum()
        return estimates, whole.sum() ** 2 / squares if squares > 0 else 0.0

    return _values(map(estimated, policies), shape, level)


@checked_arguments
def model_based(
    data: Dataset,
    q_values: np.ndarray,
    discount: Discount = 0.9,
    epsilon: Share = 0.0,
    initial_q: InitialValue = 0.0,
    resamples: Resamples = 200,
    level: Share = 0.95,
    threads: int | None = None,
) -> PolicyValues:
    """The value that target policies have in the empirical model of the data.

    The direct method, as Jiang and Li (Doubly robust off-policy value evaluation for reinforcement
    learning, ICML 2016) call it: little variance, but wrong however many data there are where the
    states that ants see are not Markov. A resample has a model of its own. Pairs that the data lack
    have the value `initial_q`. Other arguments are those of `importance_sampling`.
    """
    policies, shape = _policies(data, q_values, epsilon)
    times = _times(data, resamples)
    model, first = EmpiricalModel.resampled(data, times), data.state[data.begins[:-1]]
    starts = times / times.sum(axis=1, keepdims=True, dtype=np.int64)  # of each episode

    def estimated(policy: np.ndarray) -> tuple[np.ndarray, float]:
        q = model.solve(discount, model.rewards, initial_q, policy, threads=threads)
        values = (policy[first] * q[:, first]).sum(axis=-1)
        return (starts * values).sum(axis=1), np.nan

    return _values(map(estimated, policies), shape, level)


def _values(
    of_policies: Iterable[tuple[np.ndarray, float]], shape: tuple[int, ...], level: float
) -> PolicyValues:
    """From estimates, of the data and of each resample, and sample size of each policy."""
    tail, rows = (1.0 - level) / 2.0, []
    for (value, *resampled), size in of_policies:
        ends = np.quantile(resampled, (tail, 1.0 - tail)) if resampled else (np.nan, np.nan)
        rows.append((value, *ends, size))
    return PolicyValues(*(np.reshape(column, shape) for column in np.array(rows).T))


def _policies(data: Dataset, q_values: np.ndarray, epsilon: float) -> tuple[np.ndarray, tuple]:
    """The probabilities of actions (policies, n_states, 5), and the leading shape of the tables."""
    expect("data", data, Dataset)
    tables = checked_q_values(q_values, data.task)
    probabilities = action_probabilities(tables, epsilon)
    return probabilities.reshape(-1, *tables.shape[-2:]), tables.shape[:-2]


def _times(data: Dataset, resamples: int) -> np.ndarray:
    """How often each episode counts, uint8 (1 + resamples, episodes): once, then as drawn."""
    n = len(data.begins) - 1
    once = np.ones((1, n), np.uint8)
    return np.concatenate([once, resampling_counts(n, resamples)]) if resamples else once
