"""Estimates over seeds and their intervals; see docs/concepts/statistics.md for their coverage.

There are two estimators: the mean, and the interquartile mean (IQM), which is the mean of the
middle half of the runs (Agarwal et al. 2021). Each has two intervals:

- Bootstrap. For the mean it is BCa with the expansion of Hesterberg (2015), which replaces the
  normal quantile z in the percentile levels. The replacement is sqrt(n / (n - 1)) times the t
  quantile with n - 1 degrees of freedom. For the IQM it is the percentile interval, as in rliable.
- Student's t. For the IQM it is the interval of Tukey and McLaughlin (1963).

Tables and figures show the bootstrap interval. Verdicts on claims use the hull of both intervals,
because each can be too short. A bootstrap of few seeds never exceeds its most extreme resample, and
the t interval is a point if the middle half consists of ties.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

__all__ = ["bootstrap_interval", "interquartile_mean", "student_interval"]
RESAMPLES = 40_000
RANDOM_SEED = 20_250_801
# Differences of means of integers carry rounding errors of about 1e-15 of their size.
TIE_TOLERANCE = 1e-9
_BLOCK_ROWS = 256
_BLOCK_DRAWS = 4096
_BLOCK_WEIGHTS = 1 << 19  # 4 MB as float64, which fits into processor caches


@lru_cache(maxsize=2)
def resampling_counts(n: int, resamples: int = RESAMPLES, iqm: bool = False) -> np.ndarray:
    """Return how often each of n seeds is in each resample, uint8 (resamples, n), read-only.

    With `iqm`, only the middle half of each resample counts, and seeds must be *in ascending order
    of their values*. Sorting a resample does not change that order, so all rows can share them.
    Results are reproducible, because the generator depends on nothing but n.
    """
    random = np.random.default_rng((RANDOM_SEED, n))
    counts = np.empty((resamples, n), np.uint8)
    size = min(_BLOCK_DRAWS, max(1, _BLOCK_WEIGHTS // n))  # the size does not change the numbers
    for start in range(0, resamples, size):
        block = counts[start : start + size]
        drawn = random.integers(0, n, size=block.shape)
        drawn += n * np.arange(len(drawn))[:, None]
        drawn = np.bincount(drawn.ravel(), minlength=drawn.size).reshape(block.shape)
        if iqm:
            cut = n // 4
            until = drawn.cumsum(axis=1, dtype=np.int32).clip(cut, n - cut)
            drawn = np.diff(until, axis=1, prepend=np.int32(cut))
        block[:] = drawn
    counts.setflags(write=False)
    return counts


def interquartile_mean(values: np.ndarray) -> np.ndarray:
    """Return the IQM of values (rows, seeds) over seeds, float64 (rows,), nan for rows with a nan.

    It leaves out the lowest and the highest quarter of n seeds, n // 4 each, as in rliable.

    >>> interquartile_mean(np.array([[0, 1, 2, 9]]))
    array([1.5])
    """
    ordered = np.sort(np.atleast_2d(np.asarray(values, float)), axis=1)
    cut = ordered.shape[1] // 4
    middle = ordered[:, cut : ordered.shape[1] - cut].mean(axis=1)
    return np.where(np.isnan(ordered[:, -1]), np.nan, middle)  # nan is sorted to the end


def interquartile_values(values: np.ndarray) -> np.ndarray:
    """Return values (rows, seeds) whose mean is the IQM and whose spread is that of the IQM.

    They are winsorised (moved to the ends of the middle half), shifted to the IQM, and stretched to
    make up for the trimming.
    """
    values = np.asarray(values, float)
    ordered, cut = np.sort(values, axis=1), values.shape[1] // 4
    ends = ordered[:, [cut]], ordered[:, [values.shape[1] - cut - 1]]
    moved = np.clip(values, *ends)
    stretch = values.shape[1] / (values.shape[1] - 2 * cut)
    moved = (moved - moved.mean(axis=1, keepdims=True)) * stretch
    moved[ends[0][:, 0] == ends[1][:, 0]] = 0.0  # without rounding errors
    return interquartile_mean(values)[:, None] + moved


class Estimator(NamedTuple):
    """Estimates of a measure over seeds: mean, IQM or None, 95 % intervals (nan for one seed).

    Seeds without a value (nan) are left out; without any value, the estimates are nan.
    """

    mean: float
    ci_low: float
    ci_high: float
    iqm: float | None = None
    iqm_ci_low: float = math.nan
    iqm_ci_high: float = math.nan
    left_out: int = 0


def estimates(
    values: np.ndarray, uses_iqm: bool = True, resamples: int = RESAMPLES
) -> list[Estimator]:
    """Return the estimates of each row of values (rows, seeds), without IQM unless `uses_iqm`."""
    values = np.asarray(values, float)
    columns = [values.mean(axis=1), *bootstrap_interval(values, resamples=resamples)]
    if uses_iqm:
        columns += [interquartile_mean(values), *bootstrap_interval(values, iqm=True)]
    exact = (without_noise(column, values).tolist() for column in columns)
    estimators = [Estimator(*row) for row in zip(*exact, strict=True)]
    missing = np.isnan(values)
    for row in np.flatnonzero(missing.any(axis=1)):
        if not missing[row].all():
            known = values[row, ~missing[row]][None]
            (estimators[row],) = estimates(known, uses_iqm, resamples)
        estimators[row] = estimators[row]._replace(left_out=int(missing[row].sum()))
    return estimators


def known_means(values: np.ndarray) -> np.ndarray:
    """Return the mean of each row of values (rows, seeds) without nan; nan if all are nan."""
    known = ~np.isnan(values)
    n, sums = known.sum(axis=1), np.where(known, values, 0.0).sum(axis=1)
    return np.divide(sums, n, out=np.full(len(n), np.nan), where=n > 0)


def without_noise(numbers: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return numbers (rows,), but 0 for those that are tiny next to the row's `values`."""
    tiny = TIE_TOLERANCE * np.abs(values).max(axis=1)
    return np.where(np.abs(numbers) <= tiny, 0.0, numbers)


def bootstrap_interval(
    values: np.ndarray, level: float = 0.95, resamples: int = RESAMPLES, iqm: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Return the bootstrap interval of the mean over seeds (expanded BCa) or the IQM (percentiles).

    Args:
        values: float (rows, seeds), or (seeds,) for a single row.
        level: The probability with which the interval covers the true value, 0 to 1.
        resamples: The number of resamples of the seeds.
        iqm: Whether it is the interval of the interquartile mean.

    Returns:
        The lower and the upper ends, float64 (rows,). They are nan for fewer than two seeds and for
        rows with a nan, and equal if all seeds of a row are.

    >>> low, high = bootstrap_interval(np.arange(10))
    >>> low.round(1), high.round(1)
    (array([2.4]), array([6.6]))
    """
    # Rows often repeat, for example where all runs of two configurations deliver equally often.
    bits = np.ascontiguousarray(np.atleast_2d(np.asarray(values, float))).view(np.int64)
    distinct, place = np.unique(bits, axis=0, return_inverse=True)
    values = distinct.view(float)
    rows, n = values.shape
    ends = np.full((rows, 2), np.nan)
    interval = _percentile if iqm else _bca
    for start in range(0, rows if n > 1 else 0, _BLOCK_ROWS):  # bounds the memory of the means
        block = slice(start, start + _BLOCK_ROWS)
        ends[block] = interval(values[block], level, resamples)
    low, high = ends[place.ravel()].T
    return low, high


def student_interval(
    values: np.ndarray, level: float = 0.95, iqm: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Return Student's t interval of the mean over seeds; with `iqm`, Tukey and McLaughlin's.

    Arguments and results are those of `bootstrap_interval`.

    >>> low, high = student_interval(np.arange(10))
    >>> low.round(1), high.round(1)
    (array([2.3]), array([6.7]))
    """
    from scipy.special import stdtrit

    values = np.atleast_2d(np.asarray(values, float))
    rows, n = values.shape
    if n < 2:
        return np.full(rows, np.nan), np.full(rows, np.nan)
    kept = n
    if iqm:
        kept, values = n - 2 * (n // 4), interquartile_values(values)
    half = stdtrit(kept - 1, (1 + level) / 2) * values.std(axis=1, ddof=1) / np.sqrt(n)
    half[all_equal(values)] = 0.0
    mean = values.mean(axis=1)
    return mean - half, mean + half


def cautious_interval(
    values: np.ndarray, level: float, resamples: int = RESAMPLES, iqm: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Return the hull of the bootstrap and the t interval, which verdicts use.

    If all n seeds agree, but could do so by chance, the interval is unbounded. By the sign test,
    this is so if 2^(1-n) is above 1 - level: the probability that n seeds agree if half of all
    seeds differ from the others.
    """
    values = np.asarray(values, float)
    n = values.shape[1]
    bootstrap = bootstrap_interval(values, level, resamples, iqm)
    student = student_interval(values, level, iqm)
    low, high = np.minimum(bootstrap[0], student[0]), np.maximum(bootstrap[1], student[1])
    if n > 1 and 2.0 ** (1 - n) > 1 - level:
        same = all_equal(values)
        low[same], high[same] = -np.inf, np.inf
    return low, high


def all_equal(values: np.ndarray) -> np.ndarray:
    """Return whether all seeds of a row agree up to rounding errors, bool (rows,)."""
    return np.ptp(values, axis=1) <= TIE_TOLERANCE * np.abs(values).max(axis=1)


def _bca(values: np.ndarray, level: float, resamples: int) -> np.ndarray:
    from scipy.special import ndtr, ndtri, stdtrit

    n = values.shape[1]
    mean = values.mean(axis=1, keepdims=True)
    deviations = np.where(all_equal(values)[:, None], 0.0, values - mean)
    draws = _resampled_means(deviations, resamples)

    # Bias correction: the share of resampled means below the mean; ties count by half.
    tie = TIE_TOLERANCE * np.abs(deviations).max(axis=1, keepdims=True)
    ends = zip(draws, tie, strict=True)
    twice = [np.count_nonzero(row < -end) + np.count_nonzero(row <= end) for row, end in ends]
    below = np.array(twice) / (2 * draws.shape[1])
    least = 0.5 / draws.shape[1]
    shift = ndtri(np.clip(below, least, 1 - least))[:, None]
    # Acceleration, from the jackknife: a sixth of the skewness of the mean.
    squares = np.square(deviations).sum(axis=1, keepdims=True)
    cubes = (deviations**3).sum(axis=1, keepdims=True)
    acceleration = cubes / (6 * np.where(squares > 0, squares, 1.0) ** 1.5)

    half = np.sqrt(n / (n - 1)) * stdtrit(n - 1, (1 + level) / 2)
    quantile = shift + np.array([-half, half])
    stretch = 1 - acceleration * quantile
    # Beyond its pole, the transformation is at infinity: the end of the distribution.
    stretched = np.copysign(np.inf, quantile)
    np.divide(quantile, stretch, out=stretched, where=stretch > 0)
    return mean + _at_level(draws, ndtr(shift + stretched))


def _percentile(values: np.ndarray, level: float, resamples: int) -> np.ndarray:
    middle = interquartile_mean(values)[:, None]
    n = values.shape[1]
    draws = _resampled_means(np.sort(values, axis=1) - middle, resamples, iqm=True)
    draws *= n / (n - 2 * (n // 4))  # from a sum of the middle half to its mean
    draws[all_equal(values)] = 0.0
    levels = np.broadcast_to([(1 - level) / 2, (1 + level) / 2], (len(values), 2))
    return middle + _at_level(draws, levels)


def _resampled_means(deviations: np.ndarray, resamples: int, iqm: bool = False) -> np.ndarray:
    """Return means, float64 (rows, resamples); with `iqm`, rows must be in ascending order."""
    n = deviations.shape[1]
    draws = np.empty((len(deviations), resamples))
    counts, size = resampling_counts(n, resamples, iqm), max(1, _BLOCK_WEIGHTS // n)
    for start in range(0, resamples, size):
        some = slice(start, start + size)
        np.matmul(deviations, counts[some].astype(float).T, out=draws[:, some])
    draws /= n
    return draws


def _at_level(draws: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Sort `draws` (rows, resamples) in place; return Weibull's quantiles at `levels` (rows, k)."""
    last = draws.shape[1] - 1
    position = np.clip(levels * (last + 2) - 1, 0, last)
    left = np.nan_to_num(np.floor(position)).astype(int)
    draws.sort(axis=1)
    low, high = (np.take_along_axis(draws, np.minimum(left + k, last), axis=1) for k in (0, 1))
    return low + (position - left) * (high - low)
