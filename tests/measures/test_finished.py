"""Measures of finished runs, by hand: those of lone ants, and of the evaluation of a colony."""

import numpy as np
import pytest

from taichi_ants.measures.finished import LONE, Run, values_of


def single_run(returns: list, steps: list, deliveries: list) -> dict[str, np.ndarray]:
    """One configuration, one seed, two rollouts."""
    arrays = {
        **{"returns": returns, "steps": steps, "deliveries": deliveries},
        **{"greedy_returns": [45, 45], "greedy_steps": [34, 36], "greedy_deliveries": [1, 0]},
    }
    outcome = {name: np.array(array)[None, None] for name, array in arrays.items()}
    return values_of(Run.of_lone_ant(outcome))


def measured(run: dict[str, np.ndarray], name: str) -> float:
    return float(run[name][0, 0])


def test_measures_by_hand() -> None:
    returns = [0] * 50 + [10, 20] * 25 + [30] * 50
    steps = [600] * 50 + [100, 50] * 25 + [34, 36] * 25
    deliveries = [0] * 50 + [1, 1, 1, 0, 1] * 10 + [1] * 50
    run = single_run(returns, steps, deliveries)
    # Of the length, changes are 500 once, 50 49 times, 16 once (50 to 34), 2 49 times.
    squares = 500**2 + 49 * 50**2 + 16**2 + 49 * 2**2
    expected = {
        **{"return_last50": 30, "return_first50": 0, "steps_last50": 35, "steps_first50": 600},
        **{"steps_all": (600 + 75 + 35) / 3, "deliveries_last50": 1, "deliveries_second50": 0.8},
        **{"shortest_episode": 34, "improved": 1, "greedy_return": 45, "greedy_steps": 35},
        **{"greedy_deliveries": 0.5, "greedy_repeats": 0},
        **{"return_fluctuation_first50": 0, "return_fluctuation_last50": 0},
        # Changes of the return: 10 once, then 10 49 times, 10 once; 149 changes in all.
        "return_fluctuation_all": np.sqrt(51 * 100 / 149 / 2),
        "steps_fluctuation_all": np.sqrt(squares / 149 / 2),
    }
    assert {name: measured(run, name) for name in expected} == pytest.approx(expected)


def test_short_runs_use_all_episodes_or_say_that_they_cannot() -> None:
    run = single_run([1, 2, 6], [3, 4, 5], [0, 0, 1])
    assert measured(run, "return_last50") == 3
    assert measured(run, "deliveries_last50") == pytest.approx(1 / 3)
    for name, measure in LONE.items():
        assert np.isnan(measured(run, name)) == (measure.episodes > 3), name
    assert np.isnan(measured(run, "steps_first50"))
    assert np.isnan(measured(single_run([1], [1], [0]), "return_fluctuation_all"))


# Two seeds, three episodes of 500 ticks, four ants; as small as blocks keep them.
OUTCOME = {
    "deliveries": np.array([[10, 20, 0], [0, 0, 0]], np.int8),
    "first_delivery": np.array([[40, 60, -1], [-1, -1, -1]], np.int8),
    "moves": np.array([[100, 200, 100], [0, 0, 0]], np.uint8),
    "blocked": np.array([[10, 10, 20], [0, 0, 0]], np.uint8),
    "returns": np.array([[600, 900, -300], [-30, -30, -60]], np.int16),
}


@pytest.mark.parametrize(
    ("measure", "expected"),
    [
        ("deliveries", [20, 0]),
        ("per_ant", [5, 0]),
        # Episodes without a delivery count with all their ticks.
        ("first_delivery", [200, 500]),
        ("no_delivery_rate", [1 / 3, 1]),
        # Of all moves, not the mean of shares; without a move there is none.
        ("blocked", [0.1, np.nan]),
        ("reward", [200, -20]),
    ],
)
def test_measures_of_a_colony(measure: str, expected: list[float]) -> None:
    np.testing.assert_allclose(values_of(Run.of_colony(OUTCOME, 4, 500))[measure], expected)
