"""Off-policy evaluation: estimates of the value of a policy from data of another policy.

The *target policy* is the evaluated policy, and the *behaviour policy* generated the data. The
value of a policy is its expected discounted return from the first states of the data's episodes.
"""

from collections.abc import Callable
from typing import Annotated, NamedTuple

import numpy as np

from taichi_ants.analysis.statistics import resampling_counts
from taichi_ants.errors import AntsError, expect
from taichi_ants.learners.config import InitialValue
from taichi_ants.learners.policies import action_probabilities, checked_values
from taichi_ants.offline.dataset import Dataset
from taichi_ants.offline.learners import Discount, EmpiricalModel
from taichi_ants.settings import Flag, Setting, Share, checked_arguments

Resamples = Annotated[int, Setting(least=0, most=100_000)]


class PolicyValues(NamedTuple):
    """Estimated values of policies, float64 arrays in the leading shape of the tables.

    Attributes:
        value: The estimated discounted return.
        low, high: The ends of its bootstrap interval over episodes (percentiles); nan without
            resamples. It covers the choice of episodes, not the error of the method.
        effective_sample_size: (sum of weights)^2 / sum of squared weights, over whole episodes
            (Kong, A note on importance sampling using standardized weights, 1992). It is the number
            of episodes of the target policy itself that would be equally informative. nan without
            weights. If it is 0, ignore the value, because the target policy cannot produce any
            whole episode of the data.
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
) -> PolicyValues:
    """Return values by per-decision importance sampling (Precup, Sutton and Singh, ICML 2000).

    The weight of a reward is the product, over the actions up to it, of their probability under the
    target policy divided by that under the behaviour policy. States need not be Markov, but the
    variance grows exponentially with the length of episodes.

    Args:
        data: The recorded transitions.
        q_values: float (..., n_states, 5), the tables of the target policies.
        discount: The factor by which later rewards count less, per step.
        epsilon: The exploration rate of the target policies.
        weighted: At each step, divide by the sum of the weights rather than by the number of
            episodes (Thomas, Safe reinforcement learning, 2015, section 3.8; an episode that has
            ended keeps its weight). The estimate is biased, but its variance is far smaller.
        resamples: The number of bootstrap resamples of episodes; 0 gives no intervals. Intervals
            are too short for ants of one colony, because they are not independent.
        level: The confidence level of the intervals.

    Raises:
        AntsError: An argument is not allowed, or the data have no behaviour probabilities.

    >>> found = offline.importance_sampling(data, random_policy(), epsilon=1.0, resamples=20)
    >>> bool(found.low <= found.value <= found.high)
    True
    """
    expect("data", data, Dataset)
    if np.isnan(data.behaviour_probability).any():
        raise AntsError("behaviour_probability of the data contains nan; use model_based.")
    times, begins = _times(data, resamples), data.begins
    lengths, step = np.diff(begins), np.arange(len(data)) - begins[data.episode]
    longest = lengths.max() + 1
    factors = np.cumprod(np.append(1.0, np.full(longest - 1, discount)))

    def estimated(policy: np.ndarray) -> tuple[np.ndarray, float]:
        ratios = policy[data.state, data.action] / data.behaviour_probability
        weights = np.concatenate([np.cumprod(one) for one in np.split(ratios, begins[1:-1])])
        whole, estimates = weights[begins[1:] - 1], []
        for of_episode in times:
            of_row = of_episode[data.episode]
            sums = np.bincount(step, of_row * (weights * data.reward), longest)
            total = np.full(longest, of_episode.sum(dtype=float))
            if weighted:
                ended = np.bincount(lengths, of_episode * whole, longest)
                total = np.bincount(step, of_row * weights, longest) + np.cumsum(ended)
            means = np.divide(sums, total, out=np.zeros(longest), where=total > 0)
            estimates.append(np.cumsum(factors * means)[-1])
        squares = np.square(whole).sum()
        return np.array(estimates), whole.sum() ** 2 / squares if squares > 0 else 0.0

    return _values(data, q_values, epsilon, estimated, level)


@checked_arguments
def model_based(
    data: Dataset,
    q_values: np.ndarray,
    discount: Discount = 0.9,
    epsilon: Share = 0.0,
    initial_q: InitialValue = 0.0,
    resamples: Resamples = 200,
    level: Share = 0.95,
) -> PolicyValues:
    """Return the values of target policies in the empirical model of the data.

    This is the direct method (Jiang and Li, Doubly robust off-policy value evaluation for
    reinforcement learning, ICML 2016). Its variance is small, but it is biased for any amount of
    data if states are not Markov. Each resample has a separate model.

    Args:
        initial_q: The value of pairs of state and action without data.
        data, q_values, discount, epsilon, resamples, level: As in `importance_sampling`.

    >>> bool(np.isfinite(offline.model_based(data, result.q_values[0, 0], resamples=0).value))
    True
    """
    expect("data", data, Dataset)
    times = _times(data, resamples)
    model, first = EmpiricalModel.of(data, times), data.state[data.begins[:-1]]
    starts = times / times.sum(axis=1, keepdims=True, dtype=np.int64)  # shares of episodes

    def estimated(policy: np.ndarray) -> tuple[np.ndarray, float]:
        q = model.solve(discount, model.rewards, initial_q, policy)
        values = (policy[first] * q[:, first]).sum(axis=-1)
        return (starts * values).sum(axis=1), np.nan

    return _values(data, q_values, epsilon, estimated, level)


def _values(
    data: Dataset,
    q_values: np.ndarray,
    epsilon: float,
    estimated: Callable[[np.ndarray], tuple[np.ndarray, float]],
    level: float,
) -> PolicyValues:
    """Return the values of policies by a function of the probabilities of one policy's actions.

    It returns the estimates (of the data, then of each resample) and the effective sample size.
    """
    tables = checked_values(q_values, data.task)
    probabilities = action_probabilities(tables, epsilon)
    tail, rows = (1.0 - level) / 2.0, []
    for policy in probabilities.reshape(-1, *tables.shape[-2:]):
        (value, *resampled), size = estimated(policy)
        ends = np.quantile(resampled, (tail, 1.0 - tail)) if resampled else (np.nan, np.nan)
        rows.append((value, *ends, size))
    return PolicyValues(*(np.reshape(column, tables.shape[:-2]) for column in np.array(rows).T))


def _times(data: Dataset, resamples: int) -> np.ndarray:
    """Return counts of each episode, uint8 (1 + resamples, episodes): all 1, then as drawn."""
    n = len(data.begins) - 1
    once = np.ones((1, n), np.uint8)
    return np.concatenate([once, resampling_counts(n, resamples)]) if resamples else once
