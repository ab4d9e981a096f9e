"""What the claims read from a comparison."""

import numpy as np
import pytest
from paper.comparison import Q_LEARNING, SARSA
from paper.quantities import (
    READS,
    ContrastOfEstimates,
    grids_of,
    jackknife_values,
    rank_correlation,
    share_above,
)
from synthetic_comparison import build, remeasured, unchanged

from taichi_ants.analysis.findings import above, judge

AT_FIGURE_1, MEAN_OF_ALL = READS["at figure 1"], READS["mean of all"]


def test_the_held_out_half_does_not_choose() -> None:
    """The configuration that shines on odd seeds only is not chosen for them."""
    comparison = build({"truncates": unchanged}, seeds=6, variants=[SARSA], noise=0.0, shared=0.0)
    comparison.arrays["returns"][...] = 10
    comparison.arrays["returns"][3, ::2] = 20  # best on the seeds that choose, poor on the others
    comparison.arrays["returns"][3, 1::2] = 0
    comparison.arrays["returns"][5, 1::2] = 99
    comparison = remeasured(comparison)
    values = READS["best on held-out seeds"].values(
        grids_of(comparison, "truncates"), "return_last50", SARSA
    )
    assert values.tolist() == [0.0, 0.0, 0.0]


def test_shares_count_ties_by_half() -> None:
    comparison = build({"truncates": unchanged}, seeds=2, variants=[Q_LEARNING, SARSA])
    comparison.arrays["returns"][...] = 10
    comparison.arrays["returns"][:4, 0] = 20  # four of 16 pairs are above, the others tie
    comparison = remeasured(comparison)
    part = grids_of(comparison, "truncates")
    for sign, expected in ((1, [10 / 16, 0.5]), (-1, [6 / 16, 0.5])):
        quantity = share_above("return_last50", Q_LEARNING, SARSA, sign)
        (share,) = (effect(part) for effect in quantity.effects.values())
        assert share.tolist() == expected


def test_the_rank_correlation_is_spearmans_within_each_seed() -> None:
    from scipy.stats import spearmanr

    comparison = build({"truncates": unchanged}, seeds=3, variants=[SARSA], noise=20.0)
    comparison.arrays["steps"][:, 2] = 50  # constant: no correlation
    comparison = remeasured(comparison)
    quantity = rank_correlation("return_last50", "steps_last50", SARSA)
    (found,) = (effect(grids_of(comparison, "truncates")) for effect in quantity.effects.values())
    returns, steps = (comparison.measures[name] for name in ("return_last50", "steps_last50"))
    for seed in (0, 1):
        assert found[seed] == pytest.approx(spearmanr(returns[:, seed], steps[:, seed])[0])
    assert found[2] == 0


def test_a_statistic_of_estimates_is_that_of_the_iqm() -> None:
    """The difference of two estimates, near 0 and near 3, with a far run in the first."""
    random = np.random.default_rng(0)
    rows = random.normal(0, 0.1, size=(2, 40)) + np.array([[0.0], [3.0]])
    rows[0, 7] = 900.0
    contrast = ContrastOfEstimates(
        *("spread", rows, above(1.0), True), of_estimates=lambda c: c[1] - c[0]
    )
    (finding,) = judge([contrast])
    assert finding.effect == pytest.approx(3.0, abs=0.1)
    assert finding.by_mean.effect == pytest.approx(3 - 900 / 40, abs=0.1)


def test_jackknife_values_remove_the_bias_of_noise() -> None:
    """Effects of 8 configurations that do not differ have no spread; single seeds seem to."""
    random = np.random.default_rng(3)
    plain, single, corrected = [], [], []
    for _ in range(300):
        noise = random.normal(5, 1, size=(8, 40))
        plain.append(variance(noise.mean(axis=1)))
        single.append(variance(noise).mean())
        corrected.append(jackknife_values(variance, noise).mean())
    assert np.mean(single) == pytest.approx(1.0, abs=0.02)
    assert np.mean(plain) == pytest.approx(1 / 40, abs=0.003)
    assert np.mean(corrected) == pytest.approx(0.0, abs=0.003)


def variance(means: np.ndarray) -> np.ndarray:
    return means.var(axis=0, ddof=1)
