"""How intervals become verdicts, for each kind of claim."""

from __future__ import annotations

import math

import numpy as np
import pytest
from synthetic_comparison import build, unchanged

from taichi_ants.analysis.claims import (
    Above,
    Claim,
    Contrast,
    Finding,
    NotTestedError,
    Slice,
    Verdict,
    Within,
    assess,
)
from taichi_ants.analysis.paper.published import FIGURE_1, Q_LEARNING, SARSA

SUPPORTED, CONTRADICTED = Verdict.SUPPORTED, Verdict.CONTRADICTED
EQUIVALENT, UNDECIDED = Verdict.EQUIVALENT, Verdict.UNDECIDED


@pytest.mark.parametrize(
    ("low", "high", "verdict", "note"),
    [
        (1.5, 3.0, SUPPORTED, ""),
        (0.1, 1.1, SUPPORTED, "may be within the margin"),
        (0.1, 0.9, EQUIVALENT, ""),
        (-0.9, 0.9, EQUIVALENT, ""),
        (-0.9, -0.1, EQUIVALENT, ""),
        (-0.5, 1.5, UNDECIDED, ""),
        (-math.inf, math.inf, UNDECIDED, ""),
        (0.0, 5.0, UNDECIDED, ""),
        (-1.1, -0.1, CONTRADICTED, "may be within the margin"),
        (-3.0, -1.5, CONTRADICTED, ""),
    ],
)
def test_a_directed_claim(low: float, high: float, verdict: Verdict, note: str) -> None:
    assert Above(1.0).judge(low, high) == (verdict, note)


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [
        (1.5, 9.0, SUPPORTED),
        (0.1, 10.0, SUPPORTED),
        (0.1, 10.1, UNDECIDED),
        (-0.1, 11.0, UNDECIDED),
        (10.1, 20.0, CONTRADICTED),
        (-9.0, -2.0, CONTRADICTED),
        (-0.5, 0.5, EQUIVALENT),
    ],
)
def test_a_directed_claim_with_a_limit(low: float, high: float, verdict: Verdict) -> None:
    assert Above(1.0, most=10.0).judge(low, high) == (
        verdict,
        "may be within the margin" if (low, verdict) == (0.1, SUPPORTED) else "",
    )


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [
        (2.0, 4.0, SUPPORTED),
        (2.5, 3.5, SUPPORTED),
        (1.9, 4.0, UNDECIDED),
        (2.0, 4.1, UNDECIDED),
        (0.0, 9.0, UNDECIDED),
        (-math.inf, math.inf, UNDECIDED),
        (4.1, 9.0, CONTRADICTED),
        (0.0, 1.9, CONTRADICTED),
    ],
)
def test_a_claim_of_a_range(low: float, high: float, verdict: Verdict) -> None:
    assert Within(2.0, 4.0).judge(low, high)[0] is verdict


def test_criteria_say_what_they_are() -> None:
    assert Above(0.5).words == "above 0, margin 0.5"
    assert Above(0.5, most=3).words == "above 0 and at most 3, margin 0.5"
    assert Within(2, 4).words == "from 2 to 4"
    assert Within(-np.inf, 4).words == "at most 4"
    assert Within(2, np.inf).words == "at least 2"


def verdict_of(
    effects: dict[str, list[float]], criterion: Above | Within
) -> tuple[Verdict, str, float]:
    """Verdict, contrast shown and its effect, of a claim with these effects of 20 seeds."""
    finding = finding_of(effects, criterion)
    return finding.verdict, finding.contrast, finding.effect


def finding_of(
    effects: dict[str, list[float]], criterion: Above | Within, **options: tuple[float, float]
) -> Finding:

    def contrast(label: str, values: list[float]) -> Contrast:
        return Contrast(label, lambda part: np.resize(values, 20))

    contrasts = tuple(contrast(label, values) for label, values in effects.items())
    claim = Claim("made-up", "0", "A claim.", "a number", "reward", criterion, contrasts, **options)
    comparison = build({"continuing": unchanged}, seeds=20, variants=[SARSA], grid=[FIGURE_1])
    (finding,) = assess(comparison, [claim])
    return finding


HIGH, LOW, WIDE = [4.0, 6.0], [-6.0, -4.0], [-50.0, 60.0]
NEAR = [-0.1, 0.2]


def test_all_contrasts_must_hold() -> None:
    criterion = Above(1.0)
    assert verdict_of({"a": HIGH, "b": [8.0, 9.0]}, criterion) == (SUPPORTED, "a", 5.0)
    assert verdict_of({"a": HIGH, "b": NEAR}, criterion) == (EQUIVALENT, "b", pytest.approx(0.05))
    assert verdict_of({"a": LOW, "b": HIGH}, criterion) == (CONTRADICTED, "a", -5.0)
    # One difference that is known not to matter says more than one that is unknown.
    assert verdict_of({"a": WIDE, "b": NEAR}, criterion)[:2] == (EQUIVALENT, "b")
    # A contradiction counts more than a contrast that is weaker, but undecided.
    assert verdict_of({"a": LOW, "b": [-300.0, 280.0]}, criterion) == (CONTRADICTED, "a", -5.0)
    assert verdict_of({"a": HIGH, "b": WIDE}, criterion) == (UNDECIDED, "b", 5.0)


def test_all_contrasts_must_lie_in_the_range() -> None:
    criterion = Within(0.0, 10.0)
    assert verdict_of({"a": HIGH, "b": [7.0, 8.0]}, criterion) == (SUPPORTED, "b", 7.5)
    assert verdict_of({"a": HIGH, "b": NEAR}, criterion)[:2] == (UNDECIDED, "b")
    assert verdict_of({"a": HIGH, "b": LOW}, criterion) == (CONTRADICTED, "b", -5.0)
    assert verdict_of({"a": HIGH, "b": [11.0, 12.0]}, criterion) == (CONTRADICTED, "b", 11.5)


def test_one_far_run_decides_the_mean_but_not_the_typical_run() -> None:
    """Twenty pairs that differ by a tenth of the margin, and one run that found something else."""
    values = [0.1 * (-1) ** seed for seed in range(19)] + [400.0]
    finding = finding_of({"a": values}, Above(1.0))
    assert (finding.verdict, finding.by_mean.verdict) == (EQUIVALENT, UNDECIDED)
    assert finding.disagrees
    assert abs(finding.effect) < 0.11
    assert finding.by_mean.effect == pytest.approx(20.0, abs=0.1)
    # What is bounded has no far runs: it rests on the mean, and there is no other reading.
    share = finding_of({"a": [0.0] * 3 + [1.0] * 17}, Within(0.9, 1.0), possible=(0.0, 1.0))
    assert share.effect == 0.85
    assert share.by_mean is None
    assert not share.disagrees


def test_a_statistic_of_centres_is_that_of_typical_runs() -> None:
    """The difference of two centres, near 0 and near 3, with a far run in the first."""
    random = np.random.default_rng(0)
    rows = random.normal(0, 0.1, size=(2, 40)) + np.array([[0.0], [3.0]])
    rows[0, 7] = 900.0
    contrast = Contrast("spread", lambda part: rows, lambda centres: centres[1] - centres[0])
    assert contrast.values(None, typical=True).mean() == pytest.approx(3.0, abs=0.1)
    assert contrast.values(None, typical=False).mean() == pytest.approx(3 - 900 / 40, abs=0.1)


def test_a_slice_reads_the_rows_it_is_asked_for() -> None:
    comparison = build({"absorbing": unchanged, "continuing": unchanged}, seeds=4)
    part = Slice(comparison, "absorbing")
    values = part.figure1("return_last50", SARSA)
    position = comparison.position("absorbing", SARSA, FIGURE_1)
    np.testing.assert_array_equal(values, comparison.measure("return_last50")[position])
    assert part.used == {position}
    grid = part.grid("steps_all", Q_LEARNING)
    assert grid.shape == (2, 2, 2, 2, 4)
    # Learning rate 0.01, discount 0.9, epsilon 0.5, decay 0.99.
    row = next(
        number
        for number, row in enumerate(comparison.rows)
        if row.variant == Q_LEARNING
        and row.hyperparameters == (0.01, 0.9, 0.5, 0.99)
        and row.delivery == "absorbing"
    )
    np.testing.assert_array_equal(grid[1, 0, 1, 0], comparison.measure("steps_all")[row])
    pairs = part.pairs("steps_all", Q_LEARNING, "epsilon")
    assert pairs.shape == (8, 4)
    np.testing.assert_allclose(
        pairs.mean(axis=0), grid[:, :, 1].mean(axis=(0, 1, 2)) - grid[:, :, 0].mean(axis=(0, 1, 2))
    )
    assert len(part.used) == 17


def test_a_slice_says_what_is_missing() -> None:
    comparison = build({"continuing": unchanged}, variants=[SARSA], grid=[FIGURE_1])
    with pytest.raises(NotTestedError, match=r"no SARSA at 0\.01"):
        Slice(comparison, "absorbing").figure1("return_last50", SARSA)
    with pytest.raises(NotTestedError, match="15 of the paper's 16 configurations of SARSA"):
        Slice(comparison, "continuing").mean("return_last50", SARSA)


def test_the_held_out_half_does_not_choose() -> None:
    """The configuration that shines on odd seeds only is not chosen for them."""
    comparison = build({"continuing": unchanged}, seeds=6, variants=[SARSA], noise=0.0, shared=0.0)
    comparison.returns[...] = 10
    comparison.returns[3, ::2] = 20  # best on the seeds that choose, poor on the others
    comparison.returns[3, 1::2] = 0
    comparison.returns[5, 1::2] = 99
    values = Slice(comparison, "continuing").held_out("return_last50", SARSA)
    assert values.tolist() == [0.0, 0.0, 0.0]
