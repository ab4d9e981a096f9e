"""Estimates over seeds and their intervals: what they are for and cover is in docs/statistics.md.

Two estimators, the mean and the interquartile mean (IQM), which is the mean of the middle half of
the runs (Agarwal et al. 2021). Each has two intervals:

- The bootstrap's. For the mean it is BCa with the expansion of Hesterberg (2015): the normal
  quantile z in the percentile levels is replaced by sqrt(n / (n - 1)) times the t quantile with
  n - 1 degrees of freedom. For the IQM it is the percentile interval, as in rliable.
- Student's t. For the IQM it is that of Tukey and McLaughlin (1963).

Tables and figures show the first. Verdicts on claims use the hull of both, at a level corrected
for their number: far in the tails a bootstrap of few seeds ends at its most extreme resample,
where the t interval goes on; where ties fill the middle half, the t interval is a point, while
the bootstrap knows how near the tails are.

The resampling weights of a number of seeds come from a fixed generator and serve all rows, so that
results are reproducible.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache

import numpy as np

from taichi_ants.errors import AntsError

RESAMPLES = 40_000
RANDOM_SEED = 20_250_801
# Differences of means of integers carry rounding errors of about 1e-15 of their size.
TIE_TOLERANCE = 1e-9
_BLOCK_ROWS = 256
_BLOCK_DRAWS = 4096
_BLOCK_WEIGHTS = 1 << 19  # as float 4 MB, which caches hold
_MOST_KEPT = 1 << 27  # weights, of a byte each


@lru_cache(maxsize=2)
def resampling_counts(n: int, resamples: int = RESAMPLES, iqm: bool = False) -> np.ndarray:
    """Return the counts of n seeds in each resample, uint8 (resamples, n), read-only.

    With `iqm` these are counts of the seeds, *in ascending order of their values*, in the middle
    half of each resample. Sorting a resample keeps that order, so these hold for all rows.
    """
    counts = np.empty((resamples, n), np.uint8)
    for start, block in _drawn(n, resamples, iqm):
        counts[start : start + len(block)] = block
    counts.setflags(write=False)
    return counts


def _drawn(n: int, resamples: int, iqm: bool) -> Iterator[tuple[int, np.ndarray]]:
    """The same in blocks: the number of the first resample of each, and its counts."""
    random = np.random.default_rng((RANDOM_SEED, n))
    size = min(_BLOCK_DRAWS, max(1, _BLOCK_WEIGHTS // n))  # with any, the numbers are the same
    for start in range(0, resamples, size):
        shape = min(size, resamples - start), n
        drawn = random.integers(0, n, size=shape)
        drawn += n * np.arange(len(drawn))[:, None]
        drawn = np.bincount(drawn.ravel(), minlength=drawn.size).reshape(shape)
        if iqm:
            cut = n // 4
            until = drawn.cumsum(axis=1, dtype=np.int32).clip(cut, n - cut)
            drawn = np.diff(until, axis=1, prepend=np.int32(cut))
        yield start, drawn


def interquartile_mean(values: np.ndarray) -> np.ndarray:
    """Mean of (rows, seeds) over seeds without the lowest and the highest quarter, float64 (rows,).

    A quarter of n seeds is rounded down, as in rliable. Rows with a nan give nan.
    """
    ordered = np.sort(np.asarray(values, float), axis=1)
    cut = ordered.shape[1] // 4
    middle = ordered[:, cut : ordered.shape[1] - cut].mean(axis=1)
    return np.where(np.isnan(ordered[:, -1]), np.nan, middle)  # nan is sorted to the end


def interquartile_values(values: np.ndarray) -> np.ndarray:
    """Values (rows, seeds) that have the interquartile mean as their mean, and its spread.

    They are the winsorised values (moved to the ends of the middle half) around the IQM, stretched
    by what the trimming takes away.
    """
    values = np.asarray(values, float)
    ordered, cut = np.sort(values, axis=1), values.shape[1] // 4
    ends = ordered[:, [cut]], ordered[:, [values.shape[1] - cut - 1]]
    moved = np.clip(values, *ends)
    stretch = values.shape[1] / (values.shape[1] - 2 * cut)
    moved = (moved - moved.mean(axis=1, keepdims=True)) * stretch
    moved[ends[0][:, 0] == ends[1][:, 0]] = 0.0  # free of rounding errors
    return interquartile_mean(values)[:, None] + moved


def estimates(values: np.ndarray, uses_iqm: bool = True) -> dict[str, np.ndarray]:
    """Columns of a table, float64 (rows,) each: estimates of values (rows, seeds) with intervals.

    "mean", "ci_low", "ci_high"; with the IQM also "iqm", "iqm_ci_low", "iqm_ci_high".
    """
    values = np.asarray(values, float)
    columns = {"mean": values.mean(axis=1)}
    columns["ci_low"], columns["ci_high"] = bootstrap_interval(values)
    if uses_iqm:
        columns["iqm"] = interquartile_mean(values)
        columns["iqm_ci_low"], columns["iqm_ci_high"] = bootstrap_interval(values, iqm=True)
    return {name: without_noise(column, values) for name, column in columns.items()}


def without_noise(numbers: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Numbers (rows,) computed from values (rows, seeds), 0 where they are rounding errors."""
    tiny = TIE_TOLERANCE * np.abs(values).max(axis=1)
    return np.where(np.abs(numbers) <= tiny, 0.0, numbers)


def bootstrap_interval(
    values: np.ndarray, level: float = 0.95, resamples: int = RESAMPLES, iqm: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Bootstrap interval of the mean over seeds (expanded BCa), or of the IQM (percentiles).

    Returns the ends for each row of values (rows, seeds), float64 (rows,) each: nan for fewer than
    two seeds and for rows with a nan, a single point where all seeds agree.
    """
    values = _rows(values)
    rows, n = values.shape
    ends = np.full((rows, 2), np.nan)
    interval = _percentile if iqm else _bca
    for start in range(0, rows if n > 1 else 0, _BLOCK_ROWS):  # bounds the memory of the means
        block = slice(start, start + _BLOCK_ROWS)
        ends[block] = interval(values[block], level, resamples)
    return ends[:, 0], ends[:, 1]


def _rows(values: np.ndarray) -> np.ndarray:
    rows = np.asarray(values, float)
    if rows.ndim != 2:
        raise AntsError(
            f"values has shape {rows.shape}; it must be (rows, seeds), so give values[None] for a "
            "single row."
        )
    return rows


def student_interval(
    values: np.ndarray, level: float = 0.95, iqm: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Student's t interval of the mean over seeds, or Tukey and McLaughlin's of the IQM."""
    from scipy.special import stdtrit

    values = _rows(values)
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
    """The hull of both intervals, on which verdicts rest.

    That all n seeds agree by chance, although half of all seeds would differ, has probability
    2^(1-n) (the sign test). If this is not below 1 - level, the interval is unbounded.
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
    """Whether a row's seeds agree up to rounding errors, bool (rows,)."""
    return np.ptp(values, axis=1) <= TIE_TOLERANCE * np.abs(values).max(axis=1)


def jackknife_values(
    statistic: Callable[[np.ndarray], np.ndarray], values: np.ndarray
) -> np.ndarray:
    """Pseudo-values of a smooth function of means over seeds, one for each seed; nan of one seed.

    Their mean is the statistic, float (..., k) -> float (k,), with its bias of order 1/n removed,
    and their spread is that of the statistic; so they can be averaged like any other effect.
    """
    n = values.shape[-1]
    if n < 2:
        return np.full(n, np.nan)
    total = values.sum(axis=-1, keepdims=True)
    return n * statistic(total / n) - (n - 1) * statistic((total - values) / (n - 1))


def _bca(values: np.ndarray, level: float, resamples: int) -> np.ndarray:
    from scipy.special import ndtr, ndtri, stdtrit

    n = values.shape[1]
    mean = values.mean(axis=1, keepdims=True)
    deviations = np.where(all_equal(values)[:, None], 0.0, values - mean)
    draws = _resampled_means(deviations, resamples)

    # Bias correction: where the mean lies among the resampled means, ties counted by half.
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
    # Past its pole the transformation has run through infinity: the end of the distribution.
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
    """Float64 (rows, resamples), relative to each row's mean; with `iqm` of ascending rows."""
    n = deviations.shape[1]
    draws = np.empty((len(deviations), resamples))
    if n * resamples > _MOST_KEPT:
        blocks = _drawn(n, resamples, iqm)
    else:
        kept, size = resampling_counts(n, resamples, iqm), max(1, _BLOCK_WEIGHTS // n)
        blocks = ((start, kept[start : start + size]) for start in range(0, resamples, size))
    for start, counts in blocks:
        some = slice(start, start + len(counts))
        np.matmul(deviations, counts.astype(float).T, out=draws[:, some])
    draws /= n
    return draws


def _at_level(draws: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Sort rows (rows, resamples) and return their quantiles at levels (rows, k), as Weibull."""
    last = draws.shape[1] - 1
    place = np.clip(levels * (last + 2) - 1, 0, last)
    left = np.nan_to_num(np.floor(place)).astype(int)
    draws.sort(axis=1)
    low, high = (np.take_along_axis(draws, np.minimum(left + k, last), axis=1) for k in (0, 1))
    return low + (place - left) * (high - low)
