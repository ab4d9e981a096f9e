"""The report in the terminal."""

from __future__ import annotations

import io
import math

import pytest
from synthetic_comparison import build, change, subset, unchanged

from taichi_ants.analysis.baselines import TRAINING_SETTING
from taichi_ants.analysis.claims import CLAIMS, assess
from taichi_ants.analysis.comparison import Comparison
from taichi_ants.analysis.markdown import count, interval, number, table
from taichi_ants.analysis.paper import DYNA_P5, SARSA
from taichi_ants.analysis.report import WIDTH, print_report, render
from taichi_ants.analysis.table2 import table2

BASELINES = [
    {
        "baseline": "optimal policy",
        "setting": TRAINING_SETTING,
        "discount": 0.99,
        "return_mean": 476.0,
        "steps_mean": 600.0,
        "deliveries_mean": None,
    }
]
COSTS = [
    {"learner": "q_learning", "planning_steps": 0, "nanoseconds_per_step": 12.0},
    {"learner": "dyna_q", "planning_steps": 5, "nanoseconds_per_step": 42.0},
    {"learner": "sarsa", "planning_steps": 0, "nanoseconds_per_step": math.nan},
]


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    circles = change(DYNA_P5, late_return=200)
    return build({"continuing": unchanged, "absorbing": circles}, seeds=16)


@pytest.fixture(scope="module")
def text(comparison: Comparison) -> str:
    return render(comparison, table2(comparison, 500), assess(comparison), BASELINES, COSTS)


def row(text: str, start: str, after: str = "") -> list[str]:
    lines = text[text.index(after) :].splitlines()
    return next(line for line in lines if line.strip().startswith(start)).split()


def test_it_is_plain_and_narrow(text: str) -> None:
    assert "\x1b" not in text
    assert max(len(line) for line in text.splitlines()) <= WIDTH
    assert text.startswith("128 configurations, 16 seeds, 120 episodes of at most 600 steps, 3 gr")


def test_table_2_stands_beside_the_papers(text: str, comparison: Comparison) -> None:
    line = next(
        line
        for line in table2(comparison, 500)
        if line["learner"] == "sarsa" and line["delivery"] == "continuing"
    )
    cells = row(text, "SARSA", after="Table 2, continuing")
    assert cells[:3] == ["SARSA", "47.3", f"{line['same_return_mean']:.1f}"]
    assert cells[-4:-2] == ["73.0", f"{line['same_steps_mean']:.1f}"]
    assert row(text, "Dyna-Q (p5)", after="Table 2, absorbing")[3] == "248"


def test_greedy_claims_costs_and_baselines(text: str) -> None:
    assert row(text, "SARSA", after="Greedy evaluation") == ["SARSA"] + ["45.0", "35.0", "1.00"] * 2
    words = " ".join(text.split())
    first = CLAIMS[0].statement.removesuffix(".").split(" of all")[0]
    assert first in words
    assert row(text, "3.2", after="In our words")[-2:] == ["supported", "contradicted"]
    assert f"continuing: {len(CLAIMS)} supported" in text
    assert row(text, "Dyna-Q (p5)", after="Cost per step")[-2:] == ["42.0", "3.50"]
    assert row(text, "SARSA", after="Cost per step")[-2:] == ["-", "-"]
    assert row(text, "optimal policy, discount 0.99")[-3:] == ["476.0", "600.0", "-"]


def test_a_terminal_gets_colours(comparison: Comparison, monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    for name in ("NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")
    terminal = Terminal()
    print_report(comparison, [], assess(comparison, CLAIMS[:1]), file=terminal)
    assert "\x1b[32msupported" in terminal.getvalue()
    assert "\x1b[31mcontradicted" in terminal.getvalue()


def test_a_small_comparison_says_what_is_missing() -> None:
    one = subset(build({"absorbing": unchanged}, variants=[SARSA], rollouts=0), [3], 1, 7)
    text = render(one, table2(one, 10), assess(one))
    assert text.startswith("1 configuration, 1 seed, 7 episodes of at most 600 steps, 0 greedy ro")
    assert f"absorbing: {len(CLAIMS)} not tested" in text
    assert "not tested (12): no Q-learning at 0.001 / 0.99 / 0.3 / 0.99" in text
    assert "Greedy evaluation" not in text
    assert "The paper's claims" not in text
    assert row(text, "SARSA", after="Table 2")[1:3] == ["47.3", "-"]
    assert "nan" not in text


def test_numbers_as_text() -> None:
    assert number(-0.04) == "0.0"
    assert number(-0.06) == "-0.1"
    assert number(math.nan) == "-"
    assert number(math.inf, 0) == "inf"
    assert interval(-1.0, 2.25, 2) == "[-1.00, 2.25]"
    assert interval(1.0, math.nan) == "-"
    assert (count(1, "seed"), count(0, "seed")) == ("1 seed", "0 seeds")
    assert table(["a", "b"], [["x", "1"]]) == "| a | b |\n| --- | ---: |\n| x | 1 |\n"
