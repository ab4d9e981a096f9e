"""The main findings of the study, on made-up data where they hold and where they do not."""

from __future__ import annotations

from functools import cache

import pytest
from synthetic_colony_study import Truth, build, proportional

from taichi_ants.analysis.colony.study import ABC, JOINT, PAPER
from taichi_ants.analysis.colony.tables import Results, headlines, on_one_screen
from taichi_ants.analysis.tables import plain_text


@cache
def told(truth: Truth = proportional, **settings: object) -> list[list[str]]:
    return [list(row) for row in headlines(*Results.of(build(truth, **settings))).rows]


@cache
def times(factor: float, rules: str, regime: str = JOINT) -> Truth:
    """Twenty for each ant, but so many times as much for one design."""

    def truth(of: str, trained: str, ants: int) -> float:
        return 20.0 * ants * (factor if (of, trained) == (rules, regime) else 1.0)

    return truth


@pytest.mark.parametrize(
    ("place", "design"), [(0, (ABC, JOINT)), (1, (PAPER, JOINT)), (2, (ABC, JOINT))]
)
def test_each_line_has_a_verdict(place: int, design: tuple[str, str]) -> None:
    order = ["Ants with all three", "Under the paper's", "With all three"]
    assert [row[0].startswith(one) for row, one in zip(told(), order, strict=True)] == [True] * 3
    assert told(times(2, *design))[place][1].startswith("supported\n")
    assert told(times(0.5, *design))[place][1].startswith("contradicted\n")
    assert told(noise=20)[place][1].startswith("undecided\n")


def test_the_numbers_are_the_means_of_the_largest_colonies() -> None:
    row = told(times(2, ABC), noise=0, world_kinds=("paper", "open"))[0]
    assert row == [
        "Ants with all three rules deliver more than under the paper's rules",
        *["supported\n8: 320 against 160"] * 2,
    ]


def test_few_seeds_have_no_verdict_and_one_ant_no_line() -> None:
    clear = times(2, ABC)
    assert told(clear, noise=0.1, seeds=9)[0][1].startswith("too few seeds\n")
    assert told(clear, noise=0.1, seeds=10)[0][1].startswith("supported\n")
    assert told(sizes=(1,)) == []


def test_it_fits_on_one_screen() -> None:
    study = build(world_kinds=("paper", "open", "piles", "rocks"))
    found = Results.of(study)
    lines = plain_text(on_one_screen(*found), 79).splitlines()
    assert len(lines) <= 50
    assert max(map(len, lines)) <= 79
    [row] = [line.split() for line in lines if line.startswith("A + B + C  ")]
    means = [
        one.estimates["deliveries"].mean
        for one in found.rows
        if one.condition[1:] == (ABC, JOINT, 8)
    ]
    assert row[5::4] == [f"{mean:.0f}" for mean in means[:3]]
    assert row[6::4] == [f"({1.5 * mean:.0f})," for mean in means[:3]]
    assert any(line.startswith("  Do the trails help? ") for line in lines)
    elsewhere = build(regimes=("open",), world_kinds=("rocks",))
    found = Results.of(elsewhere)
    text = plain_text(on_one_screen(*found), 79)
    assert "rocks" in text
