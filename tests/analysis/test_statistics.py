"""Intervals over seeds: known values, coverage, and what they must not depend on."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from taichi_ants.analysis.statistics import (
    _at_level,
    bootstrap_interval,
    cautious_interval,
    estimates,
    interquartile_mean,
    interquartile_values,
    known_means,
    student_interval,
    without_noise,
)

SAMPLES = arrays(float, (3, 8), elements=st.floats(-100, 100, width=32))


def coverage(draw, truth: float, n: int, interval, level: float = 0.95) -> float:
    """The share of 2000 samples of n whose interval holds the truth."""
    low, high = interval(draw(np.random.default_rng(n), (2000, n)), level)
    return float(((low <= truth) & (truth <= high)).mean())


DISTRIBUTIONS = {
    "normal": (lambda random, shape: random.normal(3, 2, shape), 3.0),
    "skewed": (lambda random, shape: random.exponential(1.0, shape), 1.0),
    "binary": (lambda random, shape: 1.0 * (random.random(shape) < 0.4), 0.4),
}


bootstrap = partial(bootstrap_interval, resamples=2000)
cautious = partial(cautious_interval, resamples=2000)


@pytest.mark.parametrize("n", [10, pytest.param(100, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", DISTRIBUTIONS)
def test_intervals_cover_the_truth_as_often_as_they_say(name: str, n: int) -> None:
    draw, truth = DISTRIBUTIONS[name]
    least = 0.915 if (name, n) == ("skewed", 10) else 0.935
    assert coverage(draw, truth, n, bootstrap) > least
    assert coverage(draw, truth, n, cautious) > least
    if name == "normal":
        assert coverage(draw, truth, n, bootstrap) < 0.965


@pytest.mark.parametrize("n", [2, 3, 5])
def test_with_few_seeds_only_the_cautious_interval_covers(n: int) -> None:
    draw, truth = DISTRIBUTIONS["normal"]
    assert coverage(draw, truth, n, bootstrap) < 0.93
    assert coverage(draw, truth, n, cautious) > 0.94
    assert coverage(draw, truth, n, cautious, level=0.999) > 0.997


def test_bca_without_expansion_agrees_with_scipy() -> None:
    """The expansion is a change of level, which can be undone."""
    from scipy import stats

    values = np.random.default_rng(5).gamma(2.0, size=(1, 40))
    n, level = 40, 0.9
    half = stats.norm.ppf((1 + level) / 2) / np.sqrt(n / (n - 1))
    undone = 2 * stats.t.cdf(half, n - 1) - 1
    ours = np.array(bootstrap_interval(values, undone, resamples=40_000)).ravel()
    theirs = stats.bootstrap(
        (values[0],), np.mean, confidence_level=level, n_resamples=40_000, rng=1
    ).confidence_interval
    np.testing.assert_allclose(ours, theirs, rtol=0.005)


@pytest.mark.parametrize("n", [1, 3, 4, 10, 100])
def test_the_interquartile_mean_is_that_of_scipy(n: int) -> None:
    from scipy import stats

    values = np.random.default_rng(n).normal(size=(5, n))
    np.testing.assert_allclose(
        interquartile_mean(values), stats.trim_mean(values, 0.25, axis=1), rtol=1e-14
    )


def test_interquartile_values_have_the_estimate_and_the_spread_of_the_iqm() -> None:
    from scipy import stats

    values = np.random.default_rng(0).standard_t(1.5, size=(3, 40))
    moved = interquartile_values(values)
    np.testing.assert_allclose(moved.mean(axis=1), interquartile_mean(values))
    error = [stats.mstats.trimmed_stde(row, limits=(0.25, 0.25)) for row in values]
    np.testing.assert_allclose(moved.std(axis=1, ddof=1) / np.sqrt(40), error)
    # Seeds keep their places, so that rows stay paired.
    assert (np.diff(np.take_along_axis(moved, values.argsort(axis=1), 1), axis=1) >= -1e-12).all()


def test_the_bootstrap_of_the_iqm_agrees_with_scipy() -> None:
    from scipy import stats

    values = np.random.default_rng(5).standard_t(1.5, size=(1, 40))
    ours = np.array(bootstrap_interval(values, 0.9, iqm=True)).ravel()
    theirs = stats.bootstrap(
        (values[0],),
        lambda sample, axis: stats.trim_mean(sample, 0.25, axis=axis),
        confidence_level=0.9,
        n_resamples=40_000,
        method="percentile",
        rng=1,
    ).confidence_interval
    np.testing.assert_allclose(ours, theirs, atol=0.01)


def test_ties_in_the_middle_half_leave_an_interval_where_the_tails_are_near() -> None:
    """Eight of ten agree: there the t interval is a point, but the truth may lie beyond."""
    values = np.array([[45.0] * 8 + [50.0, 60.0], [45.0] * 10])
    low, high = student_interval(values, iqm=True)
    np.testing.assert_array_equal([low, high], 45.0)
    low, high = cautious_interval(values, 0.95, iqm=True)
    assert (low[0], low[1], high[1]) == (45.0, 45.0, 45.0)
    assert high[0] > 46


def test_columns_of_a_table_are_free_of_rounding_noise() -> None:
    values = np.array([[0.1, 0.2, -0.3, 0.1, 0.2, -0.3], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]])
    assert 0 < abs(values[0].mean()) < 1e-16
    first, second = estimates(values)
    assert (first.mean, second.mean) == (0.0, 3.5)
    assert first.iqm == without_noise(interquartile_mean(values), values)[0]
    assert second.iqm == 3.5
    fields = ("mean", "ci_low", "ci_high", "iqm", "iqm_ci_low", "iqm_ci_high", "left_out")
    assert first._fields == fields
    assert [one[:4] for one in estimates(values, uses_iqm=False)] == [
        (*first[:3], None),
        (*second[:3], None),
    ]


def test_student_interval_by_hand() -> None:
    # Mean 2, deviation 1, t quantile of 2 degrees of freedom 4.302653, sqrt(3) = 1.7320508.
    low, high = student_interval(np.array([[1.0, 2.0, 3.0]]))
    np.testing.assert_allclose([low[0], high[0]], [2 - 2.484138, 2 + 2.484138], rtol=1e-6)


def test_equal_seeds_give_a_point_and_one_seed_gives_nothing() -> None:
    # 0.1 + 0.2 is not 0.3: equal up to rounding counts as equal.
    values = np.array([[7.0] * 20, [0.1 + 0.2] * 10 + [0.3] * 10])
    intervals = (bootstrap_interval, student_interval, cautious_interval)
    for interval in (*intervals, *(partial(interval, iqm=True) for interval in intervals)):
        low, high = interval(values, 0.95)
        np.testing.assert_allclose(low, [7.0, 0.3])
        np.testing.assert_allclose(high, [7.0, 0.3])
        low, high = interval(values[:, :1], 0.95)
        assert np.isnan(low).all()
        assert np.isnan(high).all()


def test_few_equal_seeds_are_no_certainty() -> None:
    """Ten seeds agree by chance with probability 2^-9 = 0.00195 if half of all differ."""
    values = np.full((1, 10), 45.0)
    low, high = cautious_interval(values, 1 - 0.002)
    assert (low[0], high[0]) == (45.0, 45.0)
    low, high = cautious_interval(values, 1 - 0.0019)
    assert (low[0], high[0]) == (-np.inf, np.inf)


@pytest.mark.parametrize("iqm", [False, True])
@given(values=SAMPLES)
def test_the_interval_stays_within_the_seeds_and_around_the_middle(
    iqm: bool, values: np.ndarray
) -> None:
    low, high = bootstrap_interval(values, resamples=2000, iqm=iqm)
    slack = 1e-6
    assert (values.min(axis=1) - slack <= low).all()
    assert (low <= high + slack).all()
    assert (high <= values.max(axis=1) + slack).all()


@pytest.mark.parametrize("shape", ["bell", "ties", "ascending", "nearly constant"])
@pytest.mark.parametrize("levels", [(0.025, 0.975), (1e-5, 0.2), (0.45, 0.55), (0.0, 1.0)])
def test_quantiles_are_those_of_the_sorted_rows(shape: str, levels: tuple[float, float]) -> None:
    draws = np.random.default_rng(3).normal(size=(4, 5000))
    if shape == "ties":
        draws = np.round(draws)
    elif shape == "ascending":  # a sample of every k-th tells it well
        draws.sort(axis=1)
    elif shape == "nearly constant":  # what the sample does not hold
        draws = np.where(np.arange(5000) % 32 == 5, draws, 0.0)
    quantiles = _at_level(draws, np.broadcast_to(levels, (4, 2)))
    expected = np.quantile(draws, levels, axis=1, method="weibull").T
    np.testing.assert_allclose(quantiles, expected, rtol=1e-12, atol=1e-12)


def test_estimates_leave_out_seeds_without_a_value() -> None:
    values = np.random.default_rng(3).normal(size=(4, 12))
    whole = estimates(values)
    gaps = np.insert(values, [2, 5], np.nan, axis=1)
    gaps[1] = np.nan
    gaps[2, [2, 6]] = 7.5, -1.5
    found = estimates(gaps)
    assert [one.left_out for one in found] == [2, 14, 0, 2]
    for row in (0, 3):
        assert found[row][:6] == pytest.approx(whole[row][:6], rel=1e-12)
    assert np.isnan([found[1].mean, found[1].ci_low, found[1].iqm]).all()
    assert found[2][:6] == pytest.approx(estimates(gaps[2:3])[0][:6], rel=1e-12)
    assert estimates(gaps, uses_iqm=False)[0].iqm is None
    assert known_means(gaps).tolist() == pytest.approx([one.mean for one in found], nan_ok=True)
