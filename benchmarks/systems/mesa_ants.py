"""Ants on Mesa's hexagonal grid: agents as objects that forage by a fixed rule.

A carrier moves to the free neighbour that is nearest to the nest, and deposits on it. A forager
takes adjacent food, follows the strongest adjacent trail, or moves at random. Trails evaporate by 1
per tick, as in Taichi Ants. The ants do not learn.
"""

from __future__ import annotations

from collections.abc import Callable

import mesa
from mesa.discrete_space import Cell, CellAgent, HexGrid, PropertyLayer

_LEVEL = 500


class Ant(CellAgent):
    """An ant."""

    def __init__(self, model: Colony, cell: Cell) -> None:
        super().__init__(model)
        self.cell, self.carries = cell, False

    def step(self) -> None:
        """Observe the six neighbours, and act."""
        model, cells = self.model, self.cell.neighborhood.cells
        if self.carries and model.nest in cells:
            self.carries = False
            model.delivered += 1
            return
        if not self.carries and (foods := [cell for cell in cells if cell.food]):
            self.random.choice(foods).food = False
            self.carries, self.cell.trail = True, _LEVEL
            return
        free = [cell for cell in cells if cell.is_empty and not cell.food and cell != model.nest]
        if not free:
            return
        if self.carries:
            self.cell = min(free, key=lambda cell: cell.to_nest)
            self.cell.trail = max(self.cell.trail, _LEVEL // 2)
            return
        strongest = max(cell.trail for cell in free)
        ways = [cell for cell in free if cell.trail == strongest] if strongest >= 1 else free
        self.cell = self.random.choice(ways)


class Colony(mesa.Model):
    """A colony with a nest in the middle, food in 3 % of the cells, and ants anywhere."""

    def __init__(self, ants: int, width: int) -> None:
        super().__init__(rng=0)
        self.grid = HexGrid((width, width), torus=False, capacity=1, random=self.random)
        for name, kind in (("trail", int), ("food", bool), ("to_nest", float)):
            layer = PropertyLayer(name, (width, width), default_value=kind(0), dtype=kind)
            self.grid.add_property_layer(layer)
        self.delivered, middle = 0, width // 2
        self.nest = self.grid[middle, middle]
        for cell in self.grid.all_cells:
            x, y = cell.coordinate
            cell.to_nest = ((x - middle) ** 2 + (y - middle) ** 2) ** 0.5
            cell.food = cell is not self.nest and self.random.random() < 0.03
        free = [cell for cell in self.grid.all_cells if cell is not self.nest and not cell.food]
        for cell in self.random.sample(free, ants):
            Ant(self, cell)

    def step(self) -> None:
        """Let all ants act in random order, and let trails evaporate."""
        self.agents.shuffle_do("step")
        trail = self.grid.trail.data
        trail[trail > 0] -= 1


def colony(ants: int) -> Callable[[], int]:
    """Return work: ticks of a colony with ten cells per ant."""
    model = Colony(ants, round((10 * ants) ** 0.5))

    def work() -> int:
        for _ in range(10):
            model.step()
        return 10 * ants

    work()
    return work
