"""The cells ahead; another ant is a code of its own."""

from __future__ import annotations

from taichi_ants.reference.observations.observation import Observation, number
from taichi_ants.reference.records import Ant
from taichi_ants.reference.vision import cells_in_view, codes_in_view
from taichi_ants.reference.world_state import WorldState

ANOTHER_ANT = 4


def row(world: WorldState, ant: Ant) -> int:
    """Return the load, then the code of each cell."""
    codes = [
        ANOTHER_ANT if cell in world.ants else code
        for cell, code in zip(cells_in_view(ant), codes_in_view(world, ant), strict=True)
    ]
    return number([ant.carries, *codes], 5)


ANTS_SEEN = Observation(2 * 5**3, row)
