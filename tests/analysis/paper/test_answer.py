"""The answer in a few sentences, on made-up comparisons where it is so and where it is not."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from synthetic_comparison import build, change, level_truth, subset, unchanged

from taichi_ants.analysis.behaviour import CIRCLES, DELIVERS, OTHER, WALKS
from taichi_ants.analysis.paper.answer import HEADLINES, NEEDS, USUAL_SEEDS, answer, temptation
from taichi_ants.analysis.paper.audit import assess
from taichi_ants.analysis.paper.claims import CLAIMS
from taichi_ants.analysis.paper.comparison import Comparison
from taichi_ants.analysis.paper.published import DYNA_P5, Q_LEARNING, SARSA
from taichi_ants.analysis.paper.summary import summarise
from taichi_ants.analysis.paper.table2 import table2
from taichi_ants.commands.compare import parse_arguments

CHOSEN = [claim for claim in CLAIMS if claim.id in HEADLINES]


def told(comparison: Comparison) -> list[str]:
    lines = table2(comparison, summarise(comparison), 50)
    return answer(comparison, lines, assess(comparison, CHOSEN))


@pytest.fixture(scope="module")
def paper() -> Comparison:
    return build({"continuing": unchanged}, seeds=12)


def test_what_the_paper_says_is_said_where_it_is_so(paper: Comparison) -> None:
    returns, steps, shorter, doings = told(paper)
    assert returns.startswith("Q-learning returns most at the configurations of table 2, as the ")
    assert steps.startswith(
        "SARSA needs the fewest steps in the mean of all 16 configurations, as "
    )
    assert shorter.startswith("SARSA's episodes are much shorter than Q-learning's at the config")
    numbers = (
        r", as the paper says: over 12 seeds, with continuing delivery .* is [\d.]+ {}, "
        r"between [\d.]+ and [\d.]+\."
    )
    assert re.search(numbers.format("reward"), returns)
    assert all(re.search(numbers.format("steps"), one) for one in (steps, shorter))
    size = paper.behaviours.size
    assert doings == f"All {size} final policies (64 configurations, 12 seeds each) deliver."


def test_the_opposite_is_said_where_it_is_so() -> None:
    worse = change(Q_LEARNING, late_return=-20)
    slow = change(SARSA, late_steps=90, early_steps=90)
    of_table = "at the configurations of table 2, contrary to the paper: "
    for edit, number, words in (
        (worse, 0, f"Q-learning does not return most {of_table}"),
        (slow, 1, "SARSA does not need the fewest steps in the mean of all 16 configurations, con"),
        (slow, 2, f"SARSA's episodes are not much shorter than Q-learning's {of_table}"),
    ):
        sentence = told(build({"continuing": edit}, seeds=12))[number]
        assert sentence.startswith(words)
        assert float(sentence.split(" is ")[1].split(" ")[0]) < -5


def test_alike_and_open_are_two_things() -> None:
    level = build({"absorbing": unchanged}, seeds=12, truth=level_truth, shared=0.0)
    returns, steps, *_ = told(level)
    assert returns.startswith("Q-learning does not return most at the configurations of table 2, c")
    assert returns.endswith(", too little to matter.")
    assert steps.endswith(", too little to matter.")
    noisy = build({"absorbing": unchanged}, seeds=100, truth=level_truth, noise=200)
    assert told(noisy)[0].startswith(
        "Whether Q-learning returns most at the configurations of table 2, as the paper says, stays"
    )


def test_a_quick_look_says_why_it_leaves_things_open_and_what_tells_more() -> None:
    quick = build({"absorbing": unchanged}, seeds=10, truth=level_truth, noise=200)
    assert re.fullmatch(
        r"10 seeds are too few to tell whether Q-learning returns most at the configurations of "
        r"table 2, as the paper says: over 10 seeds, with absorbing delivery .* is .* reward, "
        r"between .* and .*; compare --seeds 100 tells more\.",
        told(quick)[0],
    )
    assert parse_arguments([]).seeds == USUAL_SEEDS


@pytest.mark.parametrize(("seeds", "who"), [(1, "1 seed is"), (3, "3 seeds are")])
def test_few_seeds_say_that_they_cannot_tell(seeds: int, who: str) -> None:
    few = build({"continuing": unchanged}, seeds, truth=level_truth, noise=200)
    first, second, third = told(few)
    assert first == (
        f"{who} too few to tell whether the paper's claims hold; compare --seeds 100 tells more."
    )
    n = who.rsplit(" ", 1)[0]
    assert second.startswith(f"With {n} at the configurations of the table below, ")
    assert "between" not in first + second
    grid = f"64 configurations, {n} each"
    assert third == f"All {few.behaviours.size} final policies ({grid}) deliver."


def test_what_few_seeds_do_tell_is_told(paper: Comparison) -> None:
    noisy = build({"continuing": unchanged}, seeds=6, truth=level_truth, noise=200)
    both = build({"continuing": unchanged, "absorbing": unchanged}, seeds=6)
    half = len(paper.rows)
    arrays = {
        name: np.concatenate([getattr(both, name)[:half], getattr(noisy, name)])
        for name in ("returns", "steps")
    }
    returns = told(replace(both, **arrays))[0]
    assert re.fullmatch(
        r"With continuing delivery Q-learning returns most at the configurations of table 2, as "
        r"the paper says: over 6 seeds, Q-learning minus .* is .* reward, between .* and .*; with "
        r"absorbing delivery 6 seeds are too few to tell whether Q-learning returns most at the "
        r"configurations of table 2; compare --seeds 100 tells more\.",
        returns,
    )


def test_delivery_settings_that_disagree_are_told_apart(paper: Comparison) -> None:
    edits = {"continuing": unchanged, "absorbing": change(DYNA_P5, late_return=200)}
    returns, steps, *_ = told(build(edits, seeds=12))
    first, second = returns.split("; ")
    assert first.startswith("With continuing delivery Q-learning returns most at the config")
    assert second.startswith(
        "with absorbing delivery Q-learning does not return most at the config"
    )
    assert ", contrary to the paper: over 12 seeds, Q-learning minus Dyna-Q (p5) is -" in second
    assert steps.count("as the paper says") == 1  # both agree
    assert steps.count("delivery") == 1  # even in the numbers
    assert "with continuing and absorbing delivery" in steps


def test_who_does_not_deliver_is_told(paper: Comparison) -> None:
    codes = np.full_like(paper.behaviours, DELIVERS)
    position = paper.positions("continuing", DYNA_P5)[0]
    codes[position, :3], codes[position, 3] = WALKS, CIRCLES
    codes[0, 0] = OTHER
    mixed, grid = replace(paper, behaviours=codes), "64 configurations, 12 seeds each"
    assert told(mixed)[3] == (
        f"Of {codes.size} final policies ({grid}), {codes.size - 5} deliver; 3 walk the trail, "
        "1 circle with food and 1 do something else; of those that do not deliver, 80 % are "
        "Dyna-Q (p5) with continuing delivery."
    )
    none = replace(paper, behaviours=np.full_like(codes, WALKS))
    words = f"Of {codes.size} final policies ({grid}), none deliver; {codes.size} walk"
    assert words in told(none)[3]


def test_without_the_papers_world_the_learners_are_compared(paper: Comparison) -> None:
    garden = replace(paper, world="garden.txt")
    first, second, _ = told(garden)
    assert first == f"The paper's claims are not tested here: {NEEDS}."
    lines = table2(garden, summarise(garden), 50)
    best = max(line["return_last50_iqm"] for line in lines)
    assert f"returns {best:.1f}, the most, and SARSA" in second
    one = subset(garden, [20], 3, 9)
    assert told(one)[1].startswith(
        "With 3 seeds at the configurations of the table below, SARSA with continuing delivery "
    )
    assert told(one)[1].endswith(" steps.")


def test_learners_that_are_missing_leave_a_claim_untested(paper: Comparison) -> None:
    rows = [number for number, row in enumerate(paper.rows) if row.variant != DYNA_P5]
    few = subset(paper, rows, 12, 120)
    first, second, third, _ = told(few)
    assert first == (
        "Whether Q-learning returns most at the configurations of table 2, as the paper says, is "
        f"not tested: {NEEDS}."
    )
    assert "is not tested" in second
    assert third.startswith("SARSA's episodes are much shorter than Q-learning's")


BASELINES = [
    {"baseline": "exact bounds", "discount": None, "return_mean": None, "deliveries_mean": None},
    {"baseline": "shortest delivery", "discount": None, "return_mean": 45.0, "deliveries_mean": 1},
    {"baseline": "optimal policy", "discount": 0.9, "return_mean": 45.0, "deliveries_mean": 1},
    {"baseline": "optimal policy", "discount": 0.99, "return_mean": 476.0, "deliveries_mean": 0},
]


def test_what_pays_more_than_deliveries() -> None:
    assert temptation(BASELINES) == (
        "At discount 0.99 the optimal policy does not deliver either: it returns 476, the shortest "
        "delivery 45."
    )
    assert temptation(BASELINES[:3]) == temptation([]) == ""
