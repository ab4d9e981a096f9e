"""A world in motion: the ground, who stands where, the trails."""

from __future__ import annotations

from typing import TYPE_CHECKING

from taichi_ants.reference.ants import Ant
from taichi_ants.reference.geometry import Cell, existing_cells, listed_cells
from taichi_ants.reference.trail import Level, Trail
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN

if TYPE_CHECKING:
    from taichi_ants.task import Pheromone
    from taichi_ants.worlds.world import World


class WorldState:
    """The state of a world that ants change, made anew for each episode.

    Attributes:
        queen: The queen's cell.
        ground: What each existing cell holds, ants aside: EMPTY, OBSTACLE, FOOD or QUEEN.
        ants: The ants by the cells on which they stand; these are EMPTY in `ground`.
        trail: The trail of every cell.
        pheromone: How trails are laid, fall and spread, and which are seen.
    """

    def __init__(self, world: World, pheromone: Pheromone) -> None:
        self._ranges = world.ranges
        self.queen: Cell = world.queen
        self.ground: dict[Cell, int] = dict.fromkeys(existing_cells(self._ranges), EMPTY)
        self.ground[self.queen] = QUEEN
        self.ground.update(dict.fromkeys(listed_cells(world.foods), FOOD))
        self.ground.update(dict.fromkeys(listed_cells(world.obstacles), OBSTACLE))
        self.ants: dict[Cell, Ant] = {}
        self.pheromone = pheromone
        self.trail = Trail(world, pheromone)

    def content(self, cell: Cell) -> int:
        """What a cell looks like: the ground, or an OBSTACLE where an ant stands."""
        if cell in self.ants:
            return OBSTACLE
        return self.ground.get(cell, OBSTACLE)

    def level(self, cell: Cell) -> Level:
        """The trail level of a cell now."""
        return self.trail.level(cell)

    def index(self, cell: Cell) -> int:
        """The number of a cell in the flat array with a border of one void cell.

        The array holds q = x - z from -Z to X and r = y - z from -Z to Y, row by row (r).
        """
        size_x, _, size_z = self._ranges
        x, y, z = cell
        width = size_x + size_z + 1
        return (y - z + size_z) * width + (x - z + size_z)
