"""The twins of the package's observations, one file each."""

from __future__ import annotations

from taichi_ants.reference.observations.ants import ANTS
from taichi_ants.reference.observations.ants_seen import ANTS_SEEN
from taichi_ants.reference.observations.five_cells import FIVE_CELLS
from taichi_ants.reference.observations.observation import OBSERVATIONS, Observation
from taichi_ants.reference.observations.paper import PAPER
from taichi_ants.reference.observations.queues import QUEUES
from taichi_ants.reference.observations.six_cells import SIX_CELLS
from taichi_ants.reference.observations.trail_levels import TRAIL_LEVELS

__all__ = ["OBSERVATIONS", "Observation"]

OBSERVATIONS.register("paper", PAPER)
OBSERVATIONS.register("five_cells", FIVE_CELLS)
OBSERVATIONS.register("six_cells", SIX_CELLS)
OBSERVATIONS.register("trail_levels", TRAIL_LEVELS)
OBSERVATIONS.register("ants_seen", ANTS_SEEN)
OBSERVATIONS.register("ants", ANTS)
OBSERVATIONS.register("queues", QUEUES)
