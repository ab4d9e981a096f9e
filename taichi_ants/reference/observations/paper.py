"""The paper's state: the percept itself."""

from __future__ import annotations

from taichi_ants.reference.observations.observation import Observation
from taichi_ants.reference.records import Ant
from taichi_ants.reference.world_state import WorldState


def row(world: WorldState, ant: Ant) -> int:
    """Return what the ant perceives."""
    return ant.percept


PAPER = Observation(128, row)
