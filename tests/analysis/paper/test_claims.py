"""Every claim of the paper, on data where it is true and on data where it is false."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic_comparison import Edit, build, change, level_truth, subset, unchanged

from taichi_ants.analysis.findings import SIMULTANEOUS_LEVEL, UNBOUNDED, Above, Verdict
from taichi_ants.analysis.paper.audit import assess, claims_markdown, claims_rows
from taichi_ants.analysis.paper.claims import CLAIMS
from taichi_ants.analysis.paper.comparison import Hyperparameters, Variant
from taichi_ants.analysis.paper.published import DYNA_P3, DYNA_P5, FIGURE_1, Q_LEARNING, SARSA

BY_ID = {claim.id: claim for claim in CLAIMS}


def fast(point: Hyperparameters) -> bool:
    return point.learning_rate == 0.01


def slow(point: Hyperparameters) -> bool:
    return point.learning_rate == 0.001


def far_sighted(point: Hyperparameters) -> bool:
    return point.discount == 0.99


def exploring(point: Hyperparameters) -> bool:
    return point.epsilon == 0.5


def far_sighted_and_exploring(point: Hyperparameters) -> bool:
    return far_sighted(point) and exploring(point)


SARSA_LONG = change(SARSA, early_steps=100, late_steps=100)
SARSA_HIGH = change(SARSA, late_return=20)
SARSA_WILD = change(SARSA, swing=20)
P3_HIGH = change(DYNA_P3, late_return=20)
P3_LONG = change(DYNA_P3, early_steps=100, late_steps=100)
P5_SHORT = change(DYNA_P5, early_steps=-50, late_steps=-50)
P5_HIGH = change(DYNA_P5, late_return=20)
SARSA_FAILS = change(SARSA, deliveries=-0.5)
P3_GREEDY_FAILS = change(DYNA_P3, greedy_return=-15, greedy_steps=25, greedy_deliveries=-1)
Q_SHRINKS = change(Q_LEARNING, early_return=60)

# What makes each claim false.
OPPOSITES: dict[str, Edit] = {
    "q-return-highest": SARSA_HIGH,
    "q-high-return-long-episodes": change(Q_LEARNING, slow, late_steps=-40),
    "sarsa-return-slightly-lower": change(SARSA, late_return=-20),
    "sarsa-much-shorter": SARSA_LONG,
    "sarsa-consistently-direct": SARSA_LONG,
    "sarsa-shortest-episode": SARSA_LONG,
    "sarsa-shortest-mean": SARSA_LONG,
    "sarsa-more-stable": SARSA_WILD,
    "dyna-depth-return-best": change(DYNA_P5, late_return=-20),
    "dyna-depth-return-some": P5_HIGH,
    "dyna-depth-length-best": P5_SHORT,
    "dyna-depth-length": P5_SHORT,
    "dyna-depth-length-often": P5_SHORT,
    "dyna-below-q-peak": P5_HIGH,
    "dyna-between-return": P3_HIGH,
    "dyna-between-length": P3_LONG,
    "deliveries-about-one": SARSA_FAILS,
    "curves-close-returns": SARSA_HIGH,
    "curves-early-variance": SARSA_WILD,
    "curves-sarsa-stable": SARSA_WILD,
    "curves-sarsa-falls-fastest": SARSA_LONG,
    "curves-dyna-fluctuates-return": change(Q_LEARNING, swing=30),
    "curves-dyna-fluctuates-length": change(Q_LEARNING, steps_swing=30),
    "curves-deliveries-quick": SARSA_FAILS,
    "curves-equal-success": SARSA_FAILS,
    "greedy-return": P3_GREEDY_FAILS,
    "greedy-steps": P3_GREEDY_FAILS,
    "greedy-success": P3_GREEDY_FAILS,
    "greedy-deterministic": change(DYNA_P5, greedy_varies=True),
    "greedy-alike-return": P3_GREEDY_FAILS,
    "greedy-alike-length": P3_GREEDY_FAILS,
    "rate-strongest": change(where=far_sighted, late_return=20),
    "rate-q-small-best": change(Q_LEARNING, fast, late_return=20),
    "rate-destabilises": change(Q_LEARNING, slow, swing=20),
    "rate-destabilises-dyna-most": change(Q_LEARNING, fast, swing=20),
    "rate-sarsa-reliable": change(SARSA, fast, swing=20),
    "epsilon-q-moderate": change(Q_LEARNING, exploring, late_return=20),
    "epsilon-dyna-return": change(DYNA_P5, exploring, late_return=-20),
    "epsilon-dyna-length": change(DYNA_P3, exploring, early_steps=-40, late_steps=-40),
    "epsilon-sarsa-robust": change(SARSA, exploring, late_return=-20),
    "discount-q": change(Q_LEARNING, far_sighted, late_return=-20),
    "discount-depends": change(Q_LEARNING, far_sighted_and_exploring, late_return=20),
    "depth-stability": change(DYNA_P3, swing=30),
    "planning-no-gain-return": change(DYNA_P3, early_return=20),
    "planning-no-gain-length": change(DYNA_P3, early_steps=-60),
    "overall-q-return": SARSA_HIGH,
    "overall-sarsa-length": SARSA_LONG,
    "overall-dyna-return": P3_HIGH,
    "overall-dyna-length": P3_LONG,
    "overall-improvement": Q_SHRINKS,
    "overall-improvement-reliable": Q_SHRINKS,
}


def test_every_claim_has_an_opposite_here_and_a_name_of_its_own() -> None:
    assert list(OPPOSITES) == [claim.id for claim in CLAIMS]


def test_all_claims_are_supported_where_all_are_true() -> None:
    verdicts = {f.claim.id: f.verdict for f in assess(build({"continuing": unchanged}))}
    assert {name for name, verdict in verdicts.items() if verdict is not Verdict.SUPPORTED} == set()


@pytest.mark.parametrize("name", OPPOSITES)
def test_each_claim_is_contradicted_where_it_is_false_and_supported_where_it_is_true(
    name: str,
) -> None:
    comparison = build({"continuing": unchanged, "absorbing": OPPOSITES[name]})
    true, false = assess(comparison, [BY_ID[name]])
    assert (true.delivery, true.verdict) == ("continuing", Verdict.SUPPORTED)
    assert (false.delivery, false.verdict) == ("absorbing", Verdict.CONTRADICTED)


@pytest.mark.parametrize("seeds", [3, 10])
def test_where_nothing_differs_no_difference_is_claimed(seeds: int) -> None:
    """All intervals hold at once with 95 %, so at most every 20th comparison may err.

    Of 12 comparisons no more than two then err in 98 of 100 cases; these cases are fixed.
    """
    directed = [claim for claim in CLAIMS if isinstance(claim.criterion, Above)]
    assert len(directed) > 20
    errors = 0
    for number in range(12):
        comparison = build(
            {"continuing": unchanged},
            seeds=seeds,
            noise=20,
            truth=level_truth,
            random_seed=number,
        )
        findings = assess(comparison, directed)
        verdicts = {finding.verdict for finding in findings}
        errors += not verdicts <= {Verdict.UNDECIDED, Verdict.EQUIVALENT}
    assert errors <= 2


def test_one_seed_tests_nothing() -> None:
    findings = assess(build({"continuing": unchanged}, seeds=1))
    assert {finding.verdict for finding in findings} == {Verdict.NOT_TESTED}
    reasons = {finding.reason for finding in findings}
    assert reasons == {"one seed gives no interval", "needs a second seed"}
    text = claims_markdown(findings)
    assert "No claim could be tested here." in text
    assert "- %" not in text


def test_two_seeds_have_no_halves_to_compare() -> None:
    findings = assess(build({"continuing": unchanged}, seeds=2))
    reasons = {f.reason for f in findings if f.verdict is Verdict.NOT_TESTED}
    assert reasons == {"one seed in each half gives no interval"}


def test_missing_configurations_are_named_and_the_rest_is_tested() -> None:
    comparison = build({"continuing": unchanged}, variants=[Q_LEARNING, SARSA], grid=[FIGURE_1])
    by_id = {finding.claim.id: finding for finding in assess(comparison)}
    assert by_id["q-return-highest"].reason == "no Q-learning at 0.001 / 0.99 / 0.3 / 0.99"
    assert by_id["curves-early-variance"].reason == "no Dyna-Q (p3) at 0.01 / 0.9 / 0.3 / 0.995"
    assert by_id["discount-q"].reason == (
        "15 of the paper's 16 configurations of Q-learning missing"
    )
    assert {finding.verdict for finding in by_id.values()} == {Verdict.NOT_TESTED}
    pair = build({"absorbing": unchanged}, variants=[Q_LEARNING, SARSA])
    tested = {f.claim.id for f in assess(pair) if f.verdict is not Verdict.NOT_TESTED}
    assert {"sarsa-much-shorter", "sarsa-more-stable", "discount-q"} <= tested
    assert "q-return-highest" not in tested


def test_short_training_and_no_rollouts_leave_out_only_what_needs_them() -> None:
    comparison = build({"continuing": unchanged}, episodes=60, rollouts=0)
    by_id = {finding.claim.id: finding for finding in assess(comparison)}
    untested = {name for name, finding in by_id.items() if finding.verdict is Verdict.NOT_TESTED}
    assert untested == {
        "curves-early-variance",
        "curves-sarsa-falls-fastest",
        "curves-deliveries-quick",
        "planning-no-gain-return",
        "planning-no-gain-length",
        "overall-improvement",
        "overall-improvement-reliable",
        *(name for name in by_id if name.startswith("greedy")),
    }
    assert by_id["greedy-return"].reason == (
        "mean return of the greedy rollouts needs greedy rollouts, there are none"
    )
    assert by_id["curves-sarsa-falls-fastest"].reason.endswith(
        "needs at least 100 episodes, there are 60"
    )


def test_other_learners_and_other_values_do_not_disturb_the_claims() -> None:
    plain = build({"continuing": unchanged})
    names = {finding.claim.id: finding.verdict for finding in assess(plain)}
    strange = Hyperparameters(0.5, 0.5, 0.5, 0.5)
    wide = build(
        {"continuing": unchanged},
        variants=[Q_LEARNING, SARSA, DYNA_P3, DYNA_P5, Variant("my_learner", 9)],
        grid=[*{row.hyperparameters for row in plain.rows}, strange],
    )
    assert {finding.claim.id: finding.verdict for finding in assess(wide)} == names


def test_the_order_of_rows_does_not_matter() -> None:
    comparison = build({"continuing": unchanged})
    order = np.random.default_rng(0).permutation(len(comparison.rows))
    shuffled = subset(comparison, order, len(comparison.seeds), comparison.episodes)
    for one, other in zip(assess(comparison), assess(shuffled), strict=True):
        assert one.verdict is other.verdict
        assert one.finding.effect == pytest.approx(other.finding.effect)
        assert one.configurations == other.configurations


def test_seeds_pair_the_rows() -> None:
    """What a seed adds to all rows alike must not blur their difference."""
    comparison = build({"continuing": unchanged}, shared=30)
    (paired,) = assess(comparison, [BY_ID["sarsa-return-slightly-lower"]])
    assert paired.verdict is Verdict.SUPPORTED
    unpaired = build({"continuing": unchanged}, shared=30)
    rows = [n for n, row in enumerate(unpaired.rows) if row.variant == SARSA]
    unpaired.returns[rows] = unpaired.returns[rows][:, ::-1]
    (blurred,) = assess(unpaired, [BY_ID["sarsa-return-slightly-lower"]])
    assert blurred.finding.by_mean.effect == pytest.approx(paired.finding.by_mean.effect)
    assert blurred.verdict is Verdict.UNDECIDED


def test_a_finding_shows_the_weakest_contrast_and_what_it_rests_on() -> None:
    comparison = build({"continuing": unchanged, "absorbing": P3_HIGH})
    true, false = assess(comparison, [BY_ID["q-return-highest"]])
    # Returns at the configurations of table 2: 52, SARSA 43, p3 45, p5 48.6.
    assert true.finding.contrast.label == "Q-learning minus Dyna-Q (p5)"
    assert true.finding.effect == pytest.approx(3.4, abs=0.2)
    assert false.finding.contrast.label == "Q-learning minus Dyna-Q (p3)"
    assert false.finding.effect == pytest.approx(-13, abs=0.2)
    assert (true.finding.contrast.seeds, true.configurations) == (16, 4)
    assert true.finding.low < true.finding.effect < true.finding.high
    (peak,) = assess(build({"absorbing": unchanged}), [BY_ID["dyna-below-q-peak"]])
    assert (peak.finding.contrast.seeds, peak.configurations) == (8, 48)


def test_contrasts_name_what_they_subtract() -> None:
    labels = {claim.id: list(claim.quantity.effects) for claim in CLAIMS}
    assert labels["rate-q-small-best"] == ["Q-learning, 0.001 minus 0.01"]
    assert labels["discount-q"] == ["Q-learning, 0.99 minus 0.9"]
    assert labels["epsilon-q-moderate"] == [
        "0.3 / 0.99 minus 0.3 / 0.995",
        "0.3 / 0.99 minus 0.5 / 0.99",
        "0.3 / 0.99 minus 0.5 / 0.995",
    ]
    assert labels["rate-strongest"][2] == "learning rate minus epsilon decay"


def test_levels_are_corrected_for_all_intervals_of_all_tested_claims() -> None:
    claims = [BY_ID["q-return-highest"], BY_ID["discount-q"], BY_ID["greedy-return"]]
    comparison = build({"continuing": unchanged, "absorbing": unchanged})
    intervals = 2 * (3 + 1 + 4)  # of the typical run and of the mean
    for one in assess(comparison, claims):
        assert one.finding.level == pytest.approx(1 - (1 - SIMULTANEOUS_LEVEL) / (2 * intervals))
    without = build({"continuing": unchanged, "absorbing": unchanged}, rollouts=0)
    for one in assess(without, claims[:2]):
        assert one.finding.level == pytest.approx(1 - (1 - SIMULTANEOUS_LEVEL) / (2 * 2 * 4))
    shares = assess(without, [BY_ID["overall-improvement-reliable"]])
    assert shares[0].finding.level == pytest.approx(1 - (1 - SIMULTANEOUS_LEVEL) / (2 * 4))


def test_in_another_world_nothing_is_tested_for_one_reason() -> None:
    garden = replace(build({"continuing": unchanged, "absorbing": unchanged}), world="garden.txt")
    findings = assess(garden)
    assert {finding.verdict for finding in findings} == {Verdict.NOT_TESTED}
    assert {finding.reason for finding in findings} == {"the claims are about the paper's world"}
    assert claims_markdown(findings, "garden.txt").startswith("World: garden.txt.\n")


def test_intervals_of_shares_end_where_shares_do() -> None:
    comparison = build({"continuing": change(SARSA, deliveries=-0.2)}, seeds=4, episodes=101)
    comparison.greedy_returns[:, 0, 0] += 1  # one seed's rollouts differ
    limits = {"share": (0, 1), "correlation": (-1, 1), "deliveries": (-1, 1)}
    cut = 0
    for audited in assess(comparison):
        quantity, finding = audited.claim.quantity, audited.finding
        bounds = limits.get(quantity.unit.split()[0])
        if bounds is None:
            assert quantity.possible == UNBOUNDED
            continue
        assert bounds[0] <= finding.low <= finding.effect <= finding.high <= bounds[1]
        cut += finding.low in bounds or finding.high in bounds
        differs = " minus " in finding.contrast.label or quantity.unit == "correlation"
        assert quantity.possible == ((-1, 1) if differs else (0, 1))
    assert cut >= 3


def test_findings_say_which_configurations_they_rest_on() -> None:
    scopes = {claim.id: claim.quantity.scope for claim in CLAIMS}
    assert scopes["q-return-highest"] == "table 2 configurations"
    assert scopes["curves-sarsa-stable"] == "figure 1 configuration"
    assert scopes["overall-q-return"] == scopes["discount-q"] == "all 16"
    assert scopes["dyna-below-q-peak"] == "best, on other seeds"
    assert scopes["epsilon-dyna-return"] == "single configurations"


def test_the_tables_hold_the_findings() -> None:
    comparison = build({"continuing": unchanged, "absorbing": SARSA_HIGH}, rollouts=0)
    findings = assess(comparison)
    rows = claims_rows(findings)
    assert len(rows) == 2 * len(CLAIMS)
    assert [row["verdict"] for row in rows] == [finding.verdict.value for finding in findings]
    assert rows[0]["claim"] == "q-return-highest"
    assert rows[0]["criterion"] == "above 0, margin 1"
    assert rows[0]["effect"] == findings[0].finding.effect
    assert (rows[0]["centre"], rows[0]["mean_effect"]) == (
        "interquartile mean",
        findings[0].finding.by_mean.effect,
    )
    share = rows[[claim.id for claim in CLAIMS].index("deliveries-about-one") * 2]
    assert (share["centre"], share["mean_verdict"]) == ("mean", "")
    text = claims_markdown(findings)
    assert all(text.count(f"| {claim.id} |") == 1 for claim in CLAIMS)
    line = next(line for line in text.splitlines() if line.startswith("| q-return-highest"))
    cells = [cell.strip() for cell in line.strip("|").split("|")]
    assert cells[4] == "interquartile mean above 0, margin 1 reward"
    assert cells[5].startswith("**supported")
    assert cells[6].startswith("**contradicted**")
    assert "not tested (mean return of the greedy rollouts needs greedy rollouts" in text


def test_quantities_say_what_is_computed() -> None:
    by_id = {claim.id: claim.tested_on for claim in CLAIMS}
    assert by_id["sarsa-much-shorter"] == (
        "mean length of all episodes, at the learner's configuration in the paper's table 2: "
        "Q-learning minus SARSA; the configurations differ in more than the learner"
    )
    assert by_id["rate-q-small-best"] == (
        "mean return of the last 50 episodes, learning rate 0.001 minus 0.01, mean over 8 pairs of "
        "configurations: Q-learning, 0.001 minus 0.01"
    )
    for claim in CLAIMS:
        assert all(label in claim.tested_on for label in claim.quantity.effects), claim.id
