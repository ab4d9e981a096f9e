"""Edits: ants in the way of rocks and food are moved aside.

That edits keep colony and reference equal is tested in `tests/engines/colony/test_protocol.py`.
"""

from __future__ import annotations

import numpy as np
import pytest

from taichi_ants import Colony, TrainingConfig, worlds
from taichi_ants.engines.colony.interventions import Interventions
from taichi_ants.engines.colony.layout import NestRow, Stage, WorldRow
from taichi_ants.interventions import Place
from taichi_ants.task import foraging
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN

TRAINING = TrainingConfig("sarsa", 0.2, 0.9, 0.4, 0.9)


def assert_sound(interventions: Interventions) -> None:
    """What holds in every colony at the end of a tick."""
    colony = interventions.colony
    arrays, world = colony.arrays, colony.arrays["worlds"][:, 0]
    taken = arrays["stage"] != Stage.VACANT
    cells, numbers = arrays["cell"][taken], arrays["number"][taken]
    assert (arrays["stage"][taken] == Stage.LIVING).all()
    assert len(set(cells.tolist())) == len(set(numbers.tolist())) == world[WorldRow.LIVING]
    assert numbers.max(initial=-1) < world[WorldRow.NEXT_NUMBER]
    assert (np.flatnonzero(arrays["ground"] > 15) == np.sort(cells)).all()
    bare = colony.snapshot().ground
    assert (arrays["walls"] == (bare == OBSTACLE)).all()
    queens = colony.arrays["nests"][NestRow.QUEEN_CELL].tolist()
    assert np.flatnonzero(bare == QUEEN).tolist() == queens
    assert colony.snapshot().trail[bare == OBSTACLE].sum() == 0
    later = interventions.world()
    assert (later.closer() == arrays["closer"]).all()
    assert np.count_nonzero(later.ground() == EMPTY) >= interventions.ants


@pytest.mark.parametrize(("what", "content"), [("rock", OBSTACLE), ("food", FOOD)])
def test_a_wall_across_a_road_of_ants_has_no_hole(what, content):
    """Ants in the way are moved aside, to the nearest empty cells; nothing else of them changes."""
    colony = Colony(worlds.paper(), foraging(), TRAINING, 2, ants=40)
    colony.begin_episode()
    colony.tick(200)
    interventions, before = (
        Interventions(colony),
        {name: colony.arrays[name].copy() for name in colony._columns()},
    )
    cells = np.sort(before["cell"])[::2]
    interventions.apply(Place(what, cells.tolist()))
    assert (colony.snapshot().ground[cells] == content).all()
    for name in before.keys() - {"cell", "state", "paper_state"}:
        assert np.array_equal(colony.arrays[name], before[name]), name
    moved = before["cell"] != colony.arrays["cell"]
    assert np.array_equal(moved, np.isin(before["cell"], cells))
    assert_sound(interventions)


def test_an_ant_without_room_stays_where_it_is():
    colony = Colony(worlds.from_text("Q   0   F\n"), foraging(), TRAINING, ants=1)
    colony.begin_episode()
    interventions, (cell,) = Interventions(colony), colony.snapshot().ant_cells
    interventions.apply(Place("rock", [cell]))
    assert colony.snapshot().ground[cell] == EMPTY
    assert colony.snapshot().ant_cells.tolist() == [cell]
