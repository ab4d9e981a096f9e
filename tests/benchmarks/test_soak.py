"""The soak: a small one holds, and each fault that is put into a colony is found."""

from __future__ import annotations

import numpy as np
import pytest
import soak

from taichi_ants.engines.colony.layout import Tally, WorldRow
from taichi_ants.task.constants import EMPTY, FOOD


def put_food(colony):
    empty = (colony.arrays["ground"] == EMPTY) & (colony.arrays["walls"] == 0)
    colony.arrays["ground"][np.argmax(empty)] = FOOD


def share_a_cell(colony):
    colony.arrays["cell"][0] = colony.arrays["cell"][1]


def share_a_number(colony):
    colony.arrays["number"][0] = 1


def change(row, value):
    def fault(colony):
        colony.arrays["worlds"][row, 0] = value(colony.arrays["worlds"][row, 0])

    return fault


def overflow(colony):
    colony.arrays["totals"][Tally.MOVES] *= -1


def put_trail(colony):
    colony.arrays["trail"][np.argmax(colony.arrays["walls"])] = 1


FAULTS = {
    "food has vanished or appeared": put_food,
    "ants share a cell": share_a_cell,
    "ants share a number": share_a_number,
    "ants were lost": change(WorldRow.LIVING, lambda living: living - 1),
    "a trail is not finite, is negative, or is on rock": put_trail,
    "the clocks of world and colony differ": change(WorldRow.TICKS, lambda ticks: ticks + 1),
    "a counter has overflowed": overflow,
}


@pytest.mark.slow
def test_each_fault_is_found():
    for words, put in FAULTS.items():
        colony = soak.new_colony("paper", 200)
        colony.tick(100)
        assert soak.faults(colony) == []
        put(colony)
        assert words in soak.faults(colony)
