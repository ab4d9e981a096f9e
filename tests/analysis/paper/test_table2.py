"""The paper's table 2 beside ours, and the best of several configurations."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from synthetic_comparison import build, change, subset, unchanged

from taichi_ants.analysis.behaviour import CIRCLES, DELIVERS, MIXED, OTHER, WALKS
from taichi_ants.analysis.paper.best_of import (
    Chosen,
    best_of,
    choice,
    examples,
    held_out,
    paper_position,
    percentile_of,
)
from taichi_ants.analysis.paper.comparison import Comparison, Variant
from taichi_ants.analysis.paper.published import (
    DYNA_P3,
    FIGURE_1,
    Q_LEARNING,
    SARSA,
    TABLE_2,
    VARIANTS,
)
from taichi_ants.analysis.paper.table2 import apart, table2, table2_markdown
from taichi_ants.analysis.statistics import interquartile_mean


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    return build({"continuing": unchanged, "absorbing": unchanged}, seeds=8, noise=15.0)


def exact_share_at_most(comparison: Comparison, variant: Variant, level: float) -> float:
    """The best of independent runs is at most a level if all are: the product of the shares."""
    rows = comparison.positions("continuing", variant)
    return float((comparison.measure("return_last50")[rows] <= level).mean(axis=1).prod())


@pytest.mark.parametrize("variant", VARIANTS, ids=lambda variant: variant.label)
def test_best_of_16_has_the_distribution_of_the_maximum(
    comparison: Comparison, variant: Variant
) -> None:
    best = best_of(comparison, "continuing", variant, draws=40_000)
    rows = comparison.positions("continuing", variant)
    for level in np.unique(comparison.measure("return_last50")[rows])[-40::3]:
        share = (best["return"] <= level).mean()
        assert share == pytest.approx(exact_share_at_most(comparison, variant, level), abs=0.01)


def test_the_winners_other_figures_belong_to_the_same_run(comparison: Comparison) -> None:
    best = best_of(comparison, "absorbing", DYNA_P3, draws=500)
    rows = comparison.positions("absorbing", DYNA_P3)
    runs = zip(
        *(
            comparison.measure(name)[rows].ravel()
            for name in ("return_last50", "steps_all", "steps_last50", "deliveries_last50")
        ),
        strict=True,
    )
    assert set(zip(*best.values(), strict=True)) <= set(runs)


def test_seeds_of_the_configurations_are_independent() -> None:
    """Two configurations that are good on different seeds: together good with 3/4, not always."""
    two = subset(build({"continuing": unchanged}, seeds=2), [0, 1], 2, 120)
    two.returns[...] = 0
    two.returns[0, 0] = two.returns[1, 1] = 50
    best = best_of(two, "continuing", Q_LEARNING, draws=20_000)
    assert (best["return"] == 50).mean() == pytest.approx(0.75, abs=0.01)


def test_percentiles_count_ties_by_half() -> None:
    values = np.array([1.0, 2.0, 2.0, 3.0])
    assert percentile_of(2.0, values) == 50
    assert percentile_of(0.5, values) == 0
    assert percentile_of(2.5, values) == 75
    assert percentile_of(9.0, values) == 100


def test_held_out_choice(comparison: Comparison) -> None:
    rows = comparison.positions("continuing", SARSA)
    chosen = held_out(comparison, rows)
    choosing = comparison.measure("return_last50")[rows, ::2].mean(axis=1)
    assert chosen.position == rows[int(choosing.argmax())]
    assert comparison.rows[chosen.position].hyperparameters == chosen.hyperparameters
    assert comparison.seeds[chosen.seeds] == (1, 3, 5, 7)
    assert held_out(comparison, []) is None


def test_table2_lines(comparison: Comparison) -> None:
    lines = table2(comparison, draws=2000)
    assert [(line["delivery"], line["learner"], line["planning_steps"]) for line in lines] == [
        (delivery, *variant) for delivery in ("continuing", "absorbing") for variant in VARIANTS
    ]
    line = lines[1]
    position = comparison.position("continuing", SARSA, FIGURE_1)
    assert line["configuration"] == "0.01 / 0.9 / 0.3 / 0.995"
    assert (line["paper_return"], line["paper_steps"], line["paper_deliveries"]) == (47.3, 73, 1)
    assert line["seeds"] == 8
    for stem, measure in (
        ("same_return", "return_last50"),
        ("same_steps_all", "steps_all"),
        ("same_steps_last50", "steps_last50"),
        ("same_deliveries", "deliveries_last50"),
    ):
        mean = comparison.measure(measure)[position].mean()
        assert line[f"{stem}_mean"] == pytest.approx(mean)
        assert line[f"{stem}_ci_low"] <= mean <= line[f"{stem}_ci_high"]
        if stem != "same_deliveries":
            typical = interquartile_mean(comparison.measure(measure)[[position]])[0]
            assert line[f"{stem}_iqm"] == pytest.approx(typical)
            assert line[f"{stem}_iqm_ci_low"] <= typical <= line[f"{stem}_iqm_ci_high"]
    assert "same_deliveries_iqm" not in line
    best = best_of(comparison, "continuing", SARSA, draws=2000)
    assert line["best_run_of"] == 16
    assert line["best_run_return_median"] == np.median(best["return"])
    assert line["best_run_steps_all_high"] == pytest.approx(np.percentile(best["steps_all"], 97.5))
    last = np.percentile(best["steps_last50"], 97.5)
    assert line["best_run_steps_last50_high"] == pytest.approx(last)
    assert line["best_run_return_paper_percentile"] == percentile_of(47.3, best["return"])
    chosen = held_out(comparison, comparison.positions("continuing", SARSA))
    assert line["held_out_configuration"] == chosen.hyperparameters.label
    assert line["held_out_seeds"] == 4
    assert line["held_out_return_mean"] == pytest.approx(
        comparison.measure("return_last50")[chosen.position, 1::2].mean()
    )


def test_choosing_by_luck_is_paid_for_on_the_other_seeds() -> None:
    """With equal configurations the best run is above the mean, the held-out one is not."""
    noisy = build({"continuing": unchanged}, seeds=40, variants=[SARSA], noise=0.0, shared=0.0)
    luck = np.random.default_rng(0).normal(45, 10, size=(16, 40)).round().astype(int)
    noisy.returns[...] = luck[..., None]
    line = table2(noisy, draws=2000)[1]
    assert line["best_run_return_median"] > 55
    assert line["held_out_return_mean"] == pytest.approx(45, abs=4)


def test_what_is_missing_is_nan() -> None:
    full = build({"absorbing": unchanged}, variants=[SARSA, Variant("mine", 2)], seeds=3)
    rows = [
        number
        for number, row in enumerate(full.rows)
        if row.learner == "mine" or row.hyperparameters != FIGURE_1
    ]
    cut = subset(full, rows, 1, 120)
    lines = table2(cut, draws=100)
    by_name = {line["learner"]: line for line in lines if line["planning_steps"] in (0, 2)}
    sarsa, mine, absent = by_name["sarsa"], by_name["mine"], by_name["q_learning"]
    assert (sarsa["seeds"], sarsa["best_run_of"], sarsa["held_out_seeds"]) == (0, 15, 0)
    assert math.isnan(sarsa["same_return_mean"])
    assert math.isnan(sarsa["held_out_return_mean"])
    assert sarsa["best_run_return_median"] > 0
    for name in ("low", "high", "paper_percentile"):  # one seed: there is nothing to draw from
        assert math.isnan(sarsa[f"best_run_return_{name}"])
    assert math.isnan(mine["paper_return"])
    assert math.isnan(mine["best_run_return_paper_percentile"])
    assert mine["best_run_of"] == 16
    assert absent["best_run_of"] == 0
    assert math.isnan(absent["best_run_return_median"])
    assert absent["paper_return"] == TABLE_2[Q_LEARNING].return_last50
    text = table2_markdown(lines, cut)
    assert "| mine (p2) * | absorbing | - |" in text
    assert "| Q-learning |" not in text
    assert "nan" not in text


def test_another_world_has_nothing_of_the_paper(comparison: Comparison) -> None:
    garden = replace(comparison, world="garden.txt")
    lines = table2(garden, draws=200)
    assert len(lines) == 8
    assert {line["configuration"] for line in lines} == {""}
    assert {line["seeds"] for line in lines} == {0}
    assert all(math.isnan(line["paper_return"]) for line in lines)
    assert all(math.isnan(line["best_run_steps_all_paper_percentile"]) for line in lines)
    assert not any(math.isnan(line["held_out_return_mean"]) for line in lines)
    text = table2_markdown(lines, garden)
    assert text.startswith("World: garden.txt.\n")
    assert "paper" not in text
    one = subset(replace(comparison, world="garden.txt"), [16], 2, 120)
    assert [line["learner"] for line in table2(replace(one, world="x"), 10)] == ["sarsa"]


def test_what_stands_for_a_learner(comparison: Comparison) -> None:
    chosen = choice(comparison, "absorbing", SARSA)
    assert (chosen.why, chosen.hyperparameters) == (Chosen.PAPER, FIGURE_1)
    garden = replace(comparison, world="garden.txt")
    best = held_out(garden, garden.positions("absorbing", SARSA))
    chosen = choice(garden, "absorbing", SARSA)
    assert (chosen.why, chosen.position) == (Chosen.HELD_OUT, best.position)
    single = replace(subset(comparison, range(128), 1, 120), world="garden.txt")
    rows = single.positions("absorbing", SARSA)
    chosen = choice(single, "absorbing", SARSA)
    assert chosen.why is Chosen.BEST
    assert chosen.position == max(rows, key=lambda row: single.measure("return_last50")[row, 0])
    assert choice(comparison, "absorbing", Variant("mine")) is None


def test_the_markdown_holds_the_numbers(comparison: Comparison) -> None:
    lines = table2(comparison, draws=2000)
    text = table2_markdown(lines, comparison)
    assert text.startswith("World: the paper's.\n\nTraining without evaporation of trails, greedy ")
    assert "mean, IQM: over 8 seeds, at the paper's configuration" in text
    row = next(line for line in text.splitlines() if line.startswith("| SARSA | continuing"))
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    line = lines[1]
    assert cells[:3] == ["SARSA", "continuing", "47.3"]
    assert cells[3].startswith(f"{line['same_return_mean']:.1f} [")
    assert cells[4].startswith(f"{line['same_return_iqm']:.1f} [")
    assert cells[5].startswith(f"{line['best_run_return_median']:.1f} [")
    held_out = text[text.index("reported on the other half") :]
    row = next(line for line in held_out.splitlines() if line.startswith("| SARSA | continuing"))
    assert f"| {line['held_out_configuration']} | {line['held_out_return_mean']:.1f} [" in row
    widths = {len(row.split("|")) - 2 for row in text.splitlines() if row.startswith("|")}
    assert widths == {7, 10}


def test_both_readings_of_steps_are_labelled_and_the_nearer_one_is_named() -> None:
    """All episodes: 100 at first, then fewer; the paper's 73 to 138 lie nearer to their mean."""
    comparison = build({"continuing": change(early_steps=100, late_steps=-30)}, seeds=8)
    text = table2_markdown(table2(comparison, draws=50), comparison)
    assert "**Table 2: steps, all episodes**" in text
    assert "**Table 2: steps, last 50 episodes**" in text
    assert "ours come nearer over all\n" in text.replace("  \n", "\n")
    late = build({"continuing": change(early_steps=500, late_steps=30)}, seeds=8)
    text = table2_markdown(table2(late, draws=50), late)
    assert "ours come nearer over the last 50\n" in text.replace("  \n", "\n")
    short = subset(comparison, range(len(comparison.rows)), 8, 20)
    text = table2_markdown(table2(short, draws=50), short)
    assert "last 50 episodes" not in text
    assert "**Table 2: steps, all 20 episodes**" in text


def test_a_mean_that_far_runs_have_moved_is_marked() -> None:
    comparison = build({"continuing": unchanged}, seeds=40)
    row = comparison.position("continuing", SARSA, FIGURE_1)
    line = table2(comparison, draws=50)[1]
    assert not apart(line, "same_return_")
    comparison = build({"continuing": unchanged}, seeds=40)
    comparison.returns[row, 7] = 4000
    lines = table2(comparison, draws=50)
    assert apart(lines[1], "same_return_")
    text = table2_markdown(lines, comparison)
    mean = f"{lines[1]['same_return_mean']:.0f} ! ["
    assert mean in next(row for row in text.splitlines() if row.startswith("| SARSA"))
    assert lines[1]["same_return_iqm"] == pytest.approx(line["same_return_iqm"], abs=0.5)


def some_circle(comparison: Comparison) -> Comparison:
    """In the paper's configuration of absorbing Dyna-Q (p3) three of eight runs circle."""
    behaviours = comparison.behaviours.copy()
    behaviours[paper_position(comparison, "absorbing", DYNA_P3), [1, 2, 5]] = CIRCLES
    return replace(comparison, behaviours=behaviours)


def test_means_of_runs_that_do_different_things_are_marked(comparison: Comparison) -> None:
    circling = some_circle(comparison)
    lines = table2(circling, draws=10)
    mixed = [line for line in lines if line["same_behaviours"]]
    assert [(line["planning_steps"], line["delivery"]) for line in mixed] == [(3, "absorbing")]
    assert mixed[0]["same_behaviours"] == "delivers 5, circles with food 3"
    text = table2_markdown(lines, circling)
    assert f"+ {MIXED}:" in text
    assert "Dyna-Q (p3), absorbing: delivers 5, circles with food 3\n" in text
    assert text.count("| Dyna-Q (p3) + | absorbing |") == 4
    assert MIXED not in table2_markdown(table2(comparison, draws=10), comparison)


def test_examples_show_each_behaviour_by_its_median_run(comparison: Comparison) -> None:
    changed = some_circle(comparison)
    shown = paper_position(comparison, "absorbing", DYNA_P3)
    elsewhere, more = comparison.positions("absorbing", Q_LEARNING)[:2]
    assert paper_position(comparison, "absorbing", Q_LEARNING) not in (elsewhere, more)
    changed.behaviours[elsewhere, 3] = WALKS
    changed.behaviours[more, [0, 3, 4]] = WALKS
    changed.behaviours[elsewhere, 6] = OTHER
    changed.behaviours[more, 7] = CIRCLES  # shown already
    returns = changed.measure("return_last50")
    found = examples(changed)
    whats = [(row, int(changed.behaviours[row, run])) for row, run in found]
    expected = []
    for setting in ("continuing", "absorbing"):
        for variant in comparison.variants:
            row = paper_position(comparison, setting, variant)
            expected += [(row, DELIVERS)] + [(row, CIRCLES)] * (row == shown)
    assert whats == [*expected, (more, WALKS), (elsewhere, OTHER)]
    for row, run in found:
        alike = changed.behaviours[row] == changed.behaviours[row, run]
        below = (returns[row, alike] < returns[row, run]).sum()
        assert below == (alike.sum() - 1) // 2


def test_examples_of_learners_outside_of_the_paper(comparison: Comparison) -> None:
    few = subset(comparison, comparison.positions("absorbing", SARSA)[:2], 3, 120)
    assert paper_position(few, "absorbing", SARSA) is None
    ((row, run),) = examples(few)
    means = few.measure("return_last50")
    assert row == means.mean(axis=1).argmax()
    assert means[row, run] == np.median(means[row])
