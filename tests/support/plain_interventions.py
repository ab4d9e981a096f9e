"""Interventions: changes of a colony between two ticks, and protocols, which say when."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from plain_measures import measured

import taichi_ants.interventions as language
from taichi_ants.grid.constants import N_HEADINGS, STREAM_INTERVENTION
from taichi_ants.protocol import At, Every, ProtocolEvent, When
from taichi_ants.reference.ants import Ant, start_order
from taichi_ants.reference.colony import ReferenceColony
from taichi_ants.reference.features.castes import draw_caste
from taichi_ants.reference.geometry import Cell, distance, existing_cells, listed_cells, normal_form
from taichi_ants.reference.random_stream import RandomStream, pick, stream_state
from taichi_ants.task.constants import EMPTY, FOOD, OBSTACLE, QUEEN

REACH = 8  # the most cells by which an ant is moved aside


class Interventions:
    """Changes of a colony during the present episode.

    A cell on which something cannot be placed stays as it is.
    """

    def __init__(self, colony: ReferenceColony) -> None:
        self.colony = colony
        state = stream_state(colony.seed, STREAM_INTERVENTION, max(colony.episode, 0))
        self._stream = RandomStream(state)

    def apply(self, change: Any) -> None:
        """Apply an intervention; if it changes cells or ants, all ants observe again.

        Ants still take the actions that they have already drawn.
        """
        colony, world = self.colony, self.colony.world
        match change:
            case language.SetEpsilon() | language.SetLearningRate():
                setattr(colony, change.path, change.value)
                constant: dict[str, Any] = {f"{change.path}_decay": 1.0, f"min_{change.path}": 0.0}
                colony.training = replace(colony.training, **constant)
            case language.SetTask():
                colony.task = change.changed(colony.task)
                world.take(colony.task, colony.learns)
            case _:
                self._change_cells_or_ants(change)
                for ant in colony.ants.values():
                    colony.observe(ant)

    def _change_cells_or_ants(self, change: Any) -> None:
        world, cells = self.colony.world, self._cells(change)
        match change:
            case language.RemoveAnts():
                ants = self._ants(change.nest)
                if change.cells is None:
                    draws = [self._stream.draw() for _ in ants]
                    order = sorted(range(len(ants)), key=draws.__getitem__)
                    self._remove([ants[k] for k in order[: self._amount(change)]])
                else:
                    self._remove([ant for ant in ants if ant.cell in cells])
            case language.AddAnts(cells=None):
                self._add_some(self._amount(change), change.nest)
            case language.AddAnts():
                nests = range(len(world.queens)) if change.nest is None else [change.nest]
                nearest = [
                    min(nests, key=lambda nest: distance(cell, world.queens[nest]))
                    for cell in cells
                ]
                self._add(cells, nearest)
            case language.SetAnts():
                missing = change.number - len(self._ants())
                self._remove(self._ants()[change.number :])
                self._add_some(max(missing, 0))
            case language.Place(what="queen"):
                self._move_queen(cells[0], change.nest or 0)
            case language.Place():
                names = list(self.colony.task.foods)
                kind = names.index(change.kind) if change.kind else 0
                what = OBSTACLE if change.what == "rock" else FOOD
                self._put(cells, what, kind)
            case language.Clear():
                self._put(cells, EMPTY)
            case language.Move():
                self._move(*cells)
            case language.SetTrail():
                for cell in world.ground if change.cells is None else cells:
                    if world.ground[cell] != OBSTACLE:
                        world.pheromones[change.field].lay(cell, change.level)

    def _cells(self, change: Any) -> list[Cell]:
        """Return the cells of an intervention, without duplicates."""
        cells = getattr(change, "cells", None) or ()
        if isinstance(cells, str):
            return listed_cells(self.colony.start_world.regions[cells])
        return list(dict.fromkeys(normal_form(*cell) for cell in cells))

    def _ants(self, nest: int | None = None) -> list[Ant]:
        """Return the living ants, or those of a nest, in the order of numbers."""
        ants = [ant for ant in self.colony.ants.values() if nest in (None, ant.nest)]
        return sorted(ants, key=lambda ant: ant.number)

    def _amount(self, change: Any) -> int:
        """Return a number of ants; a share is rounded, halves up."""
        if change.number is not None:
            return change.number
        return int(change.share * len(self._ants(change.nest)) + 0.5)

    def _put(self, cells: Sequence[Cell], what: int, kind: int = 0) -> None:
        """Make cells EMPTY, OBSTACLE or FOOD, except those of ants and queens."""
        world = self.colony.world
        self._move_aside(cells if what != EMPTY else ())
        for cell in cells:
            if cell in world.ants or cell in world.queens:
                continue
            world.ground[cell] = what
            if what == FOOD:
                self.colony.fill(cell, kind)
                self.colony.food_sources.put(cell, kind)
            else:
                self.colony.food_sources.end(cell)
        world.take(self.colony.task, self.colony.learns)  # rocks have no trail

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

    def _move(self, cell: Cell, to: Cell) -> None:
        """Move rock, food or the queen to an empty cell; ants move aside."""
        world = self.colony.world
        what = world.ground[cell]
        if what == EMPTY or world.ground[to] != EMPTY:
            return
        self._move_aside([to])
        if to not in world.ants and what == QUEEN:
            self._move_queen(to, world.queens.index(cell))
        elif to not in world.ants:
            self._put([cell], EMPTY)
            food = world.of_cells[cell]
            self._put([to], what, food.get("kind_of", 0))
            world.of_cells[to] = food

    def _move_queen(self, cell: Cell, nest: int) -> None:
        """Move a queen to an empty cell; an ant there moves aside."""
        world = self.colony.world
        self._move_aside([cell])
        assert world.content(cell) == EMPTY
        old, world.queens[nest] = world.queens[nest], cell
        world.ground[old], world.ground[cell] = EMPTY, QUEEN
        self.colony.food_sources.end(cell)

    def _add(self, cells: Sequence[Cell], nests: Sequence[int]) -> None:
        """Put ants on those of the cells that are empty."""
        colony = self.colony
        pairs = zip(cells, nests, strict=True)
        free = [(cell, nest) for cell, nest in pairs if colony.world.content(cell) == EMPTY]
        headings = [pick(self._stream.draw()[0], N_HEADINGS) for _ in free]
        castes = [
            draw_caste(colony.castes, nest, colony.starting[nest], self._stream) for _, nest in free
        ]
        for (cell, nest), heading, caste in zip(free, headings, castes, strict=True):
            slot = next(slot for slot in range(colony.slots) if slot not in colony.ants)
            colony.new_ant(cell, heading, slot, nest, caste)

    def _add_some(self, n: int, nest: int | None = None) -> None:
        """Put n ants on free cells, in the order of `ants.starts`; without a nest, by turns."""
        colony, world = self.colony, self.colony.world
        by_turns = range(len(world.queens)) if nest is None else [nest]
        orders = {
            number: start_order(colony.start_world, world.queens[number], colony.seed, colony.start)
            for number in by_turns
        }
        cells: list[Cell] = []
        nests = [by_turns[k % len(by_turns)] for k in range(n)]
        for number in nests:
            free = (cell for cell in orders[number] if world.content(cell) == EMPTY)
            cells.append(next(cell for cell in free if cell not in cells))
        self._add(cells, nests)

    def _remove(self, ants: Iterable[Ant]) -> None:
        """Remove ants with their food."""
        for ant in ants:
            del self.colony.ants[ant.slot], self.colony.world.ants[ant.cell]


class Protocol:
    """Events in each episode of a colony.

    Each episode begins without the interventions of the one before. Call `before_tick` before each
    tick.
    """

    def __init__(self, colony: ReferenceColony, events: Sequence[ProtocolEvent]) -> None:
        self._colony, self._events = colony, events

    def begin_episode(self) -> None:
        """Begin an episode of the colony."""
        colony = self._colony
        colony.begin_episode()
        self._happened: set[int] = set()
        self._interventions = Interventions(colony)
        self._before = colony.task, colony.training, colony.epsilon, colony.learning_rate

    def end_episode(self) -> None:
        """Undo changes of numbers, and end the episode."""
        colony = self._colony
        colony.task, colony.training, colony.epsilon, colony.learning_rate = self._before
        colony.end_episode()

    def before_tick(self) -> None:
        """Let all events of the present tick happen."""
        for number, event in enumerate(self._events):
            if self._happens(number, event):
                self._happened.add(number)
                for intervention in event.interventions:
                    self._interventions.apply(intervention)

    def _happens(self, number: int, event: ProtocolEvent) -> bool:
        tick = self._colony.record.ticks
        if isinstance(event, At):
            return tick == event.tick
        if isinstance(event, Every):
            start = event.ticks if event.start is None else event.start
            stop = tick if event.stop is None else event.stop
            return start <= tick <= stop and (tick - start) % event.ticks == 0
        assert isinstance(event, When)
        if tick == 0 or tick % event.interval or (event.once and number in self._happened):
            return False
        value = measured(self._colony, event.measure)
        return value > event.above if event.above is not None else value < event.below
