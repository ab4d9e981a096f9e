"""What the study computes from its records, and the tables that it writes; worked by hand."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from synthetic_colony_study import LIMITS, SIZES, build

from taichi_ants import files
from taichi_ants.analysis.colony.contrasts import COPIES, CURE, judge_all
from taichi_ants.analysis.colony.study import (
    COPIED,
    JOINT,
    MEASURES,
    OFF,
    ON,
    PHEROMONES,
    WAYS,
    Condition,
    Record,
    compute,
)
from taichi_ants.analysis.colony.tables import (
    CONDITION_COLUMNS,
    DIFFERENCE_COLUMNS,
    WIDTH,
    condition_rows,
    difference_rows,
    findings_markdown,
    found,
    report_text,
    table_markdown,
)
from taichi_ants.analysis.statistics import bootstrap_interval
from taichi_ants.analysis.tables import Table

# Two seeds, three episodes of 500 ticks, four ants.
RECORD = Record(
    deliveries=np.array([[10, 20, 0], [0, 0, 0]]),
    first_delivery=np.array([[40, 60, -1], [-1, -1, -1]]),
    moves=np.array([[100, 200, 100], [0, 0, 0]]),
    blocked=np.array([[10, 10, 20], [0, 0, 0]]),
    returns=np.array([[600, 900, -300], [-30, -30, -60]]),
)


@pytest.mark.parametrize(
    ("measure", "expected"),
    [
        ("deliveries", [20, 0]),
        ("per_ant", [5, 0]),
        # Episodes without a delivery count with all their ticks.
        ("first_delivery", [200, 500]),
        ("fruitless", [1 / 3, 1]),
        # Of all moves, not the mean of shares; no move, none blocked.
        ("blocked", [0.1, 0]),
        ("reward", [200, -20]),
    ],
)
def test_measures(measure: str, expected: list[float]) -> None:
    np.testing.assert_allclose(compute(RECORD, measure, ants=4, ticks=500), expected)


def test_every_measure_is_in_the_table_with_its_interval(tmp_path: Path) -> None:
    study = build(seeds=7, noise=20)
    (arena,) = study.arenas
    rows = condition_rows(study)
    assert len(rows) == len(WAYS) * len(PHEROMONES) * len(SIZES)
    row = next(
        row for row in rows if (row["pheromone"], row["way"], row["ants"]) == (OFF, JOINT, 4)
    )
    for measure in MEASURES:
        values = study.values(arena, OFF, JOINT, 4, measure)
        low, high = bootstrap_interval(values[None])
        found = [row[f"{measure}_{end}"] for end in ("mean", "ci_low", "ci_high")]
        np.testing.assert_allclose(found, [values.mean(), low[0], high[0]])
    assert row["deliveries_limit"] == LIMITS.deliveries(4) == 100
    assert row["seeds"] == 7
    files.write_csv(tmp_path / "conditions.csv", rows, CONDITION_COLUMNS)
    with open(tmp_path / "conditions.csv", newline="") as file:
        read = list(csv.DictReader(file))
    assert float(read[rows.index(row)]["per_ant_mean"]) == row["per_ant_mean"]
    assert [row["pheromone"] for row in rows[:: len(rows) // 3]] == list(PHEROMONES)


def test_the_table_of_differences_holds_what_verdicts_rest_on(tmp_path: Path) -> None:
    study = build(lambda pheromone, way, ants: 20.0 * ants * (2 if way == JOINT else 1))
    judged = judge_all(study)
    rows = difference_rows(judged)
    files.write_csv(tmp_path / "differences.csv", rows, DIFFERENCE_COLUMNS)
    assert len(rows) == sum(len(findings) for findings in judged.values())
    (row,) = (
        row
        for row in rows
        if row["question"] == CURE
        and row["difference"]
        == "deliveries per 1000 ticks: trained jointly (evaporating trails) minus "
        "trained alone, copied (evaporating trails)"
        and row["ants"] == 8
    )
    assert row["mean"] == pytest.approx(160, rel=0.02)
    assert row["low"] < row["mean"] < row["high"]
    assert (row["against"], row["verdict"]) == (8, "supported")
    growth = [row for row in rows if row["question"] == COPIES]
    assert {(row["ants"], row["against"]) for row in growth} == {
        *((2, 1), (4, 1), (8, 1), (4, 2), (8, 2), (8, 4)),
    }


def test_the_table_at_a_glance() -> None:
    text = table_markdown(study := build(noise=0, arenas=("paper", "open")), condition_rows(study))
    assert text.startswith("**The paper world**\n\n| ants | trained alone, copied |")
    assert "trained alone 64 times as long, copied" in text
    lines = text.splitlines()
    assert sum(line.startswith("| 8 | 160 [160, 160] |") for line in lines) == 2
    assert next(line for line in lines if line.startswith("| 8 |")).endswith("| 8 % | 200 |")


def test_missing_conditions_and_limits_stay_empty() -> None:
    study = build(noise=0, limits=None)
    del study.records[Condition("paper", ON, COPIED, 8)]
    rows = condition_rows(study)
    assert {row["deliveries_limit"] for row in rows} == {None}
    line = next(
        line for line in table_markdown(study, rows).splitlines() if line.startswith("| 8 |")
    )
    assert line.startswith("| 8 | - | 160 [160, 160] |")
    assert line.endswith("| 8 % | - |")
    assert "limit" not in report_text(study, rows, judge_all(study))


def test_findings_stand_under_their_questions() -> None:
    study = build()
    text = findings_markdown(study, judge_all(study))
    assert text.count("**Do more copies help?**") == 1
    assert "| Jointly trained ants deliver more than copies of an ant trained alone |" in text
    assert text.rstrip().endswith("hold at once with 95 %.")


def test_the_report_is_plain_and_narrow() -> None:
    study = build(noise=0)
    judged = judge_all(study)
    text = report_text(study, condition_rows(study), judged)
    assert "\x1b" not in text
    assert max(len(line) for line in text.splitlines()) <= WIDTH
    assert text.splitlines()[0] == "The paper world, 12 seeds: deliveries per 1000 ticks"
    assert text.splitlines()[1].split() == ["ants", *map(str, SIZES)]
    row = next(line for line in text.splitlines() if "trained jointly; no trails laid" in line)
    assert row.split()[-4:] == ["20.0", "40.0", "80.0", "160"]
    limit = next(line for line in text.splitlines() if line.strip().startswith("limit"))
    assert limit.split() == ["limit", "25.0", "50.0", "100", "200"]
    for block in found(study, judged):
        assert (block.title if isinstance(block, Table) else block) in text
