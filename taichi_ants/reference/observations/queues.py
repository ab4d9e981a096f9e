"""As `ants`; an ant with the same load is a code of its own too, if it stands better."""

from __future__ import annotations

from taichi_ants.reference.observations.observation import Observation, number
from taichi_ants.reference.records import Ant
from taichi_ants.reference.vision import cells_in_view, codes_in_view, is_better
from taichi_ants.reference.world_state import WorldState

BETTER, OTHER, AHEAD_OF_ME = 4, 5, 6


def row(world: WorldState, ant: Ant) -> int:
    """Return the load, then the code of each cell."""
    codes = codes_in_view(world, ant)
    for side, cell in enumerate(cells_in_view(ant)):
        there = world.ants.get(cell)
        if there is None:
            continue
        better = is_better(world, ant, cell)
        if there.carries != ant.carries:
            codes[side] = BETTER if better else OTHER
        elif better:
            codes[side] = AHEAD_OF_ME
    return number([ant.carries, *codes], 7)


QUEUES = Observation(2 * 7**3, row)
