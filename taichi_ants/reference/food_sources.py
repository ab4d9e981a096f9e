"""Where the food of a world belongs: it grows back there, and its piles wander."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from taichi_ants.grid.constants import HEADING_STEPS, N_HEADINGS
from taichi_ants.reference.geometry import Cell, listed_cells, neighbour
from taichi_ants.reference.random_stream import RandomStream, pick
from taichi_ants.reference.world_state import WorldState
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN

if TYPE_CHECKING:
    from taichi_ants.worlds.world import World


@dataclass(slots=True)
class FoodSource:
    """The present place of one food of the start."""

    cell: Cell
    waiting_since: int | None = None  # the tick in which the food was taken; None: it is there


class FoodSources:
    """The places of all foods of the start, in lexicographic order of their first cells.

    Food that lies elsewhere, since a dying ant dropped it, has no food source. At most one full
    food source is on a cell; waiting ones may share it, with each other or with a full one.
    """

    def __init__(self, world: World) -> None:
        self.food_sources = [FoodSource(cell) for cell in sorted(listed_cells(world.foods))]
        self._piles = _connected(self.food_sources)

    def give(self, cell: Cell) -> None:
        """Note that an intervention put food on a cell.

        The first food source that waits there has its food again. Where there is none, a new food
        source comes last; it joins the pile of the first food source beside it, else it is a pile
        of its own.
        """
        here = [source for source in self.food_sources if source.cell == cell]
        if not here:
            around = [neighbour(cell, heading) for heading in range(N_HEADINGS)]
            beside = next((source for source in self.food_sources if source.cell in around), None)
            here = [FoodSource(cell, waiting_since=0)]
            self.food_sources += here
            for pile in self._piles:
                if any(source is beside for source in pile):
                    pile += here
            if beside is None:
                self._piles.append(list(here))
        if all(source.waiting_since is not None for source in here):
            here[0].waiting_since = None

    def end(self, cell: Cell) -> None:
        """Note that an intervention put something else on a cell: nothing grows back there."""
        self.food_sources = [source for source in self.food_sources if source.cell != cell]
        piles = [[source for source in pile if source.cell != cell] for pile in self._piles]
        self._piles = [pile for pile in piles if pile]

    def taken(self, cell: Cell, tick: int) -> None:
        """Note that food was taken from a cell: a full food source there waits from now on."""
        for source in self.food_sources:
            if source.cell == cell and source.waiting_since is None:
                source.waiting_since = tick

    def regrow(self, world: WorldState, delay: int, tick: int) -> int:
        """Let food grow back on the empty cells of food sources that have waited `delay` ticks.

        Returns:
            The number of food items that grew back.
        """
        regrown = 0
        for source in self.food_sources:
            since = source.waiting_since
            if since is None or tick < since + delay or world.content(source.cell) != EMPTY:
                continue
            world.ground[source.cell] = FOOD
            source.waiting_since = None
            regrown += 1
        return regrown

    def wander(self, world: WorldState, stream: RandomStream) -> None:
        """Move each pile by one cell, in a direction drawn for it.

        Foods go one after the other, those in front first, and stay where the cell ahead is not
        empty. Food sources whose food is missing go along over everything but rocks, queen and the
        end of the world.
        """
        for pile in self._piles:
            high, _ = stream.draw()
            heading = pick(high, N_HEADINGS)
            for source in _front_first(pile, heading):
                ahead = neighbour(source.cell, heading)
                if source.waiting_since is not None:
                    if world.ground.get(ahead, OBSTACLE) not in (OBSTACLE, QUEEN):
                        source.cell = ahead
                elif world.content(ahead) == EMPTY:
                    world.ground[source.cell] = EMPTY
                    world.ground[ahead] = FOOD
                    source.cell = ahead


def _connected(food_sources: list[FoodSource]) -> list[list[FoodSource]]:
    """The piles: food sources that hang together, in the order of the first of each."""
    missing = {source.cell: source for source in food_sources}
    piles = []
    for source in food_sources:
        if source.cell not in missing:
            continue
        found = [missing.pop(source.cell)]
        for member in found:  # grows while it is walked along
            around = (neighbour(member.cell, heading) for heading in range(N_HEADINGS))
            found += [missing.pop(cell) for cell in around if cell in missing]
        piles.append(sorted(found, key=food_sources.index))
    return piles


def _front_first(pile: list[FoodSource], heading: int) -> list[FoodSource]:
    """The food sources of a pile, the foremost in the direction of `heading` first."""
    dx, dy, dz = HEADING_STEPS[heading]

    def progress(source: FoodSource) -> int:
        x, y, z = source.cell
        return (dx - dz) * (x - z) + (dy - dz) * (y - z)

    # Ties keep the order of the food sources.
    return sorted(pile, key=progress, reverse=True)
