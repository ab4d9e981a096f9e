"""The report as text."""

from __future__ import annotations

from dataclasses import replace

import pytest
from synthetic_comparison import build, change, remeasured, subset, unchanged

from taichi_ants.analysis.behaviour import CIRCLES, OTHER, WALKS
from taichi_ants.analysis.bounds.baselines import Baseline
from taichi_ants.analysis.paper.claims import CLAIMS, HEADLINES, assess
from taichi_ants.analysis.paper.comparison import Comparison, Variant
from taichi_ants.analysis.paper.published import DYNA_P5, FIGURE_1, SARSA
from taichi_ants.analysis.paper.report import (
    MOST_LINES,
    WIDTH,
    baseline_table,
    behaviour_table,
    figure_tables,
    greedy_table,
    heading,
    report,
)
from taichi_ants.analysis.paper.table2 import (
    shown_position,
    summarise,
    summarise_behaviours,
    table2,
)
from taichi_ants.analysis.tables import plain_text
from taichi_ants.task import Task

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


def test_it_is_plain_and_narrow(text: str) -> None:
    assert "\x1b" not in text
    assert max(len(line) for line in text.splitlines()) <= WIDTH
    assert all(line == line.rstrip() for line in text.splitlines())
    first, second = text.splitlines()[:2]
    assert first == "World: the paper's."
    assert second.startswith("128 configurations, 16 seeds, 120 episodes of at most 600 steps")


def test_table_2_stands_beside_the_papers(text: str, comparison: Comparison) -> None:
    centres_of_line = table2(comparison, summarise(comparison), 50)[1].summary.estimates
    for name, table, paper in (
        ("return_last50", "Return, last 50", "47.3"),
        ("steps_all", "Steps, all", "73.0"),
        ("steps_last50", "Steps, last 50", "73.0"),
    ):
        estimates = [f"{getattr(centres_of_line[name], one):.1f}" for one in ("mean", "iqm")]
        cells = row(text, "SARSA", after=table)
        cells = [cell for cell in cells if cell != "!"]
        assert cells[:4] == ["SARSA", "truncates", *estimates]
        assert cells[5] == paper
    deliveries = row(text, "SARSA", after="Deliveries, last 50")
    assert deliveries[2:6] == ["1.00", "-", "1.00", "1.00"]  # there is no IQM
    lines = section(text, "Return, last 50").splitlines()
    last = next(line for line in lines if "Dyna-Q (p5) terminates" in line)
    assert last.split()[3] == "248"


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


def test_greedy_evaluation_and_baselines(text: str) -> None:
    greedy = ["45.0", "45.0", "35.0", "35.0", "1.00"]
    assert row(text, "SARSA", after="Greedy evaluation") == ["SARSA", "truncates", *greedy]
    assert row(text, "optimal policy, discount 0.99")[-3:] == ["476.0", "600.0", "0.00"]
    assert "exact bounds: the world is too large" in text


@pytest.mark.parametrize("training", [False, True])
@pytest.mark.parametrize("greedy", [False, True])
def test_it_says_where_trails_evaporate(
    comparison: Comparison, training: bool, greedy: bool
) -> None:
    task = Task(evaporation_in_training=training, evaporation_in_evaluation=greedy)
    ways = ("without", "with")
    assert (
        f"\nTraining {ways[training]} evaporation of trails, greedy evaluation {ways[greedy]} it.\n"
    ) in render(replace(comparison, task=task))


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


def test_means_that_no_run_has_are_marked(comparison: Comparison, text: str) -> None:
    assert " +" not in text
    behaviours = comparison.behaviours.copy()
    behaviours[shown_position(comparison, "terminates", DYNA_P5), 0] = OTHER
    marked = render(replace(comparison, behaviours=behaviours))
    for start in ("Return, last 50", "Greedy evaluation", "Behaviour, in"):
        rows = [line for line in section(marked, start).splitlines() if "Dyna-Q (p5)" in line]
        marks = {(line.startswith("Dyna-Q (p5) +"), "terminates" in line) for line in rows}
        assert marks == {(False, False), (True, True)}, start
    mixed = "\n+ the runs behave in different ways, so their mean describes none of them"
    assert marked.count(mixed) == 1


def test_a_small_comparison_is_shown_too() -> None:
    one = subset(build({"terminates": unchanged}, variants=[SARSA]), [3], 1, 7)
    text = render(one)
    assert "\n1 configuration, 1 seed, 7 episodes of at most 600 steps, 3 greedy ro" in text
    mean = float(one.arrays["returns"].mean())
    assert row(text, "SARSA *", after="Return, all 7")[3] == f"{mean:.1f}"
    assert "nan" not in text


def test_learners_beside_the_papers_are_shown_at_their_best() -> None:
    full = build({"terminates": unchanged}, variants=[SARSA, Variant("hysteretic")])
    full.arrays["returns"][19] = 80
    full.arrays["greedy_returns"][19] = 17
    full = remeasured(full)
    text = render(full)
    assert row(text, "hysteretic *", after="Return, last")[3:5] == ["80.0", "80.0"]
    assert row(text, "hysteretic *", after="Greedy")[3] == "17.0"
    assert f"hysteretic *, terminates: {full.rows[19].point.label}" in text
    assert "* best configuration by the IQM of the return on these seeds, which flatters it" in text


def test_another_world_is_not_held_against_the_paper(comparison: Comparison) -> None:
    text = render(replace(comparison, world="garden.txt"))
    assert text.splitlines()[0] == "World: garden.txt."
    assert "47.3" not in text
    assert "Below" not in text
    small = screen(replace(comparison, world="garden.txt"))
    assert "truncates: 3 not tested" in small
    assert "paper mean" not in " ".join(small.split())


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


def test_more_lines_than_fit_are_named() -> None:
    many = [Variant(f"learner_{number}") for number in range(MOST_LINES + 2)]
    text = screen(build({"terminates": unchanged}, variants=many, seeds=2))
    assert f"learner_{MOST_LINES - 1} *" in text
    assert f"learner_{MOST_LINES} *" not in text
    assert "table2.csv has 2 more rows." in text
