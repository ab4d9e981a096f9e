"""The cells ahead; an ant with the other load is a code of its own, two if it stands better."""

from __future__ import annotations

from taichi_ants.reference.observations.observation import Observation, number
from taichi_ants.reference.records import Ant
from taichi_ants.reference.vision import cells_in_view, codes_in_view, is_better
from taichi_ants.reference.world_state import WorldState

BETTER, OTHER = 4, 5


def row(world: WorldState, ant: Ant) -> int:
    """Return the load, then the code of each cell."""
    codes = codes_in_view(world, ant)
    for side, cell in enumerate(cells_in_view(ant)):
        there = world.ants.get(cell)
        if there is not None and there.carries != ant.carries:
            codes[side] = BETTER if is_better(world, ant, cell) else OTHER
    return number([ant.carries, *codes], 6)


ANTS = Observation(2 * 6**3, row)
