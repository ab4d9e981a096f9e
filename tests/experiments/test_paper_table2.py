"""The paper's table 2 beside ours, and the best of several configurations."""

from dataclasses import replace

import numpy as np
import pytest
from paper.comparison import DYNA_P3, FIGURE_1, SARSA, VARIANTS, Comparison, Variant
from paper.table2 import (
    Line,
    best_of,
    best_run,
    example_name,
    examples,
    shown_position,
    summarise,
    table2,
)
from synthetic_comparison import build, remeasured, unchanged

from taichi_ants.analysis.behaviour import CIRCLES, DELIVERS, OTHER
from taichi_ants.analysis.statistics import bootstrap_interval


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
        assert (
            line[f"best_run_{name}_paper_percentile"]
            == best_run(best[name], 73.0)["paper_percentile"]
        )
    percentile = line["best_run_return_last50_paper_percentile"]
    assert percentile == best_run(best["return_last50"], 47.3)["paper_percentile"]


def some_circle(comparison: Comparison) -> Comparison:
    """In the paper's configuration of terminates Dyna-Q (p3) three of eight runs circle."""
    behaviours = comparison.behaviours.copy()
    behaviours[shown_position(comparison, "terminates", DYNA_P3), [1, 2, 5]] = CIRCLES
    return replace(comparison, behaviours=behaviours)


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


def test_a_line_by_hand() -> None:
    comparison = build({"terminates": unchanged}, seeds=3, variants=[SARSA], grid=[FIGURE_1])
    comparison.arrays["returns"][0, :, -50:] = np.array([40, 50, 60])[:, None]
    comparison.arrays["steps"][0, :, :70] = 100
    comparison.arrays["steps"][0, :, 70:] = np.array([30, 40, 50])[:, None]
    comparison = remeasured(comparison)
    comparison.behaviours[0, 1] = CIRCLES
    line = summarise(comparison)[0].columns()
    low, high = bootstrap_interval(np.array([[40.0, 50.0, 60.0]]))
    assert [*line.values()][:8] == ["sarsa", "", 0.01, 0.9, 0.3, 0.995, "terminates", 3]
    assert (line["return_last50_ci_low"], line["return_last50_ci_high"]) == (low[0], high[0])
    estimates = {name: value for name, value in line.items() if name.endswith(("mean", "iqm"))}
    runs = {name: value for name, value in line.items() if name.startswith("runs_")}
    names = ("return_last50", "steps_last50", "steps_all", "greedy_return", "greedy_steps")
    values = dict(zip(names, (50, 40, (70 * 100 + 50 * 40) / 120, 45, 35), strict=True))
    expected = {f"{name}_{kind}": values[name] for name in names for kind in ("mean", "iqm")}
    expected |= {"deliveries_last50_mean": 1, "greedy_deliveries_mean": 1}
    assert estimates == pytest.approx(expected)
    assert [*runs.values()] == [2, 0, 1, 0]  # that deliver, walk the trail, circle, do others
