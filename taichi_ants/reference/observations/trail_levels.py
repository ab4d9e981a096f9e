"""The cells ahead; trails in three levels: thirds of the strongest one."""

from __future__ import annotations

from taichi_ants.reference.observations.observation import Observation, number
from taichi_ants.reference.records import Ant
from taichi_ants.reference.vision import codes_in_view, levels_in_view, strongest_in_view
from taichi_ants.reference.world_state import Level, WorldState
from taichi_ants.task.constants import SEES_GOAL, SEES_LURE, SEES_OBSTACLE

NOTHING, OBSTACLE, WEAK, MIDDLE, STRONG, GOAL = range(6)


def row(world: WorldState, ant: Ant) -> int:
    """Return the load, then the code of each cell."""
    levels = levels_in_view(world, ant)
    strongest = strongest_in_view(world, ant)
    codes = []
    for code, level in zip(codes_in_view(world, ant), levels, strict=True):
        if code == SEES_GOAL:
            codes.append(GOAL)
        elif code == SEES_OBSTACLE:
            codes.append(OBSTACLE)
        elif ant.carries:
            codes.append(STRONG if code == SEES_LURE else NOTHING)
        else:
            codes.append(_share(level, strongest))
    return number([ant.carries, *codes], 6)


def _share(level: Level, strongest: Level) -> int:
    if level < 1:
        return NOTHING
    if level >= 2 * (strongest - level):  # two thirds
        return STRONG
    return MIDDLE if level >= strongest - 2 * level else WEAK


TRAIL_LEVELS = Observation(2 * 6**3, row)
