"""The trails of a world: laid, evaporated, spread.

Where levels only fall by 1 per tick, or do not fall, they are integers, and a cell stores the tick
at which its trail has evaporated. Where they halve or spread, they are float32 in every cell.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.reference.geometry import Cell, existing_cells, neighbour

if TYPE_CHECKING:
    from taichi_ants.task import Pheromone
    from taichi_ants.worlds.world import World


def make_trail(world: World, pheromone: Pheromone) -> IntegerTrail | DenseTrail:
    """Return the trail of a world's start, of the kind that the pheromone needs."""
    return DenseTrail(world, pheromone) if pheromone.dense else IntegerTrail(world, pheromone)


class IntegerTrail:
    """Trails that fall by 1 per tick, or never."""

    def __init__(self, world: World, pheromone: Pheromone) -> None:
        self._pheromone = pheromone
        self._falls = pheromone.evaporation == "linear"
        # Ticks since the start where trails fall, else 0.
        self._clock = 0
        # Of each cell the clock at which its trail is gone.
        self._until: dict[Cell, int] = {
            (x, y, z): level for x, y, z, level in world.trails.tolist()
        }

    def level(self, cell: Cell) -> int:
        """Return the level of a cell now, 0 where there never was a trail."""
        return max(0, self._until.get(cell, 0) - self._clock)

    def deposit(self, cell: Cell, carried: int) -> None:
        """Lay the trail of an ant that has carried its food for so many ticks."""
        level = self._pheromone.level
        if self._pheromone.deposit == "set":
            self._until[cell] = self._clock + level
        elif self._pheromone.slope is not None:  # of "fading" only
            fresh = level - self._pheromone.slope * carried
            self._until[cell] = self._clock + max(self.level(cell), fresh)
        elif self._pheromone.cap is not None:  # of "add" only
            added = min(self.level(cell) + level, self._pheromone.cap)
            self._until[cell] = self._clock + added

    def tick(self) -> None:
        """Let one tick pass: the trails evaporate."""
        if self._falls:
            self._clock += 1


class DenseTrail:
    """Trails that halve, or spread to neighbours: float32, every operation rounded."""

    def __init__(self, world: World, pheromone: Pheromone) -> None:
        self._pheromone = pheromone
        rocks = {(x, y, z) for x, y, z in world.obstacles.tolist()}
        cells = [cell for cell in existing_cells(world.ranges) if cell not in rocks]
        self._place = {cell: place for place, cell in enumerate(cells)}
        # Rocks and the outside are walls: all of them stand at one place behind the last cell.
        wall = len(cells)
        self._around = np.array(
            [
                [self._place.get(neighbour(cell, heading), wall) for heading in range(N_HEADINGS)]
                for cell in cells
            ]
        )
        self._n_open = np.count_nonzero(self._around != wall, axis=1).astype(np.float32)
        self._levels = np.zeros(len(cells), np.float32)
        for x, y, z, level in world.trails.tolist():
            self._levels[self._place[x, y, z]] = level

    def level(self, cell: Cell) -> np.float32:
        """Return the level of a cell now, 0 where there can be none."""
        place = self._place.get(cell)
        return np.float32(0) if place is None else self._levels[place]

    def deposit(self, cell: Cell, carried: int) -> None:
        """Lay the trail of an ant that has carried its food for so many ticks."""
        level = np.float32(self._pheromone.level)
        place = self._place[cell]
        if self._pheromone.deposit == "set":
            self._levels[place] = level
        elif self._pheromone.slope is not None:  # of "fading" only
            fresh = np.float32(self._pheromone.level - self._pheromone.slope * carried)
            self._levels[place] = max(self._levels[place], fresh)
        elif self._pheromone.deposit == "add":
            cap = np.float32(self._pheromone.cap)
            self._levels[place] = min(self._levels[place] + level, cap)

    def tick(self) -> None:
        """Let one tick pass: the trails evaporate, then spread."""
        self._evaporate()
        if self._pheromone.diffusion > 0:
            self._diffuse()

    def _evaporate(self) -> None:
        if self._pheromone.evaporation == "linear":
            self._levels = np.maximum(self._levels - np.float32(1), np.float32(0))
        elif self._pheromone.evaporation == "exponential":
            self._levels = self._levels * self._pheromone.decay
            self._levels[self._levels < 1] = 0

    def _diffuse(self) -> None:
        shares = self._levels * self._pheromone.share
        given = shares * self._n_open  # nothing to walls
        shares_and_wall = np.append(shares, np.float32(0))
        got = np.zeros_like(shares)
        for heading in range(N_HEADINGS):
            got = got + shares_and_wall[self._around[:, heading]]
        # At rate 1 all is given away, and rounding could leave less than nothing.
        self._levels = np.maximum((self._levels - given) + got, np.float32(0))
