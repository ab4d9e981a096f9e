"""What the claims read from a comparison."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic_comparison import build, remeasured, subset, unchanged

from taichi_ants.analysis.paper.published import FIGURE_1, Q_LEARNING, SARSA
from taichi_ants.analysis.paper.quantities import (
    READS,
    grids_of,
    minus,
    of,
    pairs,
    rank_correlation,
    share_above,
)

AT_FIGURE_1, MEAN_OF_ALL = READS["at figure 1"], READS["mean of all"]


def test_a_slice_reads_the_rows_it_is_asked_for() -> None:
    comparison = build({"terminates": unchanged, "truncates": unchanged}, seeds=4)
    part = grids_of(comparison, "terminates")
    values = AT_FIGURE_1.values(part, "return_last50", SARSA)
    position = comparison.position("terminates", SARSA, FIGURE_1)
    np.testing.assert_array_equal(values, comparison.measures["return_last50"][position])
    grid = part("steps_all", Q_LEARNING)
    assert grid.shape == (2, 2, 2, 2, 4)
    # Learning rate 0.01, discount 0.9, epsilon 0.5, decay 0.99.
    row = next(
        number
        for number, row in enumerate(comparison.rows)
        if row.variant == Q_LEARNING
        and row.point == (0.01, 0.9, 0.5, 0.99)
        and row.delivery == "terminates"
    )
    np.testing.assert_array_equal(grid[1, 0, 1, 0], comparison.measures["steps_all"][row])
    differences = pairs(grid, "epsilon")
    assert differences.shape == (8, 4)
    np.testing.assert_allclose(
        differences.mean(axis=0),
        grid[:, :, 1].mean(axis=(0, 1, 2)) - grid[:, :, 0].mean(axis=(0, 1, 2)),
    )


def test_what_is_missing_is_nan() -> None:
    comparison = build({"truncates": unchanged}, seeds=2, variants=[SARSA], grid=[FIGURE_1])
    part = grids_of(comparison, "truncates")
    assert np.isfinite(AT_FIGURE_1.values(part, "return_last50", SARSA)).all()
    assert np.isnan(MEAN_OF_ALL.values(part, "return_last50", SARSA)).all()
    for missing in (
        grids_of(comparison, "terminates"),
        grids_of(replace(comparison, world="garden.txt"), "truncates"),
        grids_of(subset(comparison, [0], 2, 49), "truncates"),
    ):
        assert np.isnan(AT_FIGURE_1.values(missing, "return_last50", SARSA)).all()
    for quantity in (
        share_above("return_last50", Q_LEARNING, SARSA),
        rank_correlation("return_last50", "steps_all", SARSA),
    ):
        (effect,) = quantity.effects.values()
        assert np.isnan(effect(part)).all()


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


def test_what_cannot_leave_a_range_rests_on_the_mean() -> None:
    assert of(MEAN_OF_ALL, "steps_all", SARSA).uses_iqm
    assert of(MEAN_OF_ALL, "improved", SARSA).possible == (0, 1)
    pair = (Q_LEARNING, SARSA)
    assert minus(MEAN_OF_ALL, "deliveries_last50", pair).possible == (-1, 1)
    assert not minus(MEAN_OF_ALL, "deliveries_last50", pair).uses_iqm
