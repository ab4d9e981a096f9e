"""The report in the terminal."""

from __future__ import annotations

import io
import math
import re
from dataclasses import replace

import pytest
from synthetic_comparison import build, change, subset, unchanged

from taichi_ants.analysis.behaviour import CIRCLES, OTHER, WALKS
from taichi_ants.analysis.bounds.baselines import TRAINING_SETTING
from taichi_ants.analysis.findings import Verdict
from taichi_ants.analysis.paper.audit import assess
from taichi_ants.analysis.paper.best_of import paper_position
from taichi_ants.analysis.paper.claims import CLAIMS
from taichi_ants.analysis.paper.comparison import PAPER_WORLD, Comparison, Variant
from taichi_ants.analysis.paper.published import DYNA_P5, FIGURE_1, SARSA
from taichi_ants.analysis.paper.report import WIDTH, print_report, render
from taichi_ants.analysis.paper.table2 import table2

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
    assert all(line == line.rstrip() for line in text.splitlines())
    first, second = text.splitlines()[:2]
    assert first == "World: the paper's."
    assert second.startswith("128 configurations, 16 seeds, 120 episodes of at most 600 steps")


def test_table_2_stands_beside_the_papers(text: str, comparison: Comparison) -> None:
    line = next(
        line
        for line in table2(comparison, 500)
        if line["learner"] == "sarsa" and line["delivery"] == "continuing"
    )
    for name, table, paper in (
        ("return", "return", "47.3"),
        ("steps_all", "steps, all", "73.0"),
        ("steps_last50", "steps, last 50", "73.0"),
    ):
        centres = [f"{line[f'same_{name}_{centre}']:.1f}" for centre in ("mean", "iqm")]
        cells = row(text, "SARSA", after=f"Table 2: {table}")
        assert [cell for cell in cells if cell != "!"][:5] == [
            *("SARSA", "continuing", paper, *centres),
        ]
    deliveries = row(text, "SARSA", after="Table 2: deliveries")
    assert deliveries[2:5] == ["1.00", "1.00", "-"]
    absorbing = text[text.index("Table 2: return") :].splitlines()
    last = next(line for line in absorbing if "Dyna-Q (p5) absorbing" in line)
    assert last.split()[3:5] == ["49.0", "248"]
    words = " ".join(text.split())
    assert "IQM: interquartile mean, of the middle half of the runs" in words
    assert "the paper leaves open whether it means all episodes or the last 50; ours come" in words


def test_means_that_far_runs_have_moved_are_marked() -> None:
    comparison = build({"continuing": unchanged}, seeds=60, noise=5.0, shared=0.0)
    position = comparison.position("continuing", SARSA, FIGURE_1)
    comparison.returns[position, 7] = 4000
    comparison.greedy_steps[position, 5] = 600
    text = render(comparison, table2(comparison, 50), [])
    cells = row(text, "SARSA", after="Table 2")
    assert cells[4] == "!"
    assert float(cells[5]) < 45 < 90 < float(cells[3])
    greedy = row(text, "SARSA", after="Greedy")
    assert greedy == ["SARSA", "continuing", "45.0", "45.0", "44.4", "!", "35.0", "1.00"]
    assert text.count(" !\n") + text.count(" ! ") == 2
    assert "Few seeds" not in text
    few = subset(comparison, range(len(comparison.rows)), 10, 120)
    assert "Few seeds (10): where one run in a hundred" in render(few, table2(few, 50), [])


def test_greedy_claims_costs_and_baselines(text: str) -> None:
    greedy = ["45.0", "45.0", "35.0", "35.0", "1.00"]
    assert row(text, "SARSA", after="Greedy evaluation") == ["SARSA", "continuing", *greedy]
    words = " ".join(text.split())
    first = CLAIMS[0].statement.removesuffix(".").split(" of all")[0]
    assert first in words
    assert row(text, "3.2", after="In our words")[-2:] == ["supported", "contradicted"]
    assert f"continuing: {len(CLAIMS)} supported" in text
    assert row(text, "Dyna-Q (p5)", after="Cost per step")[-2:] == ["42.0", "3.50"]
    assert row(text, "SARSA", after="Cost per step")[-2:] == ["-", "-"]
    assert row(text, "optimal policy, discount 0.99")[-3:] == ["476.0", "600.0", "-"]


def section(text: str, start: str) -> str:
    return text[text.index(start) :].split("\n\n")[0]


@pytest.mark.parametrize("training", [False, True])
@pytest.mark.parametrize("greedy", [False, True])
def test_it_says_where_trails_evaporate(
    comparison: Comparison, training: bool, greedy: bool
) -> None:
    changed = replace(comparison, train_evaporation=training, greedy_evaporation=greedy)
    ways = ("without", "with")
    text = render(changed, [], [])
    assert (
        f"\nTraining {ways[training]} evaporation of trails, greedy evaluation {ways[greedy]} it.\n"
    ) in text
    assert f"greedily once, {ways[training]} evaporation, as in training." in text


def test_it_counts_what_the_ants_do(comparison: Comparison) -> None:
    behaviours = comparison.behaviours.copy()
    policy_returns = comparison.policy_returns.copy()
    shown = paper_position(comparison, "absorbing", DYNA_P5)
    behaviours[shown, 4:], policy_returns[shown, 4:] = CIRCLES, 220
    behaviours[shown - 1, :3] = WALKS
    mixed = replace(comparison, behaviours=behaviours, policy_returns=policy_returns)
    text = render(mixed, table2(mixed, 10), assess(mixed))
    table = section(text, "What the ants do")
    absorbing = table[table.index("absorbing") :]
    trained = mixed.measure("return_last50")[shown]
    lines = absorbing[absorbing.index("Dyna-Q (p5)") :].splitlines()
    delivers, walks, circles = (line.split() for line in lines[:3])
    first, rest = f"{trained[:4].mean():.1f}", f"{trained[4:].mean():.1f}"
    names = ["Dyna-Q", "(p5)", "+", "absorbing"]
    assert delivers == [*names, "delivers", "4", first, "45.0", "45.0", "241"]
    assert walks == ["walks", "the", "trail", "0", "-", "-", "-", "3"]
    assert circles[3:] == ["12", rest, "220.0", "45.0", "12"]
    assert row(absorbing, "SARSA")[1:4] == ["absorbing", "delivers", "16"]
    assert "circles with food: with food, at least every fourth step leads nearer" in text
    assert "other:" not in text  # nobody does
    continuing = [line for line in table.splitlines() if " continuing " in line]
    assert [line.split()[-1] for line in continuing] == ["256"] * 4
    assert "Dyna-Q (p5), absorbing: delivers 4, circles with food 12" in text


def test_means_that_no_run_has_are_marked(comparison: Comparison, text: str) -> None:
    assert " +" not in text
    behaviours = comparison.behaviours.copy()
    behaviours[paper_position(comparison, "absorbing", DYNA_P5), 0] = OTHER
    mixed = replace(comparison, behaviours=behaviours)
    marked = render(mixed, table2(mixed, 10), [])
    for start in ("Table 2: return", "Greedy evaluation", "What the ants do"):
        rows = [line for line in section(marked, start).splitlines() if "Dyna-Q (p5)" in line]
        marks = [(line.startswith("Dyna-Q (p5) +"), "absorbing" in line) for line in rows[:2]]
        assert marks == [(False, False), (True, True)], start
    assert marked.count("\n+ the runs do different things, and no run has their mean") == 1


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_terminal_gets_colours(comparison: Comparison, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("COLUMNS", "150")
    terminal = Terminal()
    print_report(comparison, [], assess(comparison, CLAIMS[:1]), file=terminal)
    # As wide as the terminal: the statement takes one line, not three.
    assert CLAIMS[0].statement.removesuffix(".") in terminal.getvalue()
    assert "\x1b[32msupported" in terminal.getvalue()
    assert "\x1b[31mcontradicted" in terminal.getvalue()


def test_a_narrow_terminal_breaks_no_number(
    comparison: Comparison, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "50")
    monkeypatch.setenv("NO_COLOR", "1")
    terminal = Terminal()
    print_report(comparison, table2(comparison, 50), assess(comparison), file=terminal)
    assert max(map(len, terminal.getvalue().splitlines())) >= WIDTH - 5


def test_what_is_no_terminal_gets_the_plain_text(comparison: Comparison) -> None:
    pipe = io.StringIO()
    findings = assess(comparison, CLAIMS[:1])
    print_report(comparison, [], findings, file=pipe)
    assert pipe.getvalue() == render(comparison, [], findings)


def test_a_small_comparison_says_what_is_missing() -> None:
    one = subset(build({"absorbing": unchanged}, variants=[SARSA], rollouts=0), [3], 1, 7)
    text = render(one, table2(one, 10), assess(one))
    assert "last 50" not in text.replace("all episodes or the last 50", "")
    assert "not tested (51): the claims need at least 50 episodes, there are 7" in text
    assert "\n1 configuration, 1 seed, 7 episodes of at most 600 steps, 0 greedy ro" in text
    assert f"absorbing: {len(CLAIMS)} not tested" in text
    assert "Greedy evaluation" not in text
    assert "The paper's claims" not in text
    mean = float(one.returns.mean())
    assert row(text, "SARSA *", after="Table 2")[3:5] == ["47.3", f"{mean:.1f}"]
    assert "nan" not in text


def test_counts_of_what_was_not_tested_add_up() -> None:
    one = subset(build({"absorbing": unchanged}, variants=[SARSA], rollouts=0), [3], 3, 60)
    text = render(one, [], assess(one))
    assert ": no Q-learning at 0.001 / 0.99 / 0.3 / 0.99\n" in text
    counts = [int(count) for count in re.findall(r"^not tested \((\d+)\)", text, re.MULTILINE)]
    assert len(counts) == 4
    assert sum(counts) == len(CLAIMS)
    assert re.search(r"not tested \(\d+\): \d+ other reasons, see claims.md", text)


def halves(world: str, variants: list[Variant], seeds: int) -> Comparison:
    """SARSA lacks the paper's configuration; the fourth row is best on even seeds only."""
    full = build({"absorbing": unchanged}, seeds=seeds, variants=variants, noise=0.0, shared=0.0)
    rows = [n for n, one in enumerate(full.rows) if one.hyperparameters != FIGURE_1]
    cut = subset(full, rows, seeds, 120)
    for start in range(0, len(cut.rows), len(cut.rows) // len(variants)):
        cut.returns[start + 3, ::2] = 80
        cut.returns[start + 3, 1::2] = 30
        cut.greedy_returns[start + 3, ::2] = 99
        cut.greedy_returns[start + 3, 1::2] = 17
    return replace(cut, world=world)


@pytest.mark.parametrize("world", [PAPER_WORLD, "garden.txt"])
def test_learners_beside_the_papers_are_shown_at_their_best_on_other_seeds(world: str) -> None:
    comparison = halves(world, [SARSA, Variant("hysteretic")], 6)
    text = render(comparison, table2(comparison, 100), assess(comparison))
    place = "Table 2" if world == PAPER_WORLD else "Training"
    label = comparison.rows[3].hyperparameters.label
    for name, paper in (("SARSA", ["47.3"]), ("hysteretic", ["-"])):
        cells = row(text, f"{name} *", after=f"{place}: return")
        expected = [*paper, "30.0"] if world == PAPER_WORLD else ["30.0"]
        assert cells[3 : 3 + len(expected)] == expected
        assert row(text, f"{name} *", after="Greedy")[3] == "17.0"
        assert f"{name}, absorbing: {label}" in text
    assert "* best by return on half of the seeds, reported on the other half" in text


def test_one_seed_shows_the_plain_best_as_such() -> None:
    comparison = halves(PAPER_WORLD, [Variant("hysteretic")], 1)
    text = render(comparison, table2(comparison, 100), assess(comparison))
    assert row(text, "hysteretic *", after="Table 2")[3:7] == ["-", "80.0", "80.0", "80.0"]
    assert row(text, "hysteretic *", after="Greedy")[3] == "99.0"
    assert "* best by return on the one seed there is" in text


def test_another_world_is_not_held_against_the_paper(comparison: Comparison) -> None:
    garden = replace(comparison, world="garden.txt")
    text = render(garden, table2(garden, 100), assess(garden), BASELINES, COSTS)
    assert text.splitlines()[0] == "World: garden.txt."
    mentions = [line for line in text.splitlines() if "paper" in line]
    assert mentions == ["The paper's claims: not tested, the claims are about the paper's world."]
    assert "47.3" not in text


def test_the_means_verdict_stands_below_where_it_is_another(comparison: Comparison) -> None:
    first, *others = assess(comparison)
    other = replace(first.finding.by_mean, verdict=Verdict.UNDECIDED)
    equal = replace(first.finding, verdict=Verdict.EQUIVALENT, by_mean=other)
    text = render(comparison, [], [replace(first, finding=equal), *others])
    assert row(text, "3.2", after="In our words")[-2:] == ["equivalent", "contradicted"]
    assert "mean: undecided" in text
    assert "1 equivalent" in text
    assert "equivalent: what the claim says differs, differs by less than matters" in text
    assert "mean: undecided" not in render(comparison, [], [first, *others])


def test_claims_name_their_scope_and_doubtful_sizes(text: str, comparison: Comparison) -> None:
    words = " ".join(text.split())
    assert "The improvement is reliable (all 16)" in words
    assert "(figure 1 configuration)" in words
    assert "claims.md holds effects, intervals" in words
    assert "~" not in text
    first, *others = assess(comparison)
    doubtful = replace(first.finding, note="may be within the margin")
    text = render(comparison, [], [replace(first, finding=doubtful), *others])
    assert row(text, "3.2", after="In our words")[-3:] == ["supported", "~", "contradicted"]
    assert "~ the effect may be too small to matter" in text


@pytest.mark.parametrize("columns", [60, 79, 140])
def test_the_tables_fit_the_terminal(
    comparison: Comparison, columns: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("taichi_ants.analysis.paper.report.WIDTH", columns)
    lines = table2(comparison, 100)
    text = render(comparison, lines, assess(comparison), BASELINES, COSTS)
    assert max(len(line) for line in text.splitlines()) <= columns
    if columns >= 79:  # no number is broken
        span = row(text, "[", after="Table 2")
        assert len(span) == 6  # mean, IQM and best run
        assert row(text, "Dyna-Q (p5)", after="Greedy")[-5:] == ["45.0"] * 2 + ["35.0"] * 2 + [
            "1.00"
        ]
    assert "Q-learning" in text


def test_a_baseline_without_figures_says_why(comparison: Comparison) -> None:
    empty = dict.fromkeys(("return_mean", "steps_mean", "deliveries_mean"))
    endless = BASELINES[0] | empty | {"discount": 1.0, "note": "without bound"}
    text = render(comparison, [], [], [endless])
    assert "optimal policy, discount 1: without bound" in text
