"""The rows of summary.csv and behaviours.csv."""

from __future__ import annotations

import math

import numpy as np
import pytest
from synthetic_comparison import build, remeasured, subset, unchanged

from taichi_ants.analysis.behaviour import CIRCLES, WALKS
from taichi_ants.analysis.paper.published import FIGURE_1, SARSA
from taichi_ants.analysis.paper.table2 import (
    summarise,
    summarise_behaviours,
)
from taichi_ants.analysis.statistics import bootstrap_interval


def test_a_line_by_hand() -> None:
    comparison = build({"terminates": unchanged}, seeds=3, variants=[SARSA], grid=[FIGURE_1])
    comparison.arrays["returns"][0, :, -50:] = np.array([40, 50, 60])[:, None]
    comparison.arrays["steps"][0, :, :70] = 100
    comparison.arrays["steps"][0, :, 70:] = np.array([30, 40, 50])[:, None]
    comparison = remeasured(comparison)
    comparison.behaviours[0, 1] = CIRCLES
    line = summarise(comparison)[0].columns()
    low, high = bootstrap_interval(np.array([[40.0, 50.0, 60.0]]))
    assert dict(list(line.items())[:8]) == {
        "learner": "sarsa",
        "hyperparameters": "",
        "learning_rate": 0.01,
        "discount": 0.9,
        "epsilon": 0.3,
        "epsilon_decay": 0.995,
        "delivery": "terminates",
        "seeds": 3,
    }
    assert (line["return_last50_ci_low"], line["return_last50_ci_high"]) == (low[0], high[0])
    estimates = {name: value for name, value in line.items() if name.endswith(("mean", "iqm"))}
    runs = {name: value for name, value in line.items() if name.startswith("runs_")}
    assert estimates == {
        "return_last50_mean": 50.0,
        "return_last50_iqm": 50.0,
        "steps_last50_mean": 40.0,
        "steps_last50_iqm": 40.0,
        "steps_all_mean": pytest.approx((70 * 100 + 50 * 40) / 120),
        "steps_all_iqm": pytest.approx((70 * 100 + 50 * 40) / 120),
        "deliveries_last50_mean": 1.0,
        "greedy_return_mean": 45.0,
        "greedy_return_iqm": 45.0,
        "greedy_steps_mean": 35.0,
        "greedy_steps_iqm": 35.0,
        "greedy_deliveries_mean": 1.0,
    }
    assert runs == {
        "runs_delivers": 2,
        "runs_walks_the_trail": 0,
        "runs_circles_with_food": 1,
        "runs_other": 0,
    }


def test_a_far_run_moves_the_mean_and_not_the_interquartile_mean() -> None:
    comparison = build({"terminates": unchanged}, seeds=16, variants=[SARSA], grid=[FIGURE_1])
    comparison.arrays["returns"][0, :, -50:] = np.array([*range(36, 51), 436])[:, None]
    comparison = remeasured(comparison)
    line = summarise(comparison)[0].columns()
    assert (line["return_last50_mean"], line["return_last50_iqm"]) == (67.5625, 43.5)
    assert line["return_last50_iqm_ci_high"] < 50


def test_one_line_per_row_in_their_order() -> None:
    comparison = build({"truncates": unchanged, "terminates": unchanged}, seeds=4)
    lines = [one.columns() for one in summarise(comparison)]
    assert [line["delivery"] for line in lines] == [row.delivery for row in comparison.rows]
    means = comparison.measures["return_last50"].mean(axis=1)
    np.testing.assert_allclose([line["return_last50_mean"] for line in lines], means)
    assert all(
        line["return_last50_ci_low"] < line["return_last50_mean"] < line["return_last50_ci_high"]
        for line in lines
    )


def test_one_seed_has_means_only() -> None:
    comparison = subset(build({"truncates": unchanged}), [4], 1, 10)
    line = summarise(comparison)[0].columns()
    missing = {name for name, value in line.items() if value != value}
    assert missing == {name for name in line if name.endswith(("ci_low", "ci_high"))}
    assert line["return_last50_iqm"] == line["return_last50_mean"]
    assert math.isfinite(line["return_last50_mean"])


def test_runs_that_act_alike_have_means_of_their_own() -> None:
    comparison = build({"terminates": unchanged}, seeds=5, variants=[SARSA], grid=[FIGURE_1])
    comparison.behaviours[0, [1, 4]] = CIRCLES
    comparison.policy_returns[0] = [45, 210, 45, 45, 220]
    comparison.arrays["returns"][0, :, -50:] = np.array([40, 150, 41, 45, 160])[:, None]
    comparison.arrays["greedy_steps"][0, 4] = 600
    comparison = remeasured(comparison)
    delivering, circling = (one.columns() for one in summarise_behaviours(comparison))
    assert list(delivering) == list(circling)
    assert {**delivering, **circling} == {
        "learner": "sarsa",
        "hyperparameters": "",
        "learning_rate": 0.01,
        "discount": 0.9,
        "epsilon": 0.3,
        "epsilon_decay": 0.995,
        "delivery": "terminates",
        "behaviour": "circles with food",
        "runs": 2,
        "return_last50_mean": 155.0,
        "policy_return_mean": 215.0,
        "greedy_return_mean": 45.0,
        "greedy_steps_mean": (35 + 600) / 2,
        "greedy_deliveries_mean": 1.0,
    }
    assert (delivering["behaviour"], delivering["runs"]) == ("delivers", 3)
    assert delivering["return_last50_mean"] == 42.0


def test_each_run_is_counted_once() -> None:
    comparison = build({"truncates": unchanged, "terminates": unchanged}, seeds=4)
    comparison.behaviours[::3, 2:] = WALKS
    runs = sum(one.runs for one in summarise_behaviours(comparison))
    assert runs == comparison.behaviours.size
    lines = [one.columns() for one in summarise(comparison)]
    assert [line["runs_walks_the_trail"] for line in lines] == [2, 0, 0] * 42 + [2, 0]
    names = [name for name in lines[0] if name.startswith("runs_")]
    assert all(sum(line[name] for name in names) == line["seeds"] for line in lines)
