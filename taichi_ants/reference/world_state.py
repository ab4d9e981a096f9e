"""A world in motion: what each cell holds, the trail, and the clock."""

from __future__ import annotations

from typing import TYPE_CHECKING

from taichi_ants.reference.geometry import Cell, exists
from taichi_ants.task.constants import DEPOSIT_LEVEL, EMPTY, FOOD, OBSTACLE, QUEEN
from taichi_ants.task.rewards import Rewards

if TYPE_CHECKING:
    from taichi_ants.worlds.world import World


class WorldState:
    """The state of a world that ants change, made anew for each episode.

    Attributes:
        ranges: (X, Y, Z) of the world.
        queen: The queen's cell.
        evaporation: Whether every trail falls by 1 per tick.
        rewards: What each event pays.
        clock: Ticks since the episode's start.
    """

    def __init__(self, world: World, evaporation: bool, rewards: Rewards | None = None) -> None:
        self.ranges = world.ranges
        self.queen: Cell = world.queen
        self.evaporation = evaporation
        self.rewards = rewards or Rewards()
        self.clock = 0
        # Cells that are not named here are empty, if they exist.
        self._holds: dict[Cell, int] = {self.queen: QUEEN}
        for x, y, z in world.foods.tolist():
            self._holds[x, y, z] = FOOD
        for x, y, z in world.obstacles.tolist():
            self._holds[x, y, z] = OBSTACLE
        # A level and the tick at which it was set: the level falls from there. The levels of the
        # start count as set at clock 0, so the first observation sees them undiminished.
        self._trail: dict[Cell, tuple[int, int]] = {
            (x, y, z): (level, 0) for x, y, z, level in world.trails.tolist()
        }

    def content(self, cell: Cell) -> int:
        """Return EMPTY, OBSTACLE, FOOD or QUEEN; a cell outside the world is an OBSTACLE."""
        held = self._holds.get(cell)
        if held is not None:
            return held
        return EMPTY if exists(cell, self.ranges) else OBSTACLE

    def take_food(self, cell: Cell) -> None:
        """Empty a cell that holds food."""
        if self._holds[cell] != FOOD:
            raise AssertionError(f"there is no food at {cell}")
        del self._holds[cell]

    def level(self, cell: Cell) -> int:
        """Return the trail level of a cell at this clock, 0 where there never was a trail."""
        level, since = self._trail.get(cell, (0, 0))
        return max(0, level - (self.clock - since)) if self.evaporation else level

    def deposit(self, cell: Cell) -> None:
        """Set (not add) the trail of a cell to the deposit level."""
        self._trail[cell] = (DEPOSIT_LEVEL, self.clock)

    def tick(self) -> None:
        """Let one tick pass: the trails evaporate."""
        self.clock += 1
