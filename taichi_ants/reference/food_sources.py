"""Food sources: cells in which food lies or grows back, in piles that wander."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from taichi_ants.grid.constants import HEADING_STEPS, N_HEADINGS
from taichi_ants.reference.features import hooks
from taichi_ants.reference.geometry import Cell, kinds_of_food, neighbour
from taichi_ants.reference.random_stream import RandomStream, pick
from taichi_ants.reference.world_state import WorldState
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN
from taichi_ants.worlds.world import World


@dataclass(slots=True)
class FoodSource:
    """A food source and its present cell."""

    cell: Cell
    kind: int = 0
    waiting_since: int | None = None  # the tick in which its food was taken; None if it has food
    pile: int = -1


class FoodSources:
    """The food sources of a world, in lexicographic order of their first cells.

    Food dropped by a dying ant has no food source. A cell has at most one food source with food,
    and any number of waiting ones.
    """

    def __init__(self, world: World) -> None:
        kinds = kinds_of_food(world)
        self.food_sources = [FoodSource(cell, kinds[cell]) for cell in sorted(kinds)]
        missing = {source.cell: source for source in self.food_sources}
        for number, first in enumerate(self.food_sources):
            pile = [missing.pop(first.cell)] if first.cell in missing else []
            for source in pile:  # the list grows during this loop
                source.pile = number
                pile += [missing.pop(cell) for cell in _around(source.cell) if cell in missing]

    def put(self, cell: Cell, kind: int = 0) -> None:
        """Note that an intervention put food of a kind on a cell.

        The first waiting food source of the cell gets its food back. If the cell has no food
        source, a new one is appended. It joins the pile of the first adjacent food source, or
        forms a new pile.
        """
        sources = [source for source in self.food_sources if source.cell == cell]
        if not sources:
            around, known = _around(cell), self.food_sources
            new = max((source.pile for source in known), default=-1) + 1
            pile = next((source.pile for source in known if source.cell in around), new)
            sources = [FoodSource(cell, waiting_since=0, pile=pile)]
            self.food_sources += sources
        if all(source.waiting_since is not None for source in sources):
            sources[0].waiting_since = None
        for source in sources:
            if source.waiting_since is None:
                source.kind = kind

    def end(self, cell: Cell) -> None:
        """Note that an intervention removed the food source of a cell."""
        self.food_sources = [source for source in self.food_sources if source.cell != cell]

    def taken(self, cell: Cell, tick: int) -> None:
        """Note that food was taken from a cell; its food source waits from this tick on."""
        for source in self.food_sources:
            if source.cell == cell and source.waiting_since is None:
                source.waiting_since = tick

    def regrow(self, colony: Any, tick: int) -> int:
        """Let food grow back where food sources have waited long enough, and their cell is empty.

        Returns the number of loads that grew back.
        """
        regrown = 0
        for source in self.food_sources:
            since, delay = source.waiting_since, colony.task.life.regrowth
            for waits in hooks(colony.task, "waits"):
                delay = waits(colony, source.cell, source.kind, delay)
            is_over = since is not None and delay is not None and tick >= since + delay
            if is_over and colony.world.content(source.cell) == EMPTY:
                regrown += colony.fill(source.cell, source.kind)
                source.waiting_since = None
        return regrown

    def move_piles(self, world: WorldState, stream: RandomStream) -> None:
        """Move each pile by one cell, in a random direction.

        Food items move one by one, those in front first, each only if the cell ahead is empty. A
        food source without food moves too, unless a rock, the queen or the edge of the world is
        ahead.
        """
        for pile in sorted({source.pile for source in self.food_sources}):
            heading = pick(stream.draw()[0], N_HEADINGS)
            members = [source for source in self.food_sources if source.pile == pile]
            for source in _front_first(members, heading):
                ahead = neighbour(source.cell, heading)
                if source.waiting_since is not None:
                    if world.ground.get(ahead, OBSTACLE) not in (OBSTACLE, QUEEN):
                        source.cell = ahead
                elif world.content(ahead) == EMPTY:
                    world.ground[source.cell], world.ground[ahead] = EMPTY, FOOD
                    world.of_cells[ahead] = world.of_cells.pop(source.cell)
                    source.cell = ahead


def _around(cell: Cell) -> list[Cell]:
    return [neighbour(cell, heading) for heading in range(N_HEADINGS)]


def _front_first(pile: list[FoodSource], heading: int) -> list[FoodSource]:
    """Return the food sources of a pile, the foremost in the direction of `heading` first."""
    dx, dy, dz = HEADING_STEPS[heading]

    def progress(source: FoodSource) -> int:
        x, y, z = source.cell
        return (dx - dz) * (x - z) + (dy - dz) * (y - z)

    # Ties keep the order of the food sources.
    return sorted(pile, key=progress, reverse=True)
