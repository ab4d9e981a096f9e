"""How cost grows: what is counted, and the command."""

from __future__ import annotations

import growth
import numpy as np

from taichi_ants import worlds


def test_cells_of_a_world():
    for side in (10, 20):
        assert growth.n_cells(side) == worlds.open_world(0, (side,) * 3).grid.exists.sum()


def test_memory_of_what_is_known():
    """A kibibyte for each, kept; and twice that for a moment."""

    def prepare(n):
        def work():
            kept = np.ones(n * 128)
            return [kept * 1.0]  # both are there, then one

        return work

    arrays, process = growth.growth(prepare, 20_000, 60_000)
    assert arrays == 1024
    assert np.isnan(process) or 1600 < process < 2500


def test_its_tables():
    one = growth.DIRECTIONS[2]
    found = {(one, 1, 100): [(2e6, 500.0)], (one, 2, 100): [(3e6, 510.0), (5e6, 490.0)]}
    memories = [growth.Memory("ant", 40.0, float("nan"))]
    paces, memory = growth.tables(found, memories, 2)
    assert [row[2:] for row in paces.rows] == [
        ["29 701", "1", "2", "[2.0, 2.0]", "500"],
        ["29 701", "2", "4", "[3.0, 5.0]", "500"],
    ]
    assert memory.rows == [["ant", "40", "-"]]
