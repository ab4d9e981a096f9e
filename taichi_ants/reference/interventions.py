"""Interventions: changes of a world between two ticks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from taichi_ants.grid.constants import N_HEADINGS, STREAM_ANT, STREAM_INTERVENTION
from taichi_ants.reference.ants import start_order
from taichi_ants.reference.colony import ReferenceColony
from taichi_ants.reference.geometry import Cell, existing_cells, listed_cells, normal_form
from taichi_ants.reference.random_stream import RandomStream, pick, stream_state
from taichi_ants.reference.world_state import Trail
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN
from taichi_ants.worlds.world import World

REACH = 8  # cells that an ant is moved aside at most


class Interventions:
    """Changes a colony that is in an episode; ants look around again after each change.

    A cell that cannot take what is put there is left as it is. An ant still does the action that it
    has drawn already. `ants` start each later episode.
    """

    def __init__(self, colony: ReferenceColony) -> None:
        self.colony, self.ants = colony, colony.n_ants
        self._stream = RandomStream(stream_state(colony.seed, STREAM_INTERVENTION, 0))
        self._epsilon: float | None = None  # as they were set
        self._learning_rate: float | None = None
        self._first = colony.start_world
        self._pheromone = colony.task.pheromone
        self._falls = colony.pheromone.evaporation == self._pheromone.evaporation
        world = colony.start_world
        # What stands on the cells that are not empty when later episodes begin.
        self._start: dict[Cell, int] = {world.queen: QUEEN}
        self._start |= dict.fromkeys(listed_cells(world.foods), FOOD)
        self._start |= dict.fromkeys(listed_cells(world.obstacles), OBSTACLE)

    def _observe(self) -> None:
        for ant in self.colony.ants.values():
            self.colony.observe(ant)

    def put(self, cells: Sequence[Cell], what: int) -> None:
        """Make cells EMPTY, OBSTACLE or FOOD, now and later, but none with an ant or the queen.

        Rock and food move the ants in their way aside first.
        """
        world = self.colony.world
        if what != EMPTY:
            self._move_aside(cells)
        for cell in cells:
            if cell in world.ants or cell == world.queen:
                continue
            world.ground[cell] = self._start[cell] = what
            if what == FOOD:
                self.colony.food_sources.give(cell)
            else:
                self.colony.food_sources.end(cell)
        self._new_trail()
        self._observe()

    def _move_aside(self, cells: Sequence[Cell]) -> None:
        """Move the ants on cells to empty ones next to them, where there are any."""
        world = self.colony.world
        for x, y, z in sorted(existing_cells((REACH + 1,) * 3)[1:], key=max):
            for cell in cells:
                there = normal_form(cell[0] + x, cell[1] + y, cell[2] + z)
                if cell not in world.ants or there in cells or there not in world.ground:
                    continue
                if world.content(there) == EMPTY:
                    ant = world.ants[there] = world.ants.pop(cell)
                    ant.cell = there

    def move_queen(self, cell: Cell) -> None:
        """Let the queen stand on an empty cell, now and later."""
        world = self.colony.world
        assert world.content(cell) == EMPTY
        for ground in (world.ground, self._start):
            ground[world.queen], ground[cell] = EMPTY, QUEEN
        world.queen = cell
        self.colony.food_sources.end(cell)
        self._observe()

    def _new_trail(self) -> None:
        """The same levels, where the rocks are now, under the pheromone that there is now."""
        world = self.colony.world
        rocks = [cell for cell, held in world.ground.items() if held == OBSTACLE]
        bare = World(self._first.ranges, world.queen, obstacles=rocks)
        trail = Trail(bare, world.pheromone)
        for cell, held in world.ground.items():
            if held != OBSTACLE:
                trail.lay(cell, world.trail.level(cell))
        world.trail = trail

    def lay_trail(self, cells: Sequence[Cell], level: int) -> None:
        """Set the trail of cells that are no rocks."""
        world = self.colony.world
        for cell in cells:
            if world.ground[cell] != OBSTACLE:
                world.trail.lay(cell, level)
        self._observe()

    def add_ants(self, cells: Sequence[Cell], heading: int | None = None) -> None:
        """Put ants on those cells that are empty; a heading that is not given is drawn."""
        colony = self.colony
        for cell in cells:
            if colony.world.content(cell) != EMPTY:
                continue
            towards = heading
            if towards is None:
                high, _ = self._stream.draw()
                towards = pick(high, N_HEADINGS)
            slot = next(slot for slot in range(colony.slots) if slot not in colony.ants)
            colony.new_ant(cell, towards, slot)
        self._observe()

    def remove_ants(self, cells: Sequence[Cell]) -> None:
        """Take the ants on these cells away, with their food."""
        for cell in cells:
            ant = self.colony.world.ants.pop(cell, None)
            if ant is not None:
                del self.colony.ants[ant.slot]
        self._observe()

    def set_ants(self, n: int) -> None:
        """Let n ants live now, and start each later episode.

        New ones stand on free cells near the queen, as in `ants.starts`; the latest ones go.
        """
        colony, world = self.colony, self.colony.world
        self.ants = n
        by_number = sorted(colony.ants.values(), key=lambda ant: ant.number)
        self.remove_ants([ant.cell for ant in by_number[n:]])
        order = start_order(self._first, world.queen, colony.seed, colony.start)
        free = [cell for cell in order if world.content(cell) == EMPTY]
        self.add_ants(free[: max(0, n - len(by_number))])

    def set_evaporation(self, falls: bool) -> None:
        """Whether trails evaporate: as the task says, by 1 a tick if it says nothing."""
        self._falls = falls
        if falls and self._pheromone.evaporation == "none":
            self.set_pheromone(evaporation="linear")
        self.set_pheromone()

    def set_pheromone(self, **numbers: Any) -> None:
        """Other numbers of the pheromone; trails stay as dense as before."""
        self._pheromone = replace(self._pheromone, **numbers)
        still: dict[str, Any] = {} if self._falls else {"evaporation": "none", "half_life": None}
        now = replace(self._pheromone, **still)
        self.colony.pheromone = self.colony.world.pheromone = now
        self._new_trail()

    def set_epsilon(self, epsilon: float) -> None:
        """The epsilon of this episode and of all that follow."""
        self._epsilon = self.colony.epsilon = epsilon

    def set_learning_rate(self, learning_rate: float) -> None:
        """The learning rate of this episode and of all that follow."""
        self._learning_rate = self.colony.learning_rate = learning_rate
        self.colony.minds.pace(learning_rate)

    def begin_episode(self) -> None:
        """End the episode, and begin the next one as the interventions left the world."""
        colony, first = self.colony, self._first
        colony.end_episode()
        if self._epsilon is not None:
            colony.epsilon = self._epsilon
        if self._learning_rate is not None:
            self.set_learning_rate(self._learning_rate)
        colony.n_ants = self.ants
        for number in range(len(colony.streams), self.ants):
            state = stream_state(colony.seed, STREAM_ANT, number)
            colony.streams.append(RandomStream(state))
        start = self._start
        held = {kind: [cell for cell in start if start[cell] == kind]
                for kind in (QUEEN, FOOD, OBSTACLE)}  # fmt: skip
        trails = [(tuple(row[:3]), row[3]) for row in first.trails.tolist()]
        trails = [(cell, level) for cell, level in trails if start.get(cell) != OBSTACLE]
        ants = [(tuple(row[:3]), row[3]) for row in first.ants.tolist()]
        ants = [(cell, heading) for cell, heading in ants if start.get(cell, EMPTY) == EMPTY]
        [queen] = held[QUEEN]
        colony.begin_episode(World(first.ranges, queen, held[FOOD], held[OBSTACLE], trails, ants))
