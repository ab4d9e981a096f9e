"""Interventions: changes of a colony between two ticks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from taichi_ants.grid.constants import N_HEADINGS, STREAM_ANT, STREAM_INTERVENTION
from taichi_ants.reference.ants import start_order
from taichi_ants.reference.castes import draw_caste
from taichi_ants.reference.colony import ReferenceColony
from taichi_ants.reference.geometry import (
    Cell,
    distance,
    existing_cells,
    listed_cells,
    normal_form,
)
from taichi_ants.reference.random_stream import RandomStream, pick, stream_state
from taichi_ants.reference.world_state import Trail
from taichi_ants.task import Task
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN
from taichi_ants.worlds.world import World

REACH = 8  # the most cells by which an ant is moved aside


class Interventions:
    """Changes of a colony during an episode; ants observe again after each change.

    Ants still take the actions that they have already drawn. A cell on which something cannot be
    placed stays as it is. `ants` is the number of ants at the start of later episodes.
    """

    def __init__(self, colony: ReferenceColony) -> None:
        self.colony, self.ants = colony, colony.n_ants
        self._set_stream()
        self._epsilon: float | None = None  # as an intervention has set them
        self._learning_rate: float | None = None
        self._first = colony.start_world
        self._pheromone = colony.task.pheromone
        self._falls = colony.pheromone.evaporation == self._pheromone.evaporation
        for name, field in colony.fields.items():
            self._falls = self._falls and field == colony.task.fields[name]
        world = colony.start_world
        # The content of the cells that are not empty when later episodes start.
        self._queens = list(colony.world.queens)  # when later episodes start
        self._start: dict[Cell, int] = dict.fromkeys(self._queens, QUEEN)
        self._kinds = dict(colony.world.kinds)  # of their food
        self._start |= dict.fromkeys(listed_cells(world.foods), FOOD)
        self._start |= dict.fromkeys(listed_cells(world.obstacles), OBSTACLE)

    def _set_stream(self) -> None:
        """Start the stream of random numbers of the present episode."""
        state = stream_state(self.colony.seed, STREAM_INTERVENTION, max(self.colony.episode, 0))
        self._stream = RandomStream(state)

    def _observe(self) -> None:
        for ant in self.colony.ants.values():
            self.colony.observe(ant)

    def put(self, cells: Sequence[Cell], what: int, kind: int = 0) -> None:
        """Make cells EMPTY, OBSTACLE or FOOD, now and later, except those of ants and queens.

        Rock and food first move ants on these cells aside. Food has all loads of its kind.
        """
        self._put(cells, what, kind, self.colony.world.full(kind))
        self._observe()

    def _put(self, cells: Sequence[Cell], what: int, kind: int = 0, loads: int = 1) -> None:
        world = self.colony.world
        if what != EMPTY:
            self._move_aside(cells)
        for cell in cells:
            if cell in world.ants or cell in world.queens:
                continue
            world.ground[cell] = self._start[cell] = what
            if what == FOOD:
                self._kinds[cell] = kind
                world.put_food(cell, kind, loads)
                self.colony.food_sources.put(cell, kind)
            else:
                self.colony.food_sources.end(cell)
        self._new_trail()

    def _move_aside(self, cells: Sequence[Cell]) -> None:
        """Move the ants on these cells to the nearest empty cells, within REACH."""
        world = self.colony.world
        for x, y, z in sorted(existing_cells((REACH + 1,) * 3)[1:], key=max):
            for cell in cells:
                there = normal_form(cell[0] + x, cell[1] + y, cell[2] + z)
                if cell not in world.ants or there in cells or there not in world.ground:
                    continue
                if world.content(there) == EMPTY:
                    ant = world.ants[there] = world.ants.pop(cell)
                    ant.cell = there

    def move(self, cell: Cell, to: Cell) -> None:
        """Move rock, food or the queen to an empty cell, now and later; ants move aside."""
        world = self.colony.world
        what = world.ground[cell]
        if what != EMPTY and world.ground[to] == EMPTY:
            self._move_aside([to])
            if to not in world.ants and what == QUEEN:
                self._move_queen(to, world.queens.index(cell))
            elif to not in world.ants:
                self._put([cell], EMPTY)
                self._put([to], what, world.kinds.get(cell, 0), world.loads.get(cell, 1))
        self._observe()

    def move_queen(self, cell: Cell, nest: int = 0) -> None:
        """Move a queen to an empty cell, now and later; an ant there moves aside."""
        self._move_queen(cell, nest)
        self._observe()

    def _move_queen(self, cell: Cell, nest: int) -> None:
        world = self.colony.world
        self._move_aside([cell])
        assert world.content(cell) == EMPTY
        for ground in (world.ground, self._start):
            ground[world.queens[nest]], ground[cell] = EMPTY, QUEEN
        world.queens[nest] = self._queens[nest] = cell
        self.colony.food_sources.end(cell)

    def _new_trail(self) -> None:
        """Make new trails with the same levels, for the present rocks and pheromones."""
        world = self.colony.world
        rocks = [cell for cell, held in world.ground.items() if held == OBSTACLE]
        bare = World(self._first.ranges, world.queen, obstacles=rocks)
        rules = self.colony.task.rules
        world.trail = self._copy(world.trail, Trail(bare, world.pheromone, rules=rules))
        for name, field in self.colony.fields.items():
            world.fields[name] = self._copy(world.fields[name], Trail(bare, field, rules=rules))

    def _copy(self, old: Trail, new: Trail) -> Trail:
        """Return a new trail after setting it to the levels of an old one."""
        for cell, held in self.colony.world.ground.items():
            if held != OBSTACLE:
                new.lay(cell, old.level(cell))
        return new

    def lay_trail(self, cells: Sequence[Cell], level: int, field: str = "trail") -> None:
        """Set the levels of a pheromone in cells other than rocks."""
        world = self.colony.world
        for cell in cells:
            if world.ground[cell] != OBSTACLE:
                world.pheromone_named(field).lay(cell, level)
        self._observe()

    def add_ants(
        self, cells: Sequence[Cell], heading: int | None = None, nest: int | None = None
    ) -> None:
        """Put ants on those of the cells that are empty; draw each heading if none is given.

        Without a nest, each belongs to the nearest queen, the first of several.
        """
        queens = self.colony.world.queens
        nests = [
            min(range(len(queens)), key=lambda queen: distance(cell, queens[queen]))
            if nest is None
            else nest
            for cell in cells
        ]
        self._add(cells, nests, heading)

    def _add(self, cells: Sequence[Cell], nests: Sequence[int], heading: int | None) -> None:
        colony = self.colony
        pairs = zip(cells, nests, strict=True)
        free = [(cell, nest) for cell, nest in pairs if colony.world.content(cell) == EMPTY]
        headings = [heading or 0 for _ in free]
        if heading is None:
            headings = [pick(self._stream.draw()[0], N_HEADINGS) for _ in free]
        castes = [
            draw_caste(colony.castes, nest, colony.starting[nest], self._stream) for _, nest in free
        ]
        for (cell, nest), towards, caste in zip(free, headings, castes, strict=True):
            slot = next(slot for slot in range(colony.slots) if slot not in colony.ants)
            colony.new_ant(cell, towards, slot, nest, caste)
        self._observe()

    def add_some(self, n: int, heading: int | None = None, nest: int | None = None) -> None:
        """Put n ants on free cells, in the order of `ants.starts`; without a nest, by turns."""
        colony, world = self.colony, self.colony.world
        by_turns = range(len(world.queens)) if nest is None else [nest]
        orders = {
            number: start_order(self._first, world.queens[number], colony.seed, colony.start)
            for number in by_turns
        }
        cells: list[Cell] = []
        nests = [by_turns[k % len(by_turns)] for k in range(n)]
        for number in nests:
            free = (cell for cell in orders[number] if world.content(cell) == EMPTY)
            cells.append(next(cell for cell in free if cell not in cells))
        self._add(cells, nests, heading)

    def remove_some(self, n: int, nest: int | None = None) -> None:
        """Remove n random ants, or of a nest: those whose draws are the smallest."""
        draws = {}
        for ant in sorted(self.colony.ants.values(), key=lambda ant: ant.number):
            if nest in (None, ant.nest):
                high, low = self._stream.draw()
                draws[high, low] = ant.cell
        self.remove_ants([draws[draw] for draw in sorted(draws)[:n]])

    def set_task(self, task: Task) -> None:
        """Change numbers of the task."""
        self.colony.task, self._pheromone = task, task.pheromone
        self.colony.world.foods = self.colony.foods
        self.colony.take_castes()
        learns = self.colony.sharing != "frozen"
        self._falls = task.evaporation_in_training if learns else task.evaporation_in_evaluation
        self.set_pheromone()

    def set_policy(self, q_values: np.ndarray) -> None:
        """Let all ants follow a table."""
        for learner in self.colony.learners.tables:
            learner.rows = [list(row) for row in np.asarray(q_values, np.float32)]

    def remove_ants(self, cells: Sequence[Cell], nest: int | None = None) -> None:
        """Remove the ants on these cells, or those of a nest, with their food."""
        by_cell = self.colony.world.ants
        for cell in cells:
            if cell in by_cell and nest in (None, by_cell[cell].nest):
                del self.colony.ants[by_cell.pop(cell).slot]
        self._observe()

    def set_ants(self, n: int) -> None:
        """Set the number of ants, now and at the start of later episodes.

        New ants take free cells as in `ants.starts`; the highest numbers are removed first.
        """
        colony = self.colony
        self.ants = n
        by_number = sorted(colony.ants.values(), key=lambda ant: ant.number)
        if n < len(by_number):
            self.remove_ants([ant.cell for ant in by_number[n:]])
        else:
            self.add_some(n - len(by_number))

    def set_evaporation(self, falls: bool) -> None:
        """Switch evaporation on (that of the task, or 1 per tick if it has none) or off."""
        self._falls = falls
        if falls and self._pheromone.evaporation == "none":
            self.set_pheromone(evaporation="linear")
        self.set_pheromone()

    def set_pheromone(self, **numbers: Any) -> None:
        """Change numbers of the pheromone, but not whether it is dense."""
        self._pheromone = replace(self._pheromone, **numbers)
        still: dict[str, Any] = {} if self._falls else {"evaporation": "none", "half_life": None}
        now = replace(self._pheromone, **still)
        self.colony.pheromone = self.colony.world.pheromone = now
        self.colony.fields = {
            name: field if self._falls else field.lasting
            for name, field in self.colony.task.fields.items()
        }
        self._new_trail()

    def set_epsilon(self, epsilon: float) -> None:
        """Set epsilon for this and all later episodes."""
        self._epsilon = self.colony.epsilon = epsilon

    def set_learning_rate(self, learning_rate: float) -> None:
        """Set the learning rate for this and all later episodes."""
        self._learning_rate = self.colony.learning_rate = learning_rate
        self.colony.learners.set_learning_rate(learning_rate)

    def begin_episode(self) -> None:
        """End the episode, and start the next one in the world as interventions have changed it."""
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
        foods = [(cell, self._kinds[cell]) for cell in held[FOOD]]
        now = World(
            *(first.ranges, self._queens, foods, held[OBSTACLE], trails, ants),
            regions=first.regions,
        )
        colony.begin_episode(now)
        self._set_stream()
