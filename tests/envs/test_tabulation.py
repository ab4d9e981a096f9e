"""Policies that are functions, as tables."""

import numpy as np
import pytest

from taichi_ants import AntsError, tabulate
from taichi_ants.envs.formats import FORMATS, ShownObservations
from taichi_ants.task import observations


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("observation", ["paper", "ants"])
def test_a_function_gets_each_state_as_environments_show_it(observation: str, form: str) -> None:
    shown = ShownObservations(observations.get(observation), form)
    values = np.random.default_rng(0).normal(size=(shown.observation.n_states, 5))

    def function(seen: np.ndarray) -> np.ndarray:
        assert seen.dtype == shown.space.dtype
        assert all(one in shown.space for one in seen)
        assert np.array_equal(seen, shown.show(np.arange(len(values))))
        return values

    table = tabulate(function, observation, form)
    assert table.dtype == np.float32
    assert (table == values.astype(np.float32)).all()


@pytest.mark.parametrize(
    ("returned", "said"),
    [
        (lambda seen: np.zeros((5, 128)), r"shape \(5, 128\) and type float64; .*\(128, 5\)"),
        (lambda seen: np.zeros(128), r"type float64; .* whole numbers and of shape \(128,\)"),
        (lambda seen: np.zeros((128, 5), complex), "type complex128"),
        (lambda seen: np.full(128, 5), "your function contains 5; all must lie between 0 and 4"),
        (lambda seen: np.full(128, -1), "your function contains -1"),
        (lambda seen: np.where(np.eye(128, 5), np.nan, 0), "nan for state 0 and action 0"),
        (lambda seen: np.full((128, 5), -1e300), "-inf for state 0 and action 0"),
    ],
)
def test_what_a_function_may_not_return(returned, said) -> None:
    with pytest.raises(AntsError, match=said):
        tabulate(returned)
