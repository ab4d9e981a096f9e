"""The measures of the evaluation of a colony, by hand."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_ants.measures.colonies import measures_of

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
def test_measures(measure: str, expected: list[float]) -> None:
    np.testing.assert_allclose(measures_of(OUTCOME, 4, 500)[measure], expected)
