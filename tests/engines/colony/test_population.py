"""How many ants a colony can have, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_ants.engines.colony.population import MAX_ANTS, Population
from taichi_ants.errors import AntsError
from taichi_ants.task import Life, Task


def population(
    births: bool = False, ants=1, capacity=None, start="nest", ends_at_delivery=False
) -> Population:
    return Population.of(Task(life=Life(births)), ants, capacity, start, ends_at_delivery)


@pytest.mark.parametrize(
    ("settings", "slots"),
    [
        ({}, 1),
        ({"ants": 7}, 7),
        ({"ants": 7, "births": True}, 78),
        ({"ants": 7, "capacity": 7, "births": True}, 7),
        ({"ants": np.int64(7), "capacity": np.int32(9)}, 9),
        ({"ants": 1, "capacity": 1, "ends_at_delivery": True}, 1),
        ({"ants": MAX_ANTS, "births": True}, MAX_ANTS),
    ],
)
def test_slots(settings, slots):
    assert population(**settings).slots == slots


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"ants": 0}, "ants is 0; it must lie between 1"),
        ({"ants": 1.0}, "ants is 1.0; it must be a whole number"),
        ({"ants": True}, "ants is True"),
        ({"ants": MAX_ANTS + 1}, "ants is"),
        ({"ants": 5, "capacity": 4}, "capacity is 4, but 5 ants start"),
        ({"capacity": 1.5}, "capacity is 1.5"),
        ({"start": "queen"}, "start is 'queen'; it must be one of nest, spread"),
        ({"ends_at_delivery": None}, "ends_at_delivery is None"),
        ({"ends_at_delivery": True, "ants": 2}, "ends_at_delivery is set with 2 ants"),
        ({"ends_at_delivery": True, "births": True}, "births True"),
    ],
)
def test_a_population_that_cannot_be(settings, message):
    with pytest.raises(AntsError, match=message):
        population(**settings)
