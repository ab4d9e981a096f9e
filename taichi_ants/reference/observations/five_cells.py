"""The paper's codes, of the cells behind left and behind right too."""

from __future__ import annotations

from taichi_ants.reference.observations.observation import Observation, number
from taichi_ants.reference.records import Ant
from taichi_ants.reference.vision import codes_in_view
from taichi_ants.reference.world_state import WorldState


def row(world: WorldState, ant: Ant) -> int:
    """Return the load, then the codes from behind left to behind right."""
    return number([ant.carries, *codes_in_view(world, ant, (-2, -1, 0, 1, 2))], 4)


FIVE_CELLS = Observation(2 * 4**5, row)
