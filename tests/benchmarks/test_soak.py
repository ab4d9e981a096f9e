"""The soak: a small one holds, and finds faults that are put into a colony."""

from __future__ import annotations

import pytest
import soak

from taichi_ants.engines.colony.layout import WorldRow


@pytest.mark.slow
def test_faults_are_found():
    colony = soak.new_colony("paper", 200)
    colony.tick(100)
    assert soak.faults(colony) == []
    colony.arrays["cell"][0] = colony.arrays["cell"][1]
    colony.arrays["worlds"][WorldRow.LIVING, 0] -= 1
    assert {"ants share a cell", "ants were lost"} <= set(soak.faults(colony))
