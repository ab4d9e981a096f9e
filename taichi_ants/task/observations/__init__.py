"""Observations of ants, one file each; this module registers them."""

from taichi_ants.task.observations.ants import ANTS
from taichi_ants.task.observations.ants_seen import ANTS_SEEN
from taichi_ants.task.observations.five_cells import FIVE_CELLS
from taichi_ants.task.observations.paper import PAPER
from taichi_ants.task.observations.queues import QUEUES
from taichi_ants.task.observations.registry import Observation, get, names, register
from taichi_ants.task.observations.six_cells import SIX_CELLS
from taichi_ants.task.observations.trail_levels import TRAIL_LEVELS

for _observation in (PAPER, FIVE_CELLS, SIX_CELLS, TRAIL_LEVELS, ANTS_SEEN, ANTS, QUEUES):
    register(_observation)

__all__ = ["Observation", "get", "names", "register"]
