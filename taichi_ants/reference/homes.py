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
class Home:
    """The place of one food of the start.

    Attributes:
        cell: Where it is now.
        waiting_since: The tick in which its food was taken; None while the food is there.
    """

    cell: Cell
    waiting_since: int | None = None


class Homes:
    """The places of all foods of the start, in lexicographic order of their first cells.

    Food that lies elsewhere, since a dying ant dropped it, has no home. At most one full home is
    on a cell; waiting ones may share it, with each other or with a full one.

    Attributes:
        homes: In their order.
    """

    def __init__(self, world: World) -> None:
        self.homes = [Home(cell) for cell in sorted(listed_cells(world.foods))]
        self._piles = _connected(self.homes)

    def give(self, cell: Cell) -> None:
        """Note that a hand has put food on a cell.

        The first home that waits there has its food again. Where there is none, a new home comes
        last; it joins the pile of the first home beside it, else it is a pile of its own.
        """
        here = [home for home in self.homes if home.cell == cell]
        if not here:
            around = [neighbour(cell, heading) for heading in range(N_HEADINGS)]
            beside = next((home for home in self.homes if home.cell in around), None)
            here = [Home(cell, waiting_since=0)]
            self.homes += here
            for pile in self._piles:
                if any(home is beside for home in pile):
                    pile += here
            if beside is None:
                self._piles.append(list(here))
        if all(home.waiting_since is not None for home in here):
            here[0].waiting_since = None

    def end(self, cell: Cell) -> None:
        """Note that a hand has put something else on a cell: nothing grows back there."""
        self.homes = [home for home in self.homes if home.cell != cell]
        piles = [[home for home in pile if home.cell != cell] for pile in self._piles]
        self._piles = [pile for pile in piles if pile]

    def taken(self, cell: Cell, tick: int) -> None:
        """Note that food was taken from a cell: a full home there waits from now on."""
        for home in self.homes:
            if home.cell == cell and home.waiting_since is None:
                home.waiting_since = tick

    def regrow(self, world: WorldState, delay: int, tick: int) -> int:
        """Let food grow back on the empty cells of homes that have waited `delay` ticks.

        Returns:
            How many foods grew back.
        """
        regrown = 0
        for home in self.homes:
            since = home.waiting_since
            if since is None or tick < since + delay or world.content(home.cell) != EMPTY:
                continue
            world.ground[home.cell] = FOOD
            home.waiting_since = None
            regrown += 1
        return regrown

    def wander(self, world: WorldState, stream: RandomStream) -> None:
        """Move each pile by one cell, in a direction drawn for it.

        Foods go one after the other, those in front first, and stay where the cell ahead is not
        empty. Homes whose food is missing go along over everything but rocks, queen and the end of
        the world.
        """
        for pile in self._piles:
            high, _ = stream.draw()
            heading = pick(high, N_HEADINGS)
            for home in _front_first(pile, heading):
                ahead = neighbour(home.cell, heading)
                if home.waiting_since is not None:
                    if world.ground.get(ahead, OBSTACLE) not in (OBSTACLE, QUEEN):
                        home.cell = ahead
                elif world.content(ahead) == EMPTY:
                    world.ground[home.cell] = EMPTY
                    world.ground[ahead] = FOOD
                    home.cell = ahead


def _connected(homes: list[Home]) -> list[list[Home]]:
    """The piles: the homes that hang together, in the order of the first home of each."""
    missing = {home.cell: home for home in homes}
    piles = []
    for home in homes:
        if home.cell not in missing:
            continue
        found = [missing.pop(home.cell)]
        for member in found:  # grows while it is walked along
            around = (neighbour(member.cell, heading) for heading in range(N_HEADINGS))
            found += [missing.pop(cell) for cell in around if cell in missing]
        piles.append(sorted(found, key=homes.index))
    return piles


def _front_first(pile: list[Home], heading: int) -> list[Home]:
    """The homes of a pile, the foremost in the direction of `heading` first."""
    step_q, step_r = _axial(HEADING_STEPS[heading])

    def progress(home: Home) -> int:
        q, r = _axial(home.cell)
        return step_q * q + step_r * r

    return sorted(pile, key=progress, reverse=True)  # stable: ties keep the order of the homes


def _axial(cell: Cell) -> tuple[int, int]:
    x, y, z = cell
    return x - z, y - z
