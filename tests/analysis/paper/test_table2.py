"""The paper's table 2 beside ours, and the best of several configurations."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from synthetic_comparison import build, remeasured, subset, unchanged

from taichi_ants.analysis.behaviour import CIRCLES, DELIVERS, OTHER
from taichi_ants.analysis.paper.comparison import Comparison, Variant
from taichi_ants.analysis.paper.published import (
    DYNA_P3,
    FIGURE_1,
    Q_LEARNING,
    SARSA,
    TABLE_2,
    VARIANTS,
)
from taichi_ants.analysis.paper.report import table2_markdown
from taichi_ants.analysis.paper.table2 import (
    BestRun,
    Line,
    best_of,
    example_name,
    examples,
    shown_position,
    summarise,
    table2,
)
from taichi_ants.analysis.statistics import interquartile_mean


def lines_of(comparison: Comparison, draws: int = 50) -> list[Line]:
    return table2(comparison, summarise(comparison), draws)


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    return build({"truncates": unchanged, "terminates": unchanged}, seeds=8, noise=15.0)


def exact_share_at_most(comparison: Comparison, variant: Variant, level: float) -> float:
    """The best of independent runs is at most a level if all are: the product of the shares."""
    rows = comparison.positions("truncates", variant)
    return float((comparison.measures["return_last50"][rows] <= level).mean(axis=1).prod())


@pytest.mark.parametrize("variant", VARIANTS, ids=lambda variant: variant.label)
def test_best_of_16_has_the_distribution_of_the_maximum(
    comparison: Comparison, variant: Variant
) -> None:
    best = best_of(comparison, "truncates", variant, draws=40_000)
    rows = comparison.positions("truncates", variant)
    for level in np.unique(comparison.measures["return_last50"][rows])[-40::3]:
        share = (best["return_last50"] <= level).mean()
        assert share == pytest.approx(exact_share_at_most(comparison, variant, level), abs=0.01)


def test_the_winners_other_figures_belong_to_the_same_run(comparison: Comparison) -> None:
    best = best_of(comparison, "terminates", DYNA_P3, draws=500)
    rows = comparison.positions("terminates", DYNA_P3)
    runs = zip(
        *(
            comparison.measures[name][rows].ravel()
            for name in ("return_last50", "steps_all", "steps_last50", "deliveries_last50")
        ),
        strict=True,
    )
    assert set(zip(*best.values(), strict=True)) <= set(runs)


def test_seeds_of_the_configurations_are_independent() -> None:
    """Two configurations that are good on different seeds: together good with 3/4, not always."""
    two = subset(build({"truncates": unchanged}, seeds=2), [0, 1], 2, 120)
    two.arrays["returns"][...] = 0
    two.arrays["returns"][0, 0] = two.arrays["returns"][1, 1] = 50
    two = remeasured(two)
    best = best_of(two, "truncates", Q_LEARNING, draws=20_000)
    assert (best["return_last50"] == 50).mean() == pytest.approx(0.75, abs=0.01)


def test_percentiles_count_ties_by_half() -> None:
    values = np.array([1.0, 2.0, 2.0, 3.0])
    for figure, percentile in ((2.0, 50), (0.5, 0), (2.5, 75), (9.0, 100)):
        assert BestRun.of(values, figure).paper_percentile == percentile


def test_table2_lines(comparison: Comparison) -> None:
    lines, summary = lines_of(comparison, 2000), summarise(comparison)
    assert [(line.delivery, line.summary.row.variant) for line in lines] == [
        (delivery, variant) for delivery in ("truncates", "terminates") for variant in VARIANTS
    ]
    line = lines[1].columns()
    position = comparison.position("truncates", SARSA, FIGURE_1)
    assert summary[position].columns().items() <= line.items()
    assert line["paper_configuration"]
    assert (line["paper_return"], line["paper_steps"], line["paper_deliveries"]) == (47.3, 73, 1)
    best = best_of(comparison, "truncates", SARSA, draws=2000)
    assert line["best_run_of"] == 16
    assert line["best_run_return_last50_median"] == np.median(best["return_last50"])
    for name in ("steps_all", "steps_last50"):
        assert line[f"best_run_{name}_high"] == pytest.approx(np.percentile(best[name], 97.5))
        assert line[f"best_run_{name}_paper_percentile"] == BestRun.of(best[name], 73.0)[3]
    percentile = line["best_run_return_last50_paper_percentile"]
    assert percentile == BestRun.of(best["return_last50"], 47.3)[3]


def test_what_the_paper_does_not_have_is_nan() -> None:
    full = build({"terminates": unchanged}, variants=[SARSA, Variant("mine", "depth=2")], seeds=3)
    rows = [n for n, row in enumerate(full.rows) if row.variant != SARSA or row.point != FIGURE_1]
    cut = subset(full, rows, 1, 120)
    sarsa, mine = lines = lines_of(cut)
    assert (sarsa.paper_configuration, sarsa.best_run_of) == (False, 15)
    assert sarsa.of_paper("return") == TABLE_2[SARSA].reward
    assert math.isnan(mine.of_paper("return"))
    assert math.isnan(mine.best_run["return_last50"].paper_percentile)
    assert mine.best_run_of == 16
    text = table2_markdown(cut, lines)
    (row, *_) = (line for line in text.splitlines() if line.startswith("| mine (d2) *"))
    assert row.endswith("| - | - |")
    assert (
        f"mine (d2) *, terminates: {cut.rows[shown_position(cut, *cut.learners[1])].point.label}"
        in text
    )
    assert "nan" not in text


def test_another_world_has_nothing_of_the_paper(comparison: Comparison) -> None:
    garden = replace(comparison, world="garden.txt")
    lines = lines_of(garden)
    assert len(lines) == 8
    assert not any(line.paper_configuration for line in lines)
    assert all(math.isnan(line.of_paper("return")) for line in lines)
    assert all(math.isnan(line.best_run["steps_all"].paper_percentile) for line in lines)
    text = table2_markdown(garden, lines)
    assert text.startswith("World: garden.txt.\n")
    assert "| Learner | Delivery | Mean | IQM | Best run |" in text


def test_what_stands_for_a_learner(comparison: Comparison) -> None:
    position = shown_position(comparison, "terminates", SARSA)
    assert comparison.rows[position].point == FIGURE_1
    garden = replace(comparison, world="garden.txt")
    rows = garden.positions("terminates", SARSA)
    best = shown_position(garden, "terminates", SARSA)
    typical = interquartile_mean(garden.measures["return_last50"][rows])
    assert best == rows[int(typical.argmax())]
    lucky = replace(garden, arrays={name: one.copy() for name, one in garden.arrays.items()})
    lucky.arrays["returns"][rows[3], 0] = 4000  # one far run does not choose
    lucky = remeasured(lucky)
    assert shown_position(lucky, "terminates", SARSA) != rows[3] or best == rows[3]


def test_the_markdown_holds_the_numbers(comparison: Comparison) -> None:
    lines = lines_of(comparison, 2000)
    text = table2_markdown(comparison, lines)
    assert text.startswith("World: the paper's.\n128 configurations, 8 seeds")
    assert "Training without evaporation of trails, greedy evaluation with it." in text
    row = next(line for line in text.splitlines() if line.startswith("| SARSA | truncates"))
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    estimator = lines[1].summary.estimates["return_last50"]
    assert cells[:2] == ["SARSA", "truncates"]
    assert cells[2].startswith(f"{estimator.mean:.1f} [")
    assert cells[3].startswith(f"{estimator.iqm:.1f} [")
    assert cells[4].startswith(f"{lines[1].best_run['return_last50'].median:.1f} [")
    assert cells[5] == "47.3"
    assert "**Steps, all episodes**" in text
    assert "**Steps, last 50 episodes**" in text
    short = subset(comparison, range(len(comparison.rows)), 8, 20)
    text = table2_markdown(short, lines_of(short))
    assert "**Steps, all 20 episodes**" in text


def test_a_mean_that_far_runs_have_moved_is_marked() -> None:
    comparison = build({"truncates": unchanged}, seeds=40)
    row = comparison.position("truncates", SARSA, FIGURE_1)
    usual = lines_of(comparison)[1].summary.estimates["return_last50"]
    assert not usual.apart
    comparison = build({"truncates": unchanged}, seeds=40)
    comparison.arrays["returns"][row, 7] = 4000
    comparison = remeasured(comparison)
    lines = lines_of(comparison)
    moved = lines[1].summary.estimates["return_last50"]
    assert moved.apart
    mean = f"{moved.mean:.0f} ! ["
    text = table2_markdown(comparison, lines)
    assert mean in next(row for row in text.splitlines() if row.startswith("| SARSA"))
    assert moved.iqm == pytest.approx(usual.iqm, abs=0.5)


def some_circle(comparison: Comparison) -> Comparison:
    """In the paper's configuration of terminates Dyna-Q (p3) three of eight runs circle."""
    behaviours = comparison.behaviours.copy()
    behaviours[shown_position(comparison, "terminates", DYNA_P3), [1, 2, 5]] = CIRCLES
    return replace(comparison, behaviours=behaviours)


def test_means_of_runs_that_do_different_things_are_marked(comparison: Comparison) -> None:
    circling = some_circle(comparison)
    text = table2_markdown(circling, lines_of(circling))
    assert "+ the runs behave in different ways, so their mean describes none of them" in text
    assert text.count("| Dyna-Q (p3) + | terminates |") == 5
    assert text.count(" + |") == 5
    assert "+ the runs" not in table2_markdown(comparison, lines_of(comparison))


def test_examples_show_each_behaviour_by_its_median_run(comparison: Comparison) -> None:
    changed = some_circle(comparison)
    shown = shown_position(comparison, "terminates", DYNA_P3)
    returns = changed.measures["return_last50"]
    found = examples(changed)
    whats = [(row, int(changed.behaviours[row, run])) for row, run in found]
    expected = []
    for setting in ("truncates", "terminates"):
        for variant in comparison.variants:
            row = shown_position(comparison, setting, variant)
            expected += [(row, DELIVERS)] + [(row, CIRCLES)] * (row == shown)
    assert whats == expected
    for row, run in found:
        alike = changed.behaviours[row] == changed.behaviours[row, run]
        below = (returns[row, alike] < returns[row, run]).sum()
        assert below == (alike.sum() - 1) // 2


def test_a_behaviour_that_no_shown_configuration_has_gets_an_example(
    comparison: Comparison,
) -> None:
    """Of the configuration in which it is most frequent."""
    shown = {shown_position(comparison, *learner) for learner in comparison.learners}
    few, many = [row for row in range(len(comparison.rows)) if row not in shown][:2]
    codes = comparison.behaviours.copy()
    codes[few, 0], codes[many, 1:4] = OTHER, OTHER
    changed = replace(comparison, behaviours=codes)
    usual = examples(comparison)
    *same, (row, run) = examples(changed)
    assert same == usual
    assert row == many
    assert codes[row, run] == OTHER
    assert example_name(changed, row, run).endswith("_other")


def test_examples_of_learners_outside_of_the_paper(comparison: Comparison) -> None:
    few = subset(comparison, comparison.positions("terminates", SARSA)[:2], 3, 120)
    ((row, run),) = examples(few)
    means = few.measures["return_last50"]
    assert row == shown_position(few, "terminates", SARSA)
    assert means[row, run] == np.median(means[row])
