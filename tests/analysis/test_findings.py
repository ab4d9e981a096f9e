"""How intervals become verdicts, for each kind of claim."""

import math

import numpy as np
import pytest

from taichi_ants.analysis.findings import (
    UNBOUNDED,
    Contrast,
    Criterion,
    Finding,
    Verdict,
    above,
    judge,
    weakest,
)

SUPPORTED, CONTRADICTED = Verdict.SUPPORTED, Verdict.CONTRADICTED
EQUIVALENT, UNDECIDED = Verdict.EQUIVALENT, Verdict.UNDECIDED


ONE_SIDED, LIMITED = above(1.0), Criterion(1.0, 10.0, 1.0)
LARGE, RANGE = Criterion(10.0, margin=2.0), Criterion(2.0, 4.0)


@pytest.mark.parametrize(
    ("criterion", "intervals"),
    [
        (ONE_SIDED, {
            SUPPORTED: [(1.5, 3.0)],
            EQUIVALENT: [(0.1, 0.9), (-0.9, 0.9), (-0.9, -0.1), (-1.0, 1.0)],
            UNDECIDED: [(0.1, 1.1), (-0.5, 1.5), (-math.inf, math.inf), (0.0, 5.0), (1.0, 5.0),
                        (-1.1, -0.1), (-3.0, 0.9)],
            CONTRADICTED: [(-3.0, -1.1), (-3.0, -1.5)],
        }),
        (LIMITED, {
            SUPPORTED: [(1.5, 9.0), (1.1, 10.0)],
            EQUIVALENT: [(-0.5, 0.5)],
            UNDECIDED: [(1.1, 10.1), (-0.1, 11.0)],
            CONTRADICTED: [(10.1, 20.0), (-9.0, -2.0)],
        }),
        (LARGE, {
            SUPPORTED: [(10.5, 20.0)],
            EQUIVALENT: [(-1.5, 1.5)],
            UNDECIDED: [(9.5, 20.0), (1.5, 9.5), (-12.8, -1.5)],
            CONTRADICTED: [(3.0, 9.5), (-12.8, -4.7)],
        }),
        (RANGE, {
            SUPPORTED: [(2.0, 4.0), (2.5, 3.5)],
            UNDECIDED: [(1.9, 4.0), (2.0, 4.1), (0.0, 9.0), (-math.inf, math.inf)],
            CONTRADICTED: [(4.1, 9.0), (0.0, 1.9)],
        }),
    ],
    ids=["above", "with a limit", "a large difference", "a range"],
)  # fmt: skip
def test_a_criterion_judges_intervals(criterion: Criterion, intervals: dict) -> None:
    for verdict, ends in intervals.items():
        assert {criterion.judge(*pair) for pair in ends} == {verdict}


def verdict_of(effects: dict[str, list[float]], criterion: Criterion) -> tuple[Verdict, str, float]:
    """Verdict, contrast shown and its effect, of contrasts with these values of 20 seeds."""
    finding = finding_of(effects, criterion)
    return finding.verdict, finding.contrast.label, finding.effect


def finding_of(
    effects: dict[str, list[float]], criterion: Criterion, possible: tuple[float, float] = UNBOUNDED
) -> Finding:
    uses_iqm = possible == UNBOUNDED
    return weakest(
        judge(
            [
                Contrast(label, np.resize(values, 20), criterion, uses_iqm, possible)
                for label, values in effects.items()
            ]
        )
    )


HIGH, LOW, WIDE = [4.0, 6.0], [-6.0, -4.0], [-50.0, 60.0]
NEAR = [-0.1, 0.2]


def test_all_contrasts_must_hold() -> None:
    criterion = above(1.0)
    assert verdict_of({"a": HIGH, "b": [8.0, 9.0]}, criterion) == (SUPPORTED, "a", 5.0)
    assert verdict_of({"a": HIGH, "b": NEAR}, criterion) == (EQUIVALENT, "b", pytest.approx(0.05))
    assert verdict_of({"a": LOW, "b": HIGH}, criterion) == (CONTRADICTED, "a", -5.0)
    # One difference that is known not to matter says more than one that is unknown.
    assert verdict_of({"a": WIDE, "b": NEAR}, criterion)[:2] == (EQUIVALENT, "b")
    # A contradiction counts more than a contrast that is weaker, but undecided.
    assert verdict_of({"a": LOW, "b": [-300.0, 280.0]}, criterion) == (CONTRADICTED, "a", -5.0)
    assert verdict_of({"a": HIGH, "b": WIDE}, criterion) == (UNDECIDED, "b", 5.0)


def test_all_contrasts_must_lie_in_the_range() -> None:
    criterion = Criterion(0.0, 10.0)
    assert verdict_of({"a": HIGH, "b": [7.0, 8.0]}, criterion) == (SUPPORTED, "b", 7.5)
    assert verdict_of({"a": HIGH, "b": NEAR}, criterion)[:2] == (UNDECIDED, "b")
    assert verdict_of({"a": HIGH, "b": LOW}, criterion) == (CONTRADICTED, "b", -5.0)
    assert verdict_of({"a": HIGH, "b": [11.0, 12.0]}, criterion) == (CONTRADICTED, "b", 11.5)


def test_one_far_run_decides_the_mean_but_not_the_typical_run() -> None:
    """Twenty pairs that differ by a tenth of the margin, and one run that found something else."""
    values = [0.1 * (-1) ** seed for seed in range(19)] + [400.0]
    finding = finding_of({"a": values}, above(1.0))
    assert (finding.verdict, finding.by_mean.verdict) == (EQUIVALENT, UNDECIDED)
    assert abs(finding.effect) < 0.11
    assert finding.by_mean.effect == pytest.approx(20.0, abs=0.1)
    # What is bounded has no far runs: it rests on the mean, and there is no other reading.
    share = finding_of({"a": [0.0] * 3 + [1.0] * 17}, Criterion(0.9, 1.0), possible=(0.0, 1.0))
    assert share.effect == 0.85
    assert share.by_mean is None


def test_more_contrasts_at_once_need_wider_intervals() -> None:
    values = np.random.default_rng(0).normal(1, 1, 20)
    contrast = Contrast("a", values, above())
    (one,), many = judge([contrast]), judge([contrast] * 50)
    assert one.level == 0.95
    assert many[0].level == pytest.approx(1 - 0.05 / 50)
    assert one.low > many[0].low
    assert one.high < many[0].high
    assert one.effect == many[0].effect == pytest.approx(values.mean())
    assert judge([]) == []


def test_both_readings_of_a_typical_contrast_count_for_the_level() -> None:
    values = np.random.default_rng(0).normal(1, 1, 20)
    (finding,) = judge([Contrast("a", values, above(), uses_iqm=True)])
    assert finding.level == finding.by_mean.level == pytest.approx(1 - 0.05 / 2)


def test_contrasts_of_different_numbers_of_seeds_are_judged_together_in_their_order() -> None:
    random = np.random.default_rng(0)
    contrasts = [Contrast(str(n), random.normal(n, 1, n), above()) for n in (9, 30, 9, 5)]
    together = judge(contrasts)
    assert [finding.contrast for finding in together] == contrasts
    for finding, contrast in zip(together, contrasts, strict=True):
        assert finding.effect == pytest.approx(contrast.values.mean())
        assert finding.contrast.seeds == len(contrast.values)


def test_one_seed_decides_nothing() -> None:
    for criterion in (above(), Criterion(0.0, 10.0)):
        (finding,) = judge([Contrast("a", np.array([5.0]), criterion)])
        assert (finding.verdict, finding.effect) == (UNDECIDED, 5.0)
        assert np.isnan(finding.low)


def test_rounding_errors_are_no_effect() -> None:
    values = 0.1 + 0.2 - 0.3 + np.array([-1.0, 1.0] * 10)
    (finding,) = judge([Contrast("a", values, above())])
    assert finding.effect == 0.0


def test_what_is_missing_is_not_tested_and_counts_for_no_level() -> None:
    """Neither a contrast with a nan nor one without seeds, nor a claim with such a contrast."""
    good = Contrast("a", np.random.default_rng(0).normal(1, 1, 20), above(), uses_iqm=True)
    lost = Contrast("b", np.full(20, np.nan), above(), uses_iqm=True)
    none = Contrast("c", np.empty(0), above())
    (alone,) = judge([good])
    first, *others = judge([good, lost, none])
    assert (first.low, first.high, first.level) == (alone.low, alone.high, alone.level)
    for finding in (*others, others[0].by_mean, weakest([first, others[0]])):
        assert finding.verdict is Verdict.NOT_TESTED
        assert np.isnan([finding.effect, finding.low, finding.high]).all()


def test_an_interval_ends_where_the_estimate_cannot_go() -> None:
    shares = np.resize([0.0] + [1.0] * 9, 20)
    free, cut = judge(
        [Contrast("a", shares, above(), possible=one) for one in (UNBOUNDED, (0.0, 1.0))]
    )
    assert free.high > cut.high == 1.0
    assert free.low == cut.low


def test_seeds_without_a_value_are_left_out_of_a_contrast() -> None:
    values = np.random.default_rng(4).normal(1, 1, 30)
    (whole,) = judge([Contrast("", values, above())])
    (found,) = judge([Contrast("", np.insert(values, [3, 9], np.nan), above())])
    assert found.contrast.seeds == 30
    assert (found.effect, found.low, found.high) == (whole.effect, whole.low, whole.high)
    (none,) = judge([Contrast("", np.full(5, np.nan), above())])
    assert (none.verdict, none.contrast.seeds) == (Verdict.NOT_TESTED, 5)
