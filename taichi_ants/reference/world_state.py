"""A world in motion: the ground, the positions of ants, the trails."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.reference.ants import Ant
from taichi_ants.reference.geometry import Cell, existing_cells, listed_cells, neighbour
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN

if TYPE_CHECKING:
    from taichi_ants.task import Pheromone
    from taichi_ants.worlds.world import World

Level = int | np.integer | np.float32


class Trail:
    """The trail of each cell.

    Levels that only fall by 1 per tick, or do not fall, are integers. Those that halve or spread
    are float32, with every operation rounded.
    """

    def __init__(self, world: World, pheromone: Pheromone) -> None:
        self._pheromone = pheromone
        rocks = set(listed_cells(world.obstacles))
        self._cells = [cell for cell in existing_cells(world.ranges) if cell not in rocks]
        self._place = {cell: place for place, cell in enumerate(self._cells)}
        kind = np.float32 if pheromone.dense else np.int64
        self._levels: np.ndarray = np.zeros(len(self._cells), kind)
        for x, y, z, level in world.trails.tolist():
            self._levels[self._place[x, y, z]] = level
        if pheromone.diffusion > 0:
            # Rocks and the outside are walls: all of them stand at one place behind the last cell.
            wall = len(self._cells)
            around = [
                [self._place.get(neighbour(cell, heading), wall) for heading in range(N_HEADINGS)]
                for cell in self._cells
            ]
            self._around = np.array(around)
            self._n_open = np.count_nonzero(self._around != wall, axis=1).astype(np.float32)

    def level(self, cell: Cell) -> Level:
        """The level of a cell now, 0 where there can be none."""
        place = self._place.get(cell)
        return 0 if place is None else self._levels[place]

    def lay(self, cell: Cell, level: Level) -> None:
        """Set the level of a cell that is no rock."""
        self._levels[self._place[cell]] = level

    def deposit(self, cell: Cell, carried: int) -> None:
        """Lay the trail of an ant that has carried its food for so many ticks."""
        place, rule = self._place[cell], self._pheromone
        if rule.deposit == "set":
            self._levels[place] = rule.level
        elif rule.deposit == "add":
            self._levels[place] = min(self._levels[place] + rule.level, rule.cap)
        elif rule.deposit == "fading":
            self._levels[place] = max(
                self._levels[place], rule.level - int(rule.slope or 0) * carried
            )

    def tick(self) -> None:
        """Let one tick pass: the trails evaporate, then spread."""
        if self._pheromone.evaporation == "linear":
            self._levels = np.maximum(self._levels - 1, 0)
        elif self._pheromone.evaporation == "exponential":
            self._levels = self._levels * self._pheromone.decay
            self._levels[self._levels < 1] = 0
        if self._pheromone.diffusion > 0:
            self._diffuse()

    def _diffuse(self) -> None:
        shares = self._levels * self._pheromone.share
        given = shares * self._n_open  # nothing to walls
        shares_and_wall = np.append(shares, np.float32(0))
        got = np.zeros_like(shares)
        for heading in range(N_HEADINGS):
            got = got + shares_and_wall[self._around[:, heading]]
        # At rate 1 all is given away, and rounding could leave less than nothing.
        self._levels = np.maximum((self._levels - given) + got, 0)


class WorldState:
    """The state of a world that ants change, made anew for each episode.

    `ground` is EMPTY, OBSTACLE, FOOD or QUEEN for each cell, and EMPTY under `ants`, which are by
    cell.
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
        return OBSTACLE if cell in self.ants else self.ground.get(cell, OBSTACLE)

    def index(self, cell: Cell) -> int:
        """The number of a cell in the flat array with a border of one void cell.

        The array holds q = x - z from -Z to X and r = y - z from -Z to Y, row by row (r).
        """
        size_x, _, size_z = self._ranges
        x, y, z = cell
        width = size_x + size_z + 1
        return (y - z + size_z) * width + (x - z + size_z)
