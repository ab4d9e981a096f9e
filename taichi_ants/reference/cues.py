"""The cues that are not pheromones: whether a cell is better for an ant than its own."""

from __future__ import annotations

from collections.abc import Callable

from taichi_ants.reference.ants import Ant
from taichi_ants.reference.geometry import Cell, distance
from taichi_ants.reference.world_state import WorldState

Sense = Callable[[WorldState, Ant, Cell], bool]


def homing_sense(world: WorldState, ant: Ant) -> Sense | None:
    """Return the homing cue of an ant; None if that is a pheromone."""
    homing = world.cues[ant.caste][1]
    return None if homing in world.pheromones else globals()[homing]


def sense(world: WorldState, ant: Ant) -> Sense | None:
    """Return the cue of an ant with its load; None if that is a pheromone."""
    return homing_sense(world, ant) if ant.carries else None


def compass(world: WorldState, ant: Ant, cell: Cell) -> bool:
    queen = world.queens[ant.nest]
    return distance(cell, queen) < distance(ant.cell, queen)
