"""Interventions: changes of the worlds of a colony between two ticks.

Changes of single ants and of trails last for the present episode. Changes of rock, food and the
queen persist in later episodes that `Interventions.begin_episode` starts; `Colony.begin_episode`
starts from the colony's own worlds. After a change of cells or ants, the ants of these worlds
observe again once, also if nothing has changed, but still take the actions that they have drawn.

Rock, food and the queen move ants aside to empty cells up to `REACH` steps away. Candidate cells
are tried by distance, then by cube coordinates. If none is empty, the ant and its cell do not
change.

Random numbers come from the stream of (seed, STREAM_INTERVENTION, episode) of each world, in the
order of the changes. Adding n ants draws n headings and, with several castes, n castes. Removing n
of m living ants, or of those of a nest, draws a word of 64 bits for each of the m ants in order.
The n ants with the smallest words go.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from taichi_ants import files
from taichi_ants import interventions as language
from taichi_ants.engines.colony import food_sources
from taichi_ants.engines.colony.layout import ANT_STANDS, COLUMNS, Stage, WorldRow
from taichi_ants.engines.colony.stepping import TickingColony
from taichi_ants.errors import AntsError, as_array, count, expect
from taichi_ants.features.cues import arrays_of
from taichi_ants.grid.constants import N_HEADINGS, STREAM_BORN, STREAM_INTERVENTION
from taichi_ants.grid.hexgrid import AxialGrid, axial
from taichi_ants.grid.randomness import Stream, choose, stream_state
from taichi_ants.interventions import Intervention, flat_indices
from taichi_ants.task import Task
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN
from taichi_ants.worlds.world import World, free_cells

Change = Iterator[None]  # yields once, between its checks and its effects
REACH = 8  # cells; twice the radius of the largest brush on the live page

_GRID = AxialGrid((REACH + 1,) * 3)
_CELLS = _GRID.cells(np.flatnonzero(_GRID.exists))
_ORDER = np.lexsort((*_CELLS.T[::-1], _CELLS.max(axis=1)))
# The offsets of 1 to `REACH` cells, in the order in which they are tried, axial (n, 2).
_STEPS = axial(_CELLS[_ORDER[1:]])
# The ground at the start of later episodes has the kind of a food, or the nest of a queen, above
# the bits of the content.
_CONTENT, _NUMBER = 15, 4
_GROUNDS = {"rock": OBSTACLE, "food": FOOD}


class _World:
    """One world of a colony with interventions; its slots, cells and arrays are of this world.

    The first methods have the names of interventions, see the classes with these paths. A method
    that returns a `Change` yields once, between its checks and its effects.
    """

    def __init__(self, interventions: Interventions, w: int) -> None:
        self.all, self.w, self.colony = interventions, w, interventions.colony
        self.rows = self.colony.arrays["worlds"][:, w]
        self.queen_cells = self.colony.queen_cells[w]  # a view, (nests,)

    def place(self, change: language.Place) -> Change:
        cells, foods = self._index(change.cells), list(self.colony.task.foods)
        if change.what != "queen":
            kind = foods.index(change.kind) if change.kind else 0
            return self._put(cells, _GROUNDS[change.what], kind)
        if not self._can_be_free(cells[0]):
            cell = tuple(self.colony.grid.cells(cells[0]).tolist())
            raise AntsError(
                f"the queen cannot move to cell {cell}, because it is not empty; choose another."
            )
        nest = change.nest or 0
        return self._carry(self.queen_cells[nest], cells[0], QUEEN, nest)

    def clear(self, change: language.Clear) -> Change:
        return self._put(self._index(change.cells), EMPTY)

    def move(self, change: language.Move) -> Change:
        cell, to = flat_indices(self.colony.grid, change.cells)
        what, number = int(self.view("ground")[cell]), 0
        if what not in (OBSTACLE, FOOD, QUEEN) or not self._can_be_free(to):
            yield
            return
        if what == QUEEN:
            number = int(np.argmax(self.queen_cells == cell))
        if what == FOOD:
            number = int(self.colony.food_kinds[self.w, cell])
        yield from self._carry(cell, to, what, number)

    def trail(self, change: language.SetTrail) -> Change:
        everywhere = np.flatnonzero(self.colony.grid.exists)
        cells = everywhere if change.cells is None else self._index(change.cells)
        number = [*self.colony.task.pheromones].index(change.field)
        yield
        self._lay(cells[self.view("walls")[cells] == 0], change.level, number)

    def add_ants(self, change: language.AddAnts) -> Change:
        if change.cells is None:
            return self._add_some(self._amount(change), change.nest)
        cells = self._index(change.cells)
        grid, queens = self.colony.grid, self.colony.grid.cells(self.queen_cells).tolist()
        nests = np.argmin([grid.distances(tuple(queen))[cells] for queen in queens], axis=0)
        if change.nest is not None:
            nests = np.full(len(cells), change.nest)
        return self._add(cells, nests)

    def remove_ants(self, change: language.RemoveAnts) -> Change:
        slots = self._living_slots(change.nest)
        cells = None if change.cells is None else self._index(change.cells)
        yield
        if cells is None:
            words = self.all.stream(self.w).bits(len(slots))
            slots = slots[np.argsort(words, kind="stable")[: self._amount(change)]]
        else:
            slots = slots[np.isin(self.view("cell")[slots], cells)]
        self._remove(slots)

    def ants(self, change: language.SetAnts) -> Change:
        living = self._living_slots()
        if self.all.lasting:
            self._check_room(self.all.starts[self.w], change.number)
        yield from self._add_some(max(change.number - len(living), 0))
        self._remove(living[change.number :])

    # Parts of changes

    def _put(self, there: np.ndarray, what: int, kind: int = 0) -> Change:
        """Make cells EMPTY, OBSTACLE or FOOD, except those of queens and of ants that stay.

        Rock and food move ants aside, and rocks remove trails. Food of a kind fills its cell with
        all loads. Each new food item gets a food source: it grows back, and wanders with adjacent
        food. AntsError if later episodes would have no room for the ants, or no food to learn from.
        """
        held = self.view("ground")[there]
        ants, to = self._aside(there) if what != EMPTY else (there[:0], there[:0])
        at = self.view("cell")[ants]
        there = there[((held >> 4 == 0) | np.isin(there, at)) & (held != QUEEN)]  # see `layout`
        yield from self._start_with(there, what | kind << _NUMBER)
        self._step_aside(ants, to)
        self._fill(there, what, kind)

    def _carry(self, cell: int, to: int, what: int, number: int) -> Change:
        """Move what is in a cell to another one; see `_fill`."""
        yield from self._start_with([cell, to], [EMPTY, what | number << _NUMBER])
        self._step_aside(*self._aside(np.array([to])))
        self._fill(np.array([cell]), EMPTY)
        self._fill(np.array([to]), what, number)
        for feature in self.colony._model.features:
            for name in feature.filled(self.colony, number) if what == FOOD else ():
                self.view(name)[to] = self.view(name)[cell]

    def _add_some(self, n: int, nest: int | None = None) -> Change:
        """Put newborn ants on free start cells; without a nest, nests take turns.

        AntsError if there is too little room.
        """
        colony, grid = self.colony, self.colony.grid
        free = (self.view("ground") == EMPTY) & grid.exists
        if n > (room := int(np.count_nonzero(free))):
            raise AntsError(
                f"{count(n, 'ant')} cannot join, because there are {count(room, 'free cell')}; add "
                "fewer ants."
            )
        nests = np.resize(range(colony.n_nests) if nest is None else [nest], n)
        queens = grid.cells(self.queen_cells)
        cells = free_cells(grid, free, queens, nests, colony.seeds[self.w], colony.start)
        return self._add(cells, nests)

    def _index(self, cells: Sequence[Any] | str) -> np.ndarray:
        """Return the flat indices of cells, or of those of a region, without duplicates."""
        if isinstance(cells, str):
            return self.colony.worlds[self.w].region(cells)
        return np.array(list(dict.fromkeys(flat_indices(self.colony.grid, cells))), np.int64)

    def view(self, name: str) -> np.ndarray:
        """Return a view of the world's part of an array."""
        return self.colony._part(name, self.w)

    def _living_slots(self, nest: int | None = None) -> np.ndarray:
        """Return the slots of the living ants, or those of a nest, in the order of numbers."""
        living = self.colony.living[self.w]
        if nest is not None:
            living = living & (self.colony.nests[self.w] == nest)
        slots = np.flatnonzero(living)
        return slots[np.argsort(self.view("number")[slots])]

    def _amount(self, change: language.AddAnts | language.RemoveAnts) -> int:
        """Return a number of ants, or the number of a share of the living ones, rounded."""
        if change.share is None:
            return change.number or 0
        return int(change.share * len(self._living_slots(change.nest)) + 0.5)

    def _start_with(self, cells: Any, contents: Any) -> Change:
        """Let later episodes begin with these contents of cells, see `_start_of`.

        AntsError if they would have no room for the ants, or no food to learn from.
        """
        of_all, colony = self.all, self.colony
        if not of_all.lasting:
            yield
            return
        start = of_all.starts[self.w].copy()
        start[cells] = contents
        self._check_room(start, max(of_all.ants, colony.ants))
        if colony.learns and not (start & _CONTENT == FOOD).any():
            raise AntsError(
                "this change would remove the last food item, but ants that learn need at least 1; "
                "leave one."
            )
        yield
        of_all.starts[self.w], of_all.changed = start, True

    def _check_room(self, start: np.ndarray, ants: int) -> None:
        """Raise an AntsError unless a number of ants have room at the start of later episodes."""
        if ants > (room := np.count_nonzero(start == EMPTY)):
            raise AntsError(
                f"{count(ants, 'ant')} would start each later episode, but there would be "
                f"{count(int(room), 'free cell')}; leave more cells free, or choose fewer ants."
            )

    def _fill(self, cells: np.ndarray, what: int, number: int = 0) -> None:
        """Make cells without ants EMPTY, OBSTACLE or FOOD, by default with all loads, or one QUEEN.

        `number` is the kind of the food, or the nest of the queen. See `food_sources.changed`.
        """
        colony, arrays, grid = self.colony, self.colony.arrays, self.colony.grid
        self.view("ground")[cells] = what
        self.view("walls")[cells] = what == OBSTACLE
        colony.changed[self.w] = True
        if what == OBSTACLE:
            for pheromone in range(len(colony.pheromones)):
                self._lay(cells, 0, pheromone)
        if what == QUEEN:
            self.queen_cells[number] = cells[0]
            world = World(grid.ranges, grid.cells(cells[0]).tolist())
            for name, make in arrays_of(colony._model.senses).items():
                self.view(name).reshape(colony.n_nests, -1)[number] = make(world, 0)
        for feature in colony._model.features:
            for name, value in feature.filled(colony, number).items() if what == FOOD else ():
                self.view(name)[cells] = value
        if colony._model.food_changes:
            room = colony.n_food_sources
            sources = [food_sources.of_world(arrays, w, room) for w in range(len(colony.worlds))]
            now = food_sources.changed(sources[self.w], cells, what, number, grid.offsets)
            sources[self.w] = now
            if now.shape[1] > room:
                colony._read_start(now.shape[1])
            arrays |= food_sources.arrays(
                sources, arrays["worlds"], colony.n_food_sources, grid.size
            )

    def _aside(self, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the slots of the ants on cells that can move aside, and their new cells."""
        grid = self.colony.grid
        free = (self.view("ground") == EMPTY) & grid.exists
        free[cells] = False
        living = np.flatnonzero(self.colony.living[self.w])
        slots = living[np.isin(self.view("cell")[living], cells)]
        row, column = np.divmod(self.view("cell")[slots], grid.width)
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

    def _step_aside(self, ants: np.ndarray, to: np.ndarray) -> None:
        ground, at = self.view("ground"), self.view("cell")[ants]
        self.view("cell")[ants] = to
        ground[to] = ground[at]
        ground[at] = EMPTY

    def _can_be_free(self, cell: int) -> bool:
        """Return whether a cell is empty, except for an ant that can move aside."""
        return self.view("ground")[cell] == EMPTY or len(self._aside(np.array([cell]))[0]) > 0

    def _lay(self, cells: np.ndarray, level: int, number: int) -> None:
        """Set the levels of a pheromone in cells; 0 is the trail."""
        stored, clock = self.colony._stored_pheromone(self.w, number)
        stored[cells] = level + clock if level else 0

    def _add(self, cells: np.ndarray, nests: np.ndarray) -> Change:
        """Put newborn ants of some nests on those of the cells that are empty."""
        colony, ground, rows = self.colony, self.view("ground"), self.rows
        free = ground[cells] == EMPTY
        cells, nests = cells[free], nests[free]
        n, living = len(cells), int(rows[WorldRow.LIVING])
        if living + n > colony.capacity:
            raise AntsError(
                f"{count(n, 'ant')} cannot join {count(living, 'ant')}, because the capacity of "
                f"this colony is {colony.capacity}; remove ants, or start with a larger capacity."
            )
        yield
        slots = np.flatnonzero(self.view("stage") == Stage.VACANT)[:n]
        numbers = rows[WorldRow.NEXT_NUMBER] + np.arange(n)
        headings = choose(self.all.stream(self.w).bits(n) >> np.uint64(32), N_HEADINGS)
        episode = int(colony.arrays["episodes"][self.w])
        born = (episode << 32) + numbers.astype(np.int64)
        newborn: dict[str, Any] = {
            "cell": cells,
            "heading": headings,
            "number": numbers,
            "nest": nests,
            "stage": Stage.NEWBORN,
            "streams": stream_state(colony.seeds[self.w], STREAM_BORN, born),
        }
        for feature in colony._model.features:
            newborn |= feature.newborn(colony, self.w, nests, self.all.stream(self.w).bits)
        for name in colony._columns():
            self.view(name)[slots] = newborn[name] if name in newborn else COLUMNS[name].start
        ground[cells] = OBSTACLE | (ANT_STANDS - nests) << 4
        rows[WorldRow.NEXT_NUMBER] += n
        self._count_ants()

    def _remove(self, slots: np.ndarray) -> None:
        colony = self.colony
        numbers = self.view("number")[slots]
        first = numbers < colony.ants  # their streams continue in the next episode
        self.view("first_streams")[numbers[first]] = self.view("streams")[slots[first]]
        self.view("ground")[self.view("cell")[slots]] = EMPTY
        self.view("stage")[slots] = Stage.VACANT
        colony._close_gaps()
        self._count_ants()

    def _count_ants(self) -> None:
        taken = self.view("stage") != Stage.VACANT
        self.rows[WorldRow.LIVING] = np.count_nonzero(taken)
        self.rows[WorldRow.TOP] = np.max(np.flatnonzero(taken), initial=-1) + 1
        self.rows[WorldRow.FIRST_VACANT] = np.argmin(taken) if not taken.all() else len(taken)


class Interventions:
    """Changes of some worlds of a colony, and of the start of their later episodes.

    Args:
        colony: The `Colony` to change.
        worlds: Numbers of the worlds to change, None for all. Worlds of a colony share the numbers
            of the task, epsilon, the learning rate and the number of ants at the start, so these
            can only change in all worlds that are still running.
        lasting: Whether later episodes start with the changes, which requires room for the ants
            and, if they learn, food.

    Attributes:
        ants: The number of ants at the start of later episodes.
        length: The `length` of episodes that an intervention begins.

    Raises:
        AntsError: The colony does not have one of the worlds.

    >>> from taichi_ants.interventions import RemoveAnts
    >>> Interventions(colony).apply(RemoveAnts(number=6))
    >>> colony.living.sum().item()
    10
    """

    def __init__(
        self, colony: TickingColony, worlds: Sequence[int] | None = None, lasting: bool = True
    ) -> None:
        expect("colony", colony, TickingColony)
        self.colony, self.ants, self.lasting = colony, colony.ants, lasting
        self.length: int | None = None
        n = len(colony.worlds)
        given = range(n) if worlds is None else worlds
        numbers = as_array("worlds", given, "iu", (None,), 0, n - 1)
        self.worlds = tuple(dict.fromkeys(numbers.tolist()))
        self._first = colony.worlds
        self.starts = [_start_of(world) for world in colony.worlds] if lasting else []
        self._streams: dict[int, tuple[int, Stream]] = {}  # by world: the episode and its stream
        self.changed = False  # whether the next episode starts unlike the present one

    def apply(self, change: Intervention) -> None:
        """Apply an intervention.

        A cell on which something cannot be placed, because an ant, a rock or the queen is on it,
        does not change.

        Raises:
            AntsError: A world does not allow the change; nothing has changed in any world.
        """
        colony = self.colony
        expect("the intervention", change, Intervention)
        change.check_in(colony.worlds[self.worlds[0]], colony.task, colony.learns)
        sets_start = self.lasting and isinstance(change, language.SetAnts)
        running = np.flatnonzero(colony.running).tolist() if colony.episode >= 0 else []
        if (change.in_all_worlds or sets_start) and not set(running) <= set(self.worlds):
            raise AntsError(
                f"the worlds of a colony share what `{change.path}` changes, so it cannot change "
                "in some of them; change all worlds, or make a colony with a single seed."
            )
        match change:
            case language.Episode():
                self.begin_episode()
            case language.SetTask():
                self.set_task(change.changed(colony.task))
            case language.SetEpsilon() | language.SetLearningRate():
                constant: dict[str, Any] = {f"{change.path}_decay": 1.0, f"min_{change.path}": 0.0}
                colony.training = replace(colony.training, **constant)
                if isinstance(change, language.SetEpsilon):
                    colony.epsilon = change.value
                else:
                    colony._set_learning_rate(change.value)
            case _:
                self._change(change)

    def _change(self, change: Intervention) -> None:
        """Make a change in all worlds, after its checks in all; then their ants observe again."""
        colony, worlds = self.colony, list(self.worlds)
        colony._check_begun()
        changes: list[Change] = [getattr(_World(self, w), change.path)(change) for w in worlds]
        for in_world in changes:
            next(in_world)
        colony.ready[worlds] = False  # also after Ctrl-C before the end
        for in_world in changes:
            next(in_world, None)
        colony._observe(worlds)
        colony.ready[worlds] = True
        if self.lasting and isinstance(change, language.SetAnts):
            self.changed |= change.number != self.ants
            self.ants = change.number

    def set_task(self, task: Task) -> None:
        """Set a task that differs only in settings that kernels read as numbers."""
        colony = self.colony
        before = {
            (w, number): colony._stored_pheromone(w, number)
            for w in range(len(colony.worlds))
            for number, pheromone in enumerate(colony.pheromones)
            if not pheromone.dense
        }
        colony.task, colony.pheromones = task, task.pheromones_while(colony.learns)
        colony.arrays |= colony._settings()
        for which, (stored, clock) in before.items():
            _, now = colony._stored_pheromone(*which)
            stored[:] = np.where(stored > clock, stored - clock + now, 0)

    def state(self) -> str:
        """Return a hash of the whole state; colonies with equal hashes behave identically."""
        colony, streams = self.colony, [self.stream(w).state for w in self.worlds]
        rest: Any = [colony.epsilon, colony.learning_rate, colony.length, colony.ticks]
        rest += [colony.ants, self.ants, streams, colony.task.as_dict(), colony.training.as_dict()]
        maps = arrays_of(colony._model.senses)
        arrays = {name: colony.arrays[name] for name in (*colony.stored, "walls", *maps)}
        arrays |= {f"start {w}": start for w, start in enumerate(self.starts)}
        digest = hashlib.sha256(files.to_json(rest).encode())
        for name, array in sorted(arrays.items()):
            digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
            digest.update(np.ascontiguousarray(array).data)
        return digest.hexdigest()

    def stream(self, w: int) -> Stream:
        """Return the random stream of the present episode of a world."""
        episode = int(self.colony.arrays["episodes"][w])
        if w not in self._streams or self._streams[w][0] != episode:
            stream = Stream(self.colony.seeds[w], STREAM_INTERVENTION, max(episode, 0))
            self._streams[w] = episode, stream
        return self._streams[w][1]

    def world(self, w: int = 0) -> World:
        """Return the world in which later episodes of world number `w` start.

        >>> Interventions(colony).world().ranges
        (10, 18, 53)
        """
        first, grid, start = self._first[w], self.colony.grid, self.starts[w]
        trails, ants = grid.index(first.trails[:, :3]), grid.index(first.ants[:, :3])
        foods, queens = (np.flatnonzero(start & _CONTENT == what) for what in (FOOD, QUEEN))
        return World(
            first.ranges,
            grid.cells(queens[np.argsort(start[queens])]).tolist(),
            grid.cells(foods),
            grid.cells(np.flatnonzero((start == OBSTACLE) & grid.exists)),
            first.trails[start[trails] != OBSTACLE],
            first.ants[start[ants] == EMPTY],
            food_kinds=start[foods] >> _NUMBER,
            regions=first.regions,
        )

    def begin_episode(self) -> None:
        """End the present episode, if any, and start the next one; see `Colony.begin_episode`.

        >>> change = Interventions(colony)
        >>> change.apply(SetAnts(10))
        >>> change.begin_episode()
        >>> colony.living.sum().item()
        10
        """
        colony = self.colony
        if colony.episode >= 0:
            colony.end_episode()
        colony.ants = self.ants
        worlds = [self.world(w) for w in range(len(self._first))] if self.changed else None
        colony.begin_episode(self.length, worlds)
        self.changed = False


def _start_of(world: World) -> np.ndarray:
    """Return the ground of a world, with the numbers of nests and kinds of food, uint8 (size,)."""
    start = world.ground()
    start[world.grid.index(world.queens)] |= (np.arange(world.n_nests) << _NUMBER).astype(np.uint8)
    return start | world.kinds_by_cell() << _NUMBER
