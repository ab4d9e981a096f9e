"""The rows of baselines.csv."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from plain_runs import rollout

from taichi_ants.analysis.bounds import episodes as dynamic_programming
from taichi_ants.analysis.bounds.baselines import (
    BASELINE_COLUMNS,
    GREEDY_SETTING,
    TRAINING_SETTING,
    baseline_rows,
    bound_rows,
    policy_rows,
)
from taichi_ants.errors import AntsError
from taichi_ants.learners.policies import random_policy, trail_follower
from taichi_ants.task import Task
from taichi_ants.worlds.paper import paper
from taichi_ants.worlds.world import World


def evaluate(world: World, q_values: np.ndarray, **options: Any) -> SimpleNamespace:
    """Rollouts of the reference, in the form of the engine's."""
    rollouts = [
        [
            rollout(
                world,
                table,
                seed=seed,
                number=number,
                max_steps=options["max_steps"],
                task=options["task"],
                epsilon=options["epsilon"],
            )
            for number in range(options["rollouts"])
        ]
        for table, seed in zip(q_values, options["seeds"], strict=True)
    ]
    return SimpleNamespace(
        returns=np.array([[r.returns[0] for r in row] for row in rollouts]),
        steps=np.array([[r.steps[0] for r in row] for row in rollouts]),
        deliveries=np.array([[r.deliveries[0] for r in row] for row in rollouts]),
    )


def test_the_rows_of_the_world_of_the_paper() -> None:
    rows = baseline_rows(paper(), evaluate, seeds=[3, 4], rollouts=2)
    assert all(tuple(row) == BASELINE_COLUMNS for row in rows)
    assert all(row["note"] for row in rows)
    figures = [
        (
            row["baseline"],
            row["setting"],
            row["discount"],
            row["return_mean"],
            row["steps_mean"],
            row["deliveries_mean"],
        )
        for row in rows
        if row["baseline"] != "random policy"
    ]
    assert figures == [
        ("shortest delivery", TRAINING_SETTING, None, 45, 34, 1),
        ("largest return", TRAINING_SETTING, None, 491, 600, 1),
        ("optimal policy", TRAINING_SETTING, 0.9, 45, 34, 1),
        ("optimal policy", TRAINING_SETTING, 0.99, 476, 600, 0),
        ("trail follower", TRAINING_SETTING, None, 45, 34, 1),
        ("trail follower", GREEDY_SETTING, None, 45, 34, 1),
    ]
    assert [row["setting"] for row in rows if row["baseline"] == "random policy"] == [
        TRAINING_SETTING,
        GREEDY_SETTING,
    ]


def test_exact_rows_have_no_interval() -> None:
    for row in bound_rows(paper(), [0.9], 600):
        assert row["return_ci_low"] is None
        assert row["return_ci_high"] is None


def test_policies_are_evaluated_in_both_settings_with_one_table_for_each_seed() -> None:
    calls = []

    def record(world: World, q_values: np.ndarray, **options: Any) -> SimpleNamespace:
        calls.append((q_values, options))
        shape = (3, 2)
        # Per seed the means are 1, 2 and 6.
        returns = np.array([[0, 2], [2, 2], [5, 7]])
        return SimpleNamespace(returns=returns, steps=np.full(shape, 9), deliveries=np.eye(3, 2))

    rows = policy_rows(paper(), record, seeds=range(5, 8), rollouts=2, max_steps=77)
    expected = [random_policy()] * 2 + [trail_follower()] * 2
    for (q_values, options), policy, evaporation in zip(
        calls, expected, [False, True, False, True], strict=True
    ):
        np.testing.assert_array_equal(q_values, np.stack([policy] * 3))
        assert options == {
            "rollouts": 2,
            "epsilon": 0.0,
            "max_steps": 77,
            "task": Task(evaporation_in_evaluation=evaporation),
            "seeds": [5, 6, 7],
        }
    for row in rows:
        assert row["return_mean"] == 3
        assert row["steps_mean"] == 9
        assert row["deliveries_mean"] == pytest.approx(1 / 3)
        # Of three seeds the interval is wide, but within their range.
        assert 1 <= row["return_ci_low"] < 3 < row["return_ci_high"] <= 6


def test_settings_say_where_trails_evaporate() -> None:
    calls = []

    def record(*arguments: Any, **options: Any) -> SimpleNamespace:
        calls.append(options["task"].evaporation_in_evaluation)
        return evaluate(*arguments, **options)

    rows = baseline_rows(paper(), record, [0], 1, (0.9,), 40, True, False)
    assert rows[0]["note"] == "exact bounds are known for worlds without evaporation only."
    assert [row["setting"] for row in rows] == [
        "training, evaporation",
        *("training, evaporation", "greedy, no evaporation") * 2,
    ]
    assert calls == [True, False] * 2


def test_one_seed_has_no_interval() -> None:
    rows = policy_rows(paper(), evaluate, seeds=[0], rollouts=1, max_steps=40)
    assert [(row["return_ci_low"], row["return_ci_high"]) for row in rows] == [(None, None)] * 4
    assert rows[2]["return_mean"] == 45


def test_a_discount_of_one_has_no_figures_but_a_reason() -> None:
    rows = bound_rows(paper(), [1.0, 0.5, 1], 600)
    assert [row["discount"] for row in rows] == [None, None, 0.5, 1.0]
    assert rows[-1]["return_mean"] is None
    assert "may grow without bound" in rows[-1]["note"]


def test_a_world_without_a_delivery_says_so() -> None:
    world = World((3, 1, 1), (0, 0, 0), ants=[((1, 0, 0), 0)])
    shortest = bound_rows(world, [], 10)[0]
    assert shortest["return_mean"] is None
    assert shortest["note"] == "no delivery is possible"


def test_a_world_that_is_too_large_leaves_out_the_bounds_only(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(dynamic_programming, "MAX_STATES", 100)
    with pytest.raises(AntsError, match="choose a smaller world"):
        bound_rows(paper(), [], 600)
    first, *others = baseline_rows(paper(), evaluate, [0], rollouts=1, max_steps=40)
    assert first["baseline"] == "exact bounds"
    assert "choose a smaller world" in first["note"]
    assert first["return_mean"] is None
    assert [row["baseline"] for row in others] == ["random policy"] * 2 + ["trail follower"] * 2
