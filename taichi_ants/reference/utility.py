"""Ants that back up utilities, one colony, as the rules read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from taichi_ants.grid.constants import N_HEADINGS, STREAM_FORAGER
from taichi_ants.reference.geometry import Cell, existing_cells, listed_cells, neighbour
from taichi_ants.reference.random_stream import RandomStream, pick, stream_state

if TYPE_CHECKING:
    from taichi_ants.worlds.world import World


@dataclass
class _Ant:
    cell: Cell
    heading: int
    stream: RandomStream
    carries: bool = False


class UtilityColony:
    """A colony that backs up utilities.

    Attributes:
        utilities: By goal, "nest" or "food", the utility of each open cell.
        deliveries: Foods that came to the nest in each tick so far.
    """

    def __init__(
        self,
        world: World,
        seed: int,
        colony: int,
        ants: int,
        capacity: int,
        discount: float,
        evaporation: float,
        exploration: float,
        momentum: float,
    ) -> None:
        cells = set(existing_cells(world.ranges)) - set(listed_cells(world.obstacles))
        self._nest = world.queen
        self._goals = {"nest": {world.queen}, "food": set(listed_cells(world.foods))}
        self._capacity, self._discount, self._evaporation = capacity, discount, evaporation
        self._exploration, self._momentum = exploration, momentum
        self._ants = [
            _Ant(
                world.queen,
                number % N_HEADINGS,
                RandomStream(stream_state(seed, STREAM_FORAGER, colony * 2**32 + number)),
            )
            for number in range(ants)
        ]
        self.utilities = {goal: dict.fromkeys(cells, 0.0) for goal in self._goals}
        self.deliveries: list[int] = []

    def tick(self) -> None:
        """Every ant backs up and takes a step, then utilities evaporate."""
        self.deliveries.append(sum(self._step(ant) for ant in self._ants))
        for levels in self.utilities.values():
            for cell in levels:
                levels[cell] *= 1 - self._evaporation

    def _step(self, ant: _Ant) -> bool:
        """Whether the ant delivers."""
        origin, goal = ("food", "nest") if ant.carries else ("nest", "food")
        levels = self.utilities[origin]
        around = [neighbour(ant.cell, heading) for heading in range(N_HEADINGS)]
        reward = 1.0 if ant.cell in self._goals[origin] else 0.0
        backed_up = reward + self._discount * max(levels.get(cell, 0.0) for cell in around)
        levels[ant.cell] = max(levels[ant.cell], backed_up)

        heading = self._heading(ant, goal)
        if heading is None:
            return False
        ant.cell, ant.heading = around[heading], heading
        if ant.cell not in self._goals[goal]:
            return False
        ant.carries = not ant.carries
        return goal == "nest"

    def _heading(self, ant: _Ant, goal: str) -> int | None:
        """Where the ant goes, None if it has to stay."""
        high, low = ant.stream.draw()
        chance = high / 2**32
        free = {}  # the utility at each heading that can be taken
        for heading in range(N_HEADINGS):
            cell = neighbour(ant.cell, heading)
            if cell in self.utilities[goal] and self._has_room(cell):
                free[heading] = self.utilities[goal][cell]
        if not free:
            return None
        best = max(free.values())
        if best > 0 and chance < self._exploration:
            options = list(free)
        else:
            options = [heading for heading, level in free.items() if level == best]
            ahead = [h for h in options if (h - ant.heading) % N_HEADINGS in (0, 1, 5)]
            options = ahead or options
            if best == 0 and chance < self._momentum and ant.heading in options:
                options = [ant.heading]
        return options[pick(low, len(options))]

    def _has_room(self, cell: Cell) -> bool:
        inside = sum(ant.cell == cell for ant in self._ants)
        return cell == self._nest or inside < self._capacity

    def path_length(self) -> int:
        """Steps to food and back by the highest utilities; 0 if there is no such way."""
        cell, total = self._nest, 0
        for goal in ("food", "nest"):
            levels, been = self.utilities[goal], {cell}
            while True:
                options = [neighbour(cell, heading) for heading in range(N_HEADINGS)]
                cell = max(options, key=lambda one: levels.get(one, 0.0))
                total += 1
                if levels.get(cell, 0.0) == 0:
                    return 0
                if cell in self._goals[goal]:
                    break
                if cell in been:  # and so again, for ever
                    return 0
                been.add(cell)
        return total
