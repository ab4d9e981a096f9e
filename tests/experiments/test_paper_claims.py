"""Every claim of the paper, on data where it is true and on data where it is false."""

import math

import pytest
from paper.claims import CLAIMS, Audit, assess, claims_rows, in_words
from paper.comparison import (
    DYNA_P3,
    DYNA_P5,
    FIGURE_1,
    Q_LEARNING,
    SARSA,
    VARIANTS,
    Comparison,
    GridPoint,
)
from synthetic_comparison import Edit, build, change, level_truth, remeasured, unchanged

from taichi_ants.analysis.findings import (
    Criterion,
    Finding,
    Verdict,
    above,
)

BY_ID = {claim.id: claim for claim in CLAIMS}


def fast(point: GridPoint) -> bool:
    return point.learning_rate == 0.01


def slow(point: GridPoint) -> bool:
    return point.learning_rate == 0.001


def far_sighted(point: GridPoint) -> bool:
    return point.discount == 0.99


def exploring(point: GridPoint) -> bool:
    return point.epsilon == 0.5


def far_sighted_and_exploring(point: GridPoint) -> bool:
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


def verdicts(audit: Audit, setting: str = "truncates") -> dict[str, Verdict]:
    return {claim.id: findings[setting].verdict for claim, findings in audit.items()}


def untested(audit: Audit, setting: str = "truncates") -> set[str]:
    found = verdicts(audit, setting)
    return {name for name, verdict in found.items() if verdict is Verdict.NOT_TESTED}


def test_all_claims_are_supported_where_all_are_true() -> None:
    found = verdicts(assess(build({"truncates": unchanged})))
    assert {name for name, verdict in found.items() if verdict is not Verdict.SUPPORTED} == set()


@pytest.mark.parametrize("name", OPPOSITES)
def test_each_claim_is_contradicted_where_it_is_false_and_supported_where_it_is_true(
    name: str,
) -> None:
    comparison = build({"truncates": unchanged, "terminates": OPPOSITES[name]})
    (findings,) = assess(comparison, [BY_ID[name]]).values()
    assert {setting: finding.verdict for setting, finding in findings.items()} == {
        **{"truncates": Verdict.SUPPORTED, "terminates": Verdict.CONTRADICTED}
    }


@pytest.mark.parametrize("seeds", [3, 10])
def test_where_nothing_differs_no_difference_is_claimed(seeds: int) -> None:
    """All intervals hold at once with 95 %, so at most every 20th comparison may err.

    Of 12 comparisons no more than two then err in 98 of 100 cases; these cases are fixed.
    """
    directed = [claim for claim in CLAIMS if claim.criterion.margin is not None]
    assert len(directed) > 20
    errors = 0
    for number in range(12):
        comparison = build(
            {"truncates": unchanged}, seeds=seeds, noise=20, truth=level_truth, random_seed=number
        )
        found = set(verdicts(assess(comparison, directed)).values())
        errors += not found <= {Verdict.UNDECIDED, Verdict.EQUIVALENT}
    assert errors <= 2


def test_one_seed_decides_nothing() -> None:
    audit = assess(build({"truncates": unchanged}, seeds=1))
    assert set(verdicts(audit).values()) == {Verdict.UNDECIDED, Verdict.NOT_TESTED}
    assert untested(audit) == {"dyna-below-q-peak"}  # there is no second half


def test_claims_that_lack_configurations_are_not_tested_and_the_rest_is() -> None:
    single = build({"truncates": unchanged}, variants=[Q_LEARNING, SARSA], grid=[FIGURE_1])
    assert untested(assess(single)) == BY_ID.keys()
    pair = build({"terminates": unchanged}, variants=[Q_LEARNING, SARSA])
    missing = untested(assess(pair), "terminates")
    tested = {"sarsa-much-shorter", "sarsa-more-stable", "discount-q", "sarsa-consistently-direct"}
    assert not missing & {*tested, "q-high-return-long-episodes", "epsilon-q-moderate"}
    assert missing >= {
        *("q-return-highest", "dyna-depth-length-often", "dyna-below-q-peak"),
        *("rate-strongest", "discount-depends", "epsilon-dyna-return"),
    }


def only(comparison: Comparison, name: str, setting: str = "truncates") -> Finding:
    """What becomes of one claim."""
    return assess(comparison, [BY_ID[name]])[BY_ID[name]][setting]


def test_seeds_pair_the_rows() -> None:
    """What a seed adds to all rows alike must not blur their difference."""
    paired = only(build({"truncates": unchanged}, shared=30), "sarsa-return-slightly-lower")
    assert paired.verdict is Verdict.SUPPORTED
    unpaired = build({"truncates": unchanged}, shared=30)
    rows = [n for n, row in enumerate(unpaired.rows) if row.variant == SARSA]
    unpaired.arrays["returns"][rows] = unpaired.arrays["returns"][rows][:, ::-1]
    unpaired = remeasured(unpaired)
    blurred = only(unpaired, "sarsa-return-slightly-lower")
    assert blurred.by_mean.effect == pytest.approx(paired.by_mean.effect)
    assert blurred.verdict is Verdict.UNDECIDED


def test_the_tables_hold_the_findings() -> None:
    comparison = build({"truncates": unchanged, "terminates": SARSA_HIGH}, variants=VARIANTS[:3])
    audit = assess(comparison)
    rows = claims_rows(audit)
    assert len(rows) == 2 * len(CLAIMS)
    found = [finding for findings in audit.values() for finding in findings.values()]
    assert [row["verdict"] for row in rows] == [finding.verdict.value for finding in found]
    row = rows[2 * list(BY_ID).index("sarsa-return-slightly-lower")]
    finding = audit[BY_ID["sarsa-return-slightly-lower"]]["truncates"]
    assert (row["criterion"], row["effect"]) == ("above 1 and at most 10, margin 1", finding.effect)
    assert (row["estimator"], row["mean_effect"]) == ("interquartile mean", finding.by_mean.effect)
    share = rows[2 * list(BY_ID).index("sarsa-consistently-direct")]
    assert (share["estimator"], share["mean_verdict"]) == ("mean", None)


def test_criteria_say_what_they_are() -> None:
    assert in_words(above()) == "above 0, margin 0"
    assert in_words(Criterion(0.5, 3, 0.5)) == "above 0.5 and at most 3, margin 0.5"
    assert in_words(Criterion(10, margin=2)) == "above 10, margin 2"
    assert in_words(Criterion(2, 4)) == "from 2 to 4"
    assert in_words(Criterion(-math.inf, 4)) == "at most 4"
    assert in_words(Criterion(2, math.inf)) == "at least 2"
