"""Every finding of the study, on made-up data where it is so and where it is not."""

from functools import cache

import pytest
from colony_findings import (
    ABC,
    ABC_SILENT,
    ABROAD,
    ALONE,
    BC,
    FEW,
    PAPER,
    QUESTIONS,
    QUEUES,
    SILENT,
    SOME,
    A,
    Judged,
    Trained,
    difference_rows,
    judge_all,
)
from synthetic_colony_study import Truth, build, proportional

from taichi_ants.analysis.findings import Verdict, weakest

ADDS, TRAIL, MORE, TRAINING, ELSEWHERE = QUESTIONS


def answer(question: str, truth: Truth = proportional, **settings: object) -> list[list[str]]:
    """Each statement with the numbers of ants for which it is supported, contradicted or open."""
    rows = []
    for (_, series), findings in judged(truth, **settings).items():
        if series.question == question:
            sizes = sorted({n for n, _ in findings})
            by_size = {n: [one for (ants, _), one in findings.items() if ants == n] for n in sizes}
            verdicts = {n: weakest(several).verdict for n, several in by_size.items()}
            known = Verdict.SUPPORTED, Verdict.CONTRADICTED
            kinds = [[n for n in sizes if verdicts[n] is verdict] for verdict in known]
            kinds.append([n for n in sizes if verdicts[n] not in known])
            rows.append([series.statement, *(", ".join(map(str, kind)) or "-" for kind in kinds)])
    return rows


@cache
def judged(truth: Truth, **settings: object) -> Judged:
    return judge_all(build(truth, **settings))


def of_each(each: dict[int, float]) -> Truth:
    """All conditions alike: so much for each ant, by the number of ants."""
    return lambda rules, regime, ants: each[ants] * ants


@cache
def scaled(factor: float, *, rules: str | None = None, regime: str | None = None) -> Truth:
    """Twenty for each ant, but `factor` times as much for some, from two ants on."""

    def truth(smelled: str, trained: str, ants: int) -> float:
        chosen = smelled == (rules or smelled) and trained == (regime or trained) and ants > 1
        return 20.0 * ants * (factor if chosen else 1.0)

    return truth


@pytest.mark.parametrize(
    ("each", "verdicts"),
    [
        ({1: 20, 2: 20, 4: 20, 8: 20}, ["2, 4, 8", "-", "-"]),
        ({1: 20, 2: 20, 4: 15, 8: 7.5}, ["2, 4", "-", "8"]),
        # Eight deliver more than two, but less than four.
        ({1: 20, 2: 20, 4: 15, 8: 5.5}, ["2, 4", "8", "-"]),
        ({1: 20, 2: 10, 4: 5, 8: 2.5}, ["-", "-", "2, 4, 8"]),
        ({1: 20, 2: 10, 4: 2.5, 8: 1}, ["-", "4, 8", "2"]),
    ],
)
def test_do_more_ants_help(each: dict[int, float], verdicts: list[str]) -> None:
    rows = answer(MORE, of_each(each), noise=0.1)
    assert [row[1:4] for row in rows[:2]] == [verdicts] * 2


@pytest.mark.parametrize(
    ("each", "falls"),
    [
        ({1: 20, 2: 20, 4: 20, 8: 20}, "-"),
        ({1: 20, 2: 19, 4: 18, 8: 10}, "2, 4, 8"),
        ({1: 20, 2: 20, 4: 20, 8: 10}, "8"),
        ({1: 10, 2: 20, 4: 30, 8: 40}, "-"),
    ],
)
def test_where_crowding_begins(each: dict[int, float], falls: str) -> None:
    *_, last = answer(MORE, of_each(each), noise=0.5)
    assert last[0] == "with all three rules, each ant delivers more if there are more ants"
    assert last[2] == falls


# By question, the designs of each statement: the first delivers more than the second.
PAIRS: dict[str, list[tuple[Trained, Trained]]] = {
    ADDS: [
        *((Trained(ABC), Trained(rules)) for rules in (PAPER, A, BC)),
        (Trained(QUEUES), Trained(ABC)),
    ],
    TRAIL: [
        (Trained(PAPER), Trained(SILENT)),
        (Trained(A), Trained(PAPER)),
        (Trained(ABC), Trained(ABC_SILENT)),
    ],
    TRAINING: [
        (Trained(PAPER), Trained(PAPER, ALONE)),
        *((Trained(ABC), Trained(ABC, regime)) for regime in (ALONE, FEW, SOME)),
    ],
    ELSEWHERE: [
        (Trained(ABC), Trained(ABC, ABROAD)),
        (Trained(ABC, ABROAD), Trained(PAPER, ABROAD)),
        (Trained(QUEUES, ABROAD), Trained(ABC, ABROAD)),
    ],
}


@pytest.mark.parametrize("question", PAIRS)
def test_conditions_are_compared(question: str) -> None:
    alone = ["1"] if question == TRAIL else []

    def verdicts(truth: Truth) -> list[list[str]]:
        return [row[1:4] for row in answer(question, truth)]

    several, single = "2, 4, 8", ", ".join(alone) or "-"
    for place, (first, second) in enumerate(PAIRS[question]):
        better = verdicts(scaled(2.0, rules=first.rules, regime=first.regime))[place]
        assert better == [several, "-", single]
        worse = verdicts(scaled(2.0, rules=second.rules, regime=second.regime))[place]
        assert worse == ["-", several, single]
        assert verdicts(proportional)[place] == ["-", "-", ", ".join([*alone, several])]
    assert len(verdicts(proportional)) == len(PAIRS[question])


def verdicts_of(judged: dict, question: str = "") -> set[Verdict]:
    return {
        finding.verdict
        for (_, series), findings in judged.items()
        for finding in findings.values()
        if question in series.question
    }


@pytest.mark.parametrize(("seeds", "verdict"), [(9, Verdict.TOO_FEW), (10, Verdict.SUPPORTED)])
def test_below_ten_seeds_no_difference_has_a_verdict(seeds: int, verdict: Verdict) -> None:
    study = build(of_each({1: 20, 2: 20, 4: 20, 8: 20}), seeds=seeds, noise=0.1)
    judged = judge_all(study)
    assert verdicts_of(judged, MORE) >= {verdict}
    assert (verdicts_of(judged) == {Verdict.TOO_FEW}) == (seeds < 10)


def test_the_table_of_differences_holds_what_verdicts_rest_on() -> None:
    study = build(lambda rules, regime, ants: 20.0 * ants * (2 if rules == ABC else 1))
    judged = judge_all(study)
    rows = difference_rows(judged)
    assert len(rows) == sum(len(findings) for findings in judged.values())
    statement = "ants with all three rules deliver more than under the paper's rules"
    (row,) = (
        row
        for row in rows
        if (row["question"], row["statement"], row["ants"]) == (ADDS, statement, 8)
    )
    assert row["mean"] == pytest.approx(160, rel=0.02)
    assert row["low"] < row["mean"] < row["high"]
    assert (row["against"], row["verdict"]) == (8, "supported")
    growth = [row for row in rows if row["question"] == MORE]
    assert {(row["ants"], row["against"]) for row in growth} == {
        *((2, 1), (4, 1), (8, 1), (4, 2), (8, 2), (8, 4))
    }
