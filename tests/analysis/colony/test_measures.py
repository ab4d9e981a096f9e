"""What the study computes from outcomes, and the tables that it writes; worked by hand."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic_colony_study import SIZES, build

from taichi_ants.analysis.colony.study import (
    ABC,
    ABROAD,
    ALONE,
    JOINT,
    OF_STUDY,
    PAPER,
    QUESTIONS,
    REGIMES,
    RULES,
    SILENT,
    Condition,
    judge_all,
    measures_of,
)
from taichi_ants.analysis.colony.tables import (
    condition_rows,
    difference_rows,
    found,
    glance,
    means,
    rows_of_seeds,
)
from taichi_ants.analysis.statistics import bootstrap_interval
from taichi_ants.analysis.tables import markdown

# Two seeds, three episodes of 500 ticks, four ants; as small as blocks keep them.
OUTCOME = {
    "deliveries": np.array([[10, 20, 0], [0, 0, 0]], np.int8),
    "first_delivery": np.array([[40, 60, -1], [-1, -1, -1]], np.int8),
    "moves": np.array([[100, 200, 100], [0, 0, 0]], np.uint8),
    "blocked": np.array([[10, 10, 20], [0, 0, 0]], np.uint8),
    "returns": np.array([[600, 900, -300], [-30, -30, -60]], np.int16),
}

ADDS, _, MORE, *_ = QUESTIONS


@pytest.mark.parametrize(
    ("measure", "expected"),
    [
        ("deliveries", [20, 0]),
        ("per_ant", [5, 0]),
        # Episodes without a delivery count with all their ticks.
        ("first_delivery", [200, 500]),
        ("no_delivery_rate", [1 / 3, 1]),
        # Of all moves, not the mean of shares; without a move there is none.
        ("blocked", [0.1, np.nan]),
        ("reward", [200, -20]),
    ],
)
def test_measures(measure: str, expected: list[float]) -> None:
    np.testing.assert_allclose(measures_of(OUTCOME, 4, 500)[measure], expected)


def test_every_measure_is_in_the_tables() -> None:
    study = build(seeds=7, noise=20)
    rows = condition_rows(study)
    assert len(rows) == len(REGIMES) * len(RULES) * len(SIZES)
    (row,) = (row for row in rows if row.condition[1:] == (SILENT, JOINT, 4))
    lines = rows_of_seeds(study, range(3, 10))
    for measure in OF_STUDY:
        values = study[Condition("paper", SILENT, JOINT, 4)][measure]
        low, high = bootstrap_interval(values[None])
        found = row.estimates[measure][:3]
        np.testing.assert_allclose(found, [values.mean(), low[0], high[0]])
        place = {"world_kind": "paper", "rules": SILENT, "regime": JOINT, "ants": 4, "seed": 5}
        (line,) = (line for line in lines if line.items() >= place.items())
        assert line[measure] == values[2]
    values = study[Condition("paper", SILENT, JOINT, 4)]["deliveries"]
    assert row.ranges == {"deliveries": (values.min(), values.max()), "bound": (100, 100)}
    assert row.seeds == 7
    assert list(row.columns())[:6] == [
        "world_kind",
        "rules",
        "regime",
        "ants",
        "seeds",
        "deliveries_mean",
    ]


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
        *((2, 1), (4, 1), (8, 1), (4, 2), (8, 2), (8, 4)),
    }


def test_means_at_a_glance() -> None:
    study = build(noise=0, world_kinds=("paper", "rocks"))
    del study[Condition("paper", PAPER, ALONE, 8)]
    at_home = {
        condition: one for condition, one in study.items() if condition.world_kind == "paper"
    }
    at_home = {condition: one for condition, one in at_home.items() if condition.regime != ABROAD}
    abroad = {Condition("rocks", ABC, ABROAD, 8): study[Condition("rocks", ABC, ABROAD, 8)]}
    study = {**at_home, **abroad}
    home, away = means(condition_rows(study))
    basis = "12 seeds, exploration rate 0.01: deliveries per 1000 ticks"
    assert home.title == f"The paper's world, {basis}"
    assert home.columns == ("ants", *map(str, SIZES), "share of\nbound", "mean\nbound")
    rows = {row[0]: row[1:] for row in home.rows}
    assert rows["paper's rules, no trails laid"] == ["20", "40", "80", "160", "80 %", "200"]
    assert rows["paper's rules, trained alone, copied"] == ["20", "40", "80", "-", "80 %", "100"]
    assert away.title == f"Trained in open worlds, 8 ants, {basis}"
    assert away.columns == ("world", "A + B + C")
    assert away.rows == [["twice the rocks", "160 [160, 160], 160"]]


def test_the_worst_seed_stands_beside_the_mean_wherever_a_policy_is_carried() -> None:
    study = build(
        noise=0, seeds=10, world_kinds=("rocks",), regimes=(ABROAD,), rules=(ABC,), sizes=(8,)
    )
    study[Condition("rocks", ABC, ABROAD, 8)]["deliveries"][3] = 7.0
    (away,) = means(condition_rows(study))
    (_, cell) = away.rows[0]
    assert cell.startswith("145 [")
    assert cell.endswith("], 7")


def test_each_world_has_a_bound_of_its_own() -> None:
    study = build(noise=0, seeds=10, sizes=(8,))
    for measures in study.values():
        measures["bound"] = np.linspace(100, 300, 10)
        measures["bound_share"] = measures["deliveries"] / measures["bound"]
    table = glance(condition_rows(study))
    name, cell = table.rows[-1]
    assert (name, cell) == ("Mean bound, right of way [range]", "200 [100, 300]")
    shares = 160 / np.linspace(100, 300, 10)
    assert {row[1] for row in table.rows[:-1]} == {f"160 (240), {100 * shares.mean():.0f} %"}
    assert "10 seeds, exploration rate 0.01" in table.notes[0]


def test_findings_stand_under_their_questions() -> None:
    study = build()
    text = markdown(found(condition_rows(study), judge_all(study)))
    assert text.count("**Do more ants help?**") == 1
    assert "| Ants with all three rules deliver more than under the paper's rules |" in text
    assert text.rstrip().endswith("hold at once with 95 %.")
