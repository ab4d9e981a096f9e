"""The report as text."""

from dataclasses import replace

import pytest
from paper.baselines import Baseline
from paper.claims import CLAIMS, HEADLINES, assess
from paper.comparison import DYNA_P5, FIGURE_1, SARSA, Comparison
from paper.report import (
    WIDTH,
    baseline_table,
    behaviour_table,
    figure_tables,
    greedy_table,
    heading,
    report,
)
from paper.table2 import shown_position, summarise, summarise_behaviours, table2
from synthetic_comparison import build, change, remeasured, subset, unchanged

from taichi_ants.analysis.behaviour import CIRCLES, WALKS
from taichi_ants.analysis.tables import plain_text

BASELINES = [
    Baseline("optimal policy", 0.99, 476.0, 600.0, 0.0),
    Baseline("exact bounds", None, None, None, None, "the world is too large"),
]


def render(comparison: Comparison) -> str:
    """All tables as text."""
    lines = table2(comparison, summarise(comparison), 50)
    tables = [
        *figure_tables(lines, comparison),
        greedy_table(lines),
        behaviour_table(lines, summarise_behaviours(comparison)),
        baseline_table(BASELINES),
    ]
    return plain_text([*heading(comparison), *tables], WIDTH)


def screen(comparison: Comparison) -> str:
    """What the terminal shows."""
    lines = table2(comparison, summarise(comparison), 50)
    audit = assess(comparison, [one for one in CLAIMS if one.id in HEADLINES])
    return report(comparison, lines, audit)


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    circles = change(DYNA_P5, late_return=200)
    return build({"truncates": unchanged, "terminates": circles}, seeds=16)


@pytest.fixture(scope="module")
def text(comparison: Comparison) -> str:
    return render(comparison)


def row(text: str, start: str, after: str = "") -> list[str]:
    lines = text[text.index(after) :].splitlines()
    return next(line for line in lines if line.strip().startswith(start)).split()


def section(text: str, start: str) -> str:
    return text[text.index(start) :].split("\n\n")[0]


def test_means_that_far_runs_have_moved_are_marked() -> None:
    comparison = build({"truncates": unchanged}, seeds=60, noise=5.0, shared=0.0)
    position = comparison.position("truncates", SARSA, FIGURE_1)
    comparison.arrays["returns"][position, 7] = 4000
    comparison.arrays["greedy_steps"][position, 5] = 600
    comparison = remeasured(comparison)
    text = render(comparison)
    cells = row(text, "SARSA", after="Return, last 50")
    assert cells[3] == "!"
    assert float(cells[4]) < 45 < 90 < float(cells[2])
    greedy = row(text, "SARSA", after="Greedy")
    assert greedy == ["SARSA", "truncates", "45.0", "45.0", "44.4", "!", "35.0", "1.00"]
    assert "Few seeds" not in text
    few = subset(comparison, range(len(comparison.rows)), 10, 120)
    assert "Few seeds (10): if one run in a hundred" in render(few)


def test_it_counts_what_the_ants_do(comparison: Comparison) -> None:
    behaviours = comparison.behaviours.copy()
    policy_returns = comparison.policy_returns.copy()
    shown = shown_position(comparison, "terminates", DYNA_P5)
    behaviours[shown, 4:], policy_returns[shown, 4:] = CIRCLES, 220
    behaviours[shown - 1, :3] = WALKS  # in another configuration, not shown
    mixed = replace(comparison, behaviours=behaviours, policy_returns=policy_returns)
    table = section(render(mixed), "Behaviour, in")
    terminates = table[table.index("terminates") :]
    trained = mixed.measures["return_last50"][shown]
    lines = terminates[terminates.index("Dyna-Q (p5)") :].splitlines()
    delivers, circles = (line.split() for line in lines[:2])
    first, rest = f"{trained[:4].mean():.1f}", f"{trained[4:].mean():.1f}"
    names = ["Dyna-Q", "(p5)", "+", "terminates"]
    assert delivers == [*names, "delivers", "4", first, "45.0", "45.0"]
    assert circles == [*names, "circles", "with", "food", "12", rest, "220.0", "45.0"]
    assert row(terminates, "SARSA")[1:4] == ["terminates", "delivers", "16"]
    assert "circles with food: with food, at least every fourth step leads nearer" in table


def test_the_terminal_shows_what_fits_on_one_screen(comparison: Comparison) -> None:
    text = screen(comparison)
    lines = text.splitlines()
    assert len(lines) <= 48
    assert max(map(len, lines)) <= WIDTH
    line = table2(comparison, summarise(comparison), 50)[1].columns()
    columns = (
        *("return_last50_mean", "return_last50_iqm", "best_run_return_last50_median"),
        *("paper_return", "steps_all_mean", "best_run_steps_all_median", "paper_steps"),
    )
    cells = [cell for cell in row(text, "SARSA") if cell != "!"]
    assert cells[2:] == [*(f"{line[name]:.1f}" for name in columns), "1.00"]
    assert "The paper's 3 claims" in lines
    assert any(line.startswith("  terminates: ") and "contradicted" in line for line in lines)
