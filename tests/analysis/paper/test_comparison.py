"""The data of the analysis, and what is computed from each run."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from synthetic_comparison import build, subset, unchanged

from taichi_ants.analysis.paper.comparison import Row, Variant
from taichi_ants.analysis.paper.measures import MEASURES, measures_of_runs
from taichi_ants.analysis.paper.published import (
    DYNA_P3,
    FIGURE_1,
    GRID,
    Q_LEARNING,
    SARSA,
    TABLE_2,
    VARIANTS,
)
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.task import Task

ROW = Row("truncates", SARSA, FIGURE_1)


def test_hyperparameters_with_the_same_first_letter_are_named_in_full() -> None:
    assert DYNA_P3.label == "Dyna-Q (p3)"
    alike = Variant("sarsa_lambda", "trace_decay=0.9 trace_length=32")
    assert alike.label == "SARSA(lambda) (trace_decay=0.9, trace_length=32)"
    assert Variant("mine", "depth=2 alpha=0.1").label == "mine (d2, a0.1)"


def single_run(
    returns: list[int], steps: list[int], deliveries: list[int]
) -> dict[str, np.ndarray]:
    """One configuration, one seed, two rollouts."""
    arrays = {
        "returns": returns,
        "steps": steps,
        "deliveries": deliveries,
        "greedy_returns": [45, 45],
        "greedy_steps": [34, 36],
        "greedy_deliveries": [1, 0],
    }
    return measures_of_runs({name: np.array(one)[None, None] for name, one in arrays.items()})


def measured(run: dict[str, np.ndarray], name: str) -> float:
    return float(run[name][0, 0])


def test_measures_by_hand() -> None:
    returns = [0] * 50 + [10, 20] * 25 + [30] * 50
    steps = [600] * 50 + [100, 50] * 25 + [34, 36] * 25
    deliveries = [0] * 50 + [1, 1, 1, 0, 1] * 10 + [1] * 50
    run = single_run(returns, steps, deliveries)
    assert measured(run, "return_last50") == 30
    assert measured(run, "return_first50") == 0
    assert measured(run, "steps_last50") == 35
    assert measured(run, "steps_first50") == 600
    assert measured(run, "steps_all") == pytest.approx((600 + 75 + 35) / 3)
    assert measured(run, "deliveries_last50") == 1
    assert measured(run, "deliveries_second50") == 0.8
    assert measured(run, "shortest_episode") == 34
    assert measured(run, "improved") == 1
    assert measured(run, "return_fluctuation_first50") == 0
    assert measured(run, "return_fluctuation_last50") == 0
    # Changes of the return: 10 once, then 10 49 times, 10 once; 149 changes in all.
    assert measured(run, "return_fluctuation_all") == pytest.approx(np.sqrt(51 * 100 / 149 / 2))
    # Of the length: 500 once, 50 49 times, 16 once (50 to 34), 2 49 times.
    squares = 500**2 + 49 * 50**2 + 16**2 + 49 * 2**2
    assert measured(run, "steps_fluctuation_all") == pytest.approx(np.sqrt(squares / 149 / 2))
    assert measured(run, "greedy_return") == 45
    assert measured(run, "greedy_steps") == 35
    assert measured(run, "greedy_deliveries") == 0.5
    assert measured(run, "greedy_repeats") == 0


def test_independent_episodes_fluctuate_by_their_standard_deviation() -> None:
    returns = np.random.default_rng(0).normal(0, 20, size=100_000).round().astype(int)
    run = single_run(returns.tolist(), [1] * 100_000, [1] * 100_000)
    assert measured(run, "return_fluctuation_all") == pytest.approx(20, rel=0.01)


def test_short_runs_use_all_episodes_or_say_that_they_cannot() -> None:
    run = single_run([1, 2, 6], [3, 4, 5], [0, 0, 1])
    assert measured(run, "return_last50") == 3
    assert measured(run, "deliveries_last50") == pytest.approx(1 / 3)
    for name, measure in MEASURES.items():
        assert np.isnan(measured(run, name)) == (measure.episodes > 3), name
    assert np.isnan(measured(run, "steps_first50"))
    assert np.isnan(measured(single_run([1], [1], [0]), "return_fluctuation_all"))


def test_measures_have_one_number_per_run() -> None:
    comparison = build({"truncates": unchanged}, seeds=5, variants=[SARSA])
    for name in MEASURES:
        values = comparison.measures[name]
        assert values.shape == (16, 5), name
        assert np.isfinite(values).all(), name


def test_rows_are_found_by_what_they_are() -> None:
    comparison = build({"terminates": unchanged, "truncates": unchanged}, seeds=2)
    assert comparison.delivery_settings == ("terminates", "truncates")
    assert comparison.variants == VARIANTS
    position = comparison.position("terminates", DYNA_P3, FIGURE_1)
    assert comparison.rows[position] == Row("terminates", DYNA_P3, FIGURE_1)
    assert comparison.positions("terminates", SARSA) == list(range(16, 32))
    assert (
        comparison.position("terminates", Variant("dyna_q", "planning_steps=4"), FIGURE_1) is None
    )
    assert comparison.position("elsewhere", DYNA_P3, FIGURE_1) is None
    assert comparison.episodes == 120
    few = subset(comparison, [0, 1, 16, 64], 2, 120)
    assert few.learners == [
        *(("terminates", Q_LEARNING), ("terminates", SARSA), ("truncates", Q_LEARNING)),
    ]


def test_a_training_configuration_becomes_a_row() -> None:
    config = TrainingConfig("dyna_q", 0.01, 0.9, 0.3, 0.995, planning_steps=3)
    row = Row.of(Task(), config)
    assert row == Row("terminates", DYNA_P3, FIGURE_1)
    assert (row.variant.label, row.point.label) == ("Dyna-Q (p3)", "0.01 / 0.9 / 0.3 / 0.995")
    assert row.columns() == {
        **{"learner": "dyna_q", "hyperparameters": "planning_steps=3"},
        **FIGURE_1._asdict(),
        "delivery": "terminates",
    }


def test_any_hyperparameters_of_a_learner_tell_it_apart() -> None:
    numbers = (0.01, 0.9, 0.3, 0.995)
    config = TrainingConfig("mine", *numbers, hyperparameters={"width": 0.5, "depth": 7})
    variant = Row.of(Task(), config).variant
    assert variant == Variant("mine", "depth=7 width=0.5")
    assert variant.label == "mine (d7, w0.5)"


def test_the_papers_numbers_fit_together() -> None:
    assert len(set(GRID)) == 16
    assert set(TABLE_2) == set(VARIANTS)
    assert all(row.point in GRID for row in TABLE_2.values())
    assert FIGURE_1 in GRID


def test_importing_the_analysis_is_light() -> None:
    """Neither Taichi nor what only figures, intervals or the terminal need is imported."""
    code = """
import importlib, pkgutil, sys, taichi_ants.analysis as analysis
for module in pkgutil.walk_packages(analysis.__path__, "taichi_ants.analysis."):
    importlib.import_module(module.name)
assert "taichi_ants.analysis.paper.claims" in sys.modules
print(*{"taichi", "matplotlib", "scipy", "rich"}.intersection(sys.modules))
"""
    found = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout
    assert found.split() == []
