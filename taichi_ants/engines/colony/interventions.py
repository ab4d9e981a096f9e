"""Interventions: changes of a colony of one world between two ticks.

Changes of rocks, food and the queen persist in later episodes. Changes of trails and of single ants
last for the present episode. After each change the ants observe again, but still take the actions
that they have already drawn.

Rock and food move ants aside to empty cells up to `REACH` steps away. Candidate cells are tried by
distance, then by cube coordinates. If none is empty, the ant and its cell do not change.
"""

from __future__ import annotations

import hashlib
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from taichi_ants import files
from taichi_ants.engines.colony import food_sources
from taichi_ants.engines.colony.layout import ANT_GROUND, FoodSourceRow, Stage, WorldRow
from taichi_ants.errors import AntsError, count
from taichi_ants.grid.constants import (
    N_HEADINGS,
    STREAM_BORN,
    STREAM_INTERVENTION,
    STREAM_START_CELL,
)
from taichi_ants.grid.hexgrid import AxialGrid, axial
from taichi_ants.grid.randomness import Stream, choose, stream_state
from taichi_ants.task import Task
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN
from taichi_ants.worlds.world import World

if TYPE_CHECKING:
    from taichi_ants.engines.colony.colony import Colony

REACH = 8  # cells; twice the radius of the largest brush on the live page


_GRID = AxialGrid((REACH + 1,) * 3)
_CELLS = _GRID.cells(np.flatnonzero(_GRID.exists))
_ORDER = np.lexsort((*_CELLS.T[::-1], _CELLS.max(axis=1)))
# The offsets of 1 to `REACH` cells, in the order in which they are tried, axial (n, 2).
_STEPS = axial(_CELLS[_ORDER[1:]])


class Interventions:
    """Changes of a colony of one world, and of the start of its later episodes.

    Cells are flat indices, int (n,), without duplicates. A cell on which something cannot be
    placed, because an ant, a rock or the queen is on it, does not change. A method that raises an
    error changes nothing. `ants` is the number of ants at the start of later episodes.

    Raises:
        AntsError: The colony has several worlds.
    """

    def __init__(self, colony: Colony) -> None:
        if len(colony.worlds) != 1:
            raise AntsError(
                f"the colony has {len(colony.worlds)} worlds, but interventions require a colony "
                "of one world; pass a single seed."
            )
        self.colony, self.ants = colony, colony.ants
        (self._first,) = colony.worlds
        self._start = self._first.ground()
        self._stream = Stream(colony.seeds[0], STREAM_INTERVENTION)
        self._changed = False  # whether the start of the next episode differs from the present one

    @property
    def living(self) -> int:
        """The number of living ants."""
        return int(self.colony.arrays["worlds"][WorldRow.LIVING, 0])

    def put(self, cells: np.ndarray, what: int) -> None:
        """Make cells EMPTY, OBSTACLE or FOOD, except those of the queen and of ants that stay.

        Rock and food move ants aside, and rocks remove trails. Each new food item gets a food
        source: it grows back, and wanders with adjacent food. AntsError if later episodes would
        have no room for the ants, or no food to learn from.
        """
        arrays = self.colony.arrays
        held = arrays["ground"][cells]
        ants, to = self._aside(cells) if what != EMPTY else (cells[:0], cells[:0])
        at = arrays["cell"][ants]
        cells = cells[((held >> 4 == 0) | np.isin(cells, at)) & (held != QUEEN)]  # see `layout`
        start = self._start.copy()
        start[cells] = what
        self._begin_with(start)
        arrays["cell"][ants] = to
        arrays["ground"][to] = arrays["ground"][at]
        arrays["ground"][cells] = what
        arrays["walls"][cells] = what == OBSTACLE
        if what == OBSTACLE:
            self._lay(cells, 0)
        self._change_food_sources(cells, what)
        self.colony.observe()

    def _aside(self, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the slots of the ants on cells that can move aside, and their new cells."""
        colony, grid = self.colony, self.colony.grid
        free = (colony.arrays["ground"] == EMPTY) & grid.exists
        free[cells] = False
        slots = np.flatnonzero(colony.living[0] & np.isin(colony.cells[0], cells))
        row, column = np.divmod(colony.cells[0, slots], grid.width)
        to = np.full(len(slots), -1)
        for q, r in _STEPS.tolist():
            waiting = np.flatnonzero(to < 0)
            if not len(waiting):
                break
            x, y = column[waiting] + q, row[waiting] + r
            inside = (x >= 0) & (x < grid.width) & (y >= 0) & (y < grid.height)
            waiting, there = waiting[inside], (y * grid.width + x)[inside]
            goes = free[there]
            to[waiting[goes]] = there[goes]
            free[there[goes]] = False
        return slots[to >= 0], to[to >= 0]

    def move_queen(self, cell: int) -> None:
        """Move the queen; AntsError if the cell is not empty, or later episodes would lack food."""
        arrays, grid = self.colony.arrays, self.colony.grid
        if arrays["ground"][cell] != EMPTY:
            raise AntsError(
                f"the queen cannot move to cell {tuple(grid.cells(cell).tolist())}, because it is "
                "not empty; choose an empty cell."
            )
        old = arrays["worlds"][WorldRow.QUEEN_CELL, 0]
        start = self._start.copy()
        start[old], start[cell] = EMPTY, QUEEN
        self._begin_with(start)
        arrays["ground"][old], arrays["ground"][cell] = EMPTY, QUEEN
        arrays["worlds"][WorldRow.QUEEN_CELL, 0] = cell
        arrays["closer"][:] = World(grid.ranges, grid.cells(cell).tolist()).closer()
        self._change_food_sources(np.array([cell]), QUEEN)
        self.colony.observe()

    def lay_trail(self, cells: np.ndarray, level: int) -> None:
        """Set the trail of cells other than rocks."""
        self._lay(cells[self.colony.arrays["walls"][cells] == 0], level)
        self.colony.observe()

    def _lay(self, cells: np.ndarray, level: int) -> None:
        arrays = self.colony.arrays
        if self.colony.pheromone.dense:
            arrays["level"][cells] = level
        else:
            arrays["trail"][cells] = level + self.colony.trail_clock(0) if level else 0

    def add_ants(self, cells: np.ndarray, heading: int | None = None) -> None:
        """Put newborn ants on those of the cells that are empty, with random headings by default.

        AntsError if the capacity of the colony is too small.
        """
        colony, arrays = self.colony, self.colony.arrays
        world = arrays["worlds"][:, 0]
        cells = cells[arrays["ground"][cells] == EMPTY]
        n, living = len(cells), self.living
        if living + n > colony.capacity:
            raise AntsError(
                f"{count(n, 'ant')} cannot join {count(living, 'ant')}, because the capacity of "
                f"this colony is {colony.capacity}; remove ants, or start with a larger capacity."
            )
        slots = np.flatnonzero(arrays["stage"] == Stage.VACANT)[:n]
        numbers = world[WorldRow.NEXT_NUMBER] + np.arange(n)
        drawn = heading is None
        headings = choose(self._stream.bits(n) >> np.uint64(32), N_HEADINGS) if drawn else heading
        born = (colony.episode << 32) + numbers.astype(np.int64)
        newborn = {
            "cell": cells,
            "heading": headings,
            "number": numbers,
            "action": -1,
            "next_action": -1,
            "stage": Stage.NEWBORN,
            "streams": stream_state(colony.seeds[0], STREAM_BORN, born),
        }
        for name in colony.columns():
            arrays[name][slots] = newborn.get(name, 0)
        arrays["ground"][cells] = ANT_GROUND
        world[WorldRow.NEXT_NUMBER] += n
        self._count_ants()
        colony.observe()

    def remove_ants(self, cells: np.ndarray) -> None:
        """Remove the ants on these cells, with the food that they carry."""
        colony = self.colony
        self._remove(np.flatnonzero(colony.living[0] & np.isin(colony.cells[0], cells)))

    def _remove(self, slots: np.ndarray) -> None:
        arrays = self.colony.arrays
        numbers = arrays["number"][slots]
        first = numbers < self.colony.ants  # their streams continue in the next episode
        arrays["first_streams"][numbers[first]] = arrays["streams"][slots[first]]
        arrays["ground"][arrays["cell"][slots]] = EMPTY
        arrays["stage"][slots] = Stage.VACANT
        self._count_ants()
        self.colony.observe()

    def _count_ants(self) -> None:
        world = self.colony.arrays["worlds"][:, 0]
        taken = self.colony.arrays["stage"] != Stage.VACANT
        world[WorldRow.LIVING] = np.count_nonzero(taken)
        world[WorldRow.TOP] = np.max(np.flatnonzero(taken), initial=-1) + 1
        world[WorldRow.FIRST_VACANT] = np.argmin(taken) if not taken.all() else len(taken)

    def set_ants(self, n: int) -> None:
        """Set the number of ants, now and at the start of later episodes.

        New ants take free cells in the order of `World.start`; ants with the highest numbers are
        removed. AntsError if there is too little room.
        """
        colony = self.colony
        (slots,) = np.nonzero(colony.living[0])
        missing, free = n - len(slots), np.flatnonzero(colony.arrays["ground"] == EMPTY)
        later = int(np.count_nonzero(self._start == EMPTY))
        room = min(colony.capacity, len(free) + len(slots), later)
        if n > room:
            raise AntsError(f"ants is {n}, but there is room for {room}; choose fewer ants.")
        self._changed |= n != self.ants
        self.ants = n
        if missing > 0:
            # The order in which ants would start there.
            grid = colony.grid
            words = stream_state(colony.seeds[0], STREAM_START_CELL, grid.number(grid.cells(free)))
            queen = grid.cells(colony.arrays["worlds"][WorldRow.QUEEN_CELL, 0])
            far = grid.distances(tuple(queen.tolist()))[free]
            order = np.lexsort((words, far * (colony.start == "nest")))
            self.add_ants(free[order[:missing]])
        elif missing < 0:
            self._remove(slots[np.argsort(colony.numbers[0, slots])[missing:]])

    def set_task(self, task: Task) -> None:
        """Set a task; only numbers of the pheromone and the use of evaporation may have changed."""
        colony, arrays = self.colony, self.colony.arrays
        levels = np.maximum(arrays["trail"] - colony.trail_clock(0), 0)
        colony.task, colony.pheromone = task, task.pheromone_while(colony.learns)
        arrays["trail"][:] = np.where(levels > 0, levels + colony.trail_clock(0), 0)

    def set_epsilon(self, epsilon: float) -> None:
        """Set epsilon, which no longer decays."""
        colony = self.colony
        colony.epsilon = epsilon
        colony.training = replace(colony.training, epsilon_decay=1.0, min_epsilon=0.0)

    def set_learning_rate(self, learning_rate: float) -> None:
        """Set the learning rate, which no longer decays."""
        colony = self.colony
        colony.training = replace(colony.training, learning_rate_decay=1.0, min_learning_rate=0.0)
        colony.set_learning_rate(learning_rate)

    def state(self) -> str:
        """Return a hash of the whole state; colonies with equal hashes behave identically."""
        colony = self.colony
        moment = (colony.epsilon, colony.learning_rate, colony.length, colony.ticks, colony.ants)
        rest = (self.ants, self._stream.state, colony.task.as_dict(), colony.training.as_dict())
        arrays = {name: colony.arrays[name] for name in (*colony.stored, "walls", "closer")}
        digest = hashlib.sha256(files.to_json([*moment, *rest]).encode())
        for name, array in sorted({**arrays, "start": self._start}.items()):
            digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
            digest.update(np.ascontiguousarray(array).data)
        return digest.hexdigest()

    def world(self) -> World:
        """Return the world in which later episodes start."""
        first, grid, start = self._first, self.colony.grid, self._start
        trails, ants = grid.index(first.trails[:, :3]), grid.index(first.ants[:, :3])
        return World(
            first.ranges,
            grid.cells(int(np.argmax(start == QUEEN))).tolist(),
            grid.cells(np.flatnonzero(start == FOOD)),
            grid.cells(np.flatnonzero((start == OBSTACLE) & grid.exists)),
            first.trails[start[trails] != OBSTACLE],
            first.ants[start[ants] == EMPTY],
        )

    def begin_episode(self, length: int | None) -> None:
        """End the present episode, if any, and start the next one; see `Colony.begin_episode`."""
        colony = self.colony
        if colony.episode >= 0:
            colony.end_episode()
        colony.ants = self.ants
        colony.begin_episode(length, self.world() if self._changed else None)
        self._changed = False

    def _begin_with(self, start: np.ndarray) -> None:
        """Set the ground at the start of later episodes; AntsError if it is not allowed."""
        ants, room = max(self.ants, self.colony.ants), np.count_nonzero(start == EMPTY)
        if ants > room:
            raise AntsError(
                f"{count(ants, 'ant')} start each episode, but this change would leave "
                f"{count(int(room), 'free cell')}; leave more cells free."
            )
        if self.colony.learns and not (start == FOOD).any():
            raise AntsError(
                "this change would remove the last food item, but ants that learn need at least 1; "
                "leave one."
            )
        self._start, self._changed = start, True

    def _change_food_sources(self, cells: np.ndarray, what: int) -> None:
        """Add food sources for FOOD on cells, or remove the sources of cells with anything else.

        A waiting source of a cell gets its food back. A new source joins the pile of the first
        adjacent source, or forms a new pile.
        """
        colony, arrays = self.colony, self.colony.arrays
        if not colony.food_changes:
            return
        known = arrays["food_sources"][:, : arrays["worlds"][WorldRow.FOOD_SOURCES, 0]]
        if what != FOOD:
            known = known[:, ~np.isin(known[FoodSourceRow.CELL], cells)]
        at, taken, pile = known[
            [FoodSourceRow.CELL, FoodSourceRow.TAKEN, FoodSourceRow.PILE]
        ].tolist()
        on: dict[int, list[int]] = {}
        for source, cell in enumerate(at):
            on.setdefault(cell, []).append(source)
        for cell in cells.tolist() if what == FOOD else ():
            here = on.setdefault(cell, [])
            if not here:
                around = [on.get(cell + step, ()) for step in colony.grid.offsets.tolist()]
                first = min((source for there in around for source in there), default=None)
                here.append(len(at))
                at.append(cell)
                taken.append(0)
                pile.append(max(pile, default=-1) + 1 if first is None else pile[first])
            if all(taken[source] >= 0 for source in here):
                taken[here[0]] = -1
        _, pile = np.unique(np.array(pile, int), return_inverse=True)  # without removed piles
        colony.n_food_sources = max(len(at), int(np.count_nonzero(self._start == FOOD)))
        sources = [np.array([at, taken, pile], int).reshape(3, -1)]
        arrays |= food_sources.arrays(
            sources, arrays["worlds"], colony.n_food_sources, colony.grid.size
        )
